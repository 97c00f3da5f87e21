//! Icons: letters of a font of their own, beside the text.

use eframe::egui::{
    Button, Color32, FontData, FontDefinitions, FontFamily, RichText, Role, Ui, WidgetInfo,
    WidgetText,
};
pub(crate) use lucide_icons::Icon;
use lucide_icons::LUCIDE_FONT_BYTES;

/// The fonts of the window: the toolkit's, then the icons.
pub(super) fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    let mut icons = FontData::from_static(LUCIDE_FONT_BYTES);
    // They stand on the line of the letters without it.
    icons.tweak.y_offset_factor = 0.09;
    fonts.font_data.insert("icons".to_owned(), icons.into());
    for family in [FontFamily::Proportional, FontFamily::Monospace] {
        if let Some(names) = fonts.families.get_mut(&family) {
            // Before the symbols of the toolkit, which use the same private numbers.
            names.insert(names.len().min(1), "icons".to_owned());
        }
    }
    fonts
}

/// An icon as text.
pub(crate) fn text(icon: Icon) -> RichText {
    RichText::new(icon.unicode().to_string())
}

/// A small button with a cross, for what it says; returns whether it was clicked.
pub(crate) fn dismiss(ui: &mut Ui, what: &str) -> bool {
    let response = ui.add(Button::new(text(Icon::X)).frame(false));
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, what));
    response.on_hover_text(what).clicked()
}

/// An icon before words, which are one text in the colour of the control that it is on.
pub(crate) fn iconed(ui: &Ui, icon: Icon, words: &str) -> WidgetText {
    iconed_in(ui, icon, words, Color32::PLACEHOLDER)
}

/// The same in a colour.
pub(crate) fn iconed_in(ui: &Ui, icon: Icon, words: &str, color: Color32) -> WidgetText {
    use eframe::egui::text::{LayoutJob, TextFormat};
    use eframe::egui::{Align, TextStyle};
    let font = TextStyle::Button.resolve(ui.style());
    let format =
        TextFormat { font_id: font, color, valign: Align::Center, ..TextFormat::default() };
    let mut job = LayoutJob::default();
    job.append(&icon.unicode().to_string(), 0.0, format.clone());
    job.append(words, super::space::MEDIUM, format);
    job.into()
}
