//! Runs the program on files of the test's own.

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use surfelshop_tests::stage::build_folder;
use tempfile::TempDir;

/// How a run ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Ended {
    /// Runs a command to its end.
    fn of(command: &mut Command) -> Self {
        let output = command.output().unwrap();
        Self {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// The object printed, after success.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        assert_eq!(self.code, 0, "{self:?}");
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// Expects success.
    #[track_caller]
    pub(crate) fn done(self) -> Self {
        assert_eq!(self.code, 0, "{self:?}");
        self
    }

    /// Expects failure with one line that has all these words.
    #[track_caller]
    pub(crate) fn failed(&self, words: &[&str]) {
        assert_eq!(self.code, 1, "{self:?}");
        self.says(words);
        assert_eq!(self.stderr.trim_end().lines().count(), 1, "{}", self.stderr);
    }

    /// Expects a refusal of the command line that has all these words.
    #[track_caller]
    pub(crate) fn misused(&self, words: &[&str]) {
        assert_eq!(self.code, 2, "{self:?}");
        self.says(words);
    }

    #[track_caller]
    fn says(&self, words: &[&str]) {
        assert!(self.stderr.starts_with("surfelshop: "), "{}", self.stderr);
        for word in words {
            assert!(self.stderr.contains(word), "`{word}` is missing in: {}", self.stderr);
        }
    }
}

/// A folder with clouds and pictures of one test.
pub(crate) struct TestFolder {
    folder: TempDir,
    /// What the program keeps for its next start.
    cache: TempDir,
    variables: Vec<(&'static str, &'static str)>,
}

impl TestFolder {
    pub(crate) fn new() -> Self {
        let (folder, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        Self { folder, cache, variables: Vec::new() }
    }

    /// Runs with this variable in the environment.
    pub(crate) fn with(mut self, variable: &'static str, value: &'static str) -> Self {
        self.variables.push((variable, value));
        self
    }

    /// A path in the folder.
    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The folder of what the program keeps for its next start.
    pub(crate) fn cache(&self) -> &Path {
        self.cache.path()
    }

    /// Writes a file.
    pub(crate) fn put(&self, name: &str, contents: &str) {
        fs::write(self.at(name), contents).unwrap();
    }

    /// Writes a cloud: position, normal and radius of each surfel.
    pub(crate) fn put_cloud(&self, name: &str, surfels: &[[f32; 7]]) {
        let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", surfels.len());
        for property in ["x", "y", "z", "nx", "ny", "nz", "radius"] {
            text += &format!("property float {property}\n");
        }
        text += "end_header\n";
        for surfel in surfels {
            text += &surfel.map(|value| value.to_string()).join(" ");
            text.push('\n');
        }
        self.put(name, &text);
    }

    /// Names of the files in the folder.
    pub(crate) fn files(&self) -> Vec<String> {
        let listing = self.folder.path().read_dir().unwrap();
        let mut names: Vec<String> = listing
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// Runs the program in the folder; arguments are separated by spaces.
    pub(crate) fn run(&self, arguments: &str) -> Ended {
        self.run_with(&arguments.split_whitespace().collect::<Vec<_>>())
    }

    /// Runs the program in the folder.
    pub(crate) fn run_with(&self, arguments: &[&str]) -> Ended {
        Ended::of(self.command().args(arguments))
    }

    /// The same as from a terminal, which ignores no signals: a test may have been started by what does, such as `nohup` or a shell that runs it in the background.
    pub(crate) fn command_of_a_terminal(&self) -> Command {
        let program = self.command();
        let mut command = Command::new("env");
        command.arg("--default-signal=HUP,INT,TERM").arg(program.get_program());
        command.current_dir(self.folder.path());
        for (name, value) in program.get_envs() {
            match value {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        command
    }

    /// Runs the program under a limit that a shell sets before, such as `ulimit -v`.
    pub(crate) fn run_within(&self, limit: &str, arguments: &[&str]) -> Ended {
        let command = self.command();
        let mut shell = Command::new("sh");
        shell.args(["-c", &format!("{limit}; exec \"$@\""), "sh"]).arg(command.get_program());
        shell.args(arguments).current_dir(self.folder.path());
        shell.envs(command.get_envs().filter_map(|(name, value)| Some((name, value?))));
        Ended::of(shell.env_remove("SURFELSHOP_LOG"))
    }

    /// The program, about to run in the folder.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(program());
        command
            .current_dir(self.folder.path())
            .env_remove("SURFELSHOP_PLUGINS")
            .env_remove("SURFELSHOP_LOG")
            // No test opens a window by accident.
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .env("XDG_DATA_HOME", self.folder.path())
            .env("XDG_CACHE_HOME", self.cache.path())
            // Drivers need not compile the same shaders for each test.
            .env("MESA_SHADER_CACHE_DIR", build_folder())
            // Mesa's device selection looks for a desktop and complains that there is none.
            .env("NODEVICE_SELECT", "1")
            .envs(self.variables.iter().copied());
        command
    }
}

fn program() -> PathBuf {
    let path = build_folder().join(format!("surfelshop{}", std::env::consts::EXE_SUFFIX));
    assert!(
        path.is_file(),
        "{} is not built; `cargo verify` builds it, or `cargo build --workspace` in the profile \
         of this test",
        path.display()
    );
    path
}

/// A surfel in the xy plane that faces +z.
pub(crate) fn facing_front(x: f32, y: f32, radius: f32) -> [f32; 7] {
    [x, y, 0.0, 0.0, 0.0, 1.0, radius]
}

/// A PNG's size and pixels, 8 bits each.
#[track_caller]
pub(crate) fn read_png(path: &Path) -> image::RgbaImage {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgba8()
}
