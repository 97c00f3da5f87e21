//! The most memory of this process, whoever took it: plugins have allocators of their own. Only Linux tells.

use std::fs;

/// Forgets the peak so far, and says what there is now, bytes.
pub(crate) fn reset() -> u64 {
    // Where the system has no such file, there is no peak to read either.
    drop(fs::write("/proc/self/clear_refs", "5"));
    line("VmRSS:")
}

/// The most there was since then, bytes; 0 where the system does not tell.
pub(crate) fn peak() -> u64 {
    line("VmHWM:")
}

fn line(name: &str) -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    let kibibytes = line.and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kibibytes.unwrap_or(0) * 1024
}

#[test]
#[cfg(target_os = "linux")]
fn the_peak_is_forgotten_and_seen_again() {
    drop(vec![1u8; 64 << 20]);
    let before = reset();
    assert!(peak() < before + (32 << 20), "the old peak is forgotten");
    drop(std::hint::black_box(vec![1u8; 64 << 20]));
    assert!(peak() > before + (48 << 20), "{} of {before}", peak());
}
