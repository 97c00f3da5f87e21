//! Archives of images, made here.

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};
use image_webp::{ColorType, WebPEncoder};
use std::io::Write;

/// A zip archive.
#[derive(Default)]
pub(super) struct Zip {
    files: Vec<(String, Vec<u8>)>,
    pub(super) deflated: bool,
    pub(super) comment: Vec<u8>,
}

impl Zip {
    pub(super) fn with(mut self, name: &str, bytes: Vec<u8>) -> Self {
        self.files.push((name.to_owned(), bytes));
        self
    }

    /// The contents of a file.
    pub(super) fn file_mut(&mut self, name: &str) -> &mut Vec<u8> {
        &mut self.files.iter_mut().find(|(own, _)| own == name).unwrap().1
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        let (mut bytes, mut table) = (Vec::new(), Vec::new());
        for (name, contents) in &self.files {
            let mut packed = contents.clone();
            if self.deflated {
                let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
                encoder.write_all(contents).unwrap();
                packed = encoder.finish().unwrap();
            }
            let mut crc = Crc::new();
            crc.update(contents);
            let start = bytes.len() as u32;
            let facts = |out: &mut Vec<u8>| {
                out.extend([20, 0, 0, 0, u8::from(self.deflated) * 8, 0, 0, 0, 0, 0]);
                out.extend(crc.sum().to_le_bytes());
                out.extend((packed.len() as u32).to_le_bytes());
                out.extend((contents.len() as u32).to_le_bytes());
                out.extend((name.len() as u16).to_le_bytes());
            };
            bytes.extend(b"PK\x03\x04");
            facts(&mut bytes);
            // A field of four bytes that only the file's own header has.
            bytes.extend([4, 0]);
            bytes.extend(name.as_bytes());
            bytes.extend([9, 9, 0, 0]);
            bytes.extend(&packed);
            table.extend(b"PK\x01\x02\x14\x00");
            facts(&mut table);
            table.extend([0; 12]);
            table.extend(start.to_le_bytes());
            table.extend(name.as_bytes());
        }
        let start = bytes.len() as u32;
        bytes.extend(&table);
        let n = (self.files.len() as u16).to_le_bytes();
        bytes.extend(b"PK\x05\x06\0\0\0\0");
        bytes.extend([n, n].concat());
        bytes.extend((table.len() as u32).to_le_bytes());
        bytes.extend(start.to_le_bytes());
        bytes.extend((self.comment.len() as u16).to_le_bytes());
        bytes.extend(&self.comment);
        bytes
    }
}

/// A lossless image of pixels of three or four numbers.
pub(super) fn image<const N: usize>(width: usize, pixels: &[[u8; N]]) -> Vec<u8> {
    let mut pixels = pixels.to_vec();
    pixels.resize(pixels.len().next_multiple_of(width), [7; N]);
    let color = if N == 4 { ColorType::Rgba8 } else { ColorType::Rgb8 };
    let mut bytes = Vec::new();
    let height = pixels.len() / width;
    let encoder = WebPEncoder::new(&mut bytes);
    encoder.encode(pixels.as_flattened(), width as u32, height as u32, color).unwrap();
    bytes
}

/// Numbers between two, evenly.
pub(super) fn codebook(least: f64, most: f64) -> Vec<f64> {
    (0..256).map(|i| least + (most - least) * f64::from(i) / 255.0).collect()
}

/// Pixels of Gaussians.
#[derive(Clone)]
pub(super) struct Pixels {
    pub(super) lower: Vec<[u8; 3]>,
    pub(super) upper: Vec<[u8; 3]>,
    pub(super) scales: Vec<[u8; 3]>,
    pub(super) quats: Vec<[u8; 4]>,
    pub(super) sh0: Vec<[u8; 4]>,
    pub(super) labels: Vec<u16>,
    /// A palette of so many entries with so many coefficients each.
    pub(super) entries: Vec<Vec<[u8; 3]>>,
}

pub(super) const BANDS: [usize; 4] = [0, 3, 8, 15];

