//! Which machine something ran on, as far as its times depend on it.

use serde::{Deserialize, Serialize};

/// A machine, with what drew on it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Machine {
    /// Its name in its network; empty where the system does not tell.
    pub host: String,
    /// The model of its CPU; empty where the system does not tell.
    pub cpu: String,
    /// Threads that run at a time.
    pub threads: usize,
    /// The graphics device and its driver, or what was used instead.
    pub device: String,
}

impl Machine {
    /// The one that runs this, with a description of the device that is used.
    #[must_use]
    pub fn this(device: impl Into<String>) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self { host: host(), cpu: cpu(), threads, device: device.into() }
    }
}

impl std::fmt::Display for Machine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { host, cpu, threads, device } = self;
        let known = [host, cpu].into_iter().filter(|text| !text.is_empty()).cloned();
        let all: Vec<String> =
            known.chain([format!("{threads} threads"), device.clone()]).collect();
        write!(f, "{}", all.join(", "))
    }
}

/// What Linux and most other systems say; a variable of the shell where there is no such file.
fn host() -> String {
    let files = ["/proc/sys/kernel/hostname", "/etc/hostname"];
    let said = files.iter().find_map(|file| std::fs::read_to_string(file).ok());
    let variables = ["HOSTNAME", "COMPUTERNAME"];
    let said = said.or_else(|| variables.iter().find_map(|name| std::env::var(name).ok()));
    said.unwrap_or_default().trim().to_owned()
}

fn cpu() -> String {
    let listed = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = listed.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    match model {
        Some((_, model)) => model.trim().to_owned(),
        None => std::env::var("PROCESSOR_IDENTIFIER").unwrap_or_default(),
    }
}
