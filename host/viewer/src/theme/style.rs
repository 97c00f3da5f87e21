//! The toolkit's style, made from the tokens.

use super::icons;
use super::tokens::{DARK, LIGHT, Tokens, space};
use crate::preferences::{Preferences, ThemeChoice};
use eframe::egui::{
    self, Context, CornerRadius, FontFamily, FontId, Id, Margin, Shadow, Stroke, Style, TextStyle,
    Theme, ThemePreference, Ui, Visuals, vec2,
};

/// The colours that a part of the window is shown in.
pub(crate) fn tokens(ui: &Ui) -> &'static Tokens {
    if ui.visuals().dark_mode { &DARK } else { &LIGHT }
}

/// What the context was styled by.
#[derive(Clone, PartialEq)]
struct Applied(ThemeChoice, u32, bool);

/// Styles a context as the user wants it, where it is not yet.
pub(crate) fn apply(ctx: &Context, preferences: &Preferences) {
    let wanted =
        Applied(preferences.theme, preferences.ui_scale.to_bits(), preferences.reduced_motion);
    let id = Id::unique("style of the window");
    let applied = ctx.data(|data| data.get_temp::<Applied>(id));
    if applied.as_ref() == Some(&wanted) {
        return;
    }
    if applied.is_none() {
        ctx.set_fonts(icons::fonts());
        // The commands of the window do that.
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
    }
    for (theme, tokens) in [(Theme::Dark, &DARK), (Theme::Light, &LIGHT)] {
        ctx.set_style_of(theme, style(theme, tokens, preferences.reduced_motion));
    }
    ctx.set_theme(match preferences.theme {
        ThemeChoice::System => ThemePreference::System,
        ThemeChoice::Dark => ThemePreference::Dark,
        ThemeChoice::Light => ThemePreference::Light,
    });
    ctx.set_zoom_factor(preferences.ui_scale);
    ctx.data_mut(|data| data.insert_temp(id, wanted));
}

fn style(theme: Theme, tokens: &Tokens, reduced_motion: bool) -> Style {
    let mut style = Style { visuals: visuals(theme, tokens), ..Style::default() };
    let font = |size| FontId::new(size, FontFamily::Proportional);
    style.text_styles = [
        (TextStyle::Small, font(11.5)),
        (TextStyle::Body, font(13.5)),
        (TextStyle::Button, font(13.5)),
        (TextStyle::Heading, font(18.0)),
        (TextStyle::Monospace, FontId::new(12.5, FontFamily::Monospace)),
    ]
    .into();
    style.animation_time = if reduced_motion { 0.0 } else { 0.1 };
    let spacing = &mut style.spacing;
    spacing.item_spacing = vec2(space::MEDIUM, 5.0);
    spacing.button_padding = vec2(7.0, 3.0);
    spacing.interact_size.y = 22.0;
    spacing.slider_width = 104.0;
    spacing.slider_rail_height = 5.0;
    spacing.combo_width = 110.0;
    spacing.indent = 12.0;
    spacing.menu_margin = Margin::same(6);
    spacing.window_margin = Margin::same(12);
    spacing.tooltip_width = 360.0;
    style
}

fn visuals(theme: Theme, tokens: &Tokens) -> Visuals {
    let mut visuals = match theme {
        Theme::Dark => Visuals::dark(),
        Theme::Light => Visuals::light(),
    };
    let corner = CornerRadius::same(space::CORNER);
    let line = |color| Stroke::new(1.0, color);
    let widgets = &mut visuals.widgets;
    for (widget, fill, text) in [
        (&mut widgets.noninteractive, tokens.panel, tokens.text),
        (&mut widgets.inactive, tokens.button, tokens.text),
        (&mut widgets.hovered, tokens.hovered, tokens.strong),
        (&mut widgets.active, tokens.pressed, tokens.strong),
        (&mut widgets.open, tokens.hovered, tokens.strong),
    ] {
        (widget.bg_fill, widget.weak_bg_fill) = (fill, fill);
        widget.fg_stroke = line(text);
        widget.bg_stroke = Stroke::NONE;
        widget.corner_radius = corner;
        widget.expansion = 0.0;
    }
    widgets.noninteractive.bg_stroke = line(tokens.border);
    // The focus of the keyboard must be seen.
    widgets.hovered.bg_stroke = line(tokens.border);
    widgets.active.bg_stroke = line(tokens.link);
    visuals.selection.bg_fill = tokens.accent;
    visuals.selection.stroke = line(tokens.on_accent);
    visuals.weak_text_color = Some(tokens.weak);
    visuals.hyperlink_color = tokens.link;
    visuals.faint_bg_color = tokens.second_row();
    visuals.extreme_bg_color = tokens.field;
    visuals.code_bg_color = tokens.field;
    visuals.warn_fg_color = tokens.warning;
    visuals.error_fg_color = tokens.error;
    visuals.window_fill = tokens.raised;
    visuals.window_stroke = line(tokens.border);
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    visuals.panel_fill = tokens.panel;
    visuals.slider_trailing_fill = true;
    visuals.handle_shape = egui::style::HandleShape::Rect { aspect_ratio: 0.55 };
    let shadow = Shadow { offset: [0, 4], blur: 14, spread: 0, ..visuals.popup_shadow };
    (visuals.window_shadow, visuals.popup_shadow) = (shadow, shadow);
    visuals
}
