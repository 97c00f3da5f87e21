//! The dots of pairs on the surface.

use crate::views::hands::HandMode;
use crate::window::Window;
use glam::DVec3;
use surfelshop_cloud::scene::{Figure, Segment};

/// What is drawn of pairs: figures with their numbers; of the one that is begun the last.
pub(in crate::views) fn figures(window: &Window) -> Vec<(Figure, String)> {
    let pairing = window.views.hands.pairing.as_ref();
    let Some(pairing) = pairing.filter(|_| window.views.hands.mode == HandMode::Pairs) else {
        return Vec::new();
    };
    let pairs = window.pairs().unwrap_or_default();
    let dot =
        |place: DVec3| Figure { segments: Vec::new(), places: vec![place], anchor: Some(place) };
    let mut figures = Vec::new();
    for (number, pair) in (1..).zip(&pairs) {
        let place = |from: usize| {
            let numbers = pair.get(from..from + 3)?;
            Some(DVec3::from_slice(numbers))
        };
        let Some(own) = place(0) else { continue };
        let mut figure = dot(own);
        // Of pairs with a picture the other place is there.
        if let Some(other) = place(3) {
            figure.segments.push(Segment { ends: [own, other], is_faint: true });
            figures.push((dot(other), format!("{number}")));
        }
        figures.push((figure, format!("{number}")));
    }
    figures.extend(pairing.place.map(|place| (dot(place), format!("{}", pairs.len() + 1))));
    figures
}
