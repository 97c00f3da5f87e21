//! What runs inside a plugin: decodes requests, calls the author's code, catches its panics and
//! writes the results to the host's sink.

pub use crate::abi::description::Description;
use crate::abi::needed_minor::check_minor;
use crate::abi::plugin_job::RemoteJob;
use crate::abi::table::{Bytes, MAGIC, PluginTable, RawCloud, RawJob, Sink, channel, status};
use crate::columns::{CloudView, ColumnView, Element, Values as ColumnValues};
use crate::error::{Error, Result};
use crate::format::{CloudSink, CloudSource, FileSink, FileSource, Format};
use crate::frame::{Frame, FrameRequest, HostInfo, InMotion, OnDevice};
use crate::graph::Graph;
use crate::job::Job;
use crate::manifest::{ABI_MAJOR, ABI_MINOR};
use crate::need::Need;
use crate::params::{ParamDecl, ParamSet, Values};
use crate::scene::object::ObjectFrame;
use crate::stroke::{Handling, StrokeCall};
use crate::tool::{Tile, Traced};
use crate::unit::{Limit, LimitInfo, Renderer, Tool, Tracer};
use crate::unit_info::{UnitInfo, UnitKind};
use core::ffi::c_void;
use glam::{DQuat, DVec3};
use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Once;

/// A description with limits as a unit's type states them.
fn description(params: Vec<ParamDecl>, limits: &[LimitInfo]) -> Description {
    let limits = limits.iter().map(Limit::from).collect();
    Description { params, limits, ..Description::default() }
}

/// One exported unit: how to describe and make it.
pub struct Unit {
    /// What the unit is.
    pub kind: UnitKind,
    /// How it is called.
    pub info: UnitInfo,
    describe: fn() -> Description,
    create: fn(&HostInfo) -> Result<Box<dyn Instance>>,
}

/// A plugin's units, implemented by [`export_plugin!`](crate::export_plugin!).
pub trait Package {
    /// The units in the order of the manifest.
    const UNITS: &'static [Unit];
    /// The oldest minor version of the ABI that will do. ABI 3.10.
    const MINOR: u16 = ABI_MINOR;
}

/// What a host holds of a unit, behind its `void` pointer.
pub(super) struct Created {
    pub(super) unit: Box<dyn Instance>,
    /// [`Package::MINOR`].
    pub(super) minor: u16,
}

/// An instance of a unit.
pub(super) trait Instance {
    fn frame(&mut self, _request: FrameRequest, _graph: Graph) -> Result<Graph> {
        Err(Error::new("this unit is not a renderer"))
    }
    fn tile(
        &self,
        _request: FrameRequest,
        _scene: &Traced<'_>,
        _tile: Tile,
        _pixels: &mut [f32],
        _job: &Job<'_>,
    ) -> Result<()> {
        Err(Error::new("this unit is not a tracer"))
    }
    /// `call` is msgpack of values, or of a [`StrokeCall`] where the tool is handled.
    fn run(&mut self, _call: &[u8], _cloud: &CloudView<'_>, _job: Job<'_>) -> Result<()> {
        Err(Error::new("this unit is not a tool"))
    }
    fn read(
        &mut self,
        _values: &Values,
        _file: &FileSource,
        _clouds: &mut CloudSink<'_>,
        _job: &Job<'_>,
    ) -> Result<()> {
        Err(Error::new("this unit is not a format"))
    }
    fn write(
        &mut self,
        _values: &Values,
        _clouds: &mut CloudSource<'_>,
        _file: &FileSink,
        _job: &Job<'_>,
    ) -> Result<Vec<String>> {
        Err(Error::new("this unit is not a format"))
    }
}

struct RendererInstance<R>(R);
struct TracerInstance<T>(T);
struct ToolInstance<T>(T);
struct FormatInstance<F>(F);

impl<R: Renderer> Instance for RendererInstance<R> {
    fn frame(&mut self, request: FrameRequest, mut graph: Graph) -> Result<Graph> {
        self.0.frame(&Frame::from(request), &mut graph)?;
        Ok(graph)
    }
}

impl<T: Tracer> Instance for TracerInstance<T> {
    fn tile(
        &self,
        request: FrameRequest,
        scene: &Traced<'_>,
        tile: Tile,
        pixels: &mut [f32],
        job: &Job<'_>,
    ) -> Result<()> {
        self.0.tile(&Frame::from(request), scene, tile, pixels, job)
    }
}

