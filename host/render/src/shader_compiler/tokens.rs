//! Words, numbers and marks of WGSL text.

/// One token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Token<'a> {
    /// A keyword or a name.
    Word(&'a str),
    /// A number, with its suffix.
    Number,
    /// One character of an operator or a bracket.
    Mark(char),
    /// A line of the composer: from `#` to its end.
    Directive(&'a str),
}

/// The tokens of a text with the byte each begins at; comments are left out.
pub(super) fn tokens(text: &str) -> impl Iterator<Item = (usize, Token<'_>)> {
    let mut at = 0;
    std::iter::from_fn(move || {
        loop {
            let rest = &text[at..];
            let first = rest.chars().next()?;
            let skipped = comment(rest);
            if skipped > 0 || first.is_whitespace() {
                at += skipped.max(first.len_utf8());
                continue;
            }
            let begin = at;
            let up_to = |end: fn(char) -> bool| rest.find(end).unwrap_or(rest.len());
            let token = match first {
                '#' => Token::Directive(&rest[..up_to(|c| c == '\n')]),
                _ if first.is_ascii_digit() => {
                    at += up_to(|c| !(c.is_alphanumeric() || c == '.'));
                    return Some((begin, Token::Number));
                }
                _ if is_of_word(first) => Token::Word(&rest[..up_to(|c| !is_of_word(c))]),
                _ => Token::Mark(first),
            };
            at += match token {
                Token::Word(text) | Token::Directive(text) => text.len(),
                Token::Number | Token::Mark(_) => first.len_utf8(),
            };
            return Some((begin, token));
        }
    })
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Length of the comment that a text begins with.
pub(super) fn comment(text: &str) -> usize {
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if !text.starts_with("/*") {
        return 0;
    }
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        let rest = &text.as_bytes()[at..];
        match rest {
            [b'/', b'*', ..] => (depth, at) = (depth + 1, at + 2),
            [b'*', b'/', ..] => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            break;
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_becomes_words_numbers_marks_and_directives() {
        let text = "#ifdef A\nlet é1=0x1fu; // x\n/* y /* z */ */ a.b-1e-3é";
        let all: Vec<_> = tokens(text).map(|(_, token)| token).collect();
        use Token::{Directive, Mark, Number, Word};
        let expected = [
            Directive("#ifdef A"),
            Word("let"),
            Word("é1"),
            Mark('='),
            Number,
            Mark(';'),
            Word("a"),
            Mark('.'),
            Word("b"),
            Mark('-'),
            Number,
            Mark('-'),
            Number,
        ];
        assert_eq!(all, expected);
        assert_eq!(tokens("/* never closed é").count(), 0);
    }
}
