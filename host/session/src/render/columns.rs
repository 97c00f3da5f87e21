//! Columns that a renderer reads by a name that nothing has, and another name is near to.

use crate::output::terminal;
use crate::session::LoadedRenderer;
use surfelshop_api::CloudFacts;
use surfelshop_api::columns::{NORMAL, OPACITY, POSITION, RADIUS, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_cloud::scene::distance;
use surfelshop_runtime::boundary::decode;

/// Says in lines which columns of the last frame may be misspelt: what no cloud has is drawn as if it were 0, or what
/// the renderer says instead.
pub(super) fn note(chosen: &LoadedRenderer, facts: &CloudFacts) {
    let Ok(graph) = decode(chosen.view.graph()) else { return };
    let columns = graph.buffers.iter().filter_map(|buffer| buffer.columns.as_ref());
    for column in columns.flat_map(|of| &of.columns) {
        if let Some(meant) = meant(&column.name, facts) {
            let name = &column.name;
            terminal::note(format!(
                "{}: it reads the column `{name}`, which no cloud has; did you mean `{meant}`?",
                chosen.ids()
            ));
        }
    }
}

/// The name that one which nothing has may be meant for.
fn meant<'a>(name: &str, facts: &'a CloudFacts) -> Option<&'a str> {
    let usual = [POSITION, NORMAL, RADIUS, OPACITY, SPLAT_SCALE, SPLAT_ROTATION];
    let known = || facts.columns.iter().map(String::as_str).chain(usual).chain(SH);
    if known().any(|known| known == name) {
        return None;
    }
    // A third of the letters may differ, but not numbers alone: those tell columns apart that go together.
    let letters = |name: &str| name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let near = known().filter(|known| known[..letters(known)] != name[..letters(name)]);
    let found = near.min_by_key(|known| distance(known, name))?;
    (distance(found, name) <= found.len() / 3).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_near_to_others_are_misspelt() {
        let facts = CloudFacts {
            columns: ["position", "intensity", "band_1"].map(str::to_owned).to_vec(),
            ..CloudFacts::default()
        };
        assert_eq!(meant("positon", &facts), Some("position"));
        assert_eq!(meant("intensty", &facts), Some("intensity"));
        // It is known, though no cloud has it; and one of a series.
        assert_eq!((meant("sh_3", &facts), meant("band_2", &facts)), (None, None));
        assert_eq!(meant("temperature", &facts), None);
    }
}
