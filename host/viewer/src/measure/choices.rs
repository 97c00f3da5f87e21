//! What the form means for the present window: defaults for what is not chosen.

use super::form::{Form, ReferenceChoice};
use crate::window::Window;
use surfelshop_api::UnitKind;
use surfelshop_api::params::ParamDecl;
use surfelshop_evaluate::report::knobs::steps;

impl Form {
    /// The renderer whose knob is varied.
    pub(crate) fn renderer<'a>(&self, window: &'a Window) -> Option<&'a str> {
        let pane = window.settings.pane(window.views.focused)?;
        Some(&pane.renderers[self.side(pane)])
    }

    /// The parameters of that renderer; none before it is loaded.
    pub(crate) fn declared<'a>(&self, window: &'a Window) -> &'a [ParamDecl] {
        let renderer = self.renderer(window);
        renderer.and_then(|name| window.plugins.declared.get(name)).map_or(&[], Vec::as_slice)
    }

    /// The knob: the chosen one, else the first that trades time for quality.
    pub(crate) fn knob<'a>(&self, window: &'a Window) -> Option<&'a ParamDecl> {
        let declared = self.declared(window);
        let chosen = self.knob.as_ref();
        let chosen = chosen.and_then(|id| declared.iter().find(|knob| knob.id == *id));
        chosen.or_else(|| declared.iter().find(|knob| knob.quality))
    }

    /// The reference: the chosen one while it exists, else the renderer itself at its knob's last value,
    /// or without a knob the view's other renderer.
    pub(crate) fn against(&self, window: &Window) -> ReferenceChoice {
        let exists = |against: &&ReferenceChoice| match against {
            ReferenceChoice::Itself => self.knob(window).is_some(),
            ReferenceChoice::Renderer(name) => window.renderers().contains(name),
            ReferenceChoice::Tracer(name) => {
                window.plugins.registry.names(UnitKind::Tracer).contains(name)
            }
            ReferenceChoice::Picture => true,
        };
        if let Some(chosen) = self.against.as_ref().filter(exists) {
            return chosen.clone();
        }
        let pane = window.settings.pane(window.views.focused);
        match (self.knob(window), pane) {
            (None, Some(pane)) => {
                ReferenceChoice::Renderer(pane.renderers[1 - self.side(pane)].clone())
            }
            _ => ReferenceChoice::Itself,
        }
    }

    /// The size of the pictures in pixels, unless the reference is a file.
    pub(crate) fn size_px(&self, window: &Window) -> [u32; 2] {
        let pane = window.views.panes.get(&window.views.focused);
        match self.as_view {
            true => pane.map_or([0, 0], |pane| pane.size_px),
            false => self.size,
        }
    }

    /// Enters the values of a newly chosen knob: those of `report`, and the last one as the best, since
    /// most knobs cost more at higher values.
    pub(crate) fn update_values(window: &mut Window) {
        let form = &window.measure.form;
        let Some(renderer) = form.renderer(window).map(str::to_owned) else { return };
        let Some(knob) = form.knob(window) else { return };
        let (id, values) = (knob.id.clone(), steps(knob));
        let form = &mut window.measure.form;
        if form.typed_for.as_ref().is_none_or(|of| (&of.0, &of.1) != (&renderer, &id)) {
            form.typed = values.join(", ");
            form.best = values.last().cloned().unwrap_or_default();
            form.typed_for = Some((renderer, id));
        }
    }
}
