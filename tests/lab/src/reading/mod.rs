//! Measures how fast a binary PLY of 5 million points is read, by this host and by others:
//! `reading [MILLIONS [ROUNDS]]`; `reading write FILE POINTS` keeps such a file, or with `bare` at
//! the end one without normals; `reading tell FILE` says how long a load of it is silent.
//!
//! The file has `x y z nx ny nz` as floats and `red green blue` as bytes. Every method runs in a
//! process of its own, all of them once a round, and the table shows medians over the rounds; a
//! first round, which brings the file into the page cache, is left out.

use anyhow::{Context as _, Result, ensure};
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::cell::Cell;
use std::fs::File;
use std::io::{BufReader, BufWriter, Read as _, Write as _};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use surfelshop_cloud::ReadOptions;
use surfelshop_geometry::{Progress, silent};
use surfelshop_tests::measure::{Cost, in_child};

/// Bytes of a record.
const RECORD: usize = 27;

/// A method that is measured.
struct Method {
    id: &'static str,
    name: &'static str,
    /// Reads the file and returns the points found.
    read: fn(&Path) -> Result<usize>,
    /// Takes far longer than the others and runs once.
    once: bool,
}

const METHODS: [Method; 8] = [
    Method { id: "plain", name: "`std::fs::read`", read: plain, once: false },
    Method { id: "stream", name: "plain read, 1 MiB at a time", read: stream, once: false },
    Method { id: "twice", name: "`std::fs::read`, copied once", read: twice, once: false },
    Method {
        id: "crate",
        name: "ply-rs-bw, `set_float` and `set_uchar`",
        read: by_crate::<Direct>,
        once: false,
    },
    Method {
        id: "property",
        name: "ply-rs-bw, `set_property`",
        read: by_crate::<Wrapped>,
        once: false,
    },
    Method { id: "columns", name: "ours, columns alone", read: columns, once: false },
    Method { id: "ours", name: "ours, cloud with a set radius", read: ours, once: false },
    Method { id: "whole", name: "ours, radii estimated", read: whole, once: true },
];

pub(crate) fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["measure", id, file] => measure(id, file.as_ref()),
        ["tell", file] => tell(file.as_ref()),
        ["write", file, n_points] => write_file(file.as_ref(), n_points.parse()?, true),
        ["write", file, n_points, "bare"] => write_file(file.as_ref(), n_points.parse()?, false),
        _ => {
            let number = |i: usize| words.get(i).map(|word| word.parse::<f64>()).transpose();
            let millions = number(0)?.unwrap_or(5.0);
            compare((millions * 1e6) as usize, number(1)?.unwrap_or(7.0) as usize)
        }
    }
}

/// Measures one method in this process.
fn measure(id: &str, file: &Path) -> Result<()> {
    let method = METHODS.iter().find(|method| method.id == id).context("a method")?;
    let (n_points, cost) = Cost::of(|| (method.read)(file))?;
    ensure!(n_points * RECORD + 1024 > file.metadata()?.len() as usize, "{n_points} points");
    println!("{}", cost.to_line());
    Ok(())
}

/// Measures all methods and prints the table.
fn compare(n_points: usize, rounds: usize) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("points.ply");
    write_file(&path, n_points, true)?;
    let file = path.to_str().context("the temporary folder has a name in UTF-8")?;
    let bytes = path.metadata()?.len() as f64;
    let mut costs: Vec<Vec<Cost>> = vec![Vec::new(); METHODS.len()];
    for round in 0..=rounds {
        for (method, costs) in METHODS.iter().zip(&mut costs) {
            if method.once && round != 1 {
                continue;
            }
            let cost = Cost::from_lines(&in_child(&["measure", method.id, file])?)?;
            if round > 0 {
                costs.push(cost);
            }
        }
    }
    println!("{n_points} points, {:.1} MB, medians of {rounds} rounds\n", bytes * 1e-6);
    println!("| method | Mpts per CPU s | CPU ms | MB/s | peak MB | of the plain read |");
    println!("|---|---|---|---|---|---|");
    let plain = median(&costs[0], |cost| cost.cpu);
    for (method, costs) in METHODS.iter().zip(&costs) {
        let cpu = median(costs, |cost| cost.cpu);
        println!(
            "| {} | {:.2} | {:.0} | {:.0} | {:.0} | {:.3} |",
            method.name,
            n_points as f64 * 1e-6 / cpu,
            cpu * 1e3,
            bytes * 1e-6 / median(costs, |cost| cost.wall),
            median(costs, |cost| cost.peak) * 1e-6,
            plain / cpu,
        );
    }
    println!("\n{}", in_child(&["tell", file])?.trim_end());
    Ok(())
}

