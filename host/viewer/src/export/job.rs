//! A running export: pictures in the order of drawing, and the thread that writes them.

use crate::render_thread::{RenderedView, ViewRequest};
use anyhow::Context as _;
use eframe::egui::Context;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use surfelshop_api::graph::Output;
use surfelshop_image::{exr, png};
use surfelshop_session::options::values::Format;
use surfelshop_session::output::files;
use surfelshop_session::output::overlay::Overlay;

/// A picture and its file.
#[derive(Clone)]
pub(super) struct ExportPicture {
    pub(super) request: ViewRequest,
    pub(super) path: PathBuf,
    pub(super) format: Format,
    /// What is drawn over it.
    pub(super) overlay: Overlay,
}

/// A running export.
pub(crate) struct ExportJob {
    pub(super) pictures: Vec<ExportPicture>,
    pub(super) n_requested: usize,
    pub(super) n_drawn: usize,
    pub(super) n_written: usize,
    /// The number of the pending request.
    pub(super) pending: Option<u64>,
    pub(super) drawn: Sender<(ExportPicture, RenderedView)>,
    pub(super) written: Receiver<anyhow::Result<()>>,
}

impl ExportJob {
    /// Starts the thread that writes.
    pub(super) fn start(pictures: Vec<ExportPicture>, ctx: &Context) -> std::io::Result<Self> {
        let (drawn, to_write) = channel::<(ExportPicture, RenderedView)>();
        let (report, written) = channel();
        let ctx = ctx.clone();
        std::thread::Builder::new().name("pictures".to_owned()).spawn(move || {
            // Ends with the job, after the pictures that are drawn already.
            for (picture, rendered) in to_write {
                drop(report.send(write(&picture, rendered)));
                ctx.request_repaint();
            }
        })?;
        let (n_requested, n_drawn, n_written, pending) = (0, 0, 0, None);
        Ok(Self { pictures, n_requested, n_drawn, n_written, pending, drawn, written })
    }

    /// The written share of the pictures.
    pub(super) fn fraction(&self) -> f32 {
        self.n_written as f32 / self.pictures.len().max(1) as f32
    }
}

fn write(picture: &ExportPicture, rendered: RenderedView) -> anyhow::Result<()> {
    let path = &picture.path;
    let bytes = match picture.format {
        Format::Png => {
            let mut visible = rendered.visible();
            picture.overlay.draw(&mut visible);
            png::encode(&visible, png::Bits::Eight)
        }
        Format::Exr => {
            let depth = rendered.depth.map(|depth| (Output::Depth, depth));
            let color = (Output::Color, rendered.color);
            let layers: Vec<_> = [color].into_iter().chain(depth).collect();
            exr::encode(&layers.iter().collect::<Vec<_>>())
        }
    };
    let bytes = bytes.with_context(|| format!("{}: cannot be encoded", path.display()))?;
    files::write_whole(path, &bytes)
}
