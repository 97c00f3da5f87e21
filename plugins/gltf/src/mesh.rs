//! The points and triangles of a mesh.

use crate::accessor::Accessor;
use crate::attributes::{self, Attribute};
use crate::buffers::Buffers;
use crate::extensions::{PACKED_SPLATS, compression};
use crate::names::{AllNames, Names};
use crate::packed;
use crate::splats::Splats;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use std::collections::HashMap;
use surfelshop_api::prelude::{Error, Result};

/// The colour of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Base {
    /// Linear, with alpha.
    pub factor: [f32; 4],
    /// Whether a material says so, and no texture that is not read says more.
    pub is_stated: bool,
}

/// Points with their attributes.
#[derive(Debug)]
pub(crate) struct Vertices {
    pub count: u32,
    pub position: Accessor,
    pub normal: Option<Accessor>,
    pub color: Option<Accessor>,
    pub base: Base,
    /// What is Gaussians of them.
    pub splats: Option<Splats>,
    /// Those of own names.
    pub own: Vec<Attribute>,
}

/// Triangles between points.
#[derive(Debug)]
pub(crate) struct Topology {
    /// Which of the mesh's points.
    pub vertices: usize,
    pub mode: Mode,
    pub indices: Option<Accessor>,
}

/// A mesh.
#[derive(Debug, Default)]
pub(crate) struct Mesh {
    pub vertices: Vec<Vertices>,
    pub topologies: Vec<Topology>,
}

/// What is doubtful of all meshes.
#[derive(Debug, Default)]
pub(crate) struct Doubts {
    n_without_positions: usize,
    n_lines: usize,
    has_textures: bool,
    /// Primitives beside Gaussians.
    pub n_beside_splats: usize,
    has_point_indices: bool,
    /// Attributes that are not read, and why.
    pub attributes: Vec<String>,
}

impl Doubts {
    /// A line for each.
    pub(crate) fn lines(self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.n_without_positions > 0 {
            lines.push(format!(
                "{} primitives without positions were left out",
                self.n_without_positions
            ));
        }
        if self.n_lines > 0 {
            lines.push(format!("{} primitives of lines were left out", self.n_lines));
        }
        if self.has_textures {
            lines.push(
                "textures are not read: colours are those of materials and points".to_owned(),
            );
        }
        if self.n_beside_splats > 0 {
            lines.push(format!(
                "{} primitives beside Gaussians were left out: they are none",
                self.n_beside_splats
            ));
        }
        if self.has_point_indices {
            lines.push("points that are listed by index were all read".to_owned());
        }
        lines.extend(self.attributes);
        lines
    }
}

/// What tells points of a mesh from others: the attributes, those of extensions too, and the material.
type Key = (Vec<(Checked<Semantic>, usize)>, Names, Option<usize>);

impl Mesh {
    /// Leaves what is no splats out; returns how many primitives' points these were.
    pub(crate) fn keep_splats(&mut self) -> usize {
        let before = self.vertices.len();
        self.vertices.retain(|vertices| vertices.splats.is_some());
        self.topologies.clear();
        before - self.vertices.len()
    }

    /// Finds the accessors of a mesh.
    ///
    /// # Errors
    /// Where something that it refers to is not there.
    pub(crate) fn find(
        (root, names): (&Root, &AllNames),
        buffers: &mut Buffers,
        index: usize,
        doubts: &mut Doubts,
    ) -> Result<Self> {
        let missing = || Error::new(format!("expected a mesh {index}, found none"));
        let json = root.meshes.get(index).ok_or_else(missing)?;
        let (mut mesh, mut known) = (Self::default(), HashMap::<Key, usize>::new());
        for (number, primitive) in json.primitives.iter().enumerate() {
            let Checked::Valid(mode) = primitive.mode else {
                return Err(Error::new(format!(
                    "mesh {index}: expected a mode of glTF, found another"
                )));
            };
            if matches!(mode, Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
                doubts.n_lines += 1;
                continue;
            }
            let attributes = primitive.attributes.iter();
            let key: Vec<_> =
                attributes.map(|(name, accessor)| (name.clone(), accessor.value())).collect();
            let names = names.of_primitive(index, number);
            let key = (key, names.clone(), primitive.material.map(|material| material.value()));
            let vertices = match known.get(&key) {
                Some(&vertices) => vertices,
                None => {
                    let Some(found) = vertices((root, &mut *buffers), primitive, &names, doubts)?
                    else {
                        continue;
                    };
                    mesh.vertices.push(found);
                    known.insert(key, mesh.vertices.len() - 1);
                    mesh.vertices.len() - 1
                }
            };
            if mode == Mode::Points {
                doubts.has_point_indices |= primitive.indices.is_some();
                continue;
            }
            let find = |index: Index<_>| Accessor::find(root, buffers, index.value());
            let indices = primitive.indices.map(find).transpose()?;
            mesh.topologies.push(Topology { vertices, mode, indices });
        }
        Ok(mesh)
    }
}

