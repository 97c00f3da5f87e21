//! What a call lends to code that does not run in this program's memory, by bytes: what it asks for is answered here,
//! whether it asks from a sandbox or from a process of its own.

use super::lent_sink::LentSink;
use super::outputs::Outputs;
use surfelshop_api::CloudView;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::format::{CloudSourceHost, FileHost};
use surfelshop_api::job::JobHost;
use surfelshop_api::tool::EditHeader;

/// What a call lends. Bytes are the plugin's and may be any; lines of errors go back to it.
pub(crate) struct Lent<'a> {
    pub(crate) outputs: &'a mut Outputs,
    pub(crate) job: Option<&'a dyn JobHost>,
    pub(crate) file: Option<&'a dyn FileHost>,
    pub(crate) clouds: Option<LentSink<'a>>,
    pub(crate) source: Option<&'a mut dyn CloudSourceHost>,
}

/// What was lent, or the line that it was not.
fn lent<T>(lent: Option<T>) -> Result<T, String> {
    lent.ok_or_else(|| "this call lends no such thing".to_owned())
}

fn line(error: impl std::fmt::Display) -> String {
    error.to_string()
}

impl<'a> Lent<'a> {
    /// A call that lends a sink alone.
    pub(crate) fn of(outputs: &'a mut Outputs) -> Self {
        Self { outputs, job: None, file: None, clouds: None, source: None }
    }

    pub(crate) fn cancelled(&self) -> bool {
        self.job.is_some_and(JobHost::cancelled)
    }

    pub(crate) fn progress(&self, fraction: f64, message: &[u8]) {
        if let Some(job) = self.job {
            job.progress(fraction, &String::from_utf8_lossy(message));
        }
    }

    pub(crate) fn stage(&self, header: &[u8], values: &[&[u8]]) -> Result<(), String> {
        let header: EditHeader = rmp_serde::from_slice(header)
            .map_err(|error| surfelshop_api::Error::from(error).message().to_owned())?;
        lent(self.job)?.stage(&header, values).map_err(|error| error.message().to_owned())
    }

    pub(crate) fn compute(
        &self,
        structure: &[u8],
        data: &[u8],
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, String> {
        let graph = EncodedGraph { structure: structure.to_vec(), data: data.to_vec() };
        let computed = lent(self.job)?.compute(&graph, buffers);
        computed.map_err(|error| error.message().to_owned())
    }

    pub(crate) fn length(&self) -> u64 {
        self.file.map_or(0, FileHost::length)
    }

    pub(crate) fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<usize, String> {
        match buffer.is_empty() {
            true => Ok(0),
            false => lent(self.file)?.read_at(offset, buffer).map_err(line),
        }
    }

    pub(crate) fn write_at(&self, offset: u64, bytes: &[u8]) -> Result<(), String> {
        lent(self.file)?.write_at(offset, bytes).map_err(line)
    }

    pub(crate) fn begin(&mut self, header: &[u8]) -> Result<bool, String> {
        lent(self.clouds.as_mut())?.begin(header)
    }

    pub(crate) fn batch(&mut self, columns: &[&[u8]]) -> Result<(), String> {
        lent(self.clouds.as_mut())?.batch(columns)
    }

    pub(crate) fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<(), String> {
        lent(self.clouds.as_mut())?.faces(triangles)
    }

    pub(crate) fn warn(&mut self, line: &[u8]) {
        if let Some(clouds) = &mut self.clouds {
            clouds.warn(line);
        }
    }

    pub(crate) fn next_cloud(&mut self) -> Result<Option<Vec<u8>>, String> {
        match lent(self.source.as_mut())?.next_cloud().map_err(line)? {
            Some(header) => rmp_serde::to_vec_named(&header).map(Some).map_err(line),
            None => Ok(None),
        }
    }

    pub(crate) fn next_batch(&mut self) -> Result<Option<CloudView<'_>>, String> {
        match &mut self.source {
            Some(source) => source.next_batch().map_err(line),
            None => lent(None),
        }
    }
}
