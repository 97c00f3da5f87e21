//! What the numbers below two pictures mean.

use eframe::egui::{Rect, Role, Sense, Ui, WidgetInfo};

/// What the pointer is told over them.
const ABOUT: &str = "How far the two pictures are apart, as they are on the screen: colours of 8 bits, tone mapped, \
                     with the background.\n\
                     RMSE: root of the mean squared difference, from 0 (equal) to 1; less is closer.\n\
                     PSNR: the same in decibels; more is closer, and above 40 dB it is hardly seen.\n\
                     \"Compare quality\" (M) measures radiance before tone mapping instead, where a surface is, so \
                     that its RMSE is another number.";

/// Explains the numbers where the pointer is over them.
pub(super) fn explain(ui: &Ui, (place, text): (Rect, String)) {
    let id = ui.scope_id().with("difference of the pictures");
    let response = ui.interact(place, id, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("{text}: copy")));
    if response.clicked() {
        ui.ctx().copy_text(text);
    }
    response.on_hover_text(format!("{ABOUT}\nA click copies them."));
}
