//! Checks of file formats: what they write comes back, and damaged files end in a line.

use crate::conformance::verdict::{Failure, Judged, Judges, Said, limits_name, run};
use crate::conformance::{Case, Outcome, Setup};
use glam::DVec3;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use surfelshop_api::abi::format_table::ReadCall;
use surfelshop_api::columns::{COLOR, ColumnView, Element, NORMAL, POSITION, Values as Numbers};
use surfelshop_api::format::{
    CloudHeader, CloudSinkHost, CloudSourceHost, Collected, FileColumn, FileHost, INTENSITY,
};
use surfelshop_api::params::Values;
use surfelshop_api::{CloudView, UnitKind};
use surfelshop_cloud::silent;
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::formats::{Ended, FormatRunner};
use surfelshop_runtime::plugins::LoadedUnit;

type Criteria = fn(&mut Bench<'_>) -> Judged;

const fn case(name: &'static str, about: &'static str, judge: Criteria) -> (Case, Criteria) {
    (Case { kind: UnitKind::Format, name, about }, judge)
}

const CASES: &[(Case, Criteria)] = &[
    case("limits", "limits that it declares are those of cases that there are", limits),
    case("round-trip", "points that it writes come back: as many, at their places", round_trip),
    case("moved", "points 7 million units away come back to a thousandth of a unit", moved),
    case("again", "a second read gives the same, bit by bit", again),
    case("heads", "where no points are wanted, it hands none over", heads),
    case("empty", "files of no byte and of one: refused in a line, or without clouds", empty),
    case("damaged", "its file cut short and with bits turned over: no hang, no panic", damaged),
    case("foreign", "bytes of nothing behind its first bytes: no hang, no panic", foreign),
];

fn limits(bench: &mut Bench<'_>) -> Judged {
    limits_name(&bench.unit.description.limits, &cases())
}

pub(crate) fn cases() -> Vec<Case> {
    CASES.iter().map(|(case, _)| *case).collect()
}

pub(crate) fn check(
    unit: &LoadedUnit,
    setup: &Setup<'_>,
    wanted: &dyn Fn(&Case) -> bool,
    tell: &mut dyn FnMut(&Outcome) -> bool,
) -> Vec<Outcome> {
    let silence = Duration::from_secs(10).min(setup.patience.create);
    let runner = FormatRunner { timeouts: setup.patience, silence };
    let mut bench = Bench { unit, runner };
    let cases: Vec<(Case, Judges<Bench<'_>>)> = CASES.to_vec();
    run(unit, &cases, wanted, tell, &mut bench)
}

struct Bench<'a> {
    unit: &'a LoadedUnit,
    runner: FormatRunner,
}

/// Points of the ball.
const POINTS: usize = 1000;

/// A ball of points around a place, with normals, colours and intensities, handed over in two batches.
struct Ball {
    positions: Vec<f64>,
    normals: Vec<f32>,
    colors: Vec<u8>,
    intensities: Vec<u16>,
    begun: bool,
    done: usize,
}

impl Ball {
    fn around(place: DVec3) -> Self {
        let directions: Vec<DVec3> = (0..POINTS)
            .map(|i| {
                // Even on a sphere: Fibonacci's spiral.
                let z = 1.0 - (2.0 * i as f64 + 1.0) / POINTS as f64;
                let angle = i as f64 * 2.399_963_229_728_653;
                let radius = (1.0 - z * z).sqrt();
                DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
            })
            .collect();
        Self {
            positions: directions.iter().flat_map(|d| (place + 10.0 * *d).to_array()).collect(),
            normals: directions.iter().flat_map(|d| d.as_vec3().to_array()).collect(),
            colors: (0..3 * POINTS).map(|i| (i % 251) as u8).collect(),
            intensities: (0..POINTS).map(|i| (i * 61) as u16).collect(),
            begun: false,
            done: 0,
        }
    }
}

impl CloudSourceHost for Ball {
    fn next_cloud(&mut self) -> surfelshop_api::Result<Option<CloudHeader>> {
        let columns = vec![
            FileColumn::new(POSITION, 3, Element::F64),
            FileColumn::new(NORMAL, 3, Element::F32),
            FileColumn::new(COLOR, 3, Element::U8),
            FileColumn::new(INTENSITY, 1, Element::U16),
        ];
        let header = CloudHeader { columns, ..CloudHeader::default() };
        Ok((!std::mem::replace(&mut self.begun, true)).then_some(header))
    }

    fn next_batch(&mut self) -> surfelshop_api::Result<Option<CloudView<'_>>> {
        let start = self.done;
        let end = (start + POINTS / 2 + 1).min(POINTS);
        self.done = end;
        if start == end {
            return Ok(None);
        }
        let column =
            |name, components, values| ColumnView { name, components, generation: 0, values };
        let columns = vec![
            column(POSITION, 3, Numbers::F64(&self.positions[3 * start..3 * end])),
            column(NORMAL, 3, Numbers::F32(&self.normals[3 * start..3 * end])),
            column(COLOR, 3, Numbers::U8(&self.colors[3 * start..3 * end])),
            column(INTENSITY, 1, Numbers::U16(&self.intensities[start..end])),
        ];
        Ok(Some(CloudView { len: end - start, columns, ..CloudView::default() }))
    }
}

