//! What many frames leave behind.

use super::bench::{Bench, DrawRequest, front};
use crate::conformance::clouds;
use crate::conformance::verdict::{Failure, Judged, Said};

/// Frames until everything that is kept is there.
const WARM: u32 = 100;
/// Frames in all.
const FRAMES: u32 = 1000;

/// What allocators keep besides, in bytes: what is taken and given back in other sizes leaves gaps. A
/// kilobyte a frame would show.
const SLACK: u64 = 900 << 10;

/// Bytes that the program has in memory, where the system tells.
fn resident() -> Option<u64> {
    let told = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = told.lines().find_map(|line| line.strip_prefix("RssAnon:"))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kilobytes << 10)
}

pub(super) fn growth(bench: &mut Bench<'_>) -> Judged {
    let shot = DrawRequest::new(clouds::sphere(200, 1.0).cloud(), front(16));
    let mut instance = bench.start()?;
    let mut warm = None;
    for frame in 0..FRAMES {
        let drawn = bench.frame(&mut instance, &shot, frame)?;
        let now = (bench.engine().counters().compiled, drawn.graph_bytes, resident());
        let (compiled, bytes, memory) = *warm.get_or_insert(now);
        if frame < WARM {
            warm = Some(now);
            continue;
        }
        if now.0 != compiled {
            return Err(Failure::new(format!("frame {frame} compiles again")));
        }
        if now.1 != bytes {
            return Err(Failure::new(format!(
                "its textures and buffers take {} bytes after {bytes}, at frame {frame}",
                now.1
            )));
        }
        let (Some(before), Some(after)) = (memory, now.2) else { continue };
        if frame + 1 == FRAMES && after > before + SLACK {
            let each = (after - before) / u64::from(FRAMES - WARM);
            return Err(Failure::new(format!("each frame takes {each} bytes and keeps them")));
        }
    }
    let line = format!("{FRAMES} frames");
    Ok(Said::Measured(match resident() {
        Some(_) => line,
        None => format!("{line}; this system does not tell how much memory a program has"),
    }))
}
