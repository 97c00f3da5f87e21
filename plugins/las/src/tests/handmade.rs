//! LAS and LAZ files, byte by byte.

use super::Random;
use super::first_version;
use laz::{LasZipCompressor, LazItem, LazVlr, LazVlrBuilder};
use std::io::{Cursor, Seek as _, SeekFrom};

/// Bytes of a record of each format.
pub(super) const LENGTHS: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// A file to be made.
#[derive(Clone)]
pub(super) struct Handmade {
    pub(super) minor: u8,
    pub(super) format: u8,
    pub(super) n_extra: usize,
    /// Records before the points: user, number, payload.
    pub(super) records: Vec<(&'static str, u16, Vec<u8>)>,
    /// Records behind them.
    pub(super) later: Vec<(&'static str, u16, Vec<u8>)>,
    pub(super) points: Vec<u8>,
    /// Points that the header announces; all where there is no number.
    pub(super) announced: Option<u64>,
    pub(super) scale: [f64; 3],
    pub(super) offset: [f64; 3],
}

impl Handmade {
    pub(super) fn new(minor: u8, format: u8) -> Self {
        Self {
            minor,
            format,
            n_extra: 0,
            records: Vec::new(),
            later: Vec::new(),
            points: Vec::new(),
            announced: None,
            scale: [0.01, 0.02, 0.5],
            offset: [1000.0, -2000.0, 0.0],
        }
    }

    /// The same with so many points that walk about, and so many extra bytes.
    pub(super) fn with_walk(mut self, n: usize, n_extra: usize) -> Self {
        self.n_extra = n_extra;
        self.points = walk(self.format, n, n_extra);
        self
    }

    pub(super) fn record_len(&self) -> usize {
        LENGTHS[usize::from(self.format)] + self.n_extra
    }

    fn n_points(&self) -> u64 {
        self.announced.unwrap_or((self.points.len() / self.record_len()) as u64)
    }

    /// Header and records before the points.
    fn head(&self, is_compressed: bool, end_of_points: u64) -> Vec<u8> {
        let len: usize = match self.minor {
            0..=2 => 227,
            3 => 235,
            4 => 375,
            _ => 393,
        };
        let mut records = Vec::new();
        for (user, id, body) in &self.records {
            let mut head = [0; 54];
            head[2..2 + user.len()].copy_from_slice(user.as_bytes());
            head[18..20].copy_from_slice(&id.to_le_bytes());
            head[20..22].copy_from_slice(&u16::try_from(body.len()).unwrap().to_le_bytes());
            records.extend(head);
            records.extend(body);
        }
        let mut head = vec![0; len];
        let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, b"LASF");
        put(24, &[1, self.minor]);
        put(26, b"a scanner");
        put(58, b"by hand");
        put(90, &[60, 0]);
        put(92, &2020u16.to_le_bytes());
        put(94, &(len as u16).to_le_bytes());
        put(96, &((len + records.len()) as u32).to_le_bytes());
        put(100, &(self.records.len() as u32).to_le_bytes());
        put(104, &[self.format | if is_compressed { 0x80 } else { 0 }]);
        put(105, &(self.record_len() as u16).to_le_bytes());
        if self.minor < 4 {
            put(107, &(self.n_points() as u32).to_le_bytes());
        } else {
            put(247, &self.n_points().to_le_bytes());
            put(235, &end_of_points.to_le_bytes());
            put(243, &(self.later.len() as u32).to_le_bytes());
        }
        for axis in 0..3 {
            put(131 + 8 * axis, &self.scale[axis].to_le_bytes());
            put(155 + 8 * axis, &self.offset[axis].to_le_bytes());
            put(179 + 16 * axis, &7e9f64.to_le_bytes());
            put(187 + 16 * axis, &(-7e9f64).to_le_bytes());
        }
        head.extend(records);
        head
    }

    fn add_later(&self, file: &mut Vec<u8>) {
        for (user, id, body) in &self.later {
            let mut head = [0; 60];
            head[2..2 + user.len()].copy_from_slice(user.as_bytes());
            head[18..20].copy_from_slice(&id.to_le_bytes());
            head[20..28].copy_from_slice(&(body.len() as u64).to_le_bytes());
            file.extend(head);
            file.extend(body);
        }
    }

    /// The file as LAS.
    pub(super) fn las(&self) -> Vec<u8> {
        let head = self.head(false, 0).len();
        let mut file = self.head(false, (head + self.points.len()) as u64);
        file.extend(&self.points);
        self.add_later(&mut file);
        file
    }

    /// The file as LAZ, with these compressed fields, in chunks of these numbers of points; of one size where there
    /// is a single number.
    pub(super) fn laz(&self, items: Vec<LazItem>, chunks: &[usize]) -> Vec<u8> {
        let builder = LazVlrBuilder::new(items);
        let vlr = match chunks {
            [one] => builder.with_fixed_chunk_size(*one as u32),
            _ => builder.with_variable_chunk_size(),
        }
        .build();
        self.laz_of(&vlr, chunks)
    }

    /// The file as LAZ with the fields that are usual.
    pub(super) fn usual_laz(&self, chunks: &[usize]) -> Vec<u8> {
        let extra = self.n_extra as u16;
        let vlr = LazVlrBuilder::default().with_point_format(self.format, extra).unwrap().build();
        self.laz(vlr.items().clone(), chunks)
    }

    fn laz_of(&self, vlr: &LazVlr, chunks: &[usize]) -> Vec<u8> {
        let head = self.with_laszip(vlr).head(true, 0);
        let start = head.len() as u64;
        let mut out = Cursor::new(head);
        out.seek(SeekFrom::Start(start)).unwrap();
        let mut compressor = LasZipCompressor::new(out, vlr.clone()).unwrap();
        let mut rest = self.points.as_slice();
        if chunks.len() > 1 {
            for &n in chunks {
                let (chunk, behind) = rest.split_at((n * self.record_len()).min(rest.len()));
                compressor.compress_many(chunk).unwrap();
                compressor.finish_current_chunk().unwrap();
                rest = behind;
            }
        } else {
            compressor.compress_many(rest).unwrap();
        }
        compressor.done().unwrap();
        let mut file = compressor.into_inner().into_inner();
        let end = file.len() as u64;
        let head = self.with_laszip(vlr).head(true, end);
        file[..head.len()].copy_from_slice(&head);
        self.add_later(&mut file);
        file
    }

    /// The file as LAZ of the oldest kind: one run of points without a table.
    pub(super) fn laz_run(&self, items: Vec<LazItem>) -> Vec<u8> {
        let vlr = LazVlrBuilder::new(items).build();
        let mut made = self.with_laszip(&vlr);
        made.records[0].2[0] = 1;
        let mut file = made.head(true, 0);
        file.extend(first_version::compressed(vlr.items(), &self.points));
        file
    }

    fn with_laszip(&self, vlr: &LazVlr) -> Self {
        let mut body = Vec::new();
        vlr.write_to(&mut body).unwrap();
        let mut made = self.clone();
        made.records.insert(0, ("laszip encoded", 22204, body));
        made
    }
}

/// Records of points that walk about: times of three flight lines that take turns, up to 15 returns, four channels of
/// the scanner.
pub(super) fn walk(format: u8, n: usize, n_extra: usize) -> Vec<u8> {
    let mut random = Random(u64::from(format) + 17);
    let len = LENGTHS[usize::from(format)];
    let (mut place, mut times, mut line) = ([100i32, -50, 9], [1000.0, 2e8, 3.5], 0);
    let mut records = Vec::with_capacity(n * (len + n_extra));
    for i in 0..n {
        for value in &mut place {
            *value = value.wrapping_add(random.below(2001) as i32 - 1000);
        }
        if random.below(100) == 0 {
            place[0] = random.next() as i32 / 4;
        }
        if random.below(20) == 0 {
            line = random.below(3) as usize;
        }
        match random.below(8) {
            0 => times[line] += random.below(1000) as f64 * 0.37,
            1 => {}
            2 if i % 50 == 0 => times[line] = random.next() as f64,
            _ => times[line] += 0.001,
        }
        let mut record: Vec<u8> = place.iter().flat_map(|value| value.to_le_bytes()).collect();
        record.extend(((random.below(400) * random.below(30)) as u16).to_le_bytes());
        if format < 6 {
            record.push(random.below(256) as u8);
            record.push(if random.below(3) == 0 { random.below(256) as u8 } else { 2 });
            record.push(random.below(41) as u8);
            record.push(random.below(4) as u8);
            record.extend((random.below(2) as u16 + 7).to_le_bytes());
        } else {
            let n_returns = 1 + random.below(15);
            let channel = if random.below(10) == 0 { random.below(4) } else { i as u64 / 40 % 2 };
            record.push((n_returns << 4 | (1 + random.below(n_returns))) as u8);
            record.push((random.below(16) | channel << 4 | random.below(4) << 6) as u8);
            record.push(random.below(256) as u8);
            record.push(random.below(7) as u8);
            record.extend((random.below(20_000) as i16 - 10_000).to_le_bytes());
            record.extend((random.below(3) as u16 + 500).to_le_bytes());
        }
        if !matches!(format, 0 | 2) {
            record.extend(times[line].to_le_bytes());
        }
        record.resize(len + n_extra, 0);
        let rest = if format < 6 { 20 + if matches!(format, 0 | 2) { 0 } else { 8 } } else { 30 };
        for byte in &mut record[rest..] {
            *byte = if random.below(3) == 0 { random.below(256) as u8 } else { 77 };
        }
        if matches!(format, 4 | 5 | 9 | 10) {
            // A waveform: its place in the file, its length, and floats.
            let at = len - 29;
            let offset = (i as u64 + random.below(2) * 1000) * 100;
            record[at + 1..at + 9].copy_from_slice(&offset.to_le_bytes());
            record[at + 9..at + 13].copy_from_slice(&(90 + random.below(20) as u32).to_le_bytes());
            for float in record[at + 13..len].chunks_exact_mut(4) {
                float.copy_from_slice(&(random.below(1000) as f32 * 0.25).to_le_bytes());
            }
        }
        records.extend(record);
    }
    records
}
