//! What the program remembers from one start to the next: files opened lately, and the last scene.

use crate::files;
use anyhow::Context as _;
use std::path::{Path, PathBuf};
use surfelshop_cloud::scene::SceneFile;
use surfelshop_engine::plugins::state_folder;

/// Most files in the list.
const MOST_RECENT: usize = 10;

/// Most bytes of the list: ten of the longest paths that systems take, and more.
const LONGEST_LIST: u64 = 1 << 20;

/// A folder of the user's for such things.
pub(crate) struct Memory {
    folder: PathBuf,
}

impl Memory {
    /// The user's; `None` where the system names no folder for it.
    pub(crate) fn of_user() -> Option<Self> {
        state_folder().map(Self::in_folder)
    }

    /// One in a folder, which is made when something is first remembered.
    pub(crate) fn in_folder(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// Where all this stands.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Files opened lately that are still there, the last one first.
    pub(crate) fn recent(&self) -> Vec<PathBuf> {
        let bytes = files::read_short(&self.folder.join("recent"), LONGEST_LIST);
        let text = bytes.ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default();
        let paths = text.lines().filter(|line| !line.is_empty()).map(PathBuf::from);
        paths.filter(|path| path.is_file()).take(MOST_RECENT).collect()
    }

    /// Remembers files that were opened.
    pub(crate) fn opened(&self, opened: &[PathBuf]) -> anyhow::Result<()> {
        let mut paths: Vec<PathBuf> = opened
            .iter()
            .map(|path| std::path::absolute(path).unwrap_or_else(|_| path.clone()))
            .collect();
        paths.extend(self.recent());
        let mut lines: Vec<&str> = Vec::new();
        // A name that is no text, or has a line break, cannot stand in the list.
        for path in paths.iter().filter_map(|path| path.to_str()) {
            let own = self.owns(Path::new(path));
            if !own && !path.contains('\n') && !lines.contains(&path) && lines.len() < MOST_RECENT {
                lines.push(path);
            }
        }
        self.make_folder()?;
        files::write_whole(&self.folder.join("recent"), lines.join("\n").as_bytes())
    }

    /// Puts the scene of the session before aside, before this one keeps its own.
    pub(crate) fn begin_session(&self) {
        // Where there was none, or nothing can be moved, nothing is lost.
        drop(std::fs::rename(self.last_scene_path(), self.session_before()));
    }

    fn session_before(&self) -> PathBuf {
        self.folder.join("before.scene.toml")
    }

    /// The scene of the session before, if there was one.
    pub(crate) fn scene_before(&self) -> Option<PathBuf> {
        Some(self.session_before()).filter(|path| path.is_file())
    }

    /// Whether a file is one of these.
    pub(crate) fn owns(&self, path: &Path) -> bool {
        [self.last_scene_path(), self.session_before()].iter().any(|own| own == path)
    }

    /// Where the scene that is shown is kept.
    pub(crate) fn last_scene_path(&self) -> PathBuf {
        self.folder.join("last.scene.toml")
    }

    /// Keeps the scene that is shown.
    pub(crate) fn keep(&self, scene: &SceneFile) -> anyhow::Result<()> {
        self.make_folder()?;
        scene.write(self.last_scene_path()).map_err(Into::into)
    }

    fn make_folder(&self) -> anyhow::Result<()> {
        let folder: &Path = &self.folder;
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot be made", folder.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_remembered_once_the_last_one_first() {
        let folder = tempfile::tempdir().unwrap();
        let memory = Memory::in_folder(folder.path().join("state"));
        assert!(memory.recent().is_empty());
        let file = |i: usize| folder.path().join(format!("{i}.ply"));
        for i in 0..13 {
            std::fs::write(file(i), "").unwrap();
            memory.opened(&[file(i)]).unwrap();
        }
        memory.opened(&[file(5)]).unwrap();
        std::fs::remove_file(file(12)).unwrap();
        let recent = memory.recent();
        assert_eq!(recent[..3], [file(5), file(11), file(10)]);
        assert_eq!(recent.len(), MOST_RECENT - 1);
        // What the program keeps for itself is none of the user's files.
        memory.keep(&SceneFile::default()).unwrap();
        memory.opened(&[memory.last_scene_path()]).unwrap();
        assert_eq!(memory.recent(), recent);
        std::fs::write(folder.path().join("state/recent"), [0xff, 0xfe]).unwrap();
        assert!(memory.recent().is_empty());
    }

    /// Not a test of its own: what the test below runs and kills.
    #[test]
    fn saves_until_killed() {
        let Some(folder) = std::env::var_os("SURFELSHOP_TEST_SAVES") else { return };
        let memory = Memory::in_folder(folder.into());
        let mut scene = SceneFile::default();
        loop {
            scene.exposure_stops = -scene.exposure_stops - 1.0;
            memory.keep(&scene).unwrap();
        }
    }

    #[test]
    fn a_kill_while_saving_leaves_a_whole_scene() {
        let folder = tempfile::tempdir().unwrap();
        let memory = Memory::in_folder(folder.path().to_owned());
        let program = std::env::current_exe().unwrap();
        for round in 0..12 {
            let mut child = std::process::Command::new(&program)
                .args(["--exact", "viewer::memory::tests::saves_until_killed"])
                .env("SURFELSHOP_TEST_SAVES", folder.path())
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap();
            while !memory.last_scene_path().is_file() {
                std::thread::yield_now();
            }
            // Some milliseconds later, each time others: in the middle of one write or another.
            std::thread::sleep(std::time::Duration::from_micros(3_000 + 717 * round));
            child.kill().unwrap();
            child.wait().unwrap();
            surfelshop_cloud::scene::read(memory.last_scene_path()).unwrap();
        }
    }
}
