//! The frame a renderer describes: textures, buffers, passes and outputs.
//!
//! Passes run in the order declared. Resources bind by the name of the WGSL variable; passes that
//! feed no requested output do not run. The structure travels apart from the bytes of uniforms
//! and uploads, so an unchanged structure is recognised by comparison.

mod cameras;
mod columns;
mod members;
mod passes;
mod resources;
mod splats;
mod structure;

pub use cameras::SeenFrom;
pub use columns::{BufferColumn, COLUMNS_HEADER_WORDS, Columns, ColumnsOf, Stored};
pub use passes::{Groups, Module, Pass, SurfaceMode, Target, Work};
// Beside the list, which the listing of older revisions has as it is.
pub use members::{Member, MemberType, Members};
pub use resources::CameraId;
pub use resources::{
    Buffer, BufferId, Extent, Format, Lifetime, Resource, SamplerKind, Span, Texture, TextureId,
    UniformId,
};
pub use splats::{Composition, Footprint, MAX_PAYLOADS, SplatDepth, Splats};
pub use structure::{Output, Structure};

use crate::params::ParamSet;
use crate::uniform::Uniform;

/// A frame under description.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    structure: Structure,
    data: Vec<u8>,
    /// One less than [`stride`](Self::stride).
    left_out: u32,
}

/// Bytes of a `surfelshop::surfels::Record`.
const SURFEL_BYTES: u64 = 32;

/// Uniforms start at multiples of this many bytes, the largest offset alignment WebGPU allows an
/// adapter to ask for.
const UNIFORM_ALIGN: usize = 256;

impl Graph {
    /// An empty graph.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A graph from its parts, as they crossed the boundary.
    #[must_use]
    pub fn from_parts(structure: Structure, data: Vec<u8>) -> Self {
        Self { structure, data, left_out: 0 }
    }

    /// An empty graph of a frame in which one surfel of `stride` is drawn.
    pub(crate) fn drawing_one_of(stride: u32) -> Self {
        Self { left_out: stride.saturating_sub(1), ..Self::default() }
    }

    /// One surfel of so many is drawn in this frame, and so much larger that they cover the same, or they
    /// are merged to about as few: 1, the whole, but while something moves and the whole took too long. A
    /// renderer that spends its time on other things may do with as much less of these, so that it keeps
    /// up; at rest a whole frame follows. Windows go to 64, and any number may come. Buffers of
    /// [`surfels`](Self::surfels) hold what they are asked for either way. ABI 3.6.
    #[must_use]
    pub fn stride(&self) -> u32 {
        self.left_out.saturating_add(1)
    }

    /// Declares a texture.
    pub fn texture(&mut self, label: &str, mut texture: Texture) -> TextureId {
        label.clone_into(&mut texture.label);
        self.structure.textures.push(texture);
        TextureId(index(self.structure.textures.len()))
    }

    /// Declares a storage buffer.
    pub fn buffer(&mut self, label: &str, mut buffer: Buffer) -> BufferId {
        label.clone_into(&mut buffer.label);
        self.structure.buffers.push(buffer);
        BufferId(index(self.structure.buffers.len()))
    }

    /// Declares a storage buffer filled with these bytes before the first pass.
    pub fn upload(&mut self, label: &str, bytes: &[u8]) -> BufferId {
        let size = (bytes.len() as u64).next_multiple_of(4).max(4);
        let upload = Some(self.append(bytes, 4));
        self.buffer(label, Buffer { upload, ..Buffer::new(size) })
    }

