//! Measures, as they are typed.

use super::select;
use clap::Args;
use glam::DVec3;
use surfelshop_cloud::scene::{LONGEST_NOTE, Measure, MeasureKind};

/// What is measured besides what a scene measures.
#[derive(Clone, Debug, Default, Args)]
pub struct MeasureOptions {
    /// Measure the length of a line through places, X,Y,Z:X,Y,Z or more; may be repeated, as all of these.
    #[arg(long, value_name = "PLACES", value_parser = distance, allow_hyphen_values = true)]
    pub distance: Vec<Measure>,
    /// Measure the angle of three places, at the second.
    #[arg(long, value_name = "PLACES", value_parser = angle, allow_hyphen_values = true)]
    pub angle: Vec<Measure>,
    /// Measure how much higher the second of two places is.
    #[arg(long, value_name = "PLACES", value_parser = height, allow_hyphen_values = true)]
    pub height: Vec<Measure>,
    /// Measure the area within three places or more.
    #[arg(long, value_name = "PLACES", value_parser = area, allow_hyphen_values = true)]
    pub area: Vec<Measure>,
    /// Measure the surfels near the vertical plane through two places.
    #[arg(long, value_name = "PLACES", value_parser = profile, allow_hyphen_values = true)]
    pub profile: Vec<Measure>,
    /// How thick the slabs of typed profiles are, scene units [default: a hundredth of their length].
    #[arg(long, value_name = "LENGTH", value_parser = thickness)]
    pub thickness: Option<f64>,
    /// Measure what lies between the surfels and the plane through three places or more.
    #[arg(long, value_name = "PLACES", value_parser = volume, allow_hyphen_values = true)]
    pub volume: Vec<Measure>,
    /// Note a text at a place, X,Y,Z:TEXT.
    #[arg(long, value_name = "NOTE", value_parser = note, allow_hyphen_values = true)]
    pub note: Vec<Measure>,
}

impl MeasureOptions {
    /// All that was typed, by kind.
    pub fn all(&self) -> Vec<Measure> {
        let profiles = self
            .profile
            .iter()
            .cloned()
            .map(|measure| Measure { thickness: self.thickness, ..measure });
        let before = [&self.distance, &self.angle, &self.height, &self.area];
        let before = before.into_iter().flatten().cloned();
        let after = [&self.volume, &self.note].into_iter().flatten().cloned();
        before.chain(profiles).chain(after).collect()
    }
}

fn distance(text: &str) -> Result<Measure, String> {
    measure(MeasureKind::Distance, text)
}

fn angle(text: &str) -> Result<Measure, String> {
    measure(MeasureKind::Angle, text)
}

fn height(text: &str) -> Result<Measure, String> {
    measure(MeasureKind::Height, text)
}

fn area(text: &str) -> Result<Measure, String> {
    measure(MeasureKind::Area, text)
}

fn profile(text: &str) -> Result<Measure, String> {
    measure(MeasureKind::Profile, text)
}

fn volume(text: &str) -> Result<Measure, String> {
    measure(MeasureKind::Volume, text)
}

/// Reads places with colons between.
fn measure(kind: MeasureKind, text: &str) -> Result<Measure, String> {
    let (least, most) = kind.n_places().into_inner();
    let words = match least == most {
        true => format!("{least} places"),
        false => format!("{least} places or more, at most {most},"),
    };
    let expected = || format!("expected {words} as X,Y,Z:X,Y,Z, found {text}");
    let places: Option<Vec<DVec3>> = text.split(':').map(place).collect();
    let places = places.filter(|places| kind.n_places().contains(&places.len()));
    Ok(Measure::new(kind, places.ok_or_else(expected)?))
}

fn place(text: &str) -> Option<DVec3> {
    select::place(text).filter(|place| place.abs().max_element() <= 1e37)
}

fn note(text: &str) -> Result<Measure, String> {
    let expected =
        || format!("expected X,Y,Z:TEXT of at most {LONGEST_NOTE} characters, found {text}");
    let (at, note) = text.split_once(':').ok_or_else(expected)?;
    let is_short = !note.trim().is_empty() && note.chars().count() <= LONGEST_NOTE;
    let at = place(at).filter(|_| is_short).ok_or_else(expected)?;
    Ok(Measure { text: note.trim().to_owned(), ..Measure::new(MeasureKind::Note, vec![at]) })
}

fn thickness(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|n: &f64| *n > 0.0 && *n <= 1e37);
    number.ok_or_else(|| format!("expected a length above 0, at most 1e37, found {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_as_they_are_typed() {
        let read = distance("-1,2,3.5:4e6,5,-6").unwrap();
        assert_eq!(read.places, [DVec3::new(-1.0, 2.0, 3.5), DVec3::new(4e6, 5.0, -6.0)]);
        for wrong in ["", "1,2,3", "1,2:3,4,5", "1,2,3:4,5,nan", "1,2,3:4,5,1e38"] {
            let error = distance(wrong).unwrap_err();
            assert!(error.starts_with("expected 2 places or more"), "{error}");
        }
        assert!(angle("0,0,0:1,1,1").unwrap_err().starts_with("expected 3 places as"));
        let read = note("1,2,3: crack: 2 mm").unwrap();
        assert_eq!((read.text.as_str(), read.places.len()), ("crack: 2 mm", 1));
        assert!(note("1,2,3:").is_err() && thickness("0").is_err());
    }
}
