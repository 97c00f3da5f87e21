//! What units are called.

use crate::format::file_types::FileTypes;
use crate::need::NeedInfo;
use serde::{Deserialize, Serialize};

/// What a unit is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnitKind {
    /// Describes frames as graphs.
    Renderer,
    /// Writes pixels on the CPU.
    Tracer,
    /// Edits columns of a cloud.
    Tool,
    /// Reads clouds out of files, and may write them. ABI 3.8.
    Format,
}

impl UnitKind {
    /// The word used in manifests and lists.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Renderer => "renderer",
            Self::Tracer => "tracer",
            Self::Tool => "tool",
            Self::Format => "format",
        }
    }
}

/// How a unit is called: short id for the command line, title for lists, one sentence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnitInfo {
    /// Short id: lower-case letters, digits and hyphens.
    pub id: &'static str,
    /// Title in lists and panels.
    pub title: &'static str,
    /// One sentence that says what the unit does.
    pub summary: &'static str,
    /// Files that a format recognises, for the manifest.
    pub(crate) files: FileTypes,
    /// Columns that a renderer reads, for the manifest.
    pub(crate) needs: &'static [NeedInfo],
    /// How a tool is handled, for the manifest; empty where it is not.
    pub(crate) handling: &'static str,
}

impl UnitInfo {
    /// Names a unit.
    ///
    /// # Panics
    /// At compile time where the id is empty or has other characters than `a-z`, `0-9` and `-`,
    /// or where a text has control characters.
    #[must_use]
    pub const fn new(id: &'static str, title: &'static str, summary: &'static str) -> Self {
        assert!(!id.is_empty(), "a unit's id must not be empty");
        let bytes = id.as_bytes();
        let mut i = 0;
        while i < bytes.len() {
            assert!(
                matches!(bytes[i], b'a'..=b'z' | b'0'..=b'9' | b'-'),
                "a unit's id has only a-z, 0-9 and -"
            );
            i += 1;
        }
        Self { id, title, summary, files: FileTypes::new(), needs: &[], handling: "" }
    }

    /// The same with the columns that a renderer reads.
    #[doc(hidden)]
    #[must_use]
    pub const fn reading(mut self, needs: &'static [NeedInfo]) -> Self {
        self.needs = needs;
        self
    }

    /// The same with how a tool is handled.
    #[doc(hidden)]
    #[must_use]
    pub const fn handled(mut self, handling: crate::stroke::Handling) -> Self {
        self.handling = handling.word();
        self
    }

    /// The same with the files that a format recognises.
    #[doc(hidden)]
    #[must_use]
    pub const fn recognising(mut self, files: FileTypes) -> Self {
        self.files = files;
        self
    }
}
