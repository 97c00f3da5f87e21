//! The command-line arguments of the window.

use clap::Args;
use std::path::PathBuf;
use surfelshop_session::options::colors::ColorArguments;
use surfelshop_session::options::{DeviceArguments, PluginFiles, UpAxis, values};

/// Without a command: the window.
#[derive(Clone, Debug, Args)]
pub struct ViewerArguments {
    /// Clouds to look at in a window; without one it shows its start page.
    #[arg(value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The axis that points upwards; scans often have z, what a depth camera took has -y.
    #[arg(long, value_enum, value_name = "AXIS", default_value_t, allow_hyphen_values = true)]
    pub up: UpAxis,
    /// Memory that an open pyramid takes at most, such as 500MB or 4GB [default: half of what is free].
    #[arg(long, value_name = "SIZE", value_parser = values::memory)]
    pub memory: Option<u64>,
    /// Read files whose points lie in an octree (COPC, Potree) in place, node by node, and never as a whole. Without it
    /// that is done where memory would not hold them.
    #[arg(long)]
    pub in_place: bool,
    /// What colours surfels, and which are shown.
    #[command(flatten)]
    pub colors: ColorArguments,
    /// Plugins beside the installed ones.
    #[command(flatten)]
    pub plugins: PluginFiles,
    /// The graphics device.
    #[command(flatten)]
    pub device: DeviceArguments,
}
