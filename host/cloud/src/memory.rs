//! Memory whose size a file, a tool or a setting decides, asked for before it is taken.
//!
//! A failed allocation ends a Rust program, and the unsaved work of a window with it. So whoever is about to
//! take memory by a number from outside asks here first, and gets an error in one line instead. The answer
//! is an estimate: other programs take memory meanwhile, and a system that promises more than it has gives it
//! only when it is touched.

use std::fs;

/// More memory is needed than there is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} of {} are needed{}", size(*needed), if *addresses { "address space (ulimit -v)" } else { "memory" }, allowed(*available))]
pub struct OutOfMemory {
    /// Bytes that were asked for.
    pub needed: u64,
    /// Bytes that there are; `None` where the system refused without saying.
    pub available: Option<u64>,
    /// Whether these are addresses, of which the process may take so many only.
    pub addresses: bool,
}

fn allowed(available: Option<u64>) -> String {
    match available {
        Some(bytes) => format!(", {} are free", size(bytes)),
        None => ", which the system refuses".to_owned(),
    }
}

/// Bytes in the unit that a person would choose.
fn size(bytes: u64) -> String {
    let mib = bytes as f64 / (1u64 << 20) as f64;
    if mib >= 1024.0 { format!("{:.1} GiB", mib / 1024.0) } else { format!("{mib:.1} MiB") }
}

/// Less than this is never refused by what the system says is free: it moves by more from one moment to the
/// next.
const SMALL: u64 = 64 << 20;

/// Asks whether so many bytes more can be had in all, in pieces of any size.
///
/// # Errors
/// Where the system says that it has less, or refuses to reserve as much.
pub fn ask(bytes: u64) -> Result<(), OutOfMemory> {
    if bytes <= SMALL {
        return reserve(bytes);
    }
    match available() {
        Some(available) if available < bytes => {
            Err(OutOfMemory { needed: bytes, available: Some(available), addresses: false })
        }
        // Limits of the process show only when memory is reserved.
        _ => reserve(bytes),
    }
}

/// Addresses that work on several threads takes for each byte it touches, and besides: measured with the C
/// library of Linux, whose threads have heaps of their own, 2.7 to 3.6 times for the estimates of a load.
const ADDRESSES_PER_BYTE: u64 = 4;
const ADDRESSES_BESIDES: u64 = 160 << 20;

/// Asks the same for work on several threads, which reserves more addresses than it touches. That matters where
/// the process may have so many only (`ulimit -v`).
///
/// # Errors
/// As [`ask`].
pub fn ask_for_threads(bytes: u64) -> Result<(), OutOfMemory> {
    let needed = bytes.saturating_mul(ADDRESSES_PER_BYTE).saturating_add(ADDRESSES_BESIDES);
    match addresses_left() {
        Some(left) if left < needed => {
            Err(OutOfMemory { needed, available: Some(left), addresses: true })
        }
        _ => ask(bytes),
    }
}

/// Of so many bytes what work on several threads can take where the process may have so many addresses only: the
/// bytes themselves where it may have any number, and `least` at least.
#[must_use]
pub fn within_addresses(bytes: u64, least: u64) -> u64 {
    let share = |left: u64| left.saturating_sub(ADDRESSES_BESIDES) / ADDRESSES_PER_BYTE;
    addresses_left().map_or(bytes, |left| bytes.min(share(left).max(least)))
}

/// Addresses that the process may still take; `None` where it may have any number.
fn addresses_left() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let most: u64 = line.split_ascii_whitespace().next()?.parse().ok()?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let taken = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?;
    let taken: u64 = taken.split_ascii_whitespace().next()?.parse().ok()?;
    Some(most.saturating_sub(taken.saturating_mul(1024)))
}

fn reserve(bytes: u64) -> Result<(), OutOfMemory> {
    let refused = OutOfMemory { needed: bytes, available: None, addresses: false };
    let length = usize::try_from(bytes).map_err(|_too_many| refused)?;
    Vec::<u8>::new().try_reserve_exact(length).map_err(|_refused| refused)
}

