//! The file's header, the root directory and the list of sets.

use super::report::Report;
use crate::gff::{Block, HEADER_BYTES, Link, header, tags};
use surfelshop_api::format::{CloudHeader, UpAxis};
use surfelshop_api::glam::DVec3;

/// Most bytes of a text.
const MAX_TEXT_BYTES: usize = 60_000;

/// A text that fits, cut between two letters.
pub(super) fn cut(text: &str) -> &str {
    &text[..text.floor_char_boundary(MAX_TEXT_BYTES)]
}

/// What is known of the scene before its sets.
#[derive(Debug)]
pub(super) struct SceneBlock {
    /// The axis that the file says points up.
    pub(super) up: UpAxis,
    texts: [(u16, String); 5],
    version: Option<u32>,
    metres_per_unit: f64,
}

/// What is known when all sets are written.
#[derive(Debug, Default)]
pub(super) struct SceneEnd {
    pub(super) n_sets: u32,
    pub(super) bounds: Option<[DVec3; 2]>,
    /// Where the directory lies that closes the root's children.
    pub(super) list_end: u32,
    /// Where the directory lies that closes the root's siblings.
    pub(super) root_end: u32,
}

/// A box as a file has it; zeros where there is none.
pub(super) fn bounds_floats(bounds: Option<[DVec3; 2]>) -> [f32; 6] {
    let [low, high] = bounds.unwrap_or_default().map(|corner| corner.as_vec3().to_array());
    [low[0], low[1], low[2], high[0], high[1], high[2]]
}

/// The directions to the right, upwards and back, where an axis points up.
pub(crate) fn axes_of(up: UpAxis) -> [[f32; 3]; 3] {
    match up {
        UpAxis::Unknown | UpAxis::Y => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        UpAxis::X => [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        UpAxis::Z => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    }
}

impl SceneBlock {
    /// What the header of the first cloud says of the scene. Its comments are those that the reader makes of a file's texts.
    pub(super) fn of(first: &CloudHeader, report: &mut Report) -> Self {
        let comment = |name: &str| {
            let texts = first.comments.iter();
            texts.filter_map(|text| text.strip_prefix(name)?.strip_prefix(": ")).next()
        };
        let text = |name: &str| comment(name).unwrap_or_default().to_owned();
        let or = |text: String, other: &str| if text.is_empty() { other.to_owned() } else { text };
        let known = ["title", "author", "application", "description", "version", "date"];
        let is_known = |text: &String| {
            text.split_once(": ").is_some_and(|(name, _text)| known.contains(&name))
        };
        if first.comments.iter().any(|text| !is_known(text)) {
            report
                .says("comments are left out but for title, author, description, version and date");
        }
        Self {
            up: if first.up == UpAxis::Unknown { UpAxis::Y } else { first.up },
            texts: [
                (tags::TITLE, or(text("title"), &first.name)),
                (tags::AUTHOR, text("author")),
                (tags::APPLICATION, "Surfelshop".to_owned()),
                (tags::DESCRIPTION, text("description")),
                (tags::DATE, or(text("date"), &first.time)),
            ],
            version: comment("version").and_then(|version| version.parse().ok()),
            metres_per_unit: first.metres_per_unit,
        }
    }

    /// The bytes from the beginning of the file to the first set; as many whatever the end is.
    pub(super) fn bytes(&self, end: &SceneEnd) -> Vec<u8> {
        let mut root = Block::default();
        for (tag, text) in &self.texts {
            root = root.text(*tag, cut(text));
        }
        if let Some(version) = self.version {
            root = root.words(tags::VERSION, &[version]);
        }
        let [right, up, back] = axes_of(self.up);
        root = root.floats(tags::RIGHT, &right).floats(tags::UP, &up).floats(tags::BACK, &back);
        if self.metres_per_unit > 0.0 && self.metres_per_unit.is_finite() {
            root = root.floats(tags::DEFAULT_UNITS, &[self.metres_per_unit as f32]);
        }
        let root =
            root.floats(tags::BOUNDS, &bounds_floats(end.bounds)).words(tags::SET_LIST_INDEX, &[0]);
        let list = Block::default().words(tags::N_SETS, &[end.n_sets]);
        let mut bytes = header();
        bytes.extend(root.bytes(HEADER_BYTES, Link::Parent { next: end.root_end, n_children: 1 }));
        let link = Link::Parent { next: end.list_end, n_children: end.n_sets };
        // Texts are cut: the directories take less than half a megabyte.
        let list = list.bytes(bytes.len() as u32, link);
        bytes.extend(list);
        bytes
    }
}
