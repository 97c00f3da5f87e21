//! Processes: started, waited for, ended.

use super::message::{ARGUMENT, CUT};
use super::wire::Wire;
use crate::boundary::Fault;
use crate::plugins::{leave, on_own_thread};
use rustix::io::Errno;
use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, getpgrp, getpid, kill_process_group, waitid,
};
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus};
use std::sync::OnceLock;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// How often a program that waits for a process looks whether it still should.
const TICK: Duration = Duration::from_millis(20);
/// How long a process that nobody needs any more has to end by itself.
const TO_END: Duration = Duration::from_secs(1);

static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Has this program be started for plugins in processes of their own, instead of the one that runs: of programs that do
/// not call [`serve`](fn@super::serve) themselves. Only the first call counts.
pub fn use_program(path: PathBuf) {
    PROGRAM.get_or_init(|| path);
}

/// What is started.
fn program() -> io::Result<PathBuf> {
    match PROGRAM.get() {
        Some(path) => Ok(path.clone()),
        // The very program that runs, even where its file has been built anew since.
        None if cfg!(target_os = "linux") => Ok(PathBuf::from("/proc/self/exe")),
        None => std::env::current_exe(),
    }
}

/// A process, and the connection to it; dropping it ends it.
#[derive(Debug)]
pub(super) struct Process {
    pub(super) wire: Wire,
    child: Option<Child>,
}

impl Process {
    /// Starts one that waits for orders.
    pub(super) fn start() -> Result<Self, Fault> {
        let cannot = |error: io::Error| {
            Fault::Error(format!("a process of its own cannot be started: {error}"))
        };
        let (here, there) = UnixStream::pair().map_err(cannot)?;
        for set in [UnixStream::set_read_timeout, UnixStream::set_write_timeout] {
            set(&here, Some(TICK)).map_err(cannot)?;
        }
        let child = Command::new(program().map_err(cannot)?)
            .arg(ARGUMENT)
            // What interrupts the program does not end the processes of its plugins before it.
            .process_group(0)
            .stdin(OwnedFd::from(there))
            // What plugins print is no result of the program.
            .stdout(io::stderr())
            .spawn()
            .map_err(cannot)?;
        Ok(Self { wire: Wire::new(here), child: Some(child) })
    }

    /// Ends it, as the connection to it did; says what became of it.
    pub(super) fn lost(&mut self, what: &str) -> Fault {
        let Some(mut child) = self.child.take() else {
            return Fault::Panic(what.to_owned());
        };
        self.wire.close();
        // A process that crashes closes its connection moments before its end can be told.
        match ended_within(&mut child, TO_END / 2) {
            Some(status) => Fault::Panic(format!("its process ended: {}", said(status))),
            None => {
                kill(&mut child);
                Fault::Panic(format!("its process was ended: {what}"))
            }
        }
    }

    /// Ends it at once.
    pub(super) fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            kill(&mut child);
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let Some(mut child) = self.child.take() else { return };
        self.wire.close();
        // Its library has a moment to end its instance, for which nobody waits.
        let ended = on_own_thread(move || {
            if ended_within(&mut child, TO_END).is_none() {
                kill(&mut child);
            }
        });
        if let Err(fault) = ended {
            tracing::debug!(%fault, "a process ends by itself");
        }
    }
}

/// Ends it, and what it started.
fn kill(child: &mut Child) {
    end_group(child);
    // Both fail only where it has ended.
    drop(child.kill());
    drop(child.wait());
}

fn pid_of(child: &Child) -> Option<Pid> {
    i32::try_from(child.id()).ok().and_then(Pid::from_raw)
}

/// Ends the group that a process began with itself, which must not have been waited for: its number may be another
/// one's after that.
fn end_group(child: &Child) {
    if let Some(group) = pid_of(child)
        && let Err(error) = kill_process_group(group, Signal::KILL)
    {
        tracing::debug!(%error, "nothing is left of a process");
    }
}

/// Ends this process, whose program is gone, and what its library started.
pub(super) fn leave_with_all() -> ! {
    let own = getpid();
    // It leads its group where the program started it.
    if getpgrp() == own
        && let Err(error) = kill_process_group(own, Signal::KILL)
    {
        tracing::debug!(%error, "a process ends alone");
    }
    leave(0)
}

/// Whether it ended, so that it can still be waited for; an error where there is no such process, as where the system
/// waits for those of this program itself.
fn has_ended(child: &Child) -> rustix::io::Result<bool> {
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    let pid = pid_of(child).ok_or(Errno::CHILD)?;
    match waitid(WaitId::Pid(pid), options) {
        Err(Errno::INTR) => Ok(false),
        found => found.map(|status| status.is_some()),
    }
}

/// How it ended, within a time; what it started ends with it.
fn ended_within(child: &mut Child, limit: Duration) -> Option<ExitStatus> {
    let started = Instant::now();
    loop {
        match has_ended(child) {
            Ok(true) => end_group(child),
            Ok(false) if started.elapsed() < limit => {
                sleep(Duration::from_millis(2));
                continue;
            }
            Ok(false) => return None,
            // Its number may be another one's.
            Err(_gone) => {}
        }
        return Some(child.wait().unwrap_or_default());
    }
}

/// How a process ended, in words.
fn said(status: ExitStatus) -> String {
    let Some(signal) = status.signal() else {
        return match status.code() {
            Some(CUT) => "its connection to the program was closed".to_owned(),
            Some(code) => format!("its code called exit, with {code}"),
            None => "nobody knows how".to_owned(),
        };
    };
    // The numbers that POSIX systems share.
    let name = match signal {
        4 => ", an instruction that there is not",
        6 => ", it aborted",
        8 => ", an arithmetic error",
        9 => ", it was killed",
        11 => ", memory that is not its own",
        15 => ", it was asked to end",
        _ if cfg!(target_os = "linux") && signal == 7 => ", memory that is not there",
        _ => "",
    };
    format!("signal {signal}{name}")
}
