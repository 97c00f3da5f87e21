//! The fields that all points of LAS 1.4 have, in layers: decoded as `laz` does it, with times that end (see
//! [`times`](super::times)) and models that are made only for the scanner channels that there are.

use super::layers::{Layer, Median, Models, integers, symbols};
use super::times::{Kind, Times};
use crate::numbers::{bytes, u16_at, u32_at};
use laz::DecompressionSelection as Selection;
use laz::decompressors::IntegerDecompressor;
use laz::models::ArithmeticModel;
use laz::record::LayeredFieldDecompressor;
use std::io::{self, Read, Seek};

/// Bytes of the fields.
const LEN: usize = 30;

/// The layers, in the order of the file.
const XY: usize = 0;
const Z: usize = 1;
const CLASSIFICATION: usize = 2;
const FLAGS: usize = 3;
const INTENSITY: usize = 4;
const SCAN_ANGLE: usize = 5;
const USER_DATA: usize = 6;
const POINT_SOURCE: usize = 7;
const GPS_TIME: usize = 8;

/// Contexts of differences, by the number of returns and the return: part of the format.
const CONTEXTS: [[u8; 16]; 16] = [
    [0, 1, 2, 3, 4, 5, 3, 4, 4, 5, 5, 5, 5, 5, 5, 5],
    [1, 0, 1, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3],
    [2, 1, 2, 4, 4, 4, 4, 4, 4, 4, 4, 3, 3, 3, 3, 3],
    [3, 3, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [4, 3, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [5, 3, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [3, 3, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4, 4],
    [4, 3, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4, 4],
    [4, 3, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4, 4],
    [5, 3, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4, 4],
    [5, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 4, 4, 4, 4, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 4, 4, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 4],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5],
    [5, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5],
];

/// A point as it is decoded.
#[derive(Clone, Copy, Default)]
struct Point {
    x: i32,
    y: i32,
    z: i32,
    intensity: u16,
    n_returns: u8,
    return_number: u8,
    class_flags: u8,
    channel: u8,
    scan_flags: u8,
    classification: u8,
    user_data: u8,
    scan_angle: i16,
    point_source: u16,
    time: i64,
}

impl Point {
    fn unpack(record: &[u8; LEN]) -> Self {
        let [returns, flags, classification, user_data] = bytes(record, 14);
        let place = |axis: usize| u32_at(record, 4 * axis) as i32;
        Self {
            x: place(0),
            y: place(1),
            z: place(2),
            intensity: u16_at(record, 12),
            n_returns: returns >> 4,
            return_number: returns & 15,
            class_flags: flags & 15,
            channel: flags >> 4 & 3,
            scan_flags: flags >> 6,
            classification,
            user_data,
            scan_angle: u16_at(record, 18) as i16,
            point_source: u16_at(record, 20),
            time: i64::from_le_bytes(bytes(record, 22)),
        }
    }

    fn pack(&self, record: &mut [u8; LEN]) {
        record[..4].copy_from_slice(&self.x.to_le_bytes());
        record[4..8].copy_from_slice(&self.y.to_le_bytes());
        record[8..12].copy_from_slice(&self.z.to_le_bytes());
        record[12..14].copy_from_slice(&self.intensity.to_le_bytes());
        record[14] = self.n_returns << 4 | self.return_number;
        record[15] = self.scan_flags << 6 | self.channel << 4 | self.class_flags;
        record[16] = self.classification;
        record[17] = self.user_data;
        record[18..20].copy_from_slice(&self.scan_angle.to_le_bytes());
        record[20..22].copy_from_slice(&self.point_source.to_le_bytes());
        record[22..].copy_from_slice(&self.time.to_le_bytes());
    }

    /// Whether the return is the first of its pulse, 1, and the last, 2.
    fn kind_of_return(&self) -> usize {
        usize::from(self.return_number == 1) + 2 * usize::from(self.return_number >= self.n_returns)
    }
}

/// What is known of a channel of the scanner: its last point, and models of what comes next.
struct Channel {
    last: Point,
    has_new_time: bool,
    intensities: [u16; 8],
    x_steps: [Median; 12],
    y_steps: [Median; 12],
    heights: [i32; 8],
    changes: Vec<ArithmeticModel>,
    next_channel: ArithmeticModel,
    n_returns: Models,
    returns: Models,
    returns_of_pulse: ArithmeticModel,
    classifications: Models,
    flags: Models,
    user_data: Models,
    x: IntegerDecompressor,
    y: IntegerDecompressor,
    z: IntegerDecompressor,
    intensity: IntegerDecompressor,
    scan_angle: IntegerDecompressor,
    point_source: IntegerDecompressor,
    times: Times,
}

impl Channel {
    fn new(last: Point) -> Self {
        Self {
            last,
            has_new_time: false,
            intensities: [last.intensity; 8],
            x_steps: Default::default(),
            y_steps: Default::default(),
            heights: [last.z; 8],
            changes: vec![symbols(128); 8],
            next_channel: symbols(3),
            n_returns: Models::new(16, 16),
            returns: Models::new(16, 16),
            returns_of_pulse: symbols(13),
            classifications: Models::new(64, 256),
            flags: Models::new(64, 64),
            user_data: Models::new(64, 256),
            x: integers(32, 2),
            y: integers(32, 22),
            z: integers(32, 20),
            intensity: integers(16, 4),
            scan_angle: integers(16, 2),
            point_source: integers(16, 1),
            times: Times::new(last.time, Kind::InLayer),
        }
    }

    /// What changes with the next point, as bits: how the return does, the number of returns 4, the angle 8, the
    /// time 16, the source 32, the channel 64.
    fn changes(&mut self, xy: &mut Layer) -> io::Result<u32> {
        let kind = self.last.kind_of_return() + 4 * usize::from(self.has_new_time);
        xy.symbol(&mut self.changes[kind])
    }

    /// Decodes the next point.
    fn decode(&mut self, layers: &mut [Layer; 9], changes: u32) -> io::Result<()> {
        let has_new_time = changes & 16 != 0;
        self.has_new_time = has_new_time;
        self.decode_returns(&mut layers[XY], changes)?;
        let last = &mut self.last;
        let (n, r) = (usize::from(last.n_returns), usize::from(last.return_number));
        let is_single = usize::from(n == 1);
        let steps = 2 * usize::from(CONTEXTS[n][r]) + usize::from(has_new_time);
        // Where the kind was learnt, first and last are counted the other way round.
        let kind = 2 * usize::from(r == 1) + usize::from(r >= n);

        let step = layers[XY].integer(&mut self.x, self.x_steps[steps].get(), is_single)?;
        last.x = last.x.wrapping_add(step);
        self.x_steps[steps].add(step);
        let context = is_single + even(self.x.k(), 20);
        let step = layers[XY].integer(&mut self.y, self.y_steps[steps].get(), context)?;
        last.y = last.y.wrapping_add(step);
        self.y_steps[steps].add(step);
        if layers[Z].is_open {
            let context = is_single + even((self.x.k() + self.y.k()) / 2, 18);
            let height = &mut self.heights[n.abs_diff(r).min(7)];
            last.z = layers[Z].integer(&mut self.z, *height, context)?;
            *height = last.z;
        }
        if layers[CLASSIFICATION].is_open {
            let context = 2 * usize::from(last.classification & 31) + usize::from(kind == 3);
            let model = self.classifications.get(context)?;
            last.classification = layers[CLASSIFICATION].symbol(model)? as u8;
        }
        if layers[FLAGS].is_open {
            // The edge of a flight line is the higher bit of both.
            let context = last.scan_flags << 4 | last.class_flags;
            let flags = layers[FLAGS].symbol(self.flags.get(usize::from(context))?)? as u8;
            (last.class_flags, last.scan_flags) = (flags & 15, flags >> 4 & 3);
        }
        if layers[INTENSITY].is_open {
            let before = &mut self.intensities[2 * kind + usize::from(has_new_time)];
            let guess = i32::from(*before);
            last.intensity = layers[INTENSITY].integer(&mut self.intensity, guess, kind)? as u16;
            *before = last.intensity;
        }
        if layers[SCAN_ANGLE].is_open && changes & 8 != 0 {
            let (guess, context) = (i32::from(last.scan_angle), usize::from(has_new_time));
            let angle = layers[SCAN_ANGLE].integer(&mut self.scan_angle, guess, context)?;
            last.scan_angle = angle as i16;
        }
        if layers[USER_DATA].is_open {
            let model = self.user_data.get(usize::from(last.user_data / 4))?;
            last.user_data = layers[USER_DATA].symbol(model)? as u8;
        }
        if layers[POINT_SOURCE].is_open && changes & 32 != 0 {
            let guess = i32::from(last.point_source);
            let source = layers[POINT_SOURCE].integer(&mut self.point_source, guess, 0)?;
            last.point_source = source as u16;
        }
        if layers[GPS_TIME].is_open && has_new_time {
            last.time = self.times.decode(&mut layers[GPS_TIME].decoder)?;
        }
        Ok(())
    }

    /// Decodes which return of how many the next point is.
    fn decode_returns(&mut self, xy: &mut Layer, changes: u32) -> io::Result<()> {
        let last = &mut self.last;
        if changes & 4 != 0 {
            let model = self.n_returns.get(usize::from(last.n_returns))?;
            last.n_returns = xy.symbol(model)? as u8 & 15;
        }
        let before = last.return_number;
        last.return_number = match changes & 3 {
            0 => before,
            1 => (before + 1) & 15,
            2 => (before + 15) & 15,
            _ if self.has_new_time => {
                let model = self.returns.get(usize::from(before))?;
                xy.symbol(model)? as u8 & 15
            }
            _ => (before + 2 + xy.symbol(&mut self.returns_of_pulse)? as u8) & 15,
        };
        Ok(())
    }
}

/// A number as an even one, at most `most`.
fn even(number: u32, most: u32) -> usize {
    (number.min(most) & !1) as usize
}

/// The decoder of the fields, of version 3 or 4 of the compression.
pub(super) struct Point14<const VERSION: u16> {
    layers: [Layer; 9],
    selection: u32,
    current: usize,
    channels: [Option<Box<Channel>>; 4],
}

impl<const VERSION: u16> Point14<VERSION> {
    pub(super) fn new() -> Self {
        let layers = std::array::from_fn(|_| Layer::new());
        Self { layers, selection: Selection::ALL, current: 0, channels: Default::default() }
    }
}

impl<const VERSION: u16, R: Read + Seek> LayeredFieldDecompressor<R> for Point14<VERSION> {
    fn size_of_field(&self) -> usize {
        LEN
    }

    fn set_selection(&mut self, selection: Selection) {
        self.selection = selection.0;
    }

    fn init_first_point(
        &mut self,
        bytes: &mut R,
        first: &mut [u8],
        context: &mut usize,
    ) -> io::Result<()> {
        bytes.read_exact(first)?;
        let first = Point::unpack(first.first_chunk().ok_or(io::ErrorKind::InvalidInput)?);
        self.current = usize::from(first.channel);
        *context = self.current;
        self.channels = Default::default();
        self.channels[self.current] = Some(Box::new(Channel::new(first)));
        Ok(())
    }

    fn decompress_field_with(&mut self, record: &mut [u8], context: &mut usize) -> io::Result<()> {
        let before = self.channels[self.current].as_mut().ok_or(io::ErrorKind::InvalidInput)?;
        let changes = before.changes(&mut self.layers[XY])?;
        if changes & 64 != 0 {
            let by = self.layers[XY].symbol(&mut before.next_channel)? as usize;
            let last = before.last;
            self.current = (self.current + by + 1) & 3;
            let new = || Box::new(Channel::new(last));
            self.channels[self.current].get_or_insert_with(new).last.channel = self.current as u8;
        }
        // In version 3 the other fields are told only where the channel changes.
        if VERSION == 4 || changes & 64 != 0 {
            *context = self.current;
        }
        let channel = self.channels[self.current].as_mut().ok_or(io::ErrorKind::InvalidInput)?;
        channel.decode(&mut self.layers, changes)?;
        channel.last.pack(record.first_chunk_mut().ok_or(io::ErrorKind::InvalidInput)?);
        Ok(())
    }

    fn read_layers_sizes(&mut self, bytes: &mut R) -> io::Result<()> {
        self.layers.iter_mut().try_for_each(|layer| layer.read_len(bytes))
    }

    fn read_layers(&mut self, bytes: &mut R) -> io::Result<()> {
        // Bits of the selection are in the order of the layers; the first is always needed.
        for (i, layer) in self.layers.iter_mut().enumerate() {
            let is_wanted = i == XY || self.selection & (1 << (i - 1)) != 0;
            layer.read(bytes, is_wanted)?;
        }
        Ok(())
    }
}
