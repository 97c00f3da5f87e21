//! Textures and buffers of graphs: reused from frame to frame, or kept by key.

mod free;
mod resident;
mod texture_cache;
mod views;

use crate::disk_cache::DiskCache;
use crate::gpu::Gpu;
use crate::graph::live_passes::Written;
use crate::graph::plan::{Node, Plan, wgpu_format};
use crate::graph::resources::free::{Free, FreeResources};
use crate::graph::resources::resident::{ResidentBuffers, ResidentId};
use crate::shader_compiler::fingerprint;
use std::collections::{BTreeMap, HashMap};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;
use surfelshop_api::frame::ResidentBytes;
use surfelshop_api::graph::{Lifetime, Pass, Work};
use surfelshop_raster::Coverage;

pub(super) use views::{target_views, texture_views};

/// Frames an unused resource survives.
const KEPT_FRAMES: u64 = 64;

/// Frames in which every view that is shown was drawn last: a window has at most eight pictures.
const RECENT_FRAMES: u64 = 8;

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Shape {
    Texture { format: wgpu::TextureFormat, size: [u32; 3], volume: bool, mips: u32 },
    Buffer { size: u64 },
}

/// A resource on the device.
#[derive(Clone)]
pub(crate) enum GpuResource {
    Texture(wgpu::Texture),
    Buffer(wgpu::Buffer),
}

/// What a persistent resource is kept under: the author's key, which resource of which unit's
/// graph it is, and the passes that fill it, so that neither a resource beside it nor a rebuilt
/// plugin finds the wrong contents.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Identity {
    scope: String,
    key: String,
    node: Node,
    shape: Shape,
    made_by: u64,
}

impl Identity {
    fn new(scope: &str, key: &str, plan: &Plan, node: Node, shape: &Shape) -> Self {
        let (scope, key, shape) = (scope.to_owned(), key.to_owned(), shape.clone());
        Self { scope, key, node, shape, made_by: made_by(plan, node) }
    }
}

/// A hash of the passes that write a resource.
fn made_by(plan: &Plan, node: Node) -> u64 {
    let mut hasher = DefaultHasher::new();
    for (pass, planned) in plan.structure.passes.iter().zip(&plan.passes) {
        if planned.writes.contains(&node) {
            (&pass.wgsl, &pass.modules, &pass.entry).hash(&mut hasher);
            hash_primitive(pass, &mut hasher);
            for (name, value) in &pass.constants {
                (name, value.to_bits()).hash(&mut hasher);
            }
        }
    }
    hasher.finish()
}

/// What a pass of the host's own shaders does.
fn hash_primitive(pass: &Pass, hasher: &mut DefaultHasher) {
    match &pass.work {
        Work::Sort(sort) => sort.hash(hasher),
        Work::Scan(scan) => scan.hash(hasher),
        _ => {}
    }
}

/// To be raised with every change to what the host's own part of a stored texture is made of and
/// shader modules do not show, such as mip levels of the environment.
const STORED_VERSION: u32 = 1;

struct CachedResource {
    made: GpuResource,
    filled: bool,
    /// Its name in the store, where it is not there yet and is to be.
    to_store: Option<String>,
    last_used: Use,
}

/// The last frame that used a resource.
#[derive(Clone, Copy, Debug, Default)]
struct Use {
    frame: u64,
    /// The picture's size in pixels.
    size: [u32; 2],
}

impl CachedResource {
    /// A new one, with what the store has of it.
    fn new(gpu: &Gpu, id: &Identity, label: &str, store: Option<&DiskCache>) -> Self {
        let made = make(gpu, &id.shape, label);
        let last_used = Use::default();
        let mut kept = Self { made, filled: false, to_store: None, last_used };
        if let Some(store) = store
            && let GpuResource::Texture(texture) = &kept.made
        {
            // Another driver rounds otherwise, and another version of the host may mean something
            // else by what the passes import.
            let host = (env!("CARGO_PKG_VERSION"), STORED_VERSION, fingerprint());
            let name = format!("texture {id:?} {host:?} {}", gpu.describe());
            kept.filled =
                store.load(&name).is_some_and(|bytes| texture_cache::fill(gpu, texture, &bytes));
            kept.to_store = (!kept.filled).then_some(name);
        }
        kept
    }
}

/// Where a frame of a view leaves something for the next one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Left {
    view: u64,
    node: Node,
    label: String,
}

