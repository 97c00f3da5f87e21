//! Command lines of entries: cut into words, with the names of files filled in.

use anyhow::{anyhow, bail};

/// Runs a command line of the program, the program's name first.
pub type RunCommand<'a> = &'a dyn Fn(&[String]) -> anyhow::Result<()>;

/// The words of a step; quotation marks hold words together.
pub(crate) fn words(step: &str) -> anyhow::Result<Vec<String>> {
    let (mut words, mut word, mut is_open, mut is_quoted) =
        (Vec::new(), String::new(), false, false);
    for c in step.chars() {
        match c {
            '"' => (is_quoted, is_open) = (!is_quoted, true),
            c if c.is_whitespace() && !is_quoted => {
                if is_open {
                    words.push(std::mem::take(&mut word));
                }
                is_open = false;
            }
            c => {
                word.push(c);
                is_open = true;
            }
        }
    }
    if is_quoted {
        bail!("`{step}`: a quotation mark is not closed");
    }
    if is_open {
        words.push(word);
    }
    Ok(words)
}

/// The names between braces in a text, in order.
pub(crate) fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split('{').skip(1).filter_map(|rest| rest.split_once('}')).map(|(name, _)| name)
}

/// A text with what stands for each name between braces.
pub(crate) fn filled(
    text: &str,
    mut meaning: impl FnMut(&str) -> anyhow::Result<String>,
) -> anyhow::Result<String> {
    let mut parts = text.split('{');
    let mut filled = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) =
            part.split_once('}').ok_or_else(|| anyhow!("`{text}`: a brace is not closed"))?;
        filled += &meaning(name)?;
        filled += rest;
    }
    Ok(filled)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_words_and_names() {
        let step = "render {a} --camera \"0,1; 2\" -o {out}/x.png";
        assert_eq!(
            words(step).unwrap(),
            ["render", "{a}", "--camera", "0,1; 2", "-o", "{out}/x.png"]
        );
        assert_eq!(names(step).collect::<Vec<_>>(), ["a", "out"]);
        let known = |name: &str| Ok(name.to_uppercase());
        assert_eq!(filled("{a}/b{c}", known).unwrap(), "A/bC");
        assert!(words("a \"b").is_err() && filled("{a", known).is_err());
    }
}
