//! Instances inside a library, called by its tables of functions.

use super::calls::{Calls, NamedFile, TileCall};
use super::clouds::{raw_cloud, raw_columns};
use super::fault::Fault;
use super::job::raw_job;
use super::outputs::Outputs;
use super::plugin::Tables;
use core::ffi::c_void;
use surfelshop_api::CloudView;
use surfelshop_api::abi::format_table::FormatTable;
use surfelshop_api::abi::table::{Bytes, RawCloud, RawColumn};
use surfelshop_api::format::{CloudSinkHost, CloudSourceHost};
use surfelshop_api::job::JobHost;

/// An instance inside a library; dropping it ends it there.
pub(super) struct Native {
    tables: Tables,
    pointer: *mut c_void,
}

// SAFETY: units are `Send`, so an instance may be used from another thread than it was made on.
unsafe impl Send for Native {}
// SAFETY: the only call on a shared instance is `tile`, and tracers are `Sync`.
unsafe impl Sync for Native {}

impl Native {
    /// One that `create` of these tables made.
    pub(super) fn new(tables: Tables, pointer: *mut c_void) -> Self {
        Self { tables, pointer }
    }

    /// The instance, for a call that uses it alone.
    pub(super) fn pointer(&mut self) -> *mut c_void {
        self.pointer
    }

    /// The functions of its package's formats.
    pub(super) fn formats(&self) -> Result<&'static FormatTable, Fault> {
        let lacks = || Fault::Misbehaved("it has no functions of formats".to_owned());
        self.tables.formats.ok_or_else(lacks)
    }
}

impl Calls for Native {
    fn minor(&self) -> u16 {
        self.tables.plugin.abi_minor
    }

    fn frame(&mut self, request: &[u8], outputs: &mut Outputs) -> Result<(), Fault> {
        // SAFETY: the instance is alive and used by this call alone; bytes and sink live for it.
        let status =
            unsafe { (self.tables.plugin.frame)(self.pointer, Bytes::of(request), outputs.sink()) };
        outputs.check(status)
    }

    fn tile(&self, call: TileCall<'_>, job: &dyn JobHost) -> Result<(), Fault> {
        let TileCall { request, scene, tile, pixels } = call;
        let columns: Vec<Vec<RawColumn>> = scene.clouds.iter().map(raw_columns).collect();
        let raw: Vec<RawCloud> = scene
            .clouds
            .iter()
            .zip(&columns)
            .map(|(cloud, columns)| raw_cloud(cloud, columns))
            .collect();
        let job = raw_job(&job);
        let mut outputs = Outputs::default();
        // SAFETY: the instance is alive and shared only by `tile` calls; everything lent lives
        // for the call, and the pixels are lent to it alone.
        let status = unsafe {
            (self.tables.plugin.tile)(
                self.pointer,
                Bytes::of(request),
                raw.as_ptr(),
                raw.len(),
                scene.texels.as_ptr(),
                scene.texels.len(),
                &raw const tile,
                pixels.as_mut_ptr(),
                pixels.len(),
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
    }

    fn run(
        &mut self,
        request: &[u8],
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let columns = raw_columns(cloud);
        let cloud = raw_cloud(cloud, &columns);
        let job = raw_job(&job);
        let mut outputs = Outputs::default();
        // SAFETY: the instance is alive and used by this call alone; everything lent lives for it.
        let status = unsafe {
            (self.tables.plugin.run)(
                self.pointer,
                Bytes::of(request),
                &raw const cloud,
                &raw const job,
                outputs.sink(),
            )
        };
        outputs.check(status)
    }

    fn read(
        &mut self,
        request: &[u8],
        file: NamedFile<'_>,
        clouds: &mut dyn CloudSinkHost,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        self.read_file(request, file, clouds, job)
    }

    fn write(
        &mut self,
        request: &[u8],
        clouds: &mut dyn CloudSourceHost,
        file: NamedFile<'_>,
        job: &dyn JobHost,
        outputs: &mut Outputs,
    ) -> Result<(), Fault> {
        self.write_file(request, clouds, file, job, outputs)
    }
}

impl Drop for Native {
    fn drop(&mut self) {
        let mut outputs = Outputs::default();
        // SAFETY: the pointer came from `create` and is not used after this. A failure to end is
        // contained by the plugin's shim and has no consequence here.
        unsafe { (self.tables.plugin.destroy)(self.pointer, outputs.sink()) };
    }
}
