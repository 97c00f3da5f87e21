//! The graphics device: which adapter is taken and what it can do.

use crate::adapters::{adapters, is_software, rank};
use crate::shader_features::ShaderFeature;
use crate::stages::Stages;
use crate::transfer::TransferBuffers;
use std::collections::HashMap;
use std::sync::{Arc, OnceLock};
use thiserror::Error;

/// The formats graphs and the surface buffer are made of.
const FORMATS: [wgpu::TextureFormat; 9] = [
    wgpu::TextureFormat::Rgba8Unorm,
    wgpu::TextureFormat::Rgba16Float,
    wgpu::TextureFormat::R32Float,
    wgpu::TextureFormat::Rg32Float,
    wgpu::TextureFormat::Rgba32Float,
    wgpu::TextureFormat::R32Uint,
    wgpu::TextureFormat::Rg32Uint,
    wgpu::TextureFormat::Rgba32Uint,
    wgpu::TextureFormat::Depth32Float,
];

/// The memory that a software device takes at once, bytes: the least that wgpu takes.
const SMALL_BLOCK: u64 = 4 << 20;
/// Buffers that a step of sorting binds.
const SORTED_BUFFERS: u32 = 5;
/// Buffers that composing splats tile by tile binds.
const LISTED_BUFFERS: u32 = 7;

/// Which graphics interface to use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// Vulkan, Metal or Direct3D 12.
    Primary,
    /// Vulkan alone.
    Vulkan,
    /// OpenGL (ES) alone.
    Gl,
    /// Metal alone.
    Metal,
    /// Direct3D 12 alone.
    Dx12,
}

/// What the user asked for; by default the best adapter of the best interface.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Only this interface; where `None`, OpenGL is tried when no other has an adapter.
    pub backend: Option<Backend>,
    /// Only an adapter whose name contains this text, ignoring case.
    pub adapter: Option<String>,
    /// Whether a software device takes memory in small blocks, which go back as soon as they are let go: for what is
    /// open for hours. It takes the C library's help to be worth it.
    pub small_blocks: bool,
}

/// Why there is no device.
#[derive(Debug, Error)]
pub enum GpuError {
    /// No adapter at all.
    #[error(
        "no graphics adapter was found ({tried}); install a graphics driver, or Mesa's software \
         driver: package mesa-vulkan-drivers (Debian, Ubuntu, Fedora), vulkan-swrast (Arch)"
    )]
    NoAdapter {
        /// The interfaces tried.
        tried: String,
    },
    /// Adapters, but none with the name asked for.
    #[error("no graphics adapter is called `{wanted}`; there are: {found}")]
    NoSuchAdapter {
        /// The text asked for.
        wanted: String,
        /// The adapters there are.
        found: String,
    },
    /// The adapter lacks something without which nothing can be drawn.
    #[error(
        "the graphics adapter {adapter} lacks {missing}; choose another with --adapter or --backend"
    )]
    Unfit {
        /// The adapter's name.
        adapter: String,
        /// What it lacks.
        missing: String,
    },
    /// The driver refused to make a device.
    #[error("the graphics adapter {adapter} gave no device: {reason}")]
    Refused {
        /// The adapter's name.
        adapter: String,
        /// What the driver said.
        reason: String,
    },
}

/// How wide the integers are on which compute passes work atomically.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Atomics {
    /// 32 bits.
    Only32,
    /// The greater of two numbers also of 64 bits.
    Max64,
    /// All that there is, also of 64 bits.
    All64,
}

impl Atomics {
    fn of(features: wgpu::Features) -> Self {
        let has = |wanted| features.contains(wgpu::Features::SHADER_INT64 | wanted);
        if has(wgpu::Features::SHADER_INT64_ATOMIC_ALL_OPS) {
            Self::All64
        } else if has(wgpu::Features::SHADER_INT64_ATOMIC_MIN_MAX) {
            Self::Max64
        } else {
            Self::Only32
        }
    }
}

/// A device with its queue and what is known of it.
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, kind and driver.
    pub info: wgpu::AdapterInfo,
    /// Whether additive blending into 32-bit float textures works.
    pub blends_f32: bool,
    /// Whether fragments can add to a word that all share.
    pub(crate) counts_in_fragments: bool,
    /// Whether passes can be timed on the device.
    pub times_passes: bool,
    /// Whether shaders can write into buffers that the CPU reads, without a copy: where both have one memory.
    pub maps_storage: bool,
    /// Which atomic operations compute passes of the host use.
    pub atomics: Atomics,
    /// Buffers through which pictures cross.
    pub(crate) transfers: TransferBuffers,
    /// How long stages of a frame take, where that is asked for.
    pub(crate) stages: Stages,
    /// Why the device was lost, once it is.
    lost: Arc<OnceLock<String>>,
    /// What textures of a format may be used for, where less than WebGPU promises.
    usages: HashMap<wgpu::TextureFormat, wgpu::TextureUsages>,
    /// How shaders may store into textures of a format.
    stores: HashMap<wgpu::TextureFormat, wgpu::TextureFormatFeatureFlags>,
    /// Whether dispatches take their size from a buffer.
    pub(crate) dispatches_counted: bool,
}

