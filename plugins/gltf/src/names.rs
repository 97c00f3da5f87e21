//! Names of attributes as the file has them: those of extensions are none of glTF's own.

use serde::Deserialize;
use std::collections::BTreeMap;
use surfelshop_api::prelude::{Error, Result};

/// What names of extensions' attributes have that others do not.
const SEPARATOR: u8 = b':';

#[derive(Deserialize)]
struct FileNames {
    #[serde(default)]
    meshes: Vec<MeshNames>,
}

#[derive(Default, Deserialize)]
struct MeshNames {
    #[serde(default)]
    primitives: Vec<Names>,
}

/// The attributes of a primitive, with their accessors.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq, Hash)]
pub(crate) struct Names {
    #[serde(default)]
    attributes: BTreeMap<String, usize>,
}

impl Names {
    /// The accessor of an attribute.
    pub(crate) fn accessor(&self, name: &str) -> Option<usize> {
        self.attributes.get(name).copied()
    }
}

/// The names of all attributes.
#[derive(Default)]
pub(crate) struct AllNames(Vec<MeshNames>);

impl AllNames {
    /// Reads the names of a file's JSON, where extensions are mentioned in it.
    ///
    /// # Errors
    /// Where it has another form.
    pub(crate) fn of(text: &[u8], extension: &str) -> Result<Self> {
        let mentioned = [extension.as_bytes(), &[SEPARATOR]].concat();
        if !text.windows(mentioned.len()).any(|window| window == mentioned) {
            return Ok(Self::default());
        }
        let found: FileNames = gltf::json::deserialize::from_slice(text)
            .map_err(|error| Error::new(format!("expected glTF 2 as JSON: {error}")))?;
        Ok(Self(found.meshes))
    }

    /// Those of a primitive of a mesh.
    pub(crate) fn of_primitive(&self, mesh: usize, primitive: usize) -> Names {
        let found = self.0.get(mesh).and_then(|mesh| mesh.primitives.get(primitive));
        found.cloned().unwrap_or_default()
    }
}
