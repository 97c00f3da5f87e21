//! The picture that places of the surface are of.

use eframe::egui::{
    Align2, Color32, ColorImage, Context, FontId, Image, Role, Sense, TextureHandle,
    TextureOptions, Ui, WidgetInfo, pos2, vec2,
};
use image::{DynamicImage, ImageDecoder as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Pixels of its longer side as it is shown: more than that is not seen.
const LARGEST: u32 = 1024;

/// Points of the window that it is wide and high, at most.
const WIDTH: f32 = 300.0;
const HEIGHT: f32 = 320.0;

/// A picture on its way.
pub(super) struct PictureLoad {
    state: State,
}

enum State {
    Loading(Receiver<Result<ColorImage, String>>),
    Shown(TextureHandle),
    Refused(String),
}

/// A picture file, as large as it is shown.
fn read(path: &Path) -> Result<ColorImage, String> {
    let line = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let reader = image::ImageReader::open(path).map_err(|error| line(&error))?;
    let reader = reader.with_guessed_format().map_err(|error| line(&error))?;
    let mut decoder = reader.into_decoder().map_err(|error| line(&error))?;
    // As cameras held it, which the tool sees, too.
    let orientation = decoder.orientation().map_err(|error| line(&error))?;
    let mut picture = DynamicImage::from_decoder(decoder).map_err(|error| line(&error))?;
    picture.apply_orientation(orientation);
    let picture = match picture.width().max(picture.height()) > LARGEST {
        true => picture.thumbnail(LARGEST, LARGEST),
        false => picture,
    };
    let picture = picture.to_rgba8();
    let size = [picture.width() as usize, picture.height() as usize];
    Ok(ColorImage::from_rgba_unmultiplied(size, picture.as_raw()))
}

impl PictureLoad {
    /// Begins to read a file.
    pub(super) fn new(path: PathBuf, ctx: &Context) -> Self {
        let (sender, receiver) = channel();
        let ctx = ctx.clone();
        let spawned =
            std::thread::Builder::new().name("picture of pairs".to_owned()).spawn(move || {
                // Nobody waits where something else is done meanwhile.
                drop(sender.send(read(&path)));
                ctx.request_repaint();
            });
        let state = match spawned {
            Ok(_) => State::Loading(receiver),
            Err(error) => State::Refused(error.to_string()),
        };
        Self { state }
    }

    /// Shows it with numbered dots; returns where it was clicked, shares from its left and top.
    pub(super) fn show(&mut self, ui: &mut Ui, dots: &[([f64; 2], String)]) -> Option<[f64; 2]> {
        if let State::Loading(receiver) = &self.state {
            match receiver.try_recv() {
                Ok(Ok(image)) => {
                    let texture = ui.ctx().load_texture("pairs", image, TextureOptions::LINEAR);
                    self.state = State::Shown(texture);
                }
                Ok(Err(line)) => self.state = State::Refused(line),
                Err(TryRecvError::Disconnected) => {
                    self.state = State::Refused("the picture cannot be read".to_owned());
                }
                Err(TryRecvError::Empty) => {}
            }
        }
        let texture = match &self.state {
            State::Shown(texture) => texture,
            State::Loading(_) => {
                ui.spinner();
                return None;
            }
            State::Refused(line) => {
                ui.colored_label(ui.visuals().error_fg_color, line);
                return None;
            }
        };
        let size = texture.size_vec2();
        let scale = (WIDTH / size.x).min(HEIGHT / size.y);
        let image = Image::new((texture.id(), size * scale)).sense(Sense::click());
        let response = ui.add(image.fit_to_exact_size(size * scale));
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "the picture"));
        let rect = response.rect;
        for (share, number) in dots {
            let at = rect.min + vec2(share[0] as f32, share[1] as f32) * rect.size();
            let painter = ui.painter();
            painter.circle_filled(at, 5.0, Color32::from_black_alpha(170));
            painter.circle_filled(at, 3.5, Color32::WHITE);
            let font = FontId::proportional(13.0);
            let galley = painter.layout_no_wrap(number.clone(), font, Color32::WHITE);
            let place = Align2::LEFT_CENTER.anchor_size(pos2(at.x + 8.0, at.y), galley.size());
            painter.rect_filled(place.expand2(vec2(4.0, 1.0)), 3.0, Color32::from_black_alpha(170));
            painter.galley(place.min, galley, Color32::WHITE);
        }
        let at = response.interact_pointer_pos().filter(|_| response.clicked())?;
        let share = (at - rect.min) / rect.size();
        // To a twentieth of a pixel of a large picture.
        let rounded = |share: f32| (f64::from(share.clamp(0.0, 1.0)) * 1e5).round() / 1e5;
        Some([rounded(share.x), rounded(share.y)])
    }
}
