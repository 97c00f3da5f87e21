//! Numbers of measures as a file with commas between fields.

use super::{Measure, Quantity, Units};

/// A measure with its title and its numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRow {
    /// What it is called.
    pub title: String,
    /// The measure.
    pub measure: Measure,
    /// Its numbers.
    pub quantities: Vec<Quantity>,
}

impl MeasuredRow {
    /// A line for each row's number, below a line with the names of the columns; a note has one line with its text.
    #[must_use]
    pub fn csv(rows: &[Self], units: Units) -> String {
        let mut text = "name,kind,quantity,value,unit,places\n".to_owned();
        for Self { title, measure, quantities } in rows {
            let places = measure.places.iter().map(|p| format!("{:?} {:?} {:?}", p.x, p.y, p.z));
            let places = places.collect::<Vec<_>>().join(";");
            let (name, kind) = (field(title), measure.kind.name());
            for quantity in quantities {
                let (value, unit) = (units.number(quantity), units.unit(quantity.kind));
                text += &format!("{name},{kind},{},{value:?},{unit},{places}\n", quantity.name);
            }
            if quantities.is_empty() {
                text += &format!("{name},{kind},{},,,{places}\n", field(&measure.text));
            }
        }
        text
    }
}

/// A text as a field: in quotes where it has some, a comma or a line's end. Source: RFC 4180.
fn field(text: &str) -> String {
    match text.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{MeasureKind, QuantityKind};
    use glam::DVec3;

    #[test]
    fn numbers_are_written_with_all_digits_and_texts_in_quotes() {
        let quantity = Quantity { name: "distance", value: 0.1 + 0.2, kind: QuantityKind::Length };
        let places = vec![DVec3::ZERO, DVec3::new(481_000.123_456_789, 0.0, -1.0)];
        let measure = Measure::new(MeasureKind::Distance, places);
        let title = "a \"door\", left".to_owned();
        let row = MeasuredRow { title, measure, quantities: vec![quantity] };
        let note = Measure {
            text: "crack, 2 mm".to_owned(),
            ..Measure::new(MeasureKind::Note, vec![DVec3::X])
        };
        let note =
            MeasuredRow { title: "note 2".to_owned(), measure: note, quantities: Vec::new() };
        let csv = MeasuredRow::csv(&[row, note], Units { metres: Some(10.0) });
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines[0], "name,kind,quantity,value,unit,places");
        let exact = 10.0 * (0.1 + 0.2);
        let places = "0.0 0.0 0.0;481000.123456789 0.0 -1.0";
        assert_eq!(
            lines[1],
            format!("\"a \"\"door\"\", left\",distance,distance,{exact:?},m,{places}")
        );
        assert_eq!(lines[2], "note 2,note,\"crack, 2 mm\",,,1.0 0.0 0.0");
    }
}
