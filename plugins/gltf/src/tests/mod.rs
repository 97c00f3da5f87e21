//! Tests through `Format`, with files in memory.

mod colors;
mod damage;
mod elements;
mod scenes;
mod splats;
mod triangles;

use crate::{Colors, Gltf, Settings};
use surfelshop_api::Format;
use surfelshop_api::format::{CloudSink, Collected, CollectedCloud, FileSource};
use surfelshop_api::job::JobHost;
use surfelshop_api::prelude::{Error, HostInfo, Job, Result};
use surfelshop_api::tool::EditHeader;

/// A host whose loops run one after the other.
struct SerialHost;

impl JobHost for SerialHost {
    fn progress(&self, fraction: f64, _message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction}");
    }

    fn cancelled(&self) -> bool {
        false
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Err(Error::new("formats stage nothing"))
    }
}

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// The parts of a scene.
#[derive(Clone, Default)]
struct Builder {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    /// Of the root, such as `"nodes":[]`.
    rest: Vec<String>,
}

impl Builder {
    /// A view of these bytes, and more of its JSON, such as `,"byteStride":16`.
    fn view(&mut self, bytes: &[u8], more: &str) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let (offset, len) = (self.bytes.len(), bytes.len());
        self.bytes.extend_from_slice(bytes);
        self.views
            .push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{len}{more}}}"#));
        self.views.len() - 1
    }

    /// An accessor of a view of its own.
    fn accessor(&mut self, bytes: &[u8], kind: u32, of: &str, count: usize, more: &str) -> usize {
        let view = self.view(bytes, "");
        self.accessor_of(&format!(r#""bufferView":{view},"#), kind, of, count, more)
    }

    fn accessor_of(&mut self, view: &str, kind: u32, of: &str, count: usize, more: &str) -> usize {
        let json =
            format!(r#"{{{view}"componentType":{kind},"type":"{of}","count":{count}{more}}}"#);
        self.accessors.push(json);
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], of: &str) -> usize {
        let components = if of == "SCALAR" { 1 } else { of[3..].parse().unwrap() };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(&bytes, FLOAT, of, values.len() / components, "")
    }

    fn shorts(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(&bytes, UNSIGNED_SHORT, "SCALAR", values.len(), "")
    }

    fn root(&mut self, json: &str) -> &mut Self {
        self.rest.push(json.to_owned());
        self
    }

    /// One mesh that one node shows.
    fn mesh(&mut self, primitives: &str) -> &mut Self {
        self.root(&format!(r#""meshes":[{{"primitives":[{primitives}]}}]"#));
        self.root(r#""nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0"#)
    }

    fn json(&self, uri: &str) -> String {
        let list = |name: &str, of: &[String]| {
            if of.is_empty() { String::new() } else { format!(r#","{name}":[{}]"#, of.join(",")) }
        };
        let buffers = [format!(r#"{{"byteLength":{}{uri}}}"#, self.bytes.len())];
        let rest: String = self.rest.iter().map(|json| format!(",{json}")).collect();
        format!(
            r#"{{"asset":{{"version":"2.0","generator":"a test"}}{}{}{}{rest}}}"#,
            list("buffers", &buffers),
            list("bufferViews", &self.views),
            list("accessors", &self.accessors),
        )
    }

    fn glb(&self) -> Vec<u8> {
        glb(&self.json(""), &self.bytes)
    }

    fn found(&self) -> Collected {
        read(&self.glb()).unwrap()
    }

    fn refusal(&self) -> String {
        refusal(&self.glb())
    }
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = (12 + 8 + json.len() + 8 + binary.len()) as u32;
    let mut file = b"glTF".to_vec();
    file.extend([2u32.to_le_bytes(), length.to_le_bytes()].concat());
    for (kind, contents) in [(b"JSON", json), (b"BIN\0", binary)] {
        file.extend((contents.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(contents);
    }
    file
}

fn read_with(bytes: &[u8], colors: Colors) -> Result<Collected> {
    read_file(&FileSource::of_bytes(bytes.to_vec(), "a.glb"), colors)
}

fn read_file(file: &FileSource, colors: Colors) -> Result<Collected> {
    let mut found = Collected::default();
    Gltf::new(&HostInfo::default())?.read(
        file,
        &Settings { colors },
        &mut CloudSink::new(&mut found, None),
        &Job::new(&SerialHost),
    )?;
    Ok(found)
}

fn read(bytes: &[u8]) -> Result<Collected> {
    read_with(bytes, Colors::Encoded)
}

/// The line that a file is refused with.
fn refusal(bytes: &[u8]) -> String {
    let line = read(bytes).map(|found| found.warnings.len()).unwrap_err().to_string();
    assert!(!line.contains('\n') && !line.is_empty(), "{line}");
    line
}

fn only(found: &Collected) -> &CollectedCloud {
    assert_eq!(found.clouds.len(), 1);
    &found.clouds[0]
}

/// A column that was read.
fn values<'a>(found: &'a Collected, name: &str) -> &'a [f64] {
    let cloud = only(found);
    let (place, _) = cloud.header.column(name).unwrap_or_else(|| panic!("no column `{name}`"));
    &cloud.columns[place]
}

fn near(found: &[f64], expected: &[f64]) {
    let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6 || a.is_nan() && b.is_nan();
    assert!(
        found.len() == expected.len() && found.iter().zip(expected).all(close),
        "{found:?} {expected:?}"
    );
}
