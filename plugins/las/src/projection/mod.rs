//! Coordinate systems, as records of a LAS file say them.

mod geotiff;
mod wkt;

pub(crate) use geotiff::keys_of;
pub(crate) use wkt::is_wkt;

use crate::notes;
use crate::records::Records;

/// What a file says of its coordinate system.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Projection {
    /// WKT, or `EPSG:` and a number; empty where unknown.
    pub(crate) name: String,
    /// Metres of a unit of coordinates; 0 where unknown.
    pub(crate) metres_per_unit: f64,
    /// What is doubtful.
    pub(crate) warning: Option<String>,
    /// What else there is, for people.
    pub(crate) comments: Vec<String>,
}

impl Projection {
    /// That of a file's records: WKT, or else `GeoTIFF` keys.
    pub(crate) fn of(records: &Records) -> Self {
        let [directory, floats, texts] = &records.geo_keys;
        let mut keys = geotiff::Keys::of(directory, floats, texts);
        let code = keys.projected.or(keys.geographic);
        // Of a system without a code its keys are all there is to say.
        let own =
            (code.is_none() && !directory.is_empty()).then(|| notes::of_keys(&records.geo_keys));
        if !records.wkt.is_empty() {
            let units = wkt::units(&records.wkt);
            return Self {
                name: records.wkt.clone(),
                metres_per_unit: units.plane,
                warning: two_units(units.plane, units.height),
                comments: own.flatten().into_iter().collect(),
            };
        }
        keys.comments.extend(own.flatten());
        Self {
            name: code.map(|code| format!("EPSG:{code}")).unwrap_or_default(),
            metres_per_unit: keys.metres_per_unit,
            warning: two_units(keys.metres_per_unit, keys.metres_per_height),
            comments: keys.comments,
        }
    }
}

/// What to say where heights have another unit than the plane: all axes are taken as alike.
fn two_units(plane: f64, height: f64) -> Option<String> {
    let differ = plane > 0.0 && height > 0.0 && (plane / height - 1.0).abs() > 1e-4;
    differ.then(|| {
        format!("heights are in units of {height} m, but the plane in units of {plane} m; they are not converted")
    })
}
