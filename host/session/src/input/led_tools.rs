//! Tools that edits of pyramids lead along strokes: loaded when the first stroke needs them.

use crate::options::PluginFiles;
use crate::session;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
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
    registry: OnceLock<Result<Registry, String>>,
    found: Mutex<HashMap<String, Found>>,
}

impl LedTools {
    /// The tools of these plugins.
    #[must_use]
    pub fn new(plugins: &PluginFiles) -> Arc<dyn StrokeTools> {
        Arc::new(Self {
            plugins: plugins.clone(),
            registry: OnceLock::new(),
            found: Mutex::default(),
        })
    }

    fn found(&self, tool: &str) -> Found {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        found.entry(tool.to_owned()).or_insert_with(|| self.load(tool)).clone()
    }

    fn load(&self, tool: &str) -> Found {
        let search = || session::registry(&self.plugins).map_err(|error| format!("{error:#}"));
        let registry = self.registry.get_or_init(search).as_ref().map_err(Clone::clone)?;
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