/// A file in memory.
#[derive(Default)]
struct Memory(Mutex<Vec<u8>>);

/// A format that writes more than this for a thousand points writes without end.
const MOST_BYTES: usize = 64 << 20;

impl Memory {
    fn bytes(&self) -> MutexGuard<'_, Vec<u8>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl FileHost for Memory {
    fn length(&self) -> u64 {
        self.bytes().len() as u64
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let bytes = self.bytes();
        let start = usize::try_from(offset).unwrap_or(usize::MAX).min(bytes.len());
        let len = buffer.len().min(bytes.len() - start);
        buffer[..len].copy_from_slice(&bytes[start..start + len]);
        Ok(len)
    }

    fn write_at(&self, offset: u64, written: &[u8]) -> io::Result<()> {
        let mut bytes = self.bytes();
        let end = usize::try_from(offset).ok().and_then(|start| start.checked_add(written.len()));
        let end = end.filter(|end| *end <= MOST_BYTES);
        let end = end.ok_or_else(|| io::Error::other("the disk is full"))?;
        if bytes.len() < end {
            bytes.resize(end, 0);
        }
        bytes[end - written.len()..end].copy_from_slice(written);
        Ok(())
    }
}

fn failed(ended: Ended) -> Failure {
    match ended {
        Ended::Failed(Fault::Error(line)) => Failure::new(line),
        Ended::Failed(fault @ Fault::TimedOut(_)) => Failure::silence(fault.to_string()),
        Ended::Failed(fault) => Failure::fault(fault.to_string()),
        Ended::Cancelled => Failure::new("it stopped without being asked to"),
    }
}

