//! The commands of the README, run as they stand there. Costs 20 s on two cores.

use crate::cli::program::TestFolder;
use std::path::Path;

/// How the README names the program.
const PROGRAM: &str = "target/release/surfelshop";

/// The commands of its blocks, without the program.
fn commands() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let blocks = readme.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    let lines = blocks.flat_map(str::lines).filter_map(|line| line.strip_prefix(PROGRAM));
    lines.map(|line| line.trim().to_owned()).collect()
}

/// Invariant: the commands of the README work as they stand there
#[test]
#[cfg(unix)]
fn the_commands_of_the_readme_work() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let folder = TestFolder::new();
    std::os::unix::fs::symlink(root.join("assets"), folder.at("assets")).unwrap();
    let commands = commands();
    // The window needs a screen, which another test has.
    let (window, others): (Vec<_>, Vec<_>) =
        commands.into_iter().partition(|line| line.starts_with("assets/"));
    assert_eq!(window, ["assets/sample.ply"]);
    assert!(others.len() >= 8, "{others:?}");
    for line in others {
        let ended = folder.run(&line);
        assert_eq!(ended.code, 0, "{line}: {}", ended.stderr);
    }
    for made in ["snail.png", "sky.png", "shaded.ply", "compared/index.html", "detail/index.html"] {
        assert!(folder.at(made).exists(), "{made}");
    }
}

#[test]
fn help_prints_every_page_of_the_manual() {
    let folder = TestFolder::new();
    let contents = folder.run("help");
    assert_eq!(contents.code, 0);
    let topics = contents.stdout.lines().filter_map(|line| line.strip_prefix("  "));
    let topics: Vec<&str> = topics.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(topics.len() > 30, "{topics:?}");
    for topic in topics {
        let page = folder.run(&format!("help {topic}"));
        assert_eq!(page.code, 0, "{topic}: {}", page.stderr);
        assert!(page.stdout.starts_with("# "), "{topic}");
    }
    let unknown = folder.run("help nonsense");
    assert_eq!(unknown.code, 1);
    assert!(
        unknown.stderr.contains("no page of the manual is called `nonsense`"),
        "{}",
        unknown.stderr
    );
}