impl<T: Tool> Instance for ToolInstance<T> {
    fn run(&mut self, call: &[u8], cloud: &CloudView<'_>, job: Job<'_>) -> Result<()> {
        if T::HANDLING == Handling::Cloud {
            let values: Values = rmp_serde::from_slice(call)?;
            return self.0.run(cloud, &T::Params::from_values(&values), &job);
        }
        let StrokeCall { values, stroke } = rmp_serde::from_slice(call)?;
        self.0.run(cloud, &T::Params::from_values(&values), &job.with_stroke(&stroke))
    }
}

impl<F: Format> Instance for FormatInstance<F> {
    fn read(
        &mut self,
        values: &Values,
        file: &FileSource,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        self.0.read(file, &F::Params::from_values(values), clouds, job)
    }

    fn write(
        &mut self,
        values: &Values,
        clouds: &mut CloudSource<'_>,
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        self.0.write(clouds, &F::Params::from_values(values), file, job)
    }
}

impl Unit {
    /// Registers a renderer.
    #[must_use]
    pub const fn renderer<R: Renderer>() -> Self {
        Self {
            kind: UnitKind::Renderer,
            info: R::INFO,
            describe: || Description {
                needs: R::NEEDS.iter().map(Need::from).collect(),
                ..description(R::Params::declare(), R::LIMITS)
            },
            create: |host| Ok(Box::new(RendererInstance(R::new(host)?))),
        }
    }

    /// Registers a tracer.
    #[must_use]
    pub const fn tracer<T: Tracer>() -> Self {
        Self {
            kind: UnitKind::Tracer,
            info: T::INFO,
            describe: || description(T::Params::declare(), T::LIMITS),
            create: |host| Ok(Box::new(TracerInstance(T::new(host)?))),
        }
    }

    /// Registers a tool.
    #[must_use]
    pub const fn tool<T: Tool>() -> Self {
        Self {
            kind: UnitKind::Tool,
            info: T::INFO,
            describe: || Description {
                scope: T::SCOPE,
                handling: T::HANDLING,
                ..description(T::Params::declare(), T::LIMITS)
            },
            create: |host| Ok(Box::new(ToolInstance(T::new(host)?))),
        }
    }

    /// Registers a format.
    #[must_use]
    pub const fn format<F: Format>() -> Self {
        Self {
            kind: UnitKind::Format,
            info: F::INFO,
            describe: || description(F::Params::declare(), F::LIMITS),
            create: |host| Ok(Box::new(FormatInstance(F::new(host)?))),
        }
    }
}

/// The table of a package: the same whether it is exported from a library or registered in a
/// program's own code.
#[must_use]
pub const fn table<P: Package>() -> PluginTable {
    PluginTable {
        magic: MAGIC,
        size: size_of::<PluginTable>() as u32,
        abi_major: ABI_MAJOR,
        abi_minor: P::MINOR,
        describe: describe::<P>,
        create: create::<P>,
        destroy,
        frame,
        tile,
        run,
    }
}

fn unit<P: Package>(index: u32) -> Result<&'static Unit> {
    P::UNITS.get(index as usize).ok_or_else(|| {
        Error::new(format!("unit {index} was asked for, the plugin has {}", P::UNITS.len()))
    })
}

unsafe extern "C" fn describe<P: Package>(index: u32, sink: Sink) -> i32 {
    guarded(sink, || {
        let description = (unit::<P>(index)?.describe)();
        write(sink, channel::DESCRIPTION, &rmp_serde::to_vec_named(&description)?);
        Ok(())
    })
}

unsafe extern "C" fn create<P: Package>(
    index: u32,
    host: Bytes,
    out: *mut *mut c_void,
    sink: Sink,
) -> i32 {
    guarded(sink, || {
        // SAFETY: the host keeps the bytes alive and unchanged for the duration of the call.
        let host: HostInfo = rmp_serde::from_slice(unsafe { host.as_slice() })?;
        let unit = (unit::<P>(index)?.create)(&host)?;
        let created = Box::new(Created { unit, minor: P::MINOR });
        // SAFETY: the host passes a valid place for one pointer.
        unsafe { *out = Box::into_raw(created).cast() };
        Ok(())
    })
}

unsafe extern "C" fn destroy(instance: *mut c_void, sink: Sink) -> i32 {
    guarded(sink, || {
        // SAFETY: the host passes a pointer that `create` gave out and passes it here only once.
        drop(unsafe { Box::from_raw(instance.cast::<Created>()) });
        Ok(())
    })
}

