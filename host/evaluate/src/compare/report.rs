//! A comparison as it goes: pictures are written frame by frame, numbers are noted.

use super::candidate::{Candidate, Drawn, Stage};
use super::compared::{Compared, ComparedCandidate, FrameNumbers, Numbers, Target, put};
use super::measured::{CandidateImage, Measured, Truth};
use crate::comparison_page::Picture;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_image::metrics::in_color;
use surfelshop_image::{Image, exr, outputs, png};
use surfelshop_session::input::displayed::DisplayedClouds;
use surfelshop_session::output::{files, json};
use surfelshop_session::render::camera_path::Frame;
use surfelshop_session::session::RenderSession;

/// Full brightness of the map of relative squared errors: an error as large as the radiance itself.
const FULL_RELATIVE: f32 = 1.0;

/// Maps of errors, as pages name them.
const MAPS: [&str; 2] = ["relative squared error", "FLIP"];

/// Most bytes of a picture that is read again.
const MOST_BYTES: u64 = 1 << 30;

/// A comparison frame by frame; pictures are written as they come.
pub(super) struct ComparisonOutput {
    /// The folder of all that is written.
    folder: PathBuf,
    pub(super) compared: Compared,
    /// Pictures of the first frame, and of the one with the largest error if that is another.
    first: Vec<Picture>,
    worst: Option<(f64, Vec<Picture>)>,
}

impl ComparisonOutput {
    pub(super) fn new(folder: PathBuf) -> Self {
        let compared = Compared {
            what: String::new(),
            device: String::new(),
            notes: Vec::new(),
            head: Map::new(),
            truth: String::new(),
            has_noise: false,
            truth_at: None,
            candidates: Vec::new(),
            frames: Vec::new(),
        };
        Self { folder, compared, first: Vec::new(), worst: None }
    }

    /// Writes a frame's pictures and keeps its numbers.
    pub(super) fn frame(
        &mut self,
        stage: &Stage<'_>,
        frame: &Frame,
        candidates: &[Candidate],
        truth: &Truth,
        shots: Vec<CandidateImage>,
        measured: Vec<Measured>,
    ) -> anyhow::Result<()> {
        let pictures = self.pictures(stage, frame, candidates, truth, &shots, &measured)?;
        self.compared.truth.clone_from(&truth.name);
        self.compared.has_noise = truth.variance.is_some();
        self.compared.truth_at = truth.candidate;
        let numbers = |(shot, measured): (CandidateImage, Measured)| {
            let drawn = shot.drawn.as_ref().ok();
            Numbers {
                comparison: measured.comparison,
                first_ms: drawn.map(|drawn| drawn.first_ms),
                n_passes: drawn.and_then(|drawn| drawn.n_passes),
                graph_bytes: drawn.and_then(|drawn| drawn.graph_bytes),
                runs: shot.runs,
            }
        };
        let candidates = shots.into_iter().zip(measured).map(numbers).collect();
        let numbers = FrameNumbers { frame: frame.clone(), candidates, machine: None };
        let error = self.compared.worst_rmse(&numbers);
        if self.compared.frames.is_empty() {
            self.first = pictures;
            self.worst = Some((error, Vec::new()));
        } else if self.worst.as_ref().is_none_or(|(worst, _)| error > *worst) {
            self.worst = Some((error, pictures));
        }
        self.compared.frames.push(numbers);
        Ok(())
    }

    /// Writes the pictures of a frame, and returns those of the page.
    fn pictures(
        &self,
        stage: &Stage<'_>,
        frame: &Frame,
        candidates: &[Candidate],
        truth: &Truth,
        shots: &[CandidateImage],
        measured: &[Measured],
    ) -> anyhow::Result<Vec<Picture>> {
        let folder = frame_folder(&self.folder, frame);
        let maps_folder = folder.join("maps");
        std::fs::create_dir_all(&maps_folder)?;
        let named = |name: &str| named(frame, name);
        let size = |image: &Image| [image.width, image.height];
        let shown = |image: &Image| {
            let visible = outputs::visible(&Output::Color, image, &stage.staging.how);
            png::encode(&visible, png::Bits::default())
        };
        let (mut all, mut maps) = (Vec::new(), Vec::new());
        if truth.candidate.is_none() {
            let png = shown(&truth.picture)?;
            all.push(Picture::new(named(&truth.name), size(&truth.picture), png));
        }
        let each = candidates.iter().zip(shots).zip(measured).enumerate();
        for (i, ((candidate, shot), measured)) in each {
            let (Candidate { name, .. }, Ok(Drawn { color, .. })) = (candidate, &shot.drawn) else {
                continue;
            };
            let png = shown(color)?;
            put(&folder, &format!("{name}.png"), &png)?;
            let layer = (Output::Color, color.clone());
            put(&folder, &format!("{name}.exr"), &exr::encode(&[&layer])?)?;
            all.push(Picture::new(named(name), size(color), png));
            // There is nothing to see of the reference against itself.
            let is_truth = truth.candidate == Some(i);
            let Some(found) = measured.maps.as_ref().filter(|_| !is_truth) else { continue };
            let relative = in_color(&found.relative_squared, FULL_RELATIVE);
            let flip = found.flip.as_ref().map(|flip| (in_color(flip, 1.0), MAPS[1]));
            let both = [Some((relative, MAPS[0])), flip];
            for (map, what) in both.into_iter().flatten() {
                let png = png::encode(&map, png::Bits::default())?;
                // In a folder of their own, where none has the name of another's picture.
                put(&maps_folder, &map_file(name, what), &png)?;
                maps.push(Picture::new(named(&format!("{name}, {what}")), size(&map), png));
            }
        }
        all.extend(maps);
        Ok(all)
    }