impl Bench<'_> {
    fn values(&self) -> Values {
        let declared = &self.unit.description.params;
        declared.iter().map(|p| (p.id.clone(), p.default.clone())).collect()
    }

    /// A name with the ending of its files.
    fn name(&self) -> String {
        let ending = self.unit.unit.files.endings.first().map_or("bin", String::as_str);
        format!("ball.{ending}")
    }

    /// The bytes of a ball as it writes them; none where it only reads.
    fn written(&self, place: DVec3) -> Result<Option<Vec<u8>>, Failure> {
        if !self.unit.unit.files.written {
            return Ok(None);
        }
        let file = Arc::new(Memory::default());
        let (values, ball) = (self.values(), Box::new(Ball::around(place)));
        let name = self.name();
        self.runner
            .write(self.unit, values, ball, (&name, file.clone()), &silent)
            .map_err(|ended| failed(ended).of("written"))?;
        let bytes = std::mem::take(&mut *file.bytes());
        Ok(Some(bytes))
    }

    fn read_into<S: CloudSinkHost + Send + 'static>(
        &self,
        bytes: Vec<u8>,
        sink: S,
    ) -> Result<Arc<Mutex<S>>, Ended> {
        let file = Arc::new(Memory(Mutex::new(bytes)));
        let sink = Arc::new(Mutex::new(sink));
        let (name, values) = (self.name(), self.values());
        let shared: Arc<Mutex<dyn CloudSinkHost + Send>> = sink.clone();
        let call = ReadCall { values, ..ReadCall::default() };
        self.runner.read(self.unit, call, (&name, file), shared, &silent)?;
        Ok(sink)
    }

    fn read(&self, bytes: Vec<u8>) -> Result<Collected, Ended> {
        let sink = self.read_into(bytes, Collected::default())?;
        let mut collected = sink.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(std::mem::take(&mut collected))
    }

    /// Reads bytes that nobody promised to be a file: an error in a line is as good as clouds.
    fn survives(&self, bytes: Vec<u8>, what: &str) -> Result<bool, Failure> {
        match self.read(bytes) {
            Ok(_) => Ok(true),
            Err(Ended::Failed(Fault::Error(_))) => Ok(false),
            Err(ended) => Err(failed(ended).of(what)),
        }
    }
}

/// Why cases are left out of formats without files.
fn only_read() -> Judged {
    Ok(Said::LeftOut("it writes no files, and none of its own is at hand".to_owned()))
}

/// All points of a file, in common coordinates, in an order of their own.
fn points(collected: &Collected) -> Vec<DVec3> {
    let mut points = Vec::new();
    for cloud in &collected.clouds {
        let Some((place, _)) = cloud.header.column(POSITION) else { continue };
        let (found, _) = cloud.columns[place].as_chunks::<3>();
        points.extend(found.iter().map(|p| cloud.header.pose.place(DVec3::from_array(*p))));
    }
    points.sort_by(|a, b| a.z.total_cmp(&b.z));
    points
}

/// Whether a ball around a place comes back, with places off by less than this.
fn comes_back(bench: &Bench<'_>, place: DVec3, most: f64) -> Judged {
    let Some(bytes) = bench.written(place)? else { return only_read() };
    let n_bytes = bytes.len();
    let found = points(&bench.read(bytes).map_err(|ended| failed(ended).of("read back"))?);
    if found.len() != POINTS {
        let n = found.len();
        return Err(Failure::new(format!("{POINTS} points were written, {n} came back")));
    }
    let ball = Ball::around(place);
    let (expected, _) = ball.positions.as_chunks::<3>();
    let mut expected: Vec<DVec3> = expected.iter().map(|p| DVec3::from_array(*p)).collect();
    expected.sort_by(|a, b| a.z.total_cmp(&b.z));
    let off = expected.iter().zip(&found).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    match off <= most {
        true => Ok(Said::Measured(format!("{n_bytes} bytes; places off by at most {off:.1e}"))),
        false => {
            Err(Failure::new(format!("places are off by {off:.3e}, at most {most:.0e} is right")))
        }
    }
}

fn round_trip(bench: &mut Bench<'_>) -> Judged {
    // A ten-thousandth of the ball's radius; neighbours in z are 0.02 apart.
    comes_back(bench, DVec3::ZERO, 1e-3)
}

fn moved(bench: &mut Bench<'_>) -> Judged {
    comes_back(bench, DVec3::new(7e6, 5e5, 100.0), 1e-3)
}

fn again(bench: &mut Bench<'_>) -> Judged {
    let Some(bytes) = bench.written(DVec3::ZERO)? else { return only_read() };
    let [first, second] = [bench.read(bytes.clone()), bench.read(bytes)];
    match first.map_err(failed)? == second.map_err(failed)? {
        true => Ok(Said::Measured("the same".to_owned())),
        false => Err(Failure::new("two reads of a file differ")),
    }
}