unsafe extern "C" fn frame(instance: *mut c_void, request: Bytes, sink: Sink) -> i32 {
    guarded(sink, || {
        // SAFETY: the host keeps the bytes alive and unchanged for the duration of the call.
        let bytes = unsafe { request.as_slice() };
        // Each reads its own fields, and passes over those of the others.
        let request: FrameRequest = rmp_serde::from_slice(bytes)?;
        let moves: InMotion = rmp_serde::from_slice(bytes)?;
        let on_device: OnDevice = rmp_serde::from_slice(bytes)?;
        let graph = Graph::drawing_one_of(moves.stride).with_on_device(on_device.resident);
        // SAFETY: the pointer comes from `create`; the host makes one such call at a time.
        let created = unsafe { &mut *instance.cast::<Created>() };
        let graph = created.unit.frame(request, graph)?;
        check_minor(graph.structure(), created.minor)?;
        write(sink, channel::STRUCTURE, &rmp_serde::to_vec_named(graph.structure())?);
        write(sink, channel::DATA, graph.data());
        Ok(())
    })
}

unsafe extern "C" fn tile(
    instance: *const c_void,
    request: Bytes,
    clouds: *const RawCloud,
    n_clouds: usize,
    texels: *const [f32; 3],
    n_texels: usize,
    tile: *const Tile,
    pixels: *mut f32,
    n_floats: usize,
    job: *const RawJob,
    sink: Sink,
) -> i32 {
    guarded(sink, || {
        // SAFETY: the host keeps the bytes alive and unchanged for the duration of the call.
        let request: FrameRequest = rmp_serde::from_slice(unsafe { request.as_slice() })?;
        // SAFETY: the host passes `n_clouds` valid clouds.
        let raw_clouds = unsafe { std::slice::from_raw_parts(clouds, n_clouds) };
        let clouds = raw_clouds
            .iter()
            // SAFETY: the host keeps the columns alive and unchanged for the duration of the call.
            .map(|raw| unsafe { cloud_view(raw) })
            .collect::<Result<Vec<_>>>()?;
        let texels = match n_texels {
            0 => &[],
            // SAFETY: the host passes `n_texels` texels, alive for the duration of the call.
            n => unsafe { std::slice::from_raw_parts(texels, n) },
        };
        // SAFETY: the host lends `n_floats` initialised floats to this call alone.
        let pixels = unsafe { std::slice::from_raw_parts_mut(pixels, n_floats) };
        // SAFETY: the pointer comes from `create`; tracers are `Sync`, so calls may overlap.
        let created = unsafe { &*instance.cast::<Created>() };
        // SAFETY: the host passes a valid job and a valid tile for the duration of the call.
        let (job, tile) = unsafe { (*job, *tile) };
        let scene = Traced { clouds: &clouds, texels };
        let remote = RemoteJob { raw: job, minor: created.minor };
        created.unit.tile(request, &scene, tile, pixels, &Job::new(&remote))
    })
}

unsafe extern "C" fn run(
    instance: *mut c_void,
    values: Bytes,
    cloud: *const RawCloud,
    job: *const RawJob,
    sink: Sink,
) -> i32 {
    guarded(sink, || {
        // SAFETY: the host keeps the bytes alive and unchanged for the duration of the call.
        let call = unsafe { values.as_slice() };
        // SAFETY: the host passes a valid cloud whose columns live for the duration of the call.
        let cloud = unsafe { cloud_view(&*cloud) }?;
        // SAFETY: the pointer comes from `create`; the host makes one such call at a time.
        let created = unsafe { &mut *instance.cast::<Created>() };
        // SAFETY: the host passes a valid job for the duration of the call.
        let remote = RemoteJob { raw: unsafe { *job }, minor: created.minor };
        created.unit.run(call, &cloud, Job::new(&remote))
    })
}

