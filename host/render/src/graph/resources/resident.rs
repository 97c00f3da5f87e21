//! Buffers whose bytes were sent once and stay on the device, by their keys.
//!
//! Invariant: what a unit is told to be there is there in the frame that it describes then.

use crate::graph::resources::Use;
use std::collections::HashMap;
use surfelshop_api::frame::ResidentBytes;

/// Most bytes that stay besides those of the frame that is drawn.
const MAX_BYTES: u64 = 1 << 30;
/// Most buffers that a unit is told of.
const MAX_TOLD: usize = 4096;

/// What a buffer is found by: unit, key and size in bytes, a multiple of 4.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct ResidentId {
    pub(super) scope: String,
    pub(super) key: String,
    pub(super) size: u64,
}

struct ResidentBuffer {
    buffer: wgpu::Buffer,
    /// How many bytes were sent; `None` before they were.
    filled: Option<u64>,
    last_used: Use,
}

/// All that stay.
#[derive(Default)]
pub(super) struct ResidentBuffers {
    all: HashMap<ResidentId, ResidentBuffer>,
    /// How often bytes were sent.
    pub(super) sent: u32,
}

impl ResidentBuffers {
    /// What is there of a unit and will be in the next frame, of which it counts the frames before.
    pub(super) fn of(&self, scope: &str, oldest: u64) -> Vec<ResidentBytes> {
        let own = self.all.iter().filter_map(|(id, buffer)| {
            let is_there = id.scope == scope && buffer.last_used.frame >= oldest;
            buffer.filled.filter(|_| is_there).map(|len| (id, len, buffer.last_used.frame))
        });
        let mut own: Vec<_> = own.collect();
        own.sort_by_key(|(.., last_used)| std::cmp::Reverse(*last_used));
        let told = own.into_iter().take(MAX_TOLD);
        let mut told: Vec<ResidentBytes> =
            told.map(|(id, len, _)| ResidentBytes { key: id.key.clone(), len }).collect();
        told.sort();
        told
    }

    /// A buffer, and whether its bytes are in it.
    pub(super) fn lend(
        &mut self,
        id: &ResidentId,
        now: Use,
        make: impl FnOnce() -> wgpu::Buffer,
    ) -> (wgpu::Buffer, bool) {
        let new = || ResidentBuffer { buffer: make(), filled: None, last_used: now };
        let found = self.all.entry(id.clone()).or_insert_with(new);
        found.last_used = now;
        (found.buffer.clone(), found.filled.is_some())
    }

    /// Notes that so many bytes were sent and the device has taken them.
    pub(super) fn filled(&mut self, id: &ResidentId, len: u64) {
        if let Some(found) = self.all.get_mut(id) {
            found.filled = Some(len);
            self.sent += 1;
        }
    }

    pub(super) fn keep(&mut self, is_kept: impl Fn(&Use) -> bool) {
        self.all.retain(|_, buffer| is_kept(&buffer.last_used));
    }

    /// Drops what was not used for longest, where there is too much.
    pub(super) fn make_room(&mut self, now: Use) {
        let mut bytes = self.bytes();
        while bytes > MAX_BYTES {
            let unused = self.all.iter().filter(|(_, b)| b.last_used.frame < now.frame);
            let oldest = unused.min_by_key(|(_, buffer)| buffer.last_used.frame);
            let Some(oldest) = oldest.map(|(id, _)| id.clone()) else { return };
            bytes -= self.all.remove(&oldest).map_or(0, |buffer| buffer.buffer.size());
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        self.all.values().map(|buffer| buffer.buffer.size()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::Gpu;

    #[test]
    fn what_was_not_used_for_longest_makes_room() {
        let gpu = Gpu::noop().unwrap();
        let mut resident = ResidentBuffers::default();
        let size = 128 << 20;
        let make = || {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let id = |i: u64| ResidentId { scope: "a".to_owned(), key: i.to_string(), size };
        let at = |frame: u64| Use { frame, size: [1; 2] };
        for i in 0..10 {
            let (_, filled) = resident.lend(&id(i), at(i), make);
            assert!(!filled, "{i}");
            resident.filled(&id(i), size - 3);
            resident.make_room(at(i));
            assert!(resident.bytes() <= MAX_BYTES);
        }
        let told: Vec<String> = resident.of("a", 0).into_iter().map(|bytes| bytes.key).collect();
        assert_eq!(told, ["2", "3", "4", "5", "6", "7", "8", "9"]);
        assert_eq!(resident.of("a", 8).len(), 2);
        assert_eq!(resident.of("a", 9)[0].len, size - 3);
        assert!(resident.of("b", 0).is_empty());
        // Those of the frame that is drawn stay, however much they are.
        for i in 10..30 {
            resident.lend(&id(i), at(10), make);
        }
        resident.make_room(at(10));
        assert_eq!(resident.bytes(), 20 * size);
        assert!(resident.of("a", 0).is_empty(), "they are not filled, and there is nothing else");
        assert_eq!(resident.sent, 10);
    }
}