impl Gpu {
    /// Opens a device without a window: discrete before integrated before virtual before software,
    /// and OpenGL only where nothing else has an adapter.
    ///
    /// # Errors
    /// Where no adapter fits; the message says what to install.
    pub fn headless(options: &GpuOptions) -> Result<Self, GpuError> {
        let groups: &[(wgpu::Backends, &str)] = match options.backend {
            None => &[
                (wgpu::Backends::PRIMARY, "Vulkan, Metal, Direct3D"),
                (wgpu::Backends::GL, "OpenGL"),
            ],
            Some(Backend::Primary) => &[(wgpu::Backends::PRIMARY, "Vulkan, Metal, Direct3D")],
            Some(Backend::Vulkan) => &[(wgpu::Backends::VULKAN, "Vulkan")],
            Some(Backend::Gl) => &[(wgpu::Backends::GL, "OpenGL")],
            Some(Backend::Metal) => &[(wgpu::Backends::METAL, "Metal")],
            Some(Backend::Dx12) => &[(wgpu::Backends::DX12, "Direct3D 12")],
        };
        let mut found = Vec::new();
        for (backends, _) in groups {
            let mut adapters = adapters(*backends);
            adapters.sort_by_key(|adapter| rank(adapter.get_info().device_type));
            for adapter in &adapters {
                let name = adapter.get_info().name;
                let wanted = options
                    .adapter
                    .as_ref()
                    .is_none_or(|wanted| name.to_lowercase().contains(&wanted.to_lowercase()));
                if wanted {
                    return Self::open(adapter, options.small_blocks);
                }
                if !found.contains(&name) {
                    found.push(name);
                }
            }
        }
        match &options.adapter {
            Some(wanted) if !found.is_empty() => {
                Err(GpuError::NoSuchAdapter { wanted: wanted.clone(), found: found.join(", ") })
            }
            _ => {
                let tried = groups.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(", ");
                Err(GpuError::NoAdapter { tried })
            }
        }
    }

