//! Tools that edits of pyramids lead along strokes: loaded when the first stroke needs them.

use crate::options::PluginFiles;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use surfelshop_api::params::Values;
use surfelshop_api::{Handling, UnitKind};
use surfelshop_cloud::selection::{NamedStroke, StrokeTools};
use surfelshop_cloud::{CloudPart, EditedCloud};
use surfelshop_runtime::plugins::{LoadedUnit, Registry};
use surfelshop_runtime::tools::{Ended, Running, ToolOptions};

/// How often a tool is asked whether it is late.
const TICK: Duration = Duration::from_millis(50);

/// A tool in memory, or why there is none.
type Found = Result<Arc<LoadedUnit>, String>;

/// The tools of the plugins that options name. Plugins are searched when the first stroke is done.
#[derive(Debug)]
pub struct LedTools {
    plugins: PluginFiles,
    /// Tools that were loaded.
    found: Mutex<HashMap<String, Arc<LoadedUnit>>>,
}

impl LedTools {
    /// The tools of these plugins.
    #[must_use]
    pub fn new(plugins: &PluginFiles) -> Self {
        Self { plugins: plugins.clone(), found: Mutex::default() }
    }

    fn found(&self, tool: &str) -> Found {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = found.get(tool) {
            return Ok(Arc::clone(known));
        }
        // One that cannot be loaded may be by the next stroke.
        let unit = self.load(tool)?;
        found.insert(tool.to_owned(), Arc::clone(&unit));
        Ok(unit)
    }

    fn load(&self, tool: &str) -> Found {
        // Other plugins that are refused do not matter here.
        let search = self.plugins.search().map_err(|error| format!("{error:#}"))?;
        let registry = Registry::scan(&search);
        let reference = registry.find(UnitKind::Tool, tool).map_err(|error| error.to_string())?;
        let unit = reference.load(&self.plugins.patience()).map_err(|error| error.to_string())?;
        match unit.description.handling {
            Handling::Cloud => Err("expected a tool that is led by hand".to_owned()),
            _ => Ok(Arc::new(unit)),
        }
    }

    fn with_values(&self, led: &NamedStroke) -> Result<(Arc<LoadedUnit>, Values), String> {
        let unit = self.found(&led.tool)?;
        let values = led.fitted(&unit.description.params)?;
        Ok((unit, values))
    }
}

impl StrokeTools for LedTools {
    fn check(&self, led: &NamedStroke) -> Result<(), String> {
        self.with_values(led).map(drop)
    }

    fn lead(&self, led: &NamedStroke, part: CloudPart) -> Result<Option<EditedCloud>, String> {
        let (unit, values) = self.with_values(led)?;
        let options = ToolOptions { patience: self.plugins.patience(), ..ToolOptions::default() };
        let stroke = Some(led.stroke.clone());
        let mut running = Running::start_on(&unit, &values, part, stroke, &options)
            .map_err(|fault| fault.to_string())?;
        let ended = loop {
            if let Some(ended) = running.wait(TICK) {
                break ended;
            }
        };
        match ended {
            Ended::Done(done) => Ok(done.edited),
            Ended::Cancelled => Err("it was cancelled".to_owned()),
            Ended::Failed(fault) => Err(fault.to_string()),
            Ended::LeftBehind(limit) => Err(format!(
                "it did not stop within {} s, and was left behind",
                limit.as_secs_f64()
            )),
        }
    }
}
