//! The commands of an entry as they can be typed in any folder.

use std::path::{Path, absolute};
use surfelshop_session::output::command_line;

/// A path from the root, so that it means the same in any folder; as it is where the system says none.
pub(crate) fn from_root(path: &Path) -> String {
    absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}

/// A command line for a page. What it or a command before it writes lies in the folder in which they are typed,
/// with the names of its folders before its own; clouds that no command makes are where this run made them.
pub(crate) fn shown(words: &[String], work: &Path, part: &Path, folder: &Path) -> String {
    let word = |word: &String| {
        let path = Path::new(word);
        let own = path.strip_prefix(part).map(|rest| folder.join(rest));
        let path = own.as_deref().unwrap_or(path);
        match path.strip_prefix(work) {
            Ok(rest) if rest.starts_with("clouds") => from_root(path),
            Ok(rest) => rest.display().to_string().replace(['/', '\\'], "-"),
            Err(_) => word.clone(),
        }
    };
    command_line::words("surfelshop", words.iter().map(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_write_where_they_are_typed() {
        let work = Path::new("page/work");
        let (part, folder) = (work.join("figure-1.part"), work.join("figure-1"));
        let words = [
            "compare",
            "page/work/prepared-small/small.ply",
            "page/work/clouds/knot.ply",
            "--light",
            "1,2,3",
            "-o",
            "page/work/figure-1.part/0",
        ]
        .map(str::to_owned);
        let cloud = from_root(Path::new("page/work/clouds/knot.ply"));
        assert!(cloud.starts_with('/') || cfg!(windows));
        assert_eq!(
            shown(&words, work, &part, &folder),
            format!(
                "surfelshop compare prepared-small-small.ply {cloud} --light 1,2,3 -o figure-1-0"
            )
        );
    }
}