/// The points of a primitive; `None` where it has none.
fn vertices(
    (root, buffers): (&Root, &mut Buffers),
    primitive: &Primitive,
    names: &Names,
    doubts: &mut Doubts,
) -> Result<Option<Vertices>> {
    let extensions = primitive.extensions.as_ref().map(|extensions| &extensions.others);
    let has = |name: &str| extensions.is_some_and(|others| others.contains_key(name));
    let find_in = |buffers: &Buffers, semantic: Semantic| {
        let index = primitive.attributes.get(&Checked::Valid(semantic));
        index.map(|index| Accessor::find(root, buffers, index.value())).transpose()
    };
    let Some(mut position) = find_in(buffers, Semantic::Positions)? else {
        doubts.n_without_positions += 1;
        return Ok(None);
    };
    let packed = match position.is_empty_inside() {
        true => packed::unpacked(root, buffers, primitive, position.count)?,
        false => None,
    };
    let buffers = &*buffers;
    let mut splats = None;
    if let Some(packed) = packed {
        position = packed.position;
        splats = Some(packed.splats);
    }
    if position.is_empty_inside() && has("KHR_draco_mesh_compression") {
        return Err(Error::new(
            "a mesh is compressed by Draco, which is not read; save the file without compression",
        ));
    }
    if let Some(name) = compression(primitive).filter(|_| position.is_empty_inside()) {
        let name: String = name.escape_debug().take(80).collect();
        return Err(Error::new(format!(
            "Gaussians are compressed by {name}, which is not read; {PACKED_SPLATS}"
        )));
    }
    let count = position.count;
    if position.shape.components != 3 {
        let found = position.shape.components;
        return Err(Error::new(format!("POSITION: expected 3 components, found {found}")));
    }
    let is_points = primitive.mode == Checked::Valid(Mode::Points);
    if is_points && splats.is_none() {
        splats = Splats::find((root, buffers), primitive, names, count, &mut doubts.attributes)?;
    }
    // Of splats these follow from the rest.
    let is_splats = splats.is_some();
    let find = |semantic| if is_splats { Ok(None) } else { find_in(buffers, semantic) };
    let normal = find(Semantic::Normals)?;
    let color = find(Semantic::Colors(0))?;
    let checked = |name: &str, accessor: Option<Accessor>, doubts: &mut Doubts| {
        attributes::checked(name, accessor, count, &mut doubts.attributes)
    };
    let normal = checked("NORMAL", normal, doubts);
    let color = checked("COLOR_0", color, doubts);
    let own = attributes::own(root, buffers, primitive, count, &mut doubts.attributes)?;
    let base = base(root, primitive, doubts)?;
    Ok(Some(Vertices { count, position, normal, color, base, splats, own }))
}

fn base(root: &Root, primitive: &Primitive, doubts: &mut Doubts) -> Result<Base> {
    let Some(index) = primitive.material else {
        return Ok(Base { factor: [1.0; 4], is_stated: false });
    };
    let missing = || Error::new(format!("expected a material {}, found none", index.value()));
    let material = root.materials.get(index.value()).ok_or_else(missing)?;
    let surface = &material.pbr_metallic_roughness;
    let has_texture = surface.base_color_texture.is_some();
    doubts.has_textures |= has_texture;
    let factor = surface.base_color_factor.0.map(|v| if v.is_finite() { v.max(0.0) } else { 1.0 });
    let is_stated = !has_texture || factor[..3] != [1.0; 3];
    Ok(Base { factor, is_stated })
}
