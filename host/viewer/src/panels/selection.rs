//! What of the scene is selected: its properties are shown, and commands are about it.

/// A part of the scene, as the outliner lists it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum Selection {
    /// The focused view.
    #[default]
    View,
    /// A cloud, by its index among those that are open.
    Cloud(usize),
    /// A light of the scene.
    Light(usize),
    /// A light that is switched off.
    LightOff(usize),
    Environment,
    /// The camera of the focused view.
    Camera,
    /// A remembered camera.
    Bookmark(usize),
    /// A measure.
    Measure(usize),
}
