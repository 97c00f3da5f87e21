//! Text as HTML takes it.

/// Text in an element.
pub(super) fn text(text: &str) -> String {
    let mut all = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => all += "&amp;",
            '<' => all += "&lt;",
            '>' => all += "&gt;",
            '"' => all += "&quot;",
            c => all.push(c),
        }
    }
    all
}

/// Text as the value of an attribute between quotation marks.
pub(super) fn attribute(value: &str) -> String {
    text(value)
}

/// Text in which what stands between backquotes is code.
pub(super) fn marked(line: &str) -> String {
    let parts = line.split('`').enumerate();
    let part = |(i, part): (usize, &str)| match i % 2 {
        0 => text(part),
        _ => format!("<code>{}</code>", text(part)),
    };
    parts.map(part).collect()
}
