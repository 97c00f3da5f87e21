//! The user's state folder: recent files and the scene of the last session.

use anyhow::Context as _;
use std::path::{Path, PathBuf};
use surfelshop_cloud::scene::SceneFile;
use surfelshop_runtime::plugins::state_folder;
use surfelshop_session::output::files;

/// Most recent files.
const MOST_RECENT: usize = 10;

/// Most bytes of the list: more than ten of the longest paths.
const LONGEST_LIST: u64 = 1 << 20;

/// The user's folder for the program's state.
pub(crate) struct StateFolder {
    folder: PathBuf,
}

impl StateFolder {
    /// The user's; `None` where the system names no folder for it.
    pub(crate) fn of_user() -> Option<Self> {
        state_folder().map(Self::in_folder)
    }

    /// A state folder at a path, which is created by the first write.
    pub(crate) fn in_folder(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// The path.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The recent files that still exist, the last one first.
    pub(crate) fn recent(&self) -> Vec<PathBuf> {
        let bytes = files::read_short(&self.folder.join("recent"), LONGEST_LIST);
        let text = bytes.ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default();
        let paths = text.lines().filter(|line| !line.is_empty()).map(PathBuf::from);
        paths.filter(|path| path.is_file()).take(MOST_RECENT).collect()
    }

    /// Adds opened files to the recent ones.
    pub(crate) fn add_recent(&self, opened: &[PathBuf]) -> anyhow::Result<()> {
        let mut paths: Vec<PathBuf> = opened
            .iter()
            .map(|path| std::path::absolute(path).unwrap_or_else(|_| path.clone()))
            .collect();
        paths.extend(self.recent());
        let mut lines: Vec<&str> = Vec::new();
        // A name that is not UTF-8 or has a line break cannot be in the list.
        for path in paths.iter().filter_map(|path| path.to_str()) {
            let own = self.owns(Path::new(path));
            if !own && !path.contains('\n') && !lines.contains(&path) && lines.len() < MOST_RECENT {
                lines.push(path);
            }
        }
        self.make_folder()?;
        files::write_whole(&self.folder.join("recent"), lines.join("\n").as_bytes())
    }

    /// Moves the scene of the last session aside, before this session writes its own.
    pub(crate) fn begin_session(&self) {
        // Without a scene there is nothing to move, and a failure loses nothing.
        drop(std::fs::rename(self.last_session_path(), self.previous_session_path()));
    }

    fn previous_session_path(&self) -> PathBuf {
        self.folder.join("before.scene.toml")
    }

    /// The scene of the last session, if there is one.
    pub(crate) fn previous_session(&self) -> Option<PathBuf> {
        Some(self.previous_session_path()).filter(|path| path.is_file())
    }

    /// Whether a file is one of the two sessions.
    pub(crate) fn owns(&self, path: &Path) -> bool {
        [self.last_session_path(), self.previous_session_path()].iter().any(|own| own == path)
    }

    /// The path of this session's scene.
    pub(crate) fn last_session_path(&self) -> PathBuf {
        self.folder.join("last.scene.toml")
    }

    /// Writes this session's scene.
    pub(crate) fn save_session(&self, scene: &SceneFile) -> anyhow::Result<()> {
        self.make_folder()?;
        scene.write(self.last_session_path()).map_err(Into::into)
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
        let state = StateFolder::in_folder(folder.path().join("state"));
        assert!(state.recent().is_empty());
        let file = |i: usize| folder.path().join(format!("{i}.ply"));
        for i in 0..13 {
            std::fs::write(file(i), "").unwrap();
            state.add_recent(&[file(i)]).unwrap();
        }
        state.add_recent(&[file(5)]).unwrap();
        std::fs::remove_file(file(12)).unwrap();
        let recent = state.recent();
        assert_eq!(recent[..3], [file(5), file(11), file(10)]);
        assert_eq!(recent.len(), MOST_RECENT - 1);
        // The program's own files are not listed.
        state.save_session(&SceneFile::default()).unwrap();
        state.add_recent(&[state.last_session_path()]).unwrap();
        assert_eq!(state.recent(), recent);
        std::fs::write(folder.path().join("state/recent"), [0xff, 0xfe]).unwrap();
        assert!(state.recent().is_empty());
    }

    /// The program of the test below, not a test itself.
    #[test]
    fn saves_until_killed() {
        let Some(folder) = std::env::var_os("SURFELSHOP_TEST_SAVES") else { return };
        let state = StateFolder::in_folder(folder.into());
        let mut scene = SceneFile::default();
        loop {
            scene.exposure_stops = -scene.exposure_stops - 1.0;
            state.save_session(&scene).unwrap();
        }
    }

    /// Invariant: a kill while a scene is saved leaves a whole scene
    #[test]
    fn a_kill_while_saving_leaves_a_whole_scene() {
        let folder = tempfile::tempdir().unwrap();
        let state = StateFolder::in_folder(folder.path().to_owned());
        let program = std::env::current_exe().unwrap();
        let module = module_path!().split_once("::").unwrap().1;
        for round in 0..12 {
            let mut child = std::process::Command::new(&program)
                .args(["--exact", &format!("{module}::saves_until_killed")])
                .env("SURFELSHOP_TEST_SAVES", folder.path())
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap();
            while !state.last_session_path().is_file() {
                assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
                std::thread::yield_now();
            }
            // After some milliseconds, which vary: in the middle of one write or another.
            std::thread::sleep(std::time::Duration::from_micros(3_000 + 717 * round));
            child.kill().unwrap();
            child.wait().unwrap();
            surfelshop_cloud::scene::read(state.last_session_path()).unwrap();
        }
    }
}
