//! What the user chose for the window itself, apart from scenes: one file of the user.

mod device;
mod drawing_page;
mod file;
mod plugins_page;
mod shortcuts_page;
mod units;
pub(crate) mod window;
mod window_state;

pub(crate) use device::DevicePreferences;
pub(crate) use units::Unit;
pub(crate) use window_state::{Page, SettingsWindow};

pub(crate) use file::PreferenceFile;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::scene::Table;
use surfelshop_session::input::budget;
use surfelshop_session::options::values;

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ThemeChoice {
    /// As the desktop.
    #[default]
    System,
    Dark,
    Light,
}

/// How a drag turns the camera about what it looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Orbit {
    /// About the axis that points upwards, which stays upright.
    #[default]
    Turntable,
    /// About any axis.
    Trackball,
}

/// Widths of the outliner and of the properties at first, points.
const OUTLINER: f32 = 218.0;
const PROPERTIES: f32 = 336.0;

/// Factors on the size of everything.
pub(crate) const UI_SCALES: [f32; 7] = [0.75, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0];

/// The choices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct Preferences {
    pub(crate) theme: ThemeChoice,
    /// Factor on the size of everything, over that of the screen.
    pub(crate) ui_scale: f32,
    /// Cameras jump, and nothing fades.
    pub(crate) reduced_motion: bool,
    /// Whether the axes, the grid on the ground and the scale bar are shown over pictures.
    pub(crate) axes: bool,
    pub(crate) grid: bool,
    pub(crate) scale_bar: bool,
    /// Whether the bar of icons, the outliner at the left and the properties at the right are shown.
    pub(crate) toolbar: bool,
    pub(crate) panels: bool,
    pub(crate) properties: bool,
    /// Widths of the outliner and of the properties, points.
    pub(crate) outliner_width: f32,
    pub(crate) properties_width: f32,
    /// How a drag turns the camera from outside.
    pub(crate) orbit: Orbit,
    /// What a unit of files is that do not say it.
    pub(crate) unit: Unit,
    /// What draws, from the next start on.
    pub(crate) device: DevicePreferences,
    /// Memory that open pyramids take at most, as on the command line; empty for half of what is free.
    pub(crate) memory: String,
    /// What points upwards in files with these endings that do not say it themselves.
    pub(crate) up: BTreeMap<String, Axis>,
    /// The shortcuts of commands by their ids, in place of the usual ones.
    pub(crate) shortcuts: BTreeMap<String, Vec<String>>,
    /// Keys of later versions.
    #[serde(flatten)]
    pub(crate) unknown: Table,
}

impl Default for Preferences {
    fn default() -> Self {
        Self {
            theme: ThemeChoice::default(),
            ui_scale: 1.0,
            reduced_motion: false,
            axes: true,
            grid: true,
            scale_bar: true,
            toolbar: true,
            panels: true,
            properties: true,
            outliner_width: OUTLINER,
            properties_width: PROPERTIES,
            orbit: Orbit::default(),
            unit: Unit::default(),
            device: DevicePreferences::default(),
            memory: String::new(),
            up: BTreeMap::new(),
            shortcuts: BTreeMap::new(),
            unknown: Table::new(),
        }
    }
}

impl Preferences {
    /// Lets open pyramids take as much memory as was chosen, where nothing was typed; a line where that is no size.
    pub(crate) fn use_memory(&self) -> Option<String> {
        if self.memory.trim().is_empty() {
            return None;
        }
        match values::memory(self.memory.trim()) {
            Ok(bytes) => {
                budget::use_memory(Some(bytes));
                None
            }
            Err(reason) => {
                Some(format!("settings.toml: memory: {reason}; half of what is free is used"))
            }
        }
    }

    /// The next larger or smaller factor on the size of everything.
    pub(crate) fn scaled(&self, larger: bool) -> f32 {
        let is_next = |scale: &f32| match larger {
            true => *scale > self.ui_scale + 1e-3,
            false => *scale < self.ui_scale - 1e-3,
        };
        let mut scales = UI_SCALES.into_iter();
        let next = if larger { scales.find(is_next) } else { scales.rev().find(is_next) };
        next.unwrap_or(self.ui_scale)
    }
}