    /// wgpu's device that computes nothing, with the limits that WebGPU promises: graphs are checked, compiled
    /// by naga and recorded for it, and no driver sees them. Pictures are zeros.
    ///
    /// # Errors
    /// Never but by a fault of wgpu.
    pub fn noop() -> Result<Self, GpuError> {
        let noop = wgpu::NoopBackendOptions {
            limits: Some(wgpu::Limits::default()),
            ..wgpu::NoopBackendOptions::enabled()
        };
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::NOOP,
            flags: wgpu::InstanceFlags::empty(),
            backend_options: wgpu::BackendOptions { noop, ..Default::default() },
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::NOOP));
        let none = || GpuError::NoAdapter { tried: "no-op".to_owned() };
        Self::open(found.first().ok_or_else(none)?, false)
    }

    /// Opens a device on an adapter.
    ///
    /// # Errors
    /// Where the adapter lacks compute or storage buffers, or its driver refuses.
    pub fn open(adapter: &wgpu::Adapter, small_blocks: bool) -> Result<Self, GpuError> {
        let info = adapter.get_info();
        let has = |flag| adapter.get_downlevel_capabilities().flags.contains(flag);
        for (flag, missing) in [
            (wgpu::DownlevelFlags::COMPUTE_SHADERS, "compute shaders"),
            (wgpu::DownlevelFlags::VERTEX_STORAGE, "storage buffers in vertex shaders"),
            (wgpu::DownlevelFlags::SHADER_F16_IN_F32, "half-float packing in shaders"),
            (wgpu::DownlevelFlags::FRAGMENT_STORAGE, "storage buffers in fragment shaders"),
        ] {
            if !has(flag) {
                return Err(GpuError::Unfit { adapter: info.name, missing: missing.to_owned() });
            }
        }
        let wanted = wgpu::Features::FLOAT32_BLENDABLE
            | wgpu::Features::FLOAT32_FILTERABLE
            | wgpu::Features::TIMESTAMP_QUERY
            | wgpu::Features::SHADER_INT64
            | wgpu::Features::SHADER_INT64_ATOMIC_MIN_MAX
            | wgpu::Features::SHADER_INT64_ATOMIC_ALL_OPS
            | ShaderFeature::wanted();
        // On cards it would move such buffers into slower memory.
        let wanted = match info.device_type {
            wgpu::DeviceType::Cpu => wanted | wgpu::Features::MAPPABLE_PRIMARY_BUFFERS,
            _ => wanted,
        };
        let features = adapter.features() & wanted;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("surfelshop"),
            required_features: features,
            required_limits: adapter.limits(),
            memory_hints: memory_hints(&info, small_blocks),
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                GpuError::Refused { adapter: info.name.clone(), reason: error.to_string() }
            })?;
        if info.backend == wgpu::Backend::Gl && !compiles_storage(&device) {
            let version = info.driver_info.split_whitespace().next().unwrap_or("unknown");
            let missing = format!(
                "storage buffers in its shading language (OpenGL 4.3 or ES 3.1; its driver offers {version})"
            );
            return Err(GpuError::Unfit { adapter: info.name, missing });
        }
        // Mistakes are caught by error scopes; what comes late is noted instead of ending the
        // program.
        device.on_uncaptured_error(Arc::new(|error| {
            tracing::error!("graphics device: {error}");
        }));
        let lost = Arc::new(OnceLock::new());
        let tell = lost.clone();
        device.set_device_lost_callback(move |reason, message| {
            let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
            let text = if message.is_empty() { format!("{reason:?}") } else { message };
            // Only the first reason is the cause.
            drop(tell.set(text));
        });
        let usages = FORMATS
            .map(|format| {
                let promised = format.guaranteed_format_features(features).allowed_usages;
                let here = adapter.get_texture_format_features(format).allowed_usages;
                // The no-op device names none and takes all.
                let is_noop = info.backend == wgpu::Backend::Noop;
                (format, if is_noop { promised } else { promised & here })
            })
            .into_iter()
            .collect();
        Ok(Self {
            lost,
            usages,
            transfers: TransferBuffers::default(),
            stages: Stages::default(),
            stores: storage_flags(adapter, features),
            dispatches_counted: has(wgpu::DownlevelFlags::INDIRECT_EXECUTION),
            counts_in_fragments: has(wgpu::DownlevelFlags::FRAGMENT_WRITABLE_STORAGE),
            blends_f32: features.contains(wgpu::Features::FLOAT32_BLENDABLE),
            times_passes: features.contains(wgpu::Features::TIMESTAMP_QUERY),
            maps_storage: features.contains(wgpu::Features::MAPPABLE_PRIMARY_BUFFERS),
            atomics: Atomics::of(features),
            device,
            queue,
            info,
        })
    }

    /// Why the device was lost, if it was: nothing can be drawn with it any more, only with a new
    /// one.
    #[must_use]
    pub fn lost(&self) -> Option<&str> {
        // Losses are told while the device is polled; one that fails to be polled is no news.
        drop(self.device.poll(wgpu::PollType::Poll));
        self.lost.get().map(String::as_str)
    }

    /// A buffer with these contents, zeros behind them where the size must be a multiple of four.
    /// On a device that is lost or out of memory it is not one, which using it reports.
    pub(crate) fn filled_buffer(
        &self,
        label: &str,
        contents: &[u8],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: (contents.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage,
            mapped_at_creation: !contents.is_empty(),
        });
        if !contents.is_empty() {
            // wgpu's own function for this panics where the device is lost.
            if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
                mapped.slice(..contents.len()).copy_from_slice(contents);
            }
            buffer.unmap();
        }
        buffer
    }

    /// What textures of this format may be used for.
    #[must_use]
    pub fn allowed_usages(&self, format: wgpu::TextureFormat) -> wgpu::TextureUsages {
        self.usages.get(&format).copied().unwrap_or(wgpu::TextureUsages::empty())
    }

    /// Whether passes can draw into textures of this format.
    #[must_use]
    pub fn draws(&self, format: wgpu::TextureFormat) -> bool {
        self.allowed_usages(format).contains(wgpu::TextureUsages::RENDER_ATTACHMENT)
    }

    /// Whether shaders can use textures of this format as storage in this way.
    pub(crate) fn stores(
        &self,
        format: wgpu::TextureFormat,
        access: wgpu::StorageTextureAccess,
    ) -> bool {
        use wgpu::TextureFormatFeatureFlags as Flags;
        let wanted = match access {
            wgpu::StorageTextureAccess::WriteOnly => Flags::STORAGE_WRITE_ONLY,
            wgpu::StorageTextureAccess::ReadOnly => Flags::STORAGE_READ_ONLY,
            wgpu::StorageTextureAccess::ReadWrite => Flags::STORAGE_READ_WRITE,
            wgpu::StorageTextureAccess::Atomic => Flags::STORAGE_ATOMIC,
        };
        self.stores.get(&format).is_some_and(|flags| flags.contains(wanted))
    }

    /// Whether shaders can store into all slices of a volume: through OpenGL, wgpu binds the first one
    /// alone.
    pub(crate) fn stores_into_volumes(&self) -> bool {
        self.info.backend != wgpu::Backend::Gl
    }

    /// Whether depth reaches the depth test as clip space has it. OpenGL maps [0, 1] to [-1, 1]
    /// and back on the way, which rounds away the small values of a reversed depth.
    #[must_use]
    pub fn keeps_reversed_depth(&self) -> bool {
        self.info.backend != wgpu::Backend::Gl
    }

    /// Whether compute passes may begin before what was drawn ahead of them is there, which OpenGL
    /// does not allow: seen with Mesa 22.3 on a busy machine.
    pub(crate) fn computes_early(&self) -> bool {
        self.is_software() && self.info.backend == wgpu::Backend::Gl
    }

    /// Whether it sorts: software OpenGL takes minutes to compile that.
    pub(crate) fn sorts(&self) -> bool {
        !self.computes_early()
            && self.device.limits().max_storage_buffers_per_shader_stage >= SORTED_BUFFERS
    }

    /// Whether it composes splats tile by tile, from lists that it sorts.
    pub(crate) fn lists_splats(&self) -> bool {
        self.sorts() && self.device.limits().max_storage_buffers_per_shader_stage >= LISTED_BUFFERS
    }

    /// Whether the adapter computes on the CPU.
    #[must_use]
    pub fn is_software(&self) -> bool {
        is_software(&self.info)
    }

    /// Adapter, interface and driver in a few words.
    #[must_use]
    pub fn describe(&self) -> String {
        let driver = [self.info.driver.as_str(), self.info.driver_info.as_str()];
        let driver: Vec<&str> = driver.into_iter().filter(|part| !part.is_empty()).collect();
        let backend = match self.info.backend {
            wgpu::Backend::Vulkan => "Vulkan",
            wgpu::Backend::Gl => "OpenGL",
            wgpu::Backend::Metal => "Metal",
            wgpu::Backend::Dx12 => "Direct3D 12",
            wgpu::Backend::BrowserWebGpu => "WebGPU",
            wgpu::Backend::Noop => "no-op",
        };
        if driver.is_empty() {
            format!("{} on {backend}", self.info.name)
        } else {
            format!("{} on {backend} ({})", self.info.name, driver.join(" "))
        }
    }
}