/// Takes headers and counts what comes besides.
#[derive(Default)]
struct Heads {
    n_clouds: usize,
    n_batches: usize,
}

impl CloudSinkHost for Heads {
    fn begin(&mut self, _header: &CloudHeader) -> surfelshop_api::Result<bool> {
        self.n_clouds += 1;
        Ok(false)
    }

    fn batch(&mut self, _values: &[Numbers<'_>]) -> surfelshop_api::Result<()> {
        self.n_batches += 1;
        Ok(())
    }

    fn faces(&mut self, _triangles: &[[u32; 3]]) -> surfelshop_api::Result<()> {
        self.n_batches += 1;
        Ok(())
    }

    fn warn(&mut self, _line: &str) {}
}

fn heads(bench: &mut Bench<'_>) -> Judged {
    let Some(bytes) = bench.written(DVec3::ZERO)? else { return only_read() };
    let sink = bench.read_into(bytes, Heads::default()).map_err(failed)?;
    let Heads { n_clouds, n_batches } = *sink.lock().unwrap_or_else(PoisonError::into_inner);
    match (n_clouds, n_batches) {
        (0, _) => Err(Failure::new("it found no cloud")),
        (_, 0) => Ok(Said::Measured(format!("{n_clouds} headers"))),
        (_, n) => Err(Failure::new(format!("{n} batches came that nobody wanted"))),
    }
}

fn empty(bench: &mut Bench<'_>) -> Judged {
    for bytes in [Vec::new(), vec![0], vec![b'\n']] {
        let n = bytes.len();
        bench.survives(bytes, &format!("a file of {n} bytes"))?;
    }
    Ok(Said::Measured("refused in a line, or without clouds".to_owned()))
}

/// Numbers that look random and are the same on every run.
fn noise(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        // SplitMix64 (Steele, Lea and Flood 2014).
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}

/// Files cut short, and files with bits turned over.
const CUTS: usize = 40;
const FLIPS: usize = 160;

fn damaged(bench: &mut Bench<'_>) -> Judged {
    let Some(bytes) = bench.written(DVec3::ZERO)? else { return only_read() };
    let (mut chance, mut n_read) = (noise(7), 0);
    for i in 0..CUTS {
        let cut = bytes.len() * i / CUTS;
        let what = format!("cut after {cut} of {} bytes", bytes.len());
        n_read += usize::from(bench.survives(bytes[..cut].to_vec(), &what)?);
    }
    for i in 0..FLIPS {
        let mut damaged = bytes.clone();
        // Most damage is done where the file says what it holds.
        let reach = if i % 2 == 0 { bytes.len().min(512) } else { bytes.len() };
        let place = chance() as usize % reach.max(1);
        if let Some(byte) = damaged.get_mut(place) {
            *byte ^= 1 << (chance() % 8);
        }
        let what = format!("a bit of byte {place} turned over");
        n_read += usize::from(bench.survives(damaged, &what)?);
    }
    Ok(Said::Measured(format!("{n_read} of {} could be read all the same", CUTS + FLIPS)))
}

fn foreign(bench: &mut Bench<'_>) -> Judged {
    let mut chance = noise(11);
    let magics = &bench.unit.unit.files.magics;
    for i in 0..FLIPS / 4 {
        let mut bytes: Vec<u8> = (0..64 << (i % 8)).map(|_| chance() as u8).collect();
        if let Some(magic) = magics.get(i % magics.len().max(1)) {
            let start = magic.offset as usize;
            bytes[start..start + magic.bytes.len()].copy_from_slice(&magic.bytes);
        }
        bench.survives(bytes, "bytes of nothing")?;
    }
    Ok(Said::Measured(format!("{} files", FLIPS / 4)))
}
