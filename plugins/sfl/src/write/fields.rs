//! Which columns of a cloud become which properties.

use super::report::Report;
use crate::settings::{NormalChoice, Settings};
use crate::surfel::color::ColorModel;
use crate::surfel::layout::{Layout, Normals};
use crate::surfel::normal_code::Cube;
use crate::surfel::plain::{PLAIN, Plain};
use crate::surfel::property;
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_api::format::{CloudHeader, FileColumn};

/// What is stored of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Field {
    /// Centres.
    Position,
    /// Normals as three floats.
    FloatNormal,
    /// Normals as codes.
    CodedNormal,
    /// A vector of floats, or one: radii and tangents. Components and bytes behind the property's place.
    Floats { components: usize, behind: usize },
    /// A colour.
    Color,
    /// Numbers as they are.
    Plain(Plain),
}

/// A column and where it goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Column {
    /// The column's name.
    pub(super) name: &'static str,
    /// The property's number.
    pub(super) property: usize,
    /// What is stored.
    pub(super) field: Field,
}

/// Columns that become properties, but for plain numbers; without the vectors of ellipses.
const COLUMNS: [(&str, usize, Field); 6] = [
    (POSITION, property::POSITION, Field::Position),
    (NORMAL, property::NORMAL, Field::CodedNormal),
    (RADIUS, property::RADIUS, Field::Floats { components: 1, behind: 0 }),
    (COLOR, property::DIFFUSE, Field::Color),
    ("specular", property::SPECULAR, Field::Color),
    ("ambient", property::AMBIENT, Field::Color),
];

/// The vectors of ellipses, which go together.
const TANGENTS: [(&str, usize, Field); 2] = [
    (TANGENT_U, property::TANGENTS, Field::Floats { components: 3, behind: 0 }),
    (TANGENT_V, property::TANGENTS, Field::Floats { components: 3, behind: 12 }),
];

/// Whether a field holds a column of such numbers.
fn holds(field: Field, column: &FileColumn) -> bool {
    match field {
        Field::Position | Field::FloatNormal | Field::CodedNormal => column.components == 3,
        Field::Floats { components, .. } => column.components as usize == components,
        Field::Color => {
            let elements = [Element::U8, Element::U16, Element::F32];
            matches!(column.components, 3 | 4) && elements.contains(&column.element)
        }
        Field::Plain(plain) => column.components as usize == plain.components,
    }
}

/// The columns of a cloud that are written, and the layout of their records. The others go to the report.
pub(super) fn fields(
    header: &CloudHeader,
    settings: &Settings,
    report: &mut Report,
) -> (Layout, Vec<Column>) {
    let fits = |(name, _property, field): &(&str, usize, Field)| {
        header.column(name).is_some_and(|(_, column)| holds(*field, column))
    };
    let plain = PLAIN.map(|plain| (plain.column, plain.property, Field::Plain(plain)));
    let both_tangents = TANGENTS.iter().all(fits);
    let tangents = TANGENTS.iter().filter(|_vector| both_tangents);
    let (normals, normal_field) = match settings.normals {
        NormalChoice::Cub32 => (Normals::Code(Cube::Cub32), Field::CodedNormal),
        NormalChoice::Float => (Normals::Floats, Field::FloatNormal),
    };
    let columns: Vec<Column> = COLUMNS
        .iter()
        .chain(tangents)
        .chain(&plain)
        .filter(|candidate| fits(candidate))
        .map(|&(name, property, field)| {
            let field = if property == property::NORMAL { normal_field } else { field };
            Column { name, property, field }
        })
        .collect();
    for column in &header.columns {
        let name = column.name.as_str();
        if columns.iter().any(|written| written.name == name) {
            continue;
        }
        let candidates = || COLUMNS.iter().chain(&TANGENTS).chain(&plain);
        let is_property = candidates().any(|(known, ..)| *known == name);
        report.left_out(
            name,
            if is_property && TANGENTS.iter().any(|(known, ..)| *known == name) {
                "surfels of SFL have two tangents of three numbers"
            } else if is_property {
                "surfels of SFL hold other types or numbers of components there"
            } else {
                "surfels of SFL have no such property"
            },
        );
    }
    let properties: Vec<usize> = columns.iter().map(|column| column.property).collect();
    let has_color = columns.iter().any(|column| column.field == Field::Color);
    let layout = Layout::arranged(&properties, normals, has_color.then_some(ColorModel::Rgba));
    (layout, columns)
}