/// Everything graphs have had made.
#[derive(Default)]
pub(crate) struct Resources {
    free: FreeResources,
    persistent: HashMap<Identity, CachedResource>,
    /// What the last frames of views left, by which buffer of which view's graph it is.
    history: HashMap<Left, (Identity, CachedResource)>,
    resident: ResidentBuffers,
    /// The frame that is drawn.
    now: Use,
    /// Where contents are kept for the next start.
    store: Option<DiskCache>,
}

/// Whom resources are lent to, and what of them comes from elsewhere.
#[derive(Default)]
pub(crate) struct Lending<'a> {
    /// Keeps the keys of units apart.
    pub(crate) scope: &'a str,
    /// Keeps the history of views apart.
    pub(crate) view: u64,
    /// Buffers that the host has filled.
    pub(crate) given: HashMap<usize, wgpu::Buffer>,
    /// Buffers of columns that the host has filled, in parts.
    pub(crate) columns: HashMap<usize, Vec<BufferPart>>,
}

/// A part of a buffer that may be larger than the device binds.
#[derive(Clone)]
pub(crate) struct BufferPart {
    /// The first surfel in it.
    pub(crate) first: u32,
    /// Surfels in it.
    pub(crate) n: u32,
    pub(crate) buffer: wgpu::Buffer,
}

/// A frame's resources, by node.
pub(crate) struct FrameResources {
    pub(crate) textures: Vec<Option<wgpu::Texture>>,
    pub(crate) buffers: Vec<Option<wgpu::Buffer>>,
    /// Buffers of columns, by their position; those of one part are among the buffers, too.
    pub(crate) parts: HashMap<usize, Vec<BufferPart>>,
    /// Persistent resources that were filled before this frame.
    filled: Vec<Node>,
    keys: Vec<(Node, Identity)>,
    /// Resident buffers by their position, and whether their bytes are in them.
    resident: BTreeMap<usize, (ResidentId, bool)>,
    lent: Vec<(Node, Shape, GpuResource)>,
    /// Where lent textures hold something but zeros, where that is known.
    held: HashMap<usize, Arc<Coverage>>,
}

/// Texels of all mip levels of a texture; the third extent counts slices of a volume, or layers.
pub(crate) fn texels([width, height, depth]: [u32; 3], mips: u32, volume: bool) -> u64 {
    let level = |level: u32| {
        let side = |side: u32| u64::from((side >> level).max(1));
        let slices = if volume { side(depth) } else { u64::from(depth) };
        side(width) * side(height) * slices
    };
    (0..mips).map(level).sum()
}

/// Bytes of a texture, without what the driver adds.
pub(crate) fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let texel = u64::from(texture.format().block_copy_size(None).unwrap_or(0));
    let size = [texture.width(), texture.height(), texture.depth_or_array_layers()];
    let volume = texture.dimension() == wgpu::TextureDimension::D3;
    texel * texels(size, texture.mip_level_count(), volume)
}

impl GpuResource {
    fn bytes(&self) -> u64 {
        match self {
            Self::Buffer(buffer) => buffer.size(),
            Self::Texture(texture) => texture_bytes(texture),
        }
    }
}

impl FrameResources {
    /// Bytes of all textures and buffers of the graph, without what the driver adds.
    pub(crate) fn bytes(&self) -> u64 {
        let textures = self.textures.iter().flatten().cloned().map(GpuResource::Texture);
        let buffers = self.buffers.iter().flatten().cloned().map(GpuResource::Buffer);
        // Those of one part are among the buffers.
        let parts = self.parts.values().filter(|parts| parts.len() > 1).flatten();
        let in_parts: u64 = parts.map(|part| part.buffer.size()).sum();
        in_parts + textures.chain(buffers).map(|made| made.bytes()).sum::<u64>()
    }

    /// Where a texture that was lent holds something but zeros, where that is known.
    pub(crate) fn held(&self, texture: usize) -> Option<&Arc<Coverage>> {
        self.held.get(&texture)
    }

    /// Whether the bytes of a resident buffer are in it.
    pub(crate) fn is_resident(&self, buffer: usize) -> bool {
        self.resident.get(&buffer).is_some_and(|(_, filled)| *filled)
    }

    /// Whether a persistent resource holds what its key names.
    pub(crate) fn is_filled(&self, node: Node) -> bool {
        self.filled.contains(&node)
    }
}

impl Resources {
    /// Drops what has not been used for a while; called once a frame, with the picture's size.
    pub(crate) fn next_frame(&mut self, size: [u32; 2]) {
        self.now = Use { frame: self.now.frame + 1, size };
        let oldest = self.now.frame.saturating_sub(KEPT_FRAMES);
        self.keep(|last| last.frame >= oldest);
        self.resident.keep(|last| last.frame >= oldest);
    }