    /// Declares a storage buffer that the host fills with the scene's surfels, `n_surfels` of them
    /// ([`CloudFacts::n_surfels`](crate::CloudFacts::n_surfels)): all, or evenly spread ones so that there
    /// are `at_most` so many. [`surfels_given`](Self::surfels_given) says how many that are. Shaders
    /// declare it as `var<storage, read> NAME: array<surfels::Record>` of the module
    /// `surfelshop::surfels`. Neighbours in space stand near each other in the buffer. It is filled when
    /// the clouds are new, and not again; where there is no surfel it has one of radius 0. ABI 3.5.
    pub fn surfels(&mut self, label: &str, n_surfels: u64, at_most: u32) -> BufferId {
        let given = u64::from(Self::surfels_given(n_surfels, at_most)).max(1);
        let surfels = Some(at_most);
        self.buffer(label, Buffer { surfels, ..Buffer::new(given * SURFEL_BYTES) })
    }

    /// How many of `n_surfels` a buffer of `at_most` holds: one of every
    /// [`surfels_per_given`](Self::surfels_per_given). ABI 3.5.
    #[must_use]
    pub fn surfels_given(n_surfels: u64, at_most: u32) -> u32 {
        let given = n_surfels.div_ceil(Self::surfels_per_given(n_surfels, at_most));
        u32::try_from(given).unwrap_or(u32::MAX)
    }

    /// How many surfels of the scene each one of such a buffer stands for, at least 1. ABI 3.5.
    #[must_use]
    pub fn surfels_per_given(n_surfels: u64, at_most: u32) -> u64 {
        n_surfels.div_ceil(u64::from(at_most.max(1))).max(1)
    }

    /// Declares a storage buffer that the host fills with columns of these clouds, by their number in
    /// [`CloudFacts::clouds`](crate::CloudFacts::clouds): all surfels of the first, then those of the next, each cloud's
    /// in an order that brings neighbours in space together and does not depend on that of its file. Passes that
    /// [read](Pass::reads) it import `path`, with a function of each column's name from a surfel's number to its value,
    /// `f32` or a vector of two to four; of more components `fn NAME(i: u32, k: u32)` gives the `k`-th word, an `f32`, a
    /// `vec2` of 16-bit floats or a `vec4` of 8-bit numbers:
    ///
    /// ```
    /// use surfelshop_api::graph::{Footprint, BufferColumn, Graph, Pass};
    /// # let facts = surfelshop_api::CloudFacts::default();
    /// let mut graph = Graph::new();
    /// let (n, columns) = graph.columns("splats", &facts, &[0], &[
    ///     BufferColumn::new("position", 3),
    ///     BufferColumn::new("opacity", 1).or(1.0),
    /// ]);
    /// let pass = Pass::splats("draw", "... splats::opacity(i) ...", "splat", Footprint::Conic, n);
    /// let pass = pass.reads(&columns);
    /// ```
    ///
    /// It is filled when the clouds are new, shared by all views, and brought to the device where a pass that runs reads
    /// it. Where it is larger than the device binds, passes of [splats](Pass::splats) are given it part by part; others
    /// are refused. The first number says how many surfels there are. ABI 3.9.
    pub fn columns(
        &mut self,
        path: &str,
        facts: &crate::CloudFacts,
        objects: &[u32],
        columns: &[BufferColumn],
    ) -> (u64, Columns) {
        let of = ColumnsOf { objects: objects.to_vec(), columns: columns.to_vec() };
        let n_of =
            |object: &u32| facts.clouds.get(*object as usize).map_or(0, |cloud| cloud.n_surfels);
        let n = objects.iter().map(n_of).fold(0, u64::saturating_add);
        let size = of.bytes(n);
        let given = Columns::new(BufferId(index(self.structure.buffers.len() + 1)), path, &of);
        self.buffer(path, Buffer { columns: Some(of), ..Buffer::new(size) });
        (n, given)
    }

    /// Says which clouds this graph draws itself: the host leaves them out of its surface. ABI 3.9.
    pub fn take(&mut self, objects: &[u32]) {
        self.structure.taken = objects.to_vec();
    }

    /// Says that the picture goes over what other renderers of a scene draw behind it as sRGB-encoded numbers, which is
    /// how colours that were trained on photographs are blended; else it goes over it as light. Of a graph that
    /// [takes](Self::take) clouds alone. ABI 3.10.
    pub fn blend_encoded(&mut self) {
        self.structure.encoded_over = true;
    }