/// How device memory is taken. Of large blocks, which are quick on a card, nothing is let go while anything in them is in
/// use; those of a software driver are memory of the program.
fn memory_hints(info: &wgpu::AdapterInfo, small_blocks: bool) -> wgpu::MemoryHints {
    match info.device_type {
        wgpu::DeviceType::Cpu if small_blocks => wgpu::MemoryHints::Manual {
            suballocated_device_memory_block_size: SMALL_BLOCK..SMALL_BLOCK,
        },
        wgpu::DeviceType::Cpu => wgpu::MemoryHints::MemoryUsage,
        _ => wgpu::MemoryHints::Performance,
    }
}

/// Whether shaders of the device can do what those of the host do. Through OpenGL, extensions promise
/// it also where the shading language is too old for it: drivers that offer OpenGL 3.3 where wgpu asks
/// for at least that.
fn compiles_storage(device: &wgpu::Device) -> bool {
    const PROBE: &str = "@group(0) @binding(0) var<storage, read_write> words: array<u32>;\n\
        @compute @workgroup_size(1)\n\
        fn main(@builtin(global_invocation_id) id: vec3u) {\n\
            words[id.x] = u32(unpack2x16float(words[id.x]).x) + arrayLength(&words);\n\
        }\n";
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("probe"),
        source: wgpu::ShaderSource::Wgsl(PROBE.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("probe"),
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let refused = [validation, internal].map(|scope| pollster::block_on(scope.pop()).is_some());
    drop(pipeline);
    !refused.contains(&true)
}

/// How shaders may use textures of each format as storage, as wgpu judges it.
fn storage_flags(
    adapter: &wgpu::Adapter,
    features: wgpu::Features,
) -> HashMap<wgpu::TextureFormat, wgpu::TextureFormatFeatureFlags> {
    let promised = wgpu::DownlevelFlags::WEBGPU_TEXTURE_FORMAT_SUPPORT;
    let by_promise = adapter.get_downlevel_capabilities().flags.contains(promised);
    let flags_of = |format: wgpu::TextureFormat| match by_promise {
        true => format.guaranteed_format_features(features).flags,
        false => adapter.get_texture_format_features(format).flags,
    };
    FORMATS.into_iter().map(|format| (format, flags_of(format))).collect()
}
