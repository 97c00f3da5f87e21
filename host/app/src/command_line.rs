//! The command line as it was typed, to be typed again.

/// The command that runs.
pub(crate) fn typed() -> String {
    words("surfelshop", std::env::args().skip(1))
}

/// A program and its arguments as a shell takes them.
pub(crate) fn words(program: &str, arguments: impl IntoIterator<Item = String>) -> String {
    let arguments = arguments.into_iter().map(quoted);
    std::iter::once(program.to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

fn quoted(word: String) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=./:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word;
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_takes_words_for_what_they_are() {
        let typed = ["a b.ply", "--light=0,1,0", "", "it's", "$HOME;"].map(str::to_owned);
        assert_eq!(words("x", typed), r"x 'a b.ply' --light=0,1,0 '' 'it'\''s' '$HOME;'");
    }
}
