//! What an erratum does to a picture: how far the printed form is from the corrected one on the screen, and the
//! errors of both against the truth.

use crate::entries::Entry;
use crate::outcome::Outcome;
use serde::Serialize;
use surfelshop_image::{Image, png};

/// Most pixels of a picture that is read.
const MOST_PIXELS: u64 = 1 << 24;

/// The effect of an erratum.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// Root of the mean squared difference of both pictures on the screen, 0 to 1, over the pixels that either draws
    /// and three channels; none where an erratum has no two pictures.
    pub on_screen: Option<f64>,
    /// What the errors are, such as `RMSE`; empty where none were measured.
    pub error: String,
    /// The error of the printed form.
    pub printed: Option<f64>,
    /// The error of the corrected form.
    pub corrected: Option<f64>,
}

/// Both forms of an error as numbers are called.
const PAIRS: [[&str; 2]; 4] = [
    ["RMSE as printed", "RMSE as corrected"],
    ["RMSE of printed", "RMSE of corrected"],
    ["FLIP as printed", "FLIP as corrected"],
    ["FLIP of printed", "FLIP of corrected"],
];

/// The effect of what was made; none where it has no printed form.
///
/// # Errors
/// One line where a picture cannot be read.
pub(crate) fn of(entry: &Entry, outcome: &Outcome) -> anyhow::Result<Option<Effect>> {
    let value = |name: &str| {
        outcome.numbers.iter().find(|number| number.what == name).map(|number| number.value)
    };
    let own = match entry.errors.as_slice() {
        [printed, corrected] => Some([printed.as_str(), corrected.as_str()]),
        _ => None,
    };
    let errors = own.into_iter().chain(PAIRS).find_map(|[printed, corrected]| {
        let name = printed.split(" as ").next().and_then(|name| name.split(" of ").next());
        let name = name.and_then(|name| name.split(" at ").next()).unwrap_or(printed);
        Some((name.to_owned(), value(printed)?, value(corrected)?))
    });
    let picture = |name: &str| -> anyhow::Result<Option<Image>> {
        let found = outcome.pictures.iter().find(|picture| picture.name == name);
        let path = found.map(|found| outcome.folder.join(&found.file));
        Ok(path.map(|path| png::read(&path, MOST_PIXELS)).transpose()?)
    };
    let on_screen = match (picture("printed")?, picture("corrected")?) {
        (Some(printed), Some(corrected)) => difference(&printed, &corrected),
        _ => None,
    };
    if on_screen.is_none() && errors.is_none() {
        return Ok(None);
    }
    let (error, printed, corrected) = match errors {
        Some((error, printed, corrected)) => (error, Some(printed), Some(corrected)),
        None => (String::new(), None, None),
    };
    Ok(Some(Effect { on_screen, error, printed, corrected }))
}

/// Root of the mean squared difference over the pixels that either picture draws; none where no pixel is drawn or
/// their sizes differ. What is not drawn is black.
fn difference(a: &Image, b: &Image) -> Option<f64> {
    if [a.width, a.height, a.components] != [b.width, b.height, b.components] || a.components != 4 {
        return None;
    }
    let pixels = a.data.chunks_exact(4).zip(b.data.chunks_exact(4));
    let (mut sum, mut n) = (0.0, 0u64);
    for (a, b) in pixels.filter(|(a, b)| a[3] > 0.0 || b[3] > 0.0) {
        for channel in 0..3 {
            sum += f64::from(a[channel] * a[3] - b[channel] * b[3]).powi(2);
        }
        n += 3;
    }
    (n > 0).then(|| (sum / n as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::{Number, State};

    #[test]
    fn pictures_differ_where_either_is_drawn() {
        let image = |data: &[f32]| Image { width: 2, height: 1, components: 4, data: data.into() };
        let a = image(&[0.5, 0.5, 0.5, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let b = image(&[0.1, 0.5, 0.9, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let expected = (2.0 * 0.16f64 / 3.0).sqrt();
        assert!((difference(&a, &b).unwrap() - expected).abs() < 1e-6);
        assert!(difference(&a, &a).unwrap() == 0.0);
        assert!(difference(&image(&[0.0; 8]), &image(&[0.0; 8])).is_none());
    }

    #[test]
    fn errors_are_found_by_their_names() {
        let number = |what: &str, value: f64| Number {
            what: what.to_owned(),
            value,
            unit: String::new(),
            printed: String::new(),
            command: None,
            pointer: String::new(),
            is_repeatable: true,
        };
        let mut outcome = Outcome::empty(State::Made);
        assert!(of(&Entry::default(), &outcome).unwrap().is_none());
        outcome.numbers =
            vec![number("RMSE at side=front", 0.5), number("RMSE at side=back", 0.25)];
        assert!(of(&Entry::default(), &outcome).unwrap().is_none());
        let errors = ["RMSE at side=front", "RMSE at side=back"].map(str::to_owned).to_vec();
        let effect = of(&Entry { errors, ..Entry::default() }, &outcome).unwrap().unwrap();
        assert_eq!(
            (effect.error.as_str(), effect.printed, effect.corrected),
            ("RMSE", Some(0.5), Some(0.25))
        );
    }
}
