//! Writing: every cloud becomes a surfel set with one resolution.
//!
//! Directories lie before what they count: they are written with zeros first, and again when their surfels are all there.

mod fields;
mod origin;
mod records;
mod report;
mod scene;
mod set;

use crate::gff::{ENTRY_BYTES, MAX_CHILDREN, closing};
use crate::settings::Settings;
use report::Report;
pub(crate) use scene::axes_of;
use scene::{SceneBlock, SceneEnd};
use set::SetWriter;
use surfelshop_api::format::{CloudSource, FileSink};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Job, Result};

/// Most surfel sets: the original library reads a list of 1024 children, of which one closes it.
const MAX_SETS: u32 = MAX_CHILDREN - 1;

/// Writes all clouds to a file. Returns lines of what it cannot hold.
///
/// # Errors
/// Where there is no cloud, the file would be too large, the system refuses, or the user asked to stop.
pub(crate) fn write(
    clouds: &mut CloudSource<'_>,
    settings: &Settings,
    file: &FileSink,
    job: &Job<'_>,
) -> Result<Vec<String>> {
    let mut next = clouds.next_cloud()?;
    let first = next.as_ref().ok_or_else(|| Error::new("expected a cloud to write, found none"))?;
    let mut report = Report::default();
    let scene = SceneBlock::of(first, &mut report);
    let bytes = scene.bytes(&SceneEnd::default());
    file.write_at(0, &bytes)?;
    let mut place = Place::default().after(bytes.len())?;
    let mut n_sets = 0;
    let mut bounds: Option<[DVec3; 2]> = None;
    while let Some(header) = next {
        if n_sets == MAX_SETS {
            return Err(Error::new(format!(
                "expected at most {MAX_SETS} clouds in an SFL file, found more: write them to several files"
            )));
        }
        report.header(&header, scene.up);
        let set = SetWriter::new(&header, n_sets, settings, place, &mut report);
        let written = set.write(clouds, file, job, &mut report)?;
        place = written.end;
        if let Some([low, high]) = written.bounds {
            let [lowest, highest] = bounds.unwrap_or([low, high]);
            bounds = Some([lowest.min(low), highest.max(high)]);
        }
        n_sets += 1;
        next = clouds.next_cloud()?;
    }
    // One directory closes the list of sets, one the root's children, one the root's siblings.
    let list_end = place.after(ENTRY_BYTES as usize)?;
    let root_end = list_end.after(ENTRY_BYTES as usize)?;
    let ends = [closing(list_end.0), closing(root_end.0), closing(0)];
    root_end.after(ENTRY_BYTES as usize)?;
    file.write_at(place.0.into(), ends.as_flattened())?;
    let end = SceneEnd { n_sets, bounds, list_end: list_end.0, root_end: root_end.0 };
    file.write_at(0, &scene.bytes(&end))?;
    Ok(report.lines())
}

/// An offset in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Place(u32);

impl Place {
    /// The offset behind so many bytes.
    ///
    /// # Errors
    /// Where it does not fit into 32 bits.
    fn after(self, bytes: usize) -> Result<Self> {
        let place = u32::try_from(bytes).ok().and_then(|bytes| self.0.checked_add(bytes));
        place.map(Self).ok_or_else(|| {
            Error::new(
                "expected at most 4 GiB of surfels in an SFL file, found more: write fewer, or several files",
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Place;

    #[test]
    fn files_end_before_four_gigabytes() {
        let place = Place(u32::MAX - 5);
        assert_eq!(place.after(5).unwrap(), Place(u32::MAX));
        let line = place.after(6).unwrap_err().to_string();
        assert!(line.contains("4 GiB"), "{line}");
    }
}
