//! What no command of the program makes: formulas as they are printed, beside the corrected ones and the
//! truth, for each pixel of a picture of normals, each surfel of a cloud, or along a curve.
//!
//! All angles are in radians, directions of unit length and in world space, radiance linear Rec. 709.

mod bounces;
mod camera;
mod curves;
mod fields;
mod harmonics;
mod lights;
mod mapping;
mod marble;
mod noise;
mod occlusion;
mod optics;
mod shadow_map;
mod sky;
mod specular;
mod splats;
mod surface;
mod vertices;

use crate::outcome::{Drawing, Grid, Number, Outcome, PictureFile};
use crate::work::{Used, Work};
use anyhow::bail;
use std::path::Path;
use surfelshop_image::display_transform::{DisplayTransform, develop};
use surfelshop_image::{Image, metrics, png};
use surfelshop_session::output::files::write_whole;

/// Where an entry is evaluated: its files and its folder.
pub(crate) struct Bench<'a, 'b> {
    pub(crate) work: &'a Work<'b>,
    pub(crate) used: &'a [(String, Used)],
    pub(crate) folder: &'a Path,
}

impl Bench<'_, '_> {
    /// Pixels along each side of a picture.
    pub(crate) fn size(&self) -> u32 {
        self.work.arguments.size
    }

    /// Runs a step that is no part of the entry's own.
    pub(crate) fn run(&self, step: &str) -> anyhow::Result<()> {
        let words = self.work.words(step, self.used, (self.folder, 0))?;
        self.work.run(&words).map(drop)
    }

    /// The radiance of a picture that a step wrote.
    pub(crate) fn radiance(&self, name: &str) -> anyhow::Result<Image> {
        let path = self.folder.join(name);
        Ok(surfelshop_image::exr::read_color(&path, surfelshop_image::exr::MOST_PIXELS)?)
    }
}

/// What was evaluated.
#[derive(Default)]
pub(crate) struct Computed {
    /// Pictures with their names, developed.
    pictures: Vec<(String, Vec<u8>)>,
    numbers: Vec<Number>,
    tables: Vec<Grid>,
    drawings: Vec<Drawing>,
}

impl Computed {
    /// A printed and a corrected picture, measured against the truth; linear radiance with coverage.
    pub(crate) fn pair(printed: &Image, corrected: &Image, truth: &Image) -> anyhow::Result<Self> {
        let mut all = Self::default();
        for (name, picture) in [("printed", printed), ("corrected", corrected), ("truth", truth)] {
            all.picture(name, picture)?;
        }
        let settings = metrics::Settings::default();
        for (name, picture) in [("printed", printed), ("corrected", corrected)] {
            let (found, maps) = metrics::compare_with_maps(picture, truth, &settings)?;
            if let Some(errors) = &found.errors {
                all.number(&format!("RMSE as {name}"), errors.rmse, "");
                all.number(&format!("FLIP as {name}"), errors.flip.mean, "");
            } else {
                all.number(
                    &format!("pixels that are no numbers, as {name}"),
                    found.n_not_finite as f64,
                    "",
                );
            }
            if let Some(flip) = &maps.flip {
                let map = metrics::in_color(flip, 1.0);
                let name = format!("difference from the truth (FLIP), as {name}");
                all.pictures.push((name, png::encode(&map, png::Bits::Eight)?));
            }
        }
        Ok(all)
    }

    /// Adds a picture of radiance.
    pub(crate) fn picture(&mut self, name: &str, picture: &Image) -> anyhow::Result<()> {
        let shown = develop(&finite(picture), &DisplayTransform::default());
        self.pictures.push((name.to_owned(), png::encode(&shown, png::Bits::Eight)?));
        Ok(())
    }

    /// Adds a number that another run finds again.
    pub(crate) fn number(&mut self, what: &str, value: f64, unit: &str) {
        self.numbers.push(Number {
            what: what.to_owned(),
            value,
            unit: unit.to_owned(),
            printed: String::new(),
            command: None,
            pointer: String::new(),
            is_repeatable: true,
        });
    }

    /// Adds a drawing.
    pub(crate) fn drawing(&mut self, caption: &str, svg: String) {
        self.drawings.push(Drawing { caption: caption.to_owned(), svg });
    }