    /// Notes what was compared, once all frames are done.
    pub(super) fn about(
        &mut self,
        stage: &Stage<'_>,
        (files, displayed): (&[PathBuf], &DisplayedClouds),
        studio: Option<&RenderSession>,
        candidates: &[Candidate],
    ) {
        let [width, height] = stage.view.size_px;
        let clouds = files.iter().map(|file| file.display().to_string());
        let clouds = clouds.collect::<Vec<_>>().join(", ");
        let compared = &mut self.compared;
        compared.what = format!("{clouds}, {width} x {height} pixels, against {}", compared.truth);
        let device = studio.map(|studio| studio.engine.gpu().describe());
        compared.device = device.unwrap_or_else(|| "no graphics device".to_owned());
        compared.notes = displayed.line().into_iter().collect();
        if stage.staging.antialias > 1 {
            compared.notes.push(format!(
                "Each renderer's picture is the mean of {} samples, frames seen at the same places of every pixel \
                 for all, and times are those of all of them; tracers have samples of their own.",
                stage.staging.antialias
            ));
        }
        let candidate = |candidate: &Candidate| ComparedCandidate {
            name: candidate.name.clone(),
            renderer: match &candidate.ready {
                Ok(ready) => json::unit(&candidate.reference, &ready.unit, &candidate.values),
                Err(_) => json!({ "id": candidate.reference.id }),
            },
        };
        compared.candidates = candidates.iter().map(candidate).collect();
        let head = [
            ("size", json!(stage.view.size_px)),
            ("antialias", json!(stage.staging.antialias)),
            ("scene", json!(stage.staging.scene)),
            ("facts", json!(stage.clouds.facts)),
            ("display", displayed.object()),
            ("adapter", json!(studio.map(json::adapter))),
        ];
        compared.head =
            head.map(|(key, value): (&str, Value)| (key.to_owned(), value)).into_iter().collect();
    }

    /// Writes the page and the tables, and prints.
    pub(super) fn write(&mut self, json: bool) -> anyhow::Result<()> {
        let mut pictures = std::mem::take(&mut self.first);
        pictures.extend(self.worst.take().into_iter().flat_map(|(_, pictures)| pictures));
        self.compared.write(&Target { folder: &self.folder, json }, pictures)
    }
}

/// What a picture is called on a page.
fn named(frame: &Frame, name: &str) -> String {
    match frame.name.is_empty() {
        true => name.to_owned(),
        false => format!("{}: {name}", frame.name),
    }
}

/// The folder of a frame's pictures.
pub(crate) fn frame_folder(folder: &Path, frame: &Frame) -> PathBuf {
    match frame.number() {
        "" => folder.to_owned(),
        number => folder.join(format!("frame-{number}")),
    }
}

/// The file of a map of a candidate's errors, in the folder `maps` of its frame.
fn map_file(candidate: &str, map: &str) -> String {
    format!("{candidate}-{}.png", map.replace(' ', "-"))
}

/// The pictures of a frame on a page, read again from the folder where a part wrote them.
///
/// # Errors
/// One line where one of them cannot be read.
pub(crate) fn pictures_again(
    folder: &Path,
    compared: &Compared,
    told: &FrameNumbers,
) -> anyhow::Result<Vec<Picture>> {
    let own = frame_folder(folder, &told.frame);
    let (mut all, mut maps) = (Vec::new(), Vec::new());
    for (i, (candidate, numbers)) in compared.candidates.iter().zip(&told.candidates).enumerate() {
        let Ok(comparison) = &numbers.comparison else { continue };
        let name = &candidate.name;
        let png = files::read_short(&own.join(format!("{name}.png")), MOST_BYTES)?;
        all.push(Picture::new(named(&told.frame, name), comparison.size, png));
        for map in MAPS.iter().filter(|_| !compared.is_truth(i)) {
            let path = own.join("maps").join(map_file(name, map));
            if path.exists() {
                let png = files::read_short(&path, MOST_BYTES)?;
                let title = named(&told.frame, &format!("{name}, {map}"));
                maps.push(Picture::new(title, comparison.size, png));
            }
        }
    }
    all.extend(maps);
    Ok(all)
}