    /// The bytes of a unit that are on the device and will be in the next frame.
    pub(crate) fn resident_of(&self, scope: &str) -> Vec<ResidentBytes> {
        self.resident.of(scope, (self.now.frame + 1).saturating_sub(KEPT_FRAMES))
    }

    /// How often bytes were sent that stay, and how many are there.
    pub(crate) fn resident(&self) -> (u32, u64) {
        (self.resident.sent, self.resident.bytes())
    }

    /// Drops what was used last for a picture of another size than these, and scratch memory that the last frames did not
    /// use; called while nothing is drawn.
    pub(crate) fn keep_sizes(&mut self, sizes: &[[u32; 2]]) {
        self.keep(|last| sizes.contains(&last.size));
        // Mostly of renderers that are no longer shown; a view that is and was drawn earlier makes its own again.
        let oldest = self.now.frame.saturating_sub(RECENT_FRAMES);
        self.free.keep(&|last: &Use| last.frame >= oldest);
        // Bytes that stay are of no size; without any picture nothing is to stay.
        self.resident.keep(|_| !sizes.is_empty());
    }

    fn keep(&mut self, is_kept: impl Fn(&Use) -> bool) {
        self.persistent.retain(|_, kept| is_kept(&kept.last_used));
        self.history.retain(|_, (_, kept)| is_kept(&kept.last_used));
        self.free.keep(&is_kept);
    }

    /// Bytes of all that is kept for frames to come, without what the driver adds.
    pub(crate) fn bytes(&self) -> u64 {
        let persistent = self.persistent.values().map(|kept| &kept.made);
        let history = self.history.values().map(|(_, kept)| &kept.made);
        let all = persistent.chain(history).map(GpuResource::bytes);
        all.sum::<u64>() + self.free.bytes() + self.resident.bytes()
    }

    /// Lends the resources that these passes touch.
    pub(crate) fn lend(
        &mut self,
        gpu: &Gpu,
        plan: &Plan,
        nodes: &[Node],
        lending: &Lending<'_>,
    ) -> FrameResources {
        let scope = lending.scope;
        let mut frame = FrameResources {
            textures: vec![None; plan.structure.textures.len()],
            buffers: vec![None; plan.structure.buffers.len()],
            parts: HashMap::new(),
            filled: Vec::new(),
            keys: Vec::new(),
            resident: BTreeMap::new(),
            lent: Vec::new(),
            held: HashMap::new(),
        };
        self.lend_resident(gpu, plan, scope, &mut frame);
        for &node in nodes {
            if let Node::Buffer(i) = node
                && frame.buffers[i].is_some()
            {
                continue;
            }
            if let Node::Buffer(i) = node
                && let Some(buffer) = lending.given.get(&i)
            {
                frame.buffers[i] = Some(buffer.clone());
                continue;
            }
            if let Node::Buffer(i) = node
                && let Some(parts) = lending.columns.get(&i)
            {
                if let [only] = parts.as_slice() {
                    frame.buffers[i] = Some(only.buffer.clone());
                }
                frame.parts.insert(i, parts.clone());
                continue;
            }
            let (shape, lifetime, label) = describe(plan, node);
            let made = match lifetime {
                Lifetime::History => {
                    let id = Identity::new(scope, "", plan, node, &shape);
                    self.left(gpu, Left { view: lending.view, node, label: label.to_owned() }, id)
                }
                Lifetime::Persistent { key, stored } => {
                    let id = Identity::new(scope, key, plan, node, &shape);
                    let store = self.store.as_ref().filter(|_| *stored);
                    let kept = self
                        .persistent
                        .entry(id.clone())
                        .or_insert_with(|| CachedResource::new(gpu, &id, label, store));
                    kept.last_used = self.now;
                    if kept.filled {
                        frame.filled.push(node);
                    }
                    frame.keys.push((node, id));
                    kept.made.clone()
                }
                Lifetime::Frame => {
                    let (made, held) = self.free.take(gpu, &shape, label);
                    if let (Node::Texture(i), Some(held)) = (node, held) {
                        frame.held.insert(i, held);
                    }
                    frame.lent.push((node, shape, made.clone()));
                    made
                }
            };
            match (node, made) {
                (Node::Texture(i), GpuResource::Texture(texture)) => {
                    frame.textures[i] = Some(texture)
                }
                (Node::Buffer(i), GpuResource::Buffer(buffer)) => frame.buffers[i] = Some(buffer),
                _ => {}
            }
        }
        frame
    }

