//! What is done with selected surfels: each is a step of undo.

use super::layers::{cropping, deleting};
use crate::document::OpenClouds;
use crate::window::Window;
use std::path::{Path, PathBuf};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::files::write_whole;
use surfelshop_cloud::in_groups;
use surfelshop_cloud::selection::{
    EditLayer, LayerChange, RegionSelection, Selection, SelectionError, deleted, extracted,
    with_value,
};
use surfelshop_session::input::strokes;

/// Most files of one name.
const MOST_FILES: usize = 1000;

impl Window {
    /// Changes each visible cloud of which something is selected, and says what was done to how many surfels.
    fn edit_selected(
        &mut self,
        done: &str,
        change: impl Fn(&Cloud, &Selection, usize, &OpenClouds) -> Result<OpenClouds, SelectionError>,
        of_pyramids: impl Fn(&EditLayer, RegionSelection) -> Result<EditLayer, String>,
    ) {
        let (n, _) = self.n_selected();
        if n == 0 {
            self.messages.report("nothing is selected");
            return;
        }
        // Earlier changes are a step of their own.
        self.document.history.record(&self.snapshot());
        let about = match self.edit_layers(&of_pyramids) {
            Ok(false) => "",
            Ok(true) => "about ",
            Err(line) => return self.messages.warn(line),
        };
        for (index, _, cloud) in self.hand_clouds() {
            let Some(selection) = self.views.hands.selection_of(&cloud) else { continue };
            let Some(shown) = &self.document.clouds else { return };
            match change(&cloud, &selection, index, &shown.open_clouds) {
                Ok(changed) => self.show_clouds(changed),
                Err(error) => return self.messages.warn(error.to_string()),
            }
        }
        let plural = if n == 1 { "" } else { "s" };
        self.messages.report(format!("{done} {about}{} surfel{plural}", in_groups(n as u64)));
    }

    /// Deletes what is selected.
    pub(crate) fn delete_surfels(&mut self) {
        let change = |cloud: &Cloud, selection: &Selection, index, open: &OpenClouds| {
            Ok(open.edited(index, deleted(cloud, selection)?))
        };
        self.edit_selected("deleted", change, deleting);
    }

    /// Deletes what is not selected.
    pub(crate) fn crop_to_surfels(&mut self) {
        let change = |cloud: &Cloud, selection: &Selection, index, open: &OpenClouds| {
            Ok(open.edited(index, extracted(cloud, selection)?))
        };
        self.edit_selected("kept", change, cropping);
    }

    /// Makes what is selected a cloud of its own, beside the rest.
    pub(crate) fn split_surfels(&mut self) {
        let change = |cloud: &Cloud, selection: &Selection, index, open: &OpenClouds| {
            let (part, rest) = (extracted(cloud, selection)?, deleted(cloud, selection)?);
            Ok(open.derived(index, part, "part").showing(index, true).edited(index, rest))
        };
        self.edit_selected("split off", change, |_, _| {
            Err("a pyramid is not split here; `surfelshop select -o PART.surfels` writes a part of it".to_owned())
        });
    }

    /// Writes a number into a column of what is selected.
    pub(crate) fn set_value_of_surfels(&mut self) {
        let (name, value) = self.views.hands.value.clone();
        let name = name.trim();
        let change = |cloud: &Cloud, selection: &Selection, index, open: &OpenClouds| {
            Ok(open.edited(index, with_value(cloud, selection, name, &[value])?))
        };
        self.edit_selected(&format!("set {name} of"), change, |layer, chosen| {
            let change = LayerChange::Set { column: name.to_owned(), values: vec![value] };
            Ok(layer.with(chosen, change))
        });
    }

    /// Writes the strokes of the visible clouds into a file beside the first of them.
    pub(crate) fn save_strokes(&mut self) {
        let clouds = self.hand_clouds();
        let all = clouds.iter().flat_map(|(.., cloud)| strokes::of_cloud(cloud));
        let all: Vec<_> = all.collect();
        let shown = self.document.clouds.as_ref();
        let first = clouds.first().and_then(|(i, ..)| shown?.open_clouds.all().get(*i));
        let Some(first) = first.filter(|_| !all.is_empty()) else {
            self.messages.report("no tool was led over a cloud by hand");
            return;
        };
        let n = all.len();
        let written = strokes::text(all).and_then(|text| {
            let path = unused(Path::new(&first.loaded.summary.file), "strokes.json");
            write_whole(&path, text.as_bytes())?;
            Ok(path)
        });
        let plural = if n == 1 { "" } else { "s" };
        match written {
            Ok(path) => self.messages.report(format!("{}: {n} stroke{plural}", path.display())),
            Err(error) => self.messages.warn(format!("the strokes were not written: {error:#}")),
        }
    }
}

/// A file beside a cloud, with this ending, that is not there yet.
pub(crate) fn unused(cloud: &Path, ending: &str) -> PathBuf {
    let name = |i: usize| match i {
        0 => cloud.with_extension(ending),
        i => cloud.with_extension(format!("{}.{ending}", i + 1)),
    };
    let free = (0..MOST_FILES).map(name).find(|path| !path.exists());
    free.unwrap_or_else(|| name(MOST_FILES))
}

/// What is selected, for the status line.
pub(crate) fn status(window: &Window) -> Option<String> {
    let (n, of) = window.n_selected();
    let about = window.about_selected();
    (n > 0).then(|| format!("{about}{} of {} selected", in_groups(n as u64), in_groups(of as u64)))
}
