//! What commands do with measures.

use crate::panels::Selection;
use crate::views::hands::{HandMode, unused};
use crate::window::Window;
use eframe::egui::Context;
use std::path::Path;
use surfelshop_cloud::files::write_whole;
use surfelshop_cloud::scene::{Figure, Measure, MeasureKind, MeasuredRow, Quantity, Units};
use surfelshop_session::output::measures::DrawnMeasure;

impl Window {
    /// Metres of a scene unit: as the files say, else as the user does; `None` where nobody does.
    pub(crate) fn metres_per_unit(&self) -> Option<f64> {
        let shown = self.document.clouds.as_ref();
        let metres = shown.and_then(|shown| shown.open_clouds.clouds.metres_per_unit());
        metres.or(self.preferences.unit.metres())
    }

    /// How numbers are told.
    pub(crate) fn units(&self) -> Units {
        Units { metres: self.metres_per_unit() }
    }

    /// Measures of surfels what is new.
    pub(crate) fn update_measures(&mut self, ctx: &Context) {
        let up = self.document.up.into();
        let Some(shown) = self.document.clouds.as_ref().filter(|_| self.document.preview.is_none())
        else {
            return;
        };
        let clouds = (&shown.clouds, shown.revision);
        self.views.measuring.surveys.advance(&self.settings.measures, up, clouds, ctx);
    }

    /// The numbers of a measure, the one that its label shows first.
    pub(crate) fn quantities_of(&self, measure: &Measure) -> Vec<Quantity> {
        let mut all = measure.quantities(self.document.up.axis().direction());
        let surveyed = self.views.measuring.surveys.of(measure);
        all.extend(surveyed.iter().flat_map(|surveyed| surveyed.quantities.iter().copied()));
        all
    }

    /// The label of a measure.
    pub(crate) fn measure_label(&self, measure: &Measure) -> String {
        let surveyed = self.views.measuring.surveys.of(measure);
        let of_surfels = surveyed.map(|surveyed| &surveyed.quantities[..]).unwrap_or_default();
        self.units().label(measure, self.document.up.axis().direction(), of_surfels)
    }

    /// What is drawn of measures into pictures: those that are not hidden.
    pub(crate) fn drawn_measures(&self) -> Vec<DrawnMeasure> {
        let up = self.document.up.axis().direction();
        let shown = self.settings.measures.iter().filter(|measure| !measure.hidden);
        let drawn = shown.map(|measure| DrawnMeasure {
            figure: Figure::of(measure, up),
            label: self.measure_label(measure),
        });
        drawn.collect()
    }

    /// Measures something by clicks, or lets them be again.
    pub(crate) fn toggle_measuring(&mut self, kind: MeasureKind) {
        self.views.measuring.places.clear();
        self.toggle_hand(HandMode::Measure(kind));
    }

    /// Shows measures again, or hides all.
    pub(crate) fn toggle_measures(&mut self) {
        let hides = self.settings.measures.iter().any(|measure| !measure.hidden);
        self.settings.measures.iter_mut().for_each(|measure| measure.hidden = hides);
    }

    /// Shows or hides a measure.
    pub(crate) fn toggle_measure(&mut self, index: usize) {
        if let Some(measure) = self.settings.measures.get_mut(index) {
            measure.hidden = !measure.hidden;
        }
    }

    /// Copies the first number of the selected measure, with all digits; the text of a note.
    pub(crate) fn copy_measure(&mut self, ctx: &Context) {
        let Selection::Measure(i) = self.selection() else { return };
        let Some(measure) = self.settings.measures.get(i) else { return };
        let units = self.units();
        let text = match self.quantities_of(measure).first() {
            Some(first) => {
                format!("{:?} {}", units.number(first), units.unit(first.kind)).trim().to_owned()
            }
            None => self.measure_label(measure),
        };
        self.messages.report(format!("copied {text}"));
        ctx.copy_text(text);
    }

    /// All measures with their numbers.
    fn measured_rows(&self) -> Vec<MeasuredRow> {
        let all = self.settings.measures.iter().enumerate();
        let row = |(i, measure): (usize, &Measure)| MeasuredRow {
            title: measure.title(i),
            measure: measure.clone(),
            quantities: self.quantities_of(measure),
        };
        all.map(row).collect()
    }

    /// Writes all numbers into a file beside the scene, or beside the first cloud.
    pub(crate) fn save_measures(&mut self) {
        let csv = MeasuredRow::csv(&self.measured_rows(), self.units());
        self.save_beside("measures.csv", &csv);
    }

    /// Writes the surfels of the selected profile into a file.
    pub(crate) fn save_profile(&mut self) {
        let Selection::Measure(i) = self.selection() else { return };
        let Some(measure) = self.settings.measures.get(i) else { return };
        let surveyed = self.views.measuring.surveys.of(measure);
        match surveyed.and_then(|surveyed| surveyed.profile.clone()) {
            Some(profile) => self.save_beside("profile.csv", &profile.csv()),
            None => self.messages.report("the profile is not measured yet"),
        }
    }

    fn save_beside(&mut self, ending: &str, text: &str) {
        let shown = self.document.clouds.as_ref();
        let first = shown.and_then(|shown| shown.open_clouds.all().first());
        let first = first.map(|open| Path::new(&open.loaded.summary.file).to_owned());
        // `room.scene.toml` is called like the cloud `room`.
        let scene = self.document.scene_path.as_ref().map(|path| path.with_extension(""));
        let Some(beside) = scene.or(first) else { return };
        let path = unused(&beside, ending);
        match write_whole(&path, text.as_bytes()) {
            Ok(()) => self.messages.report(format!("{} is written", path.display())),
            Err(error) => self.messages.warn(format!("{}: not written: {error}", path.display())),
        }
    }
}