    /// Writes the pictures and gives all to an outcome.
    pub(crate) fn store(self, folder: &Path, outcome: &mut Outcome) -> anyhow::Result<()> {
        for (i, (name, png)) in self.pictures.into_iter().enumerate() {
            let file = format!("computed-{i}.png");
            write_whole(&folder.join(&file), &png)?;
            outcome.pictures.push(PictureFile { name, file });
        }
        outcome.numbers.extend(self.numbers);
        outcome.tables.extend(self.tables);
        outcome.drawings.extend(self.drawings);
        Ok(())
    }
}

/// A picture with zero for what is no number, which a screen cannot show.
fn finite(picture: &Image) -> Image {
    let value = |value: &f32| if value.is_finite() { *value } else { 0.0 };
    Image { data: picture.data.iter().map(value).collect(), ..picture.clone() }
}

/// A picture of what a function has at each pixel: linear radiance and coverage.
pub(crate) fn drawn(size: u32, pixel: impl Fn(u32, u32) -> Option<[f64; 3]> + Sync) -> Image {
    use rayon::prelude::*;
    let row = |y: u32| -> Vec<f32> {
        let pixel = |x| match pixel(x, y) {
            Some([r, g, b]) => [r as f32, g as f32, b as f32, 1.0],
            None => [0.0; 4],
        };
        (0..size).flat_map(pixel).collect()
    };
    let rows: Vec<Vec<f32>> = (0..size).into_par_iter().map(row).collect();
    Image { width: size, height: size, components: 4, data: rows.concat() }
}

/// The files that something evaluated needs.
pub(crate) fn needs(name: &str) -> &'static [&'static str] {
    match name.split_once('-') {
        Some(("harmonics", "T17")) => &["chameleon", "rnl"],
        Some(("harmonics" | "specular", _)) | Some(("mapping", "T14")) => &["igea", "rnl"],
        Some(("mapping" | "vertices", _)) => &["rnl"],
        Some(("occlusion", _)) => &["knot", "knot-rays"],
        Some(("marble", _)) => &["mannequin"],
        Some(("bounces", _)) => &["cornell"],
        Some(("probe", "rnl")) => &["rnl"],
        Some(("probe", _)) => &["uffizi"],
        Some(("splat", "B10")) => &["torso"],
        Some(("noise", "texture")) => &["plate"],
        _ if matches!(name, "registers" | "irradiance") => &["rnl"],
        _ => &[],
    }
}

/// Evaluates something by its name in the entries.
pub(crate) fn evaluate(name: &str, bench: &mut Bench<'_, '_>) -> anyhow::Result<Computed> {
    let (kind, which) = name.split_once('-').unwrap_or((name, ""));
    match kind {
        "harmonics" => harmonics::erratum(which, bench),
        "specular" => specular::erratum(which, bench),
        "mapping" => mapping::erratum(which, bench),
        "vertices" => vertices::erratum(which, bench),
        "occlusion" => occlusion::erratum(which, bench),
        "marble" => marble::erratum(which, bench),
        "bounces" => bounces::erratum(which, bench),
        "vpls" => lights::erratum(which, bench.size()),
        "maps" => shadow_map::erratum(bench.size()),
        "splat" if which == "B10" => splats::small(bench),
        "splat" => splats::erratum(which, bench.size()),
        "probe" => sky::picture(bench.path(which)?),
        "registers" => harmonics::registers(bench),
        "irradiance" => harmonics::irradiance(bench),
        "angles" => harmonics::angles(),
        "noise" if which == "texture" => noise::texture(bench),
        "noise" => noise::octaves(which),
        "form" | "reflection" | "lobe" | "cosines" => optics::curves(name),
        "normal" | "projective" | "planes" => fields::curves(name),
        _ => bail!("nothing is evaluated under the name `{name}`"),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_name_of_the_entries_is_known() {
        for paper in crate::entries::papers().unwrap() {
            for entry in paper.entry.iter().filter(|entry| !entry.computed.is_empty()) {
                let kind = entry.computed.split('-').next().unwrap_or_default();
                let known = [
                    "harmonics",
                    "specular",
                    "mapping",
                    "vertices",
                    "occlusion",
                    "marble",
                    "bounces",
                    "vpls",
                    "maps",
                    "splat",
                    "probe",
                    "registers",
                    "irradiance",
                    "angles",
                    "noise",
                    "form",
                    "reflection",
                    "lobe",
                    "cosines",
                    "normal",
                    "projective",
                    "planes",
                ];
                assert!(known.contains(&kind), "{}: {}", entry.id, entry.computed);
            }
        }
    }
}
