//! A table sink that a format's thread and its caller share.

use crate::formats::plugins::SharedSink;
use crate::formats::table_sink::TableSink;
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{CloudHeader, CloudSinkHost};

/// A table sink that is lent to a format and taken back.
pub(crate) struct LentTable(Arc<Mutex<TableSink>>);

impl LentTable {
    pub(crate) fn new(sink: TableSink) -> Self {
        Self(Arc::new(Mutex::new(sink)))
    }

    pub(crate) fn shared(&self) -> SharedSink {
        Arc::new(Mutex::new(SinkOf(Arc::clone(&self.0))))
    }

    /// What came into it. A format that goes on for some reason is refused from now on.
    pub(crate) fn take(self) -> TableSink {
        let mut sink = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = std::mem::take(&mut *sink);
        sink.close();
        taken
    }
}

/// Hands everything on to a shared table.
struct SinkOf(Arc<Mutex<TableSink>>);

impl SinkOf {
    fn table(&self) -> std::sync::MutexGuard<'_, TableSink> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl CloudSinkHost for SinkOf {
    fn begin(&mut self, header: &CloudHeader) -> surfelshop_api::Result<bool> {
        self.table().begin(header)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> surfelshop_api::Result<()> {
        self.table().batch(values)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> surfelshop_api::Result<()> {
        self.table().faces(triangles)
    }

    fn warn(&mut self, line: &str) {
        self.table().warn(line);
    }
}
