//! The frame a renderer describes: textures, buffers, passes and outputs.
//!
//! Passes run in the order declared. Resources bind by the name of the WGSL variable; passes that
//! feed no requested output do not run. The structure travels apart from the bytes of uniforms
//! and uploads, so an unchanged structure is recognised by comparison.

mod cameras;
mod columns;
mod members;
mod passes;
mod primitives;
mod radiance;
mod resources;
mod settings;
mod splats;
mod structure;

pub use cameras::SeenFrom;
pub use columns::{BufferColumn, COLUMNS_HEADER_WORDS, Columns, ColumnsOf, Stored};
pub use passes::{Groups, Module, Pass, SurfaceMode, Target, Work};
// Beside the list, which the listing of older revisions has as it is.
pub use members::{Member, MemberType, Members};
pub use primitives::{Count, Scan, Sort, f32_from_ordered, ordered_from_f32};
pub use radiance::Radiance;
pub use resources::CameraId;
pub use resources::{
    Buffer, BufferId, Extent, Format, Lifetime, Resource, SamplerKind, Span, Texture, TextureId,
    UniformId,
};
pub use settings::Settings;
pub use splats::{Composition, Footprint, MAX_PAYLOADS, SplatDepth, Splats};
pub use structure::{Output, Structure};

use crate::frame::ResidentBytes;
use crate::params::ParamSet;
use crate::uniform::Uniform;

/// A frame under description.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    structure: Structure,
    data: Vec<u8>,
    /// One less than [`stride`](Self::stride).
    left_out: u32,
    /// What is on the device already of [`resident`](Self::resident) buffers.
    on_device: Vec<ResidentBytes>,
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
        Self { structure, data, ..Self::default() }
    }

    /// An empty graph of a frame in which one surfel of `stride` is drawn.
    pub(crate) fn drawing_one_of(stride: u32) -> Self {
        Self { left_out: stride.saturating_sub(1), ..Self::default() }
    }

    /// The same where these bytes are on the device already.
    pub(crate) fn with_on_device(self, on_device: Vec<ResidentBytes>) -> Self {
        Self { on_device, ..self }
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

    /// Declares a storage buffer of `len` bytes that stay on the device: `bytes` is called, and they are sent, only
    /// where the host does not have them there. `key` names them: everything that they are made of belongs into it,
    /// such as the name and the time of a file, since other bytes under the same key and length are never asked for.
    /// The host keeps the keys of units apart and shares them among the views of one. It drops what no frame has used
    /// for 64 frames, and what was not used for longest where there is too much; then `bytes` is called again, as it is
    /// on another device. Passes only read the buffer. Hosts before 3.10 are sent the bytes in every frame. ABI 3.10.
    ///
    /// ```
    /// use surfelshop_api::graph::Graph;
    /// let table: Vec<f32> = (0..1000).map(|i| (i as f32).sqrt()).collect();
    /// let to_bytes = || table.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    /// let mut graph = Graph::new();
    /// graph.resident("roots", "roots of 0 to 999", 4 * 1000, to_bytes);
    /// assert_eq!(graph.data().len(), 4000, "nothing is said to be on the device");
    /// ```
    pub fn resident<B: AsRef<[u8]>>(
        &mut self,
        label: &str,
        key: &str,
        len: u64,
        bytes: impl FnOnce() -> B,
    ) -> BufferId {
        let is_there = self.on_device.iter().any(|there| there.key == key && there.len == len);
        let upload = (!is_there).then(|| self.append(bytes().as_ref(), 4));
        let (size, resident) = (len.next_multiple_of(4).max(4), Some(key.to_owned()));
        self.buffer(label, Buffer { upload, resident, ..Buffer::new(size) })
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

    /// Gives members as a uniform, and the WGSL module `path` that declares it. Passes that read these
    /// [settings](Pass::settings) import them and write no structure of their own, so that all agree about names and
    /// types:
    ///
    /// ```
    /// use surfelshop_api::graph::{Graph, Members, Pass};
    /// # surfelshop_api::params! {
    /// #     /// Settings.
    /// #     struct Settings {
    /// #         /// A number.
    /// #         gain: f32 { default: 0.5 },
    /// #     }
    /// # }
    /// # let params = Settings::default();
    /// let mut graph = Graph::new();
    /// let settings = graph.settings("rim", Members::of(&params).u32("n_steps", 8));
    /// let wgsl = "#import rim::settings
    ///     ... settings.gain * f32(settings.n_steps) ...";
    /// let pass = Pass::shading("shade", wgsl, "shade").settings(&settings);
    /// ```
    ///
    /// Parameters have the types of their Rust fields: `f32`, `u32`, `i32`, `vec3<f32>`, and `u32` of switches and
    /// choices. No name may end in a digit. ABI 3.10, and hosts from 3.7 on run it.
    pub fn settings(&mut self, path: &str, members: Members) -> Settings {
        let declared = members.clone();
        Settings::new(self.members(members), path, &declared)
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
