//! Looks: renderer, light and environment at once.

use super::conditions::{Applies, has_environment_renderer, has_occlusion, has_phong};
use crate::commands::command::{Command, Menu};
use crate::looks::Look;
use crate::theme::Icon;
use crate::window::Window;
use eframe::egui::Context;

const fn look(
    words: (&'static str, &'static str, Icon),
    about: &'static str,
    run: fn(&mut Window, &Context),
    is_on: fn(&Window) -> bool,
    applies: fn(&Window) -> Applies,
) -> Command {
    Command::new(words, Menu::Look, about, run).state(is_on).when(applies)
}

pub(super) static LOOK: [Command; 6] = [
    look(
        ("look-headlight", "Headlight", Icon::Lightbulb),
        "One light beside the camera, as a new file is shown.",
        |window, _| window.apply_look(Look::Headlight),
        |window| window.has_look(Look::Headlight),
        has_phong,
    ),
    look(
        ("look-studio", "Studio", Icon::Aperture),
        "Soft boxes all around, with the renderer for natural light.",
        |window, _| window.apply_look(Look::Studio),
        |window| window.has_look(Look::Studio),
        has_environment_renderer,
    ),
    look(
        ("look-sunlight", "Sunlight", Icon::Sun),
        "A clear sky with its sun, with the renderer for natural light.",
        |window, _| window.apply_look(Look::Sunlight),
        |window| window.has_look(Look::Sunlight),
        has_environment_renderer,
    ),
    look(
        ("look-clay", "Clay", Icon::Shapes),
        "One matte colour for all, so that only the shape is seen.",
        |window, _| window.apply_look(Look::Clay),
        |window| window.has_look(Look::Clay),
        has_phong,
    ),
    look(
        ("look-occlusion", "Ambient occlusion", Icon::Blend),
        "White, and as dark as the surroundings hide the sky.",
        |window, _| window.apply_look(Look::AmbientOcclusion),
        |window| window.has_look(Look::AmbientOcclusion),
        has_occlusion,
    ),
    look(
        ("look-points", "Points", Icon::ChartScatter),
        "Round points of one size in even light, as scans are usually shown.",
        |window, _| window.apply_look(Look::Points),
        |window| window.has_look(Look::Points),
        has_phong,
    ),
];