    /// Declares a camera for passes that are [`seen_from`](Pass::seen_from) it: its picture has the
    /// view's `size_px`. ABI 3.5.
    pub fn camera(&mut self, label: &str, view: &crate::View) -> CameraId {
        let bytes = self.append(&cameras::bytes_of(view), 8);
        let (label, size_px) = (label.to_owned(), view.size_px);
        self.structure.cameras.push(SeenFrom { label, size_px, view: bytes });
        CameraId(index(self.structure.cameras.len()))
    }

    /// Gives the bytes of a uniform for this frame.
    pub fn uniform(&mut self, uniform: Uniform) -> UniformId {
        let span = self.append(&uniform.into_bytes(), UNIFORM_ALIGN);
        self.structure.uniforms.push(span);
        UniformId(index(self.structure.uniforms.len()))
    }

    /// Gives the members of a uniform for this frame by name; the host lays them out as the shader's
    /// structure declares them. ABI 3.7.
    pub fn members(&mut self, members: Members) -> UniformId {
        let (members, bytes) = members.into_parts();
        let span = self.append(&bytes, UNIFORM_ALIGN);
        self.structure.uniforms.push(span);
        let id = index(self.structure.uniforms.len());
        self.structure.members.insert(id, members);
        UniformId(id)
    }

    /// Gives parameters as a uniform, each as the member of its name ([`Members::of`]). ABI 3.7.
    pub fn parameters(&mut self, params: &impl ParamSet) -> UniformId {
        self.members(Members::of(params))
    }

    fn append(&mut self, bytes: &[u8], align: usize) -> Span {
        self.data.resize(self.data.len().next_multiple_of(align), 0);
        let span = Span { offset: self.data.len() as u64, len: bytes.len() as u64 };
        self.data.extend_from_slice(bytes);
        span
    }

    /// Adds a pass behind the ones before it.
    pub fn pass(&mut self, pass: Pass) {
        self.structure.passes.push(pass);
    }

    /// Offers a texture as an output.
    pub fn output(&mut self, output: Output, texture: TextureId) {
        self.structure.outputs.push((output, texture));
    }

    /// Says that another frame would refine the picture.
    pub fn request_another_frame(&mut self) {
        self.structure.wants_another_frame = true;
    }

    /// Everything but the bytes.
    #[must_use]
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// The bytes of uniforms and uploads.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data
    }
}

/// The index of the element just pushed onto a list of this length.
fn index(len: usize) -> u32 {
    u32::try_from(len - 1).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(gain: f32) -> Graph {
        let mut graph = Graph::new();
        let settings = graph.uniform(Uniform::new().f32(gain));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::shading("shade", "", "shade").target(color).bind("settings", settings));
        graph.output(Output::Color, color);
        graph
    }

    #[test]
    fn values_change_the_data_and_not_the_structure() {
        let (a, b) = (frame(1.0), frame(2.0));
        assert_eq!(a.structure(), b.structure());
        assert_ne!(a.data(), b.data());
    }

    #[test]
    fn structure_survives_the_wire() {
        let graph = frame(1.0);
        let bytes = rmp_serde::to_vec_named(graph.structure()).unwrap();
        let back: Structure = rmp_serde::from_slice(&bytes).unwrap();
        assert_eq!(&back, graph.structure());
    }

    #[test]
    fn fields_a_newer_plugin_adds_are_ignored() {
        #[derive(serde::Serialize)]
        struct Newer {
            textures: Vec<Texture>,
            something_new: u32,
        }
        let bytes = rmp_serde::to_vec_named(&Newer { textures: vec![], something_new: 1 }).unwrap();
        assert_eq!(rmp_serde::from_slice::<Structure>(&bytes).unwrap(), Structure::default());
    }
}
