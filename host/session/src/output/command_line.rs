//! The command line as it was typed, to be typed again.

use std::path::{Path, PathBuf};

/// The words that were typed behind the program's name; what is no Unicode in them is replaced by signs that say so.
pub fn typed_words() -> impl Iterator<Item = String> {
    std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned())
}

/// The command that runs.
pub fn typed() -> String {
    words("surfelshop", typed_words())
}

/// This program as it can be typed in the current folder: its name where `PATH` leads to it, else its
/// path.
pub fn program() -> String {
    found_as(from_here)
}

/// This program as it can be typed in any folder.
pub fn program_anywhere() -> String {
    found_as(|own| quoted(own.to_string_lossy().into_owned()))
}

fn found_as(typed: impl FnOnce(&Path) -> String) -> String {
    let Ok(own) = std::env::current_exe() else { return "surfelshop".to_owned() };
    let name = own.file_name().unwrap_or_default();
    let is_own = |folder: PathBuf| {
        folder
            .join(name)
            .canonicalize()
            .is_ok_and(|path| own.canonicalize().is_ok_and(|own| own == path))
    };
    let path = std::env::var_os("PATH").unwrap_or_default();
    match std::env::split_paths(&path).any(is_own) {
        true => name.to_string_lossy().into_owned(),
        false => typed(&own),
    }
}

/// A path as a shell takes it in the current folder: relative where it lies below.
pub fn from_here(path: &Path) -> String {
    let folder = std::env::current_dir().unwrap_or_default();
    let below = path.strip_prefix(&folder).ok().filter(|below| below.iter().count() > 0);
    let text = match below {
        // A shell looks for single names elsewhere.
        Some(below) if below.iter().count() == 1 => Path::new(".").join(below),
        Some(below) => below.to_owned(),
        None => path.to_owned(),
    };
    quoted(text.to_string_lossy().into_owned())
}

/// A program and its arguments as a shell takes them.
pub fn words(program: &str, arguments: impl IntoIterator<Item = String>) -> String {
    let arguments = arguments.into_iter().map(quoted);
    std::iter::once(program.to_owned()).chain(arguments).collect::<Vec<_>>().join(" ")
}

/// The words without options that take a value, apart from it or joined to it: `--knob a=1`,
/// `--knob=a=1`, `-o out`, `-oout` and `-o=out`.
pub fn without(words: &[String], options: &[&str]) -> Vec<String> {
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

/// A word as a shell takes it.
pub fn quoted(word: String) -> String {
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
    fn paths_below_the_current_folder_are_short_and_single_names_can_be_typed() {
        let folder = std::env::current_dir().unwrap();
        assert_eq!(from_here(&folder.join("target/release/x")), "target/release/x");
        assert_eq!(from_here(&folder.join("x")), "./x");
        assert_eq!(from_here(Path::new("/no such/x")), "'/no such/x'");
        // A test program is on no path.
        assert!(
            program()
                .ends_with(std::env::current_exe().unwrap().file_name().unwrap().to_str().unwrap())
        );
    }

    #[test]
    fn options_go_with_their_values_however_they_are_joined() {
        let line = "a.ply -r flat -rflat -r=flat --out b --out=b --outer c -e -r";
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        assert_eq!(without(&words, &["-r", "--out"]), ["a.ply", "--outer", "c", "-e"]);
    }
}
