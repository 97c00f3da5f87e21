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

/// The words without options that take a value, apart from it or joined to it: `--knob a=1`,
/// `--knob=a=1`, `-o out`, `-oout` and `-o=out`.
pub(crate) fn without(words: &[String], options: &[&str]) -> Vec<String> {
    let mut kept = Vec::with_capacity(words.len());
    let mut words = words.iter();
    while let Some(word) = words.next() {
        if options.contains(&word.as_str()) {
            words.next();
            continue;
        }
        let is_joined = options.iter().any(|option| {
            word.strip_prefix(option).is_some_and(|rest| {
                rest.starts_with('=') || (!option.starts_with("--") && !rest.is_empty())
            })
        });
        if !is_joined {
            kept.push(word.clone());
        }
    }
    kept
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

    #[test]
    fn options_go_with_their_values_however_they_are_joined() {
        let line = "a.ply -r flat -rflat -r=flat --out b --out=b --outer c -e -r";
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        assert_eq!(without(&words, &["-r", "--out"]), ["a.ply", "--outer", "c", "-e"]);
    }
}