/// # Safety
/// The cloud's columns are alive and unchanged for `'a`.
pub(super) unsafe fn cloud_view<'a>(raw: &RawCloud) -> Result<CloudView<'a>> {
    let mut columns = Vec::with_capacity(raw.n_columns);
    for i in 0..raw.n_columns {
        // SAFETY: the host passes `n_columns` valid columns.
        let column = unsafe { *raw.columns.add(i) };
        // SAFETY: the name lives as long as the column.
        let name = std::str::from_utf8(unsafe { column.name.as_slice() })?;
        let Some(element) = Element::from_code(column.element) else {
            continue; // A type of a newer host; the column is not visible here.
        };
        macro_rules! typed {
            ($variant:ident) => {{
                let values = if column.len == 0 {
                    &[][..]
                } else {
                    // SAFETY: the host passes `len` aligned elements of this type.
                    unsafe { std::slice::from_raw_parts(column.values.cast(), column.len) }
                };
                ColumnValues::$variant(values)
            }};
        }
        let values = match element {
            Element::I8 => typed!(I8),
            Element::U8 => typed!(U8),
            Element::I16 => typed!(I16),
            Element::U16 => typed!(U16),
            Element::I32 => typed!(I32),
            Element::U32 => typed!(U32),
            Element::F32 => typed!(F32),
            Element::F64 => typed!(F64),
        };
        let (components, generation) = (column.components, column.generation);
        columns.push(ColumnView { name, components, generation, values });
    }
    let faces = match raw.n_faces {
        0 => &[],
        // SAFETY: the host passes `n_faces` triangles, alive as long as the columns.
        n => unsafe { std::slice::from_raw_parts(raw.faces, n) },
    };
    let [x, y, z, size, qx, qy, qz, qw] = raw.object;
    let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
    let object = ObjectFrame { center: DVec3::new(x, y, z), size, rotation };
    Ok(CloudView { origin: raw.origin.into(), len: raw.len, columns, faces, object })
}

pub(super) fn write(sink: Sink, channel: u32, contents: &[u8]) {
    // SAFETY: the host's function takes its own context and copies the bytes.
    unsafe { (sink.write)(sink.context, channel, Bytes::of(contents)) };
}

thread_local! {
    static INSIDE: Cell<bool> = const { Cell::new(false) };
    static PANICKED_AT: RefCell<String> = const { RefCell::new(String::new()) };
}

/// What a panic left behind: its payload and where it was.
pub(super) struct Panicked {
    payload: Box<dyn Any + Send>,
    place: String,
}

impl Panicked {
    /// Goes on with the panic on this thread, inside the author's code.
    pub(super) fn resume(self) -> ! {
        PANICKED_AT.set(self.place);
        resume_unwind(self.payload)
    }
}

/// Runs a part of the author's code on a thread of the host.
pub(super) fn aside(work: impl FnOnce()) -> Result<(), Panicked> {
    let was_inside = INSIDE.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    INSIDE.set(was_inside);
    result.map_err(|payload| Panicked { payload, place: PANICKED_AT.take() })
}

/// Runs the author's code; an error or a panic becomes a status and a line on the error channel.
pub(super) fn guarded(sink: Sink, work: impl FnOnce() -> Result<()>) -> i32 {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        // The message travels to the host instead of being printed by the plugin's own copy of
        // the standard library; panics outside the boundary go on to the previous hook.
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if INSIDE.get() {
                #[cfg(target_family = "wasm")]
                crate::abi::last_words::write_panic(info);
                let place = info.location().map(|l| format!(" at {}:{}", l.file(), l.line()));
                PANICKED_AT.set(place.unwrap_or_default());
            } else {
                previous(info);
            }
        }));
    });
    #[cfg(target_family = "wasm")]
    crate::abi::last_words::go_to(sink);
    let was_inside = INSIDE.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    INSIDE.set(was_inside);
    match result {
        Ok(Ok(())) => status::OK,
        Ok(Err(error)) => {
            write(sink, channel::ERROR, error.message().as_bytes());
            status::ERROR
        }
        Err(payload) => {
            let text = payload
                .downcast_ref::<&str>()
                .map(|text| (*text).to_owned())
                .or_else(|| payload.downcast_ref::<String>().cloned())
                .unwrap_or_else(|| "a value that is not text".to_owned());
            let message = format!("panicked{}: {text}", PANICKED_AT.take());
            write(sink, channel::ERROR, message.as_bytes());
            // A payload may panic when dropped; that panic ends here too, as silently.
            INSIDE.set(true);
            if let Err(second) = catch_unwind(AssertUnwindSafe(|| drop(payload))) {
                // A second panic's payload is left alone: dropping it could panic again.
                let _kept = std::mem::ManuallyDrop::new(second);
            }
            INSIDE.set(was_inside);
            status::PANIC
        }
    }
}