    /// Lends the buffers whose bytes stay: those that no pass touches, too, since their bytes were sent.
    fn lend_resident(&mut self, gpu: &Gpu, plan: &Plan, scope: &str, frame: &mut FrameResources) {
        for (i, buffer) in plan.structure.buffers.iter().enumerate() {
            let Some(key) = &buffer.resident else { continue };
            let (size, label) = (buffer.size.next_multiple_of(4), buffer.label.as_str());
            let id = ResidentId { scope: scope.to_owned(), key: key.clone(), size };
            let new = || make_buffer(gpu, size, label);
            let (made, filled) = self.resident.lend(&id, self.now, new);
            frame.buffers[i] = Some(made);
            frame.resident.insert(i, (id, filled));
        }
        self.resident.make_room(self.now);
    }

    /// What the last frame of a view left in a buffer: zeros where there was none, or where the buffer
    /// had another size or was filled by other passes then.
    fn left(&mut self, gpu: &Gpu, place: Left, id: Identity) -> GpuResource {
        let new = || (id.clone(), CachedResource::new(gpu, &id, &place.label, None));
        let kept = self.history.entry(place.clone()).or_insert_with(new);
        if kept.0 != id {
            *kept = new();
        }
        kept.1.last_used = self.now;
        kept.1.made.clone()
    }

    /// With a store for contents that are kept for the next start.
    pub(crate) fn with_store(store: Option<DiskCache>) -> Self {
        Self { store, ..Self::default() }
    }

    /// Stores what was filled for the first time.
    pub(crate) fn save(&mut self, gpu: &Gpu) {
        let Some(store) = &self.store else { return };
        for kept in self.persistent.values_mut().filter(|kept| kept.filled) {
            let Some(name) = kept.to_store.take() else { continue };
            if let GpuResource::Texture(texture) = &kept.made
                && let Some(bytes) = texture_cache::bytes(gpu, texture)
            {
                store.save(&name, &bytes);
            }
        }
    }

    /// Takes a submitted frame's resources back; `written` persistent ones now hold what their
    /// key names.
    pub(crate) fn give_back(
        &mut self,
        mut frame: FrameResources,
        written: &mut Written,
        plan: &Plan,
    ) {
        for (i, (id, _)) in &frame.resident {
            if let Some(sent) = plan.structure.buffers[*i].upload {
                self.resident.filled(id, sent.len);
            }
        }
        for (node, shape, made) in frame.lent {
            let held = match node {
                Node::Texture(i) if written.nodes.contains(&node) => written.covered.remove(&i),
                Node::Texture(i) => frame.held.remove(&i),
                Node::Buffer(_) => None,
            };
            self.free.add(shape, Free { made, last_used: self.now, held });
        }
        for (node, id) in frame.keys {
            if written.nodes.contains(&node)
                && let Some(kept) = self.persistent.get_mut(&id)
            {
                kept.filled = true;
            }
        }
    }
}

fn describe(plan: &Plan, node: Node) -> (Shape, &Lifetime, &str) {
    match node {
        Node::Texture(i) => {
            let texture = &plan.structure.textures[i];
            let shape = Shape::Texture {
                format: wgpu_format(texture.format),
                size: plan.extent(i),
                volume: texture.volume,
                mips: texture.mips,
            };
            (shape, &texture.lifetime, &texture.label)
        }
        Node::Buffer(i) => {
            let buffer = &plan.structure.buffers[i];
            let shape = Shape::Buffer { size: buffer.size.next_multiple_of(4) };
            (shape, &buffer.lifetime, &buffer.label)
        }
    }
}

fn make(gpu: &Gpu, shape: &Shape, label: &str) -> GpuResource {
    match *shape {
        Shape::Texture { format, size: [width, height, slices], volume, mips } => {
            let wanted = wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::RENDER_ATTACHMENT;
            let usage = gpu.allowed_usages(format) & wanted;
            GpuResource::Texture(gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: slices },
                mip_level_count: mips,
                sample_count: 1,
                dimension: if volume {
                    wgpu::TextureDimension::D3
                } else {
                    wgpu::TextureDimension::D2
                },
                format,
                usage,
                view_formats: &[],
            }))
        }
        Shape::Buffer { size } => GpuResource::Buffer(make_buffer(gpu, size, label)),
    }
}

fn make_buffer(gpu: &Gpu, size: u64, label: &str) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    })
}