fn median(costs: &[Cost], part: impl Fn(&Cost) -> f64) -> f64 {
    let mut parts: Vec<f64> = costs.iter().map(part).collect();
    parts.sort_by(f64::total_cmp);
    parts.get(parts.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Writes points of a wavy sphere, at random places as a scanner's merged file has them.
fn write_file(path: &Path, n_points: usize, with_normals: bool) -> Result<()> {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {n_points}\n")?;
    let n_floats = if with_normals { 6 } else { 3 };
    for name in &["x", "y", "z", "nx", "ny", "nz"][..n_floats] {
        writeln!(out, "property float {name}")?;
    }
    for name in ["red", "green", "blue"] {
        writeln!(out, "property uchar {name}")?;
    }
    writeln!(out, "end_header")?;
    for i in 0..n_points {
        // Two irrational steps fill the square evenly in an order without neighbours.
        let step = |ratio: f64| (i as f64 * ratio).fract();
        let z = 2.0 * step(0.754_877_666_246_693) - 1.0;
        let angle = std::f64::consts::TAU * step(0.569_840_290_998_053);
        let ring = (1.0 - z * z).sqrt();
        let normal = [ring * angle.cos(), z, ring * angle.sin()];
        let radius = 1.0 + 0.05 * (9.0 * angle).sin() * (7.0 * z).cos();
        for value in normal.map(|c| c * radius).into_iter().chain(normal).take(n_floats) {
            out.write_all(&(value as f32).to_le_bytes())?;
        }
        out.write_all(&normal.map(|c| (127.5 + 127.0 * c) as u8))?;
    }
    Ok(out.flush()?)
}

fn plain(file: &Path) -> Result<usize> {
    Ok(std::hint::black_box(std::fs::read(file)?).len() / RECORD)
}

fn stream(file: &Path) -> Result<usize> {
    let (mut file, mut block, mut total) = (File::open(file)?, vec![0; 1 << 20], 0);
    loop {
        match std::hint::black_box(file.read(&mut block)?) {
            0 => return Ok(total / RECORD),
            n_read => total += n_read,
        }
    }
}

fn twice(file: &Path) -> Result<usize> {
    let read = std::fs::read(file)?;
    Ok(std::hint::black_box(read.clone()).len() / RECORD)
}

/// A point as its users would declare it.
#[derive(Clone, Copy, Default)]
struct Point {
    floats: [f32; 6],
    color: [u8; 3],
}

impl Point {
    fn float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        let at = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            "nx" => 3,
            "ny" => 4,
            "nz" => 5,
            _ => return PropertyAccessResult::Ignored,
        };
        self.floats[at] = value;
        PropertyAccessResult::Set
    }

    fn byte(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        let at = match name {
            "red" => 0,
            "green" => 1,
            "blue" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.color[at] = value;
        PropertyAccessResult::Set
    }
}

/// A point that takes values by type, the crate's faster way.
struct Direct(Point);

impl PropertyAccess for Direct {
    fn new() -> Self {
        Self(Point::default())
    }

    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.0.float(name, value)
    }

    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.0.byte(name, value)
    }
}

/// A point that takes values as properties, the crate's usual way.
struct Wrapped(Point);

impl PropertyAccess for Wrapped {
    fn new() -> Self {
        Self(Point::default())
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match property {
            Property::Float(value) => self.0.float(name, value),
            Property::UChar(value) => self.0.byte(name, value),
            _ => PropertyAccessResult::Ignored,
        }
    }
}

fn by_crate<P: PropertyAccess>(file: &Path) -> Result<usize> {
    let parser = Parser::<P>::new();
    let mut reader = Reader::new(BufReader::with_capacity(1 << 20, File::open(file)?));
    let header = parser.read_header(&mut reader)?;
    let vertex = header.elements.get("vertex").context("the file has vertices")?;
    let points = parser.read_payload_for_element(&mut reader, vertex, &header)?;
    Ok(std::hint::black_box(points).len())
}

fn by_us(file: &Path, radius: Option<f32>, progress: Progress<'_>) -> Result<usize> {
    let options = ReadOptions { radius, progress, ..ReadOptions::default() };
    Ok(surfelshop_cloud::read(file, &options)?.cloud.len())
}

/// Stops when all values are decoded, which is told as nine tenths where nothing is estimated.
fn columns(file: &Path) -> Result<usize> {
    let progress = |done: f64| {
        if done >= 0.9 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let options =
        ReadOptions { radius: Some(0.001), progress: &progress, ..ReadOptions::default() };
    ensure!(surfelshop_cloud::read(file, &options).is_err(), "the load was to be cancelled");
    Ok(file.metadata()?.len() as usize / RECORD)
}

fn ours(file: &Path) -> Result<usize> {
    by_us(file, Some(0.001), &silent)
}

fn whole(file: &Path) -> Result<usize> {
    by_us(file, None, &silent)
}

/// What a load told of its progress.
#[derive(Clone, Copy)]
struct ReaderOutput {
    count: u32,
    last: (f64, Instant),
    /// The widest step, as a share of the whole.
    widest: f64,
    /// The longest time in which nothing was told, seconds, and where it ended.
    longest: (f64, f64),
}

/// Prints how often loads tell their progress, and how far apart.
fn tell(file: &Path) -> Result<()> {
    println!("| load | told | widest step | longest silence |");
    println!("|---|---|---|---|");
    for (name, radius) in [("with a set radius", Some(0.001)), ("radii estimated too", None)] {
        let nothing = ReaderOutput {
            count: 0,
            last: (0.0, Instant::now()),
            widest: 0.0,
            longest: (0.0, 0.0),
        };
        let told = Cell::new(nothing);
        let progress = |done: f64| {
            let before = told.get();
            let silence = before.last.1.elapsed().as_secs_f64();
            told.set(ReaderOutput {
                count: before.count + 1,
                last: (done, Instant::now()),
                widest: before.widest.max(done - before.last.0),
                longest: if silence > before.longest.0 { (silence, done) } else { before.longest },
            });
            ControlFlow::Continue(())
        };
        by_us(file, radius, &progress)?;
        let ReaderOutput { count, widest, longest, .. } = told.get();
        println!(
            "| {name} | {count} times | {:.2} % | {:.0} ms, up to {:.1} % |",
            100.0 * widest,
            1e3 * longest.0,
            100.0 * longest.1,
        );
    }
    Ok(())
}
