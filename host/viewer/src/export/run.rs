//! An export proceeds: pictures are requested, and handed to the thread that writes them.

use super::job::{ExportJob, ExportPicture};
use crate::render_thread::{EXPORT_SLOT, RenderedView, ViewRequest};
use crate::window::Window;
use eframe::egui::Context;

/// Most pictures that are drawn and not yet written: a slow disk must not fill the memory.
const MOST_AHEAD: usize = 3;

/// Starts an export.
pub(super) fn start(window: &mut Window, pictures: Vec<ExportPicture>, ctx: &Context) {
    match ExportJob::start(pictures, ctx) {
        Ok(job) => window.panels.export_job = Some(job),
        Err(error) => window.messages.warn(format!("no picture can be written: {error}")),
    }
}

/// Takes in a picture. One of a cancelled export comes late and is dropped.
pub(crate) fn take_reply(window: &mut Window, serial: u64, outcome: Result<RenderedView, String>) {
    let job = window.panels.export_job.as_mut();
    let Some(job) = job.filter(|job| job.pending == Some(serial)) else { return };
    job.pending = None;
    let Some(picture) = job.pictures.get(job.n_drawn) else { return };
    match outcome {
        Ok(rendered) => {
            // The thread lives as long as the job.
            drop(job.drawn.send((picture.clone(), rendered)));
            job.n_drawn += 1;
        }
        Err(reason) => {
            let (n, path) = (job.n_drawn, picture.path.display());
            window.messages.warn(format!("{path}: {reason}; {n} pictures were made"));
            end(window);
        }
    }
}

/// Ends the export and releases its renderer.
pub(super) fn end(window: &mut Window) {
    window.panels.export_job = None;
    window.render.thread.release(EXPORT_SLOT);
}

/// Requests the next picture, and reports the end of the export.
pub(crate) fn advance(window: &mut Window) {
    let Some(job) = &mut window.panels.export_job else { return };
    for result in job.written.try_iter().collect::<Vec<_>>() {
        if let Err(error) = result {
            let n = job.n_written;
            window.messages.warn(format!("{error:#}; {n} pictures are written"));
            end(window);
            return;
        }
        job.n_written += 1;
    }
    if job.n_written == job.pictures.len() {
        let last = job.pictures.last().map(|picture| picture.path.display().to_string());
        let last = last.unwrap_or_default();
        window.messages.report(match job.n_written {
            1 => format!("wrote {last}"),
            n => format!("wrote {n} pictures, the last is {last}"),
        });
        end(window);
        return;
    }
    let ahead = job.n_requested - job.n_written;
    if job.pending.is_none()
        && ahead < MOST_AHEAD
        && let Some(picture) = job.pictures.get(job.n_requested)
    {
        let request = picture.request.clone();
        job.n_requested += 1;
        let serial = window.next_serial();
        window.render.thread.request(EXPORT_SLOT, ViewRequest { serial, ..request });
        if let Some(job) = &mut window.panels.export_job {
            job.pending = Some(serial);
        }
    }
}