impl Pixels {
    /// So many Gaussians that look random, with spherical harmonics up to a degree.
    pub(super) fn noise(n: usize, degree: usize) -> Self {
        let three = |seed| super::noise(3 * n, seed).as_chunks::<3>().0.to_vec();
        let four = |seed| super::noise(4 * n, seed).as_chunks::<4>().0.to_vec();
        let mut quats: Vec<[u8; 4]> = four(4);
        quats.iter_mut().for_each(|[.., tag]| *tag = 252 + *tag % 4);
        let n_entries = if degree > 0 { 70 } else { 0 };
        let entry =
            |i: usize| super::noise(3 * BANDS[degree], 100 + i as u64).as_chunks::<3>().0.to_vec();
        Self {
            lower: three(1),
            upper: three(2),
            scales: three(3),
            quats,
            sh0: four(5),
            labels: (0..n).map(|i| (i * 31 % 70) as u16).collect(),
            entries: (0..n_entries).map(entry).collect(),
        }
    }

    /// The image of the palette, 64 entries a row.
    fn palette(&self) -> Vec<u8> {
        let n = self.entries.first().map_or(1, Vec::len);
        let mut entries = self.entries.clone();
        entries.resize(entries.len().next_multiple_of(64), vec![[0; 3]; n]);
        image(64 * n, &entries.concat())
    }

    /// An archive with this `meta.json`.
    pub(super) fn zip(&self, meta: &str) -> Zip {
        let labels: Vec<[u8; 3]> = self
            .labels
            .iter()
            .map(|label| [label.to_le_bytes()[0], label.to_le_bytes()[1], 0])
            .collect();
        let zip = Zip::default()
            .with("means_l.webp", image(4, &self.lower))
            .with("means_u.webp", image(4, &self.upper))
            .with("scales.webp", image(4, &self.scales))
            .with("quats.webp", image(4, &self.quats))
            .with("sh0.webp", image(4, &self.sh0));
        let zip = match self.entries.is_empty() {
            true => zip,
            false => zip
                .with("shN_centroids.webp", self.palette())
                .with("shN_labels.webp", image(4, &labels)),
        };
        zip.with("meta.json", meta.as_bytes().to_vec())
    }

    /// `meta.json` of version 2.
    pub(super) fn meta(&self) -> String {
        let degree = BANDS.iter().position(|n| *n == self.entries.first().map_or(0, Vec::len));
        let rest = match degree.unwrap() {
            0 => String::new(),
            bands => format!(
                r#","shN":{{"count":{},"bands":{bands},"codebook":{:?},"files":["shN_centroids.webp","shN_labels.webp"]}}"#,
                self.entries.len(),
                codebook(-1.0, 1.0)
            ),
        };
        format!(
            r#"{{"version":2,"asset":{{"generator":"a test"}},"count":{},"antialias":true,
            "means":{{"mins":[-2,-1,0.5],"maxs":[1,3,4],"files":["means_l.webp","means_u.webp"]}},
            "scales":{{"codebook":{:?},"files":["scales.webp"]}},
            "quats":{{"files":["quats.webp"]}},
            "sh0":{{"codebook":{:?},"files":["sh0.webp"]}}{rest}}}"#,
            self.lower.len(),
            codebook(-9.0, 2.0),
            codebook(-2.0, 2.5),
        )
    }

    /// `meta.json` of version 1.
    pub(super) fn meta_of_1(&self) -> String {
        let n = self.lower.len();
        let rest = match self.entries.is_empty() {
            true => "",
            false => {
                r#","shN":{"mins":-1,"maxs":1,"quantization":8,"files":["shN_centroids.webp","shN_labels.webp"]}"#
            }
        };
        format!(
            r#"{{"means":{{"shape":[{n},3],"dtype":"float32","mins":[-2,-1,0.5],"maxs":[1,3,4],"files":["means_l.webp","means_u.webp"]}},
            "scales":{{"mins":[-9,-8,-7],"maxs":[2,1,0],"files":["scales.webp"]}},
            "quats":{{"encoding":"quaternion_packed","files":["quats.webp"]}},
            "sh0":{{"mins":[-2,-1,-3,-6],"maxs":[2.5,1,3,8],"files":["sh0.webp"]}}{rest}}}"#
        )
    }

    /// A file of version 2.
    pub(super) fn file(&self) -> Vec<u8> {
        self.zip(&self.meta()).bytes()
    }
}
