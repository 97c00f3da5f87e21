//! Colours and spacing by their job: widgets take them from here alone.
//!
//! Text stands on each surface it is used on with a contrast of at least 4.5 to 1, the level AA of WCAG 2.2.

use eframe::egui::Color32;

/// Distances, points of the screen.
pub(crate) mod space {
    /// Between parts of one thing.
    pub(crate) const SMALL: f32 = 4.0;
    /// Between things of a group.
    pub(crate) const MEDIUM: f32 = 8.0;
    /// Between groups.
    pub(crate) const LARGE: f32 = 16.0;
    /// Width of the labels in panels: controls stand in one column.
    pub(crate) const LABEL: f32 = 112.0;
    /// Radius of corners.
    pub(crate) const CORNER: u8 = 5;
}

/// The colours of a theme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tokens {
    /// Around the pictures.
    pub(crate) canvas: Color32,
    /// Panels and bars.
    pub(crate) panel: Color32,
    /// Menus, windows and cards.
    pub(crate) raised: Color32,
    /// Text fields and the rails of sliders.
    pub(crate) field: Color32,
    /// Buttons, and where the pointer is, and pressed.
    pub(crate) button: Color32,
    pub(crate) hovered: Color32,
    pub(crate) pressed: Color32,
    /// Lines between parts.
    pub(crate) border: Color32,
    pub(crate) text: Color32,
    /// Titles, and what is under the pointer.
    pub(crate) strong: Color32,
    /// What matters less.
    pub(crate) weak: Color32,
    /// What is chosen: its background, and the text on it.
    pub(crate) accent: Color32,
    pub(crate) on_accent: Color32,
    /// Links, and what is focused.
    pub(crate) link: Color32,
    pub(crate) warning: Color32,
    pub(crate) error: Color32,
}

impl Tokens {
    /// Every second row of a table, on which buttons and boxes must be seen.
    pub(crate) fn second_row(&self) -> Color32 {
        self.raised.lerp_to_gamma(self.button, 0.4)
    }
}

const fn gray(level: u8) -> Color32 {
    Color32::from_gray(level)
}

const fn rgb(red: u8, green: u8, blue: u8) -> Color32 {
    Color32::from_rgb(red, green, blue)
}

/// Captions over pictures, in both themes: the background behind them.
pub(crate) const OVERLAY: Color32 = Color32::from_black_alpha(170);

/// Text over [`OVERLAY`].
pub(crate) const ON_OVERLAY: Color32 = Color32::WHITE;

pub(crate) const DARK: Tokens = Tokens {
    canvas: rgb(20, 21, 24),
    panel: rgb(30, 32, 36),
    raised: rgb(40, 43, 48),
    field: rgb(20, 21, 24),
    button: rgb(52, 56, 63),
    hovered: rgb(64, 69, 78),
    pressed: rgb(74, 80, 91),
    border: rgb(58, 62, 69),
    text: rgb(214, 217, 222),
    strong: rgb(245, 246, 248),
    weak: rgb(166, 171, 180),
    accent: rgb(42, 100, 172),
    on_accent: gray(255),
    link: rgb(122, 178, 244),
    warning: rgb(240, 182, 84),
    error: rgb(255, 138, 128),
};

pub(crate) const LIGHT: Tokens = Tokens {
    canvas: rgb(205, 208, 213),
    panel: rgb(243, 244, 246),
    raised: rgb(255, 255, 255),
    field: rgb(229, 232, 236),
    button: rgb(225, 228, 232),
    hovered: rgb(212, 217, 224),
    pressed: rgb(198, 205, 214),
    border: rgb(198, 202, 208),
    text: rgb(38, 42, 48),
    strong: rgb(10, 12, 15),
    weak: rgb(84, 90, 99),
    accent: rgb(29, 95, 176),
    on_accent: gray(255),
    link: rgb(20, 84, 160),
    warning: rgb(128, 76, 0),
    error: rgb(170, 28, 28),
};

/// The axes as other programs colour them, bright enough for dark letters.
pub(crate) const AXES: [Color32; 3] = [
    Color32::from_rgb(240, 96, 92),
    Color32::from_rgb(126, 196, 74),
    Color32::from_rgb(96, 156, 250),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance. Source: WCAG 2.2, definition of relative luminance.
    fn luminance(color: Color32) -> f64 {
        let [red, green, blue] = [color.r(), color.g(), color.b()].map(|level| {
            let share = f64::from(level) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    }

    fn contrast(a: Color32, b: Color32) -> f64 {
        let [a, b] = [luminance(a), luminance(b)];
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    /// Buttons and boxes lie on the rows of tables.
    #[test]
    fn buttons_are_seen_on_every_row() {
        for tokens in [DARK, LIGHT] {
            let least = 0.3 * (contrast(tokens.raised, tokens.button) - 1.0);
            for row in [tokens.raised, tokens.second_row()] {
                assert!(contrast(row, tokens.button) - 1.0 > least, "{row:?}");
            }
            assert_ne!(tokens.second_row(), tokens.raised);
        }
    }

    /// Invariant: text has a contrast of at least 4.5 to 1 in both themes
    #[test]
    fn text_has_contrast_on_each_surface_that_it_is_used_on() {
        for (theme, tokens) in [("dark", DARK), ("light", LIGHT)] {
            let surfaces = [
                ("panel", tokens.panel),
                ("raised", tokens.raised),
                ("field", tokens.field),
                ("canvas", tokens.canvas),
            ];
            let buttons = [
                ("button", tokens.button),
                ("hovered", tokens.hovered),
                ("pressed", tokens.pressed),
            ];
            let everywhere = [("text", tokens.text), ("strong", tokens.strong)];
            let on_surfaces = [("weak", tokens.weak), ("link", tokens.link)];
            let on_surfaces = on_surfaces
                .into_iter()
                .chain([("warning", tokens.warning), ("error", tokens.error)]);
            let mut pairs = vec![("on_accent", tokens.on_accent, "accent", tokens.accent)];
            for (text, color) in everywhere {
                pairs.extend(
                    surfaces.iter().chain(&buttons).map(|(on, at)| (text, color, *on, *at)),
                );
            }
            // Nothing weak or coloured stands on the canvas alone.
            for (text, color) in on_surfaces {
                let rows = [("button", tokens.button), ("second row", tokens.second_row())];
                let tables = surfaces[..3].iter().chain(&rows);
                pairs.extend(tables.map(|(on, at)| (text, color, *on, *at)));
            }
            for (text, color, on, at) in pairs {
                let contrast = contrast(color, at);
                assert!(contrast >= 4.5, "{theme}: {text} on {on} has only {contrast:.2}");
            }
        }
        // Over the lightest picture.
        let behind = 255 - OVERLAY.a();
        assert!(contrast(ON_OVERLAY, Color32::from_gray(behind)) >= 4.5);
    }

    #[test]
    fn contrasts_are_those_of_the_standard() {
        assert!((contrast(Color32::BLACK, Color32::WHITE) - 21.0).abs() < 1e-9);
        // The darkest gray that is still readable on white, by the examples of the standard.
        assert!((contrast(gray(0x76), Color32::WHITE) - 4.54).abs() < 0.01);
    }
}