/// An empty vector with room for `length` values.
///
/// # Errors
/// Where there is not as much memory.
pub fn with_room<T>(length: usize) -> Result<Vec<T>, OutOfMemory> {
    let needed = (length as u64).saturating_mul(size_of::<T>() as u64);
    if needed > SMALL {
        ask(needed)?;
    }
    let mut values = Vec::new();
    let refused = |_refused| OutOfMemory { needed, available: None, addresses: false };
    values.try_reserve_exact(length).map_err(refused)?;
    Ok(values)
}

/// Makes room in a vector for `more` values; it grows by half at least, so that many small steps take
/// time proportional to their number.
///
/// # Errors
/// Where there is not as much memory.
pub fn grow<T>(values: &mut Vec<T>, more: usize) -> Result<(), OutOfMemory> {
    if values.capacity() - values.len() >= more {
        return Ok(());
    }
    let more = more.max(values.len() / 2);
    // While it moves both are there.
    let length = values.len().saturating_add(more);
    let needed = (length as u64).saturating_mul(size_of::<T>() as u64);
    if needed > SMALL {
        ask(needed)?;
    }
    let refused = |_refused| OutOfMemory { needed, available: None, addresses: false };
    values.try_reserve_exact(more).map_err(refused)
}

/// Bytes that the system can give this process before it has to take them from others; `None` where it does
/// not say.
#[must_use]
pub fn available() -> Option<u64> {
    let meminfo = fs::read_to_string("/proc/meminfo").ok()?;
    let kib = |name: &str| {
        let line = meminfo.lines().find(|line| line.starts_with(name))?;
        line.split_ascii_whitespace().nth(1)?.parse::<u64>().ok()
    };
    let of_machine = (kib("MemAvailable:")? + kib("SwapFree:").unwrap_or(0)).saturating_mul(1024);
    Some(of_machine.min(of_group().unwrap_or(u64::MAX)))
}

/// What the group of processes that this one belongs to, such as a container, may take besides.
fn of_group() -> Option<u64> {
    let number = |name: &str| {
        let text = fs::read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?;
        text.trim().parse::<u64>().ok()
    };
    // `max` is no number: then there is no limit.
    let most = number("memory.max")?;
    let taken = number("memory.current")?;
    // Pages of files that nobody holds are given up first.
    let stat = fs::read_to_string("/sys/fs/cgroup/memory.stat").unwrap_or_default();
    let files = stat.lines().find_map(|line| line.strip_prefix("inactive_file "));
    let files = files.and_then(|bytes| bytes.trim().parse::<u64>().ok()).unwrap_or(0);
    Some(most.saturating_sub(taken.saturating_sub(files)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_there_is_is_given_and_more_is_an_error_with_both_sizes() {
        assert_eq!(ask(0), Ok(()));
        assert_eq!(ask(1 << 20), Ok(()));
        let refused = ask(1 << 60).unwrap_err();
        assert_eq!(refused.needed, 1 << 60);
        let line = refused.to_string();
        assert!(line.starts_with("1073741824.0 GiB of memory are needed, "), "{line}");
        assert!(with_room::<u64>(usize::MAX).is_err());
        assert_eq!(with_room::<u64>(1000).unwrap().capacity(), 1000);
        let mut values = vec![0u8; 3];
        assert!(grow(&mut values, usize::MAX).is_err());
        grow(&mut values, 1).unwrap();
        assert!(values.capacity() > 3 && values == [0; 3]);
    }

    #[test]
    fn work_takes_no_more_than_addresses_allow_and_the_least_at_least() {
        let found = within_addresses(u64::MAX, 7);
        let allowed = addresses_left().map(|left| left.saturating_sub(ADDRESSES_BESIDES) / 4);
        // Other threads of the tests take addresses meanwhile.
        assert!(
            found >= 7 && allowed.is_none_or(|allowed| found <= allowed + (1 << 30)),
            "{found}"
        );
        assert_eq!(within_addresses(5, 7), 5);
    }

    #[test]
    fn many_small_steps_move_a_vector_a_few_times() {
        let mut values = Vec::new();
        let mut n_moves = 0;
        for i in 0..100_000u32 {
            let before = values.capacity();
            grow(&mut values, 1).unwrap();
            n_moves += u32::from(values.capacity() != before);
            values.push(i);
        }
        // log(100 000) / log(1.5) is 28.4, and the first few steps are of one value.
        assert!(n_moves < 40, "{n_moves}");
    }
}
