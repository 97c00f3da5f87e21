//! Which properties a record has, and where.

use super::color::ColorModel;
use super::normal_code::Cube;
use super::plain::PLAIN;
use super::property;
use surfelshop_api::{Error, Result};

/// How normals are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Normals {
    /// Three floats.
    Floats,
    /// A byte that says nothing: the writing library never made any of these codes.
    Ico8,
    /// A code.
    Code(Cube),
}

impl Normals {
    /// From bits 2 and 3 of the property vector.
    fn from_bits(bits: u32) -> Self {
        match bits >> 2 & 3 {
            0 => Self::Floats,
            1 => Self::Ico8,
            2 => Self::Code(Cube::Cub16),
            _ => Self::Code(Cube::Cub32),
        }
    }

    const fn bits(self) -> u32 {
        match self {
            Self::Floats => 0,
            Self::Ico8 => 1 << 2,
            Self::Code(Cube::Cub16) => 2 << 2,
            Self::Code(Cube::Cub32) => 3 << 2,
        }
    }

    const fn size(self) -> usize {
        match self {
            Self::Floats => 12,
            Self::Ico8 => 1,
            Self::Code(Cube::Cub16) => 2,
            Self::Code(Cube::Cub32) => 4,
        }
    }

    /// The name for people.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Floats => "float",
            Self::Ico8 => "ico8",
            Self::Code(Cube::Cub16) => "cub16",
            Self::Code(Cube::Cub32) => "cub32",
        }
    }
}

/// What a file says of its records.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tables<'a> {
    /// Version of the records.
    pub(crate) version: u32,
    /// Bytes of a record.
    pub(crate) record: u32,
    /// The property vector.
    pub(crate) bits: &'a [u32],
    /// Numbers of the properties that records have.
    pub(crate) ids: &'a [u32],
    /// Where each lies.
    pub(crate) offsets: &'a [u32],
}

/// Which properties a record has, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Bytes of a record.
    pub(crate) record: usize,
    /// How normals are stored.
    pub(crate) normals: Normals,
    /// How colours are stored, where there are any.
    pub(crate) colors: Option<ColorModel>,
    places: [Option<usize>; property::END],
}

impl Layout {
    /// Where a property lies in a record; `None` where records lack it, or have it in a way that says nothing.
    pub(crate) fn place(&self, property: usize) -> Option<usize> {
        self.places.get(property).copied().flatten()
    }

    /// Bytes of a property; `None` where it is not known, or a colour without a model.
    fn size(&self, number: usize) -> Option<usize> {
        if let Some(plain) = PLAIN.iter().find(|plain| plain.property == number) {
            return Some(plain.components * plain.stored.size());
        }
        match number {
            property::POSITION => Some(12),
            property::NORMAL => Some(self.normals.size()),
            property::RADIUS => Some(4),
            property::TANGENTS => Some(24),
            property::AMBIENT | property::DIFFUSE | property::SPECULAR => {
                self.colors.map(ColorModel::size)
            }
            _ => None,
        }
    }

    /// Whether a property's bytes begin at a multiple of four, before those that need not.
    fn is_aligned(&self, number: usize) -> bool {
        match number {
            property::NORMAL => self.normals.size().is_multiple_of(4),
            property::CAMERA_XY | property::AMBIENT | property::DIFFUSE | property::SPECULAR => {
                false
            }
            _ => self.size(number).is_some_and(|size| size.is_multiple_of(4)),
        }
    }

    /// Reads the tables of a file; what is doubtful is added to `warnings`.
    ///
    /// # Errors
    /// Where records have no positions, or no place for them.
    pub(crate) fn of_tables(tables: &Tables<'_>, warnings: &mut Vec<String>) -> Result<Self> {
        let bit = |number: usize| {
            tables.bits.get(number / 32).is_some_and(|word| word >> (number % 32) & 1 == 1)
        };
        let first = tables.bits.first().copied().unwrap_or(0);
        let mut layout = Self {
            record: usize::try_from(tables.record)?,
            normals: Normals::from_bits(first),
            colors: ColorModel::from_bits(first),
            places: [None; property::END],
        };
        if tables.ids.len() != tables.offsets.len() {
            let (ids, offsets) = (tables.ids.len(), tables.offsets.len());
            warnings.push(format!(
                "{ids} properties have {offsets} places: those without are left out"
            ));
        }
        for (&id, &offset) in tables.ids.iter().zip(tables.offsets) {
            let (number, place) = (usize::try_from(id)?, usize::try_from(offset)?);
            let Some(size) = layout.size(number).filter(|_known| bit(number)) else { continue };
            let fits = place.checked_add(size).is_some_and(|end| end <= layout.record);
            match layout.places.get_mut(number) {
                Some(entry) if fits => *entry = entry.or(Some(place)),
                _ => warnings.push(format!(
                    "property {number} at byte {place} does not fit into a surfel of {} bytes and is left out",
                    layout.record
                )),
            }
        }
        if layout.place(property::POSITION).is_none() {
            return Err(Error::new(format!(
                "expected positions in surfels of {} bytes, found none",
                layout.record
            )));
        }
        layout.leave_out_what_says_nothing(tables.version, warnings);
        Ok(layout)
    }

    fn leave_out_what_says_nothing(&mut self, version: u32, warnings: &mut Vec<String>) {
        if self.normals == Normals::Ico8 && self.places[property::NORMAL].take().is_some() {
            warnings.push("normals have the code ico8, which no program ever made".to_owned());
        }
        if version == 0 && self.places[property::TANGENTS].is_some() {
            self.places[property::NORMAL] = None;
            self.places[property::RADIUS] = None;
        }
        // `Pointshop3D` wrote the last properties of cameras over the first ones of surfels.
        if let Some(place) = self.places[property::CAMERA_ANGLES] {
            let size = |number| self.size(number).unwrap_or(0);
            let overlaps = |number: usize| {
                self.place(number).is_some_and(|other| {
                    other < place + size(property::CAMERA_ANGLES) && place < other + size(number)
                })
            };
            if (0..property::CAMERA_ANGLES).any(overlaps) {
                self.places[property::CAMERA_ANGLES] = None;
                warnings.push(
                    "angles of cameras lie over other properties and are left out".to_owned(),
                );
            }
        }
    }

    /// A record with these properties, in the order in which `Pointshop3D` has them: those of whole words first.
    pub(crate) fn arranged(
        properties: &[usize],
        normals: Normals,
        colors: Option<ColorModel>,
    ) -> Self {
        let mut layout = Self { record: 0, normals, colors, places: [None; property::END] };
        for aligned in [true, false] {
            for number in 0..property::END {
                if properties.contains(&number) && layout.is_aligned(number) == aligned {
                    layout.places[number] = Some(layout.record);
                    layout.record += layout.size(number).unwrap_or(0);
                }
            }
        }
        layout
    }

    /// The properties with their places, in the order of their numbers.
    pub(crate) fn properties(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.places.iter().enumerate().filter_map(|(number, place)| Some((number, (*place)?)))
    }

    /// The property vector.
    pub(crate) fn bits(&self) -> Vec<u32> {
        let mut bits = vec![0_u32];
        for (number, _place) in self.properties() {
            bits.resize(bits.len().max(number / 32 + 1), 0);
            bits[number / 32] |= 1 << (number % 32);
        }
        if self.place(property::NORMAL).is_some() {
            bits[0] |= self.normals.bits();
        }
        bits[0] |= self.colors.map_or(0, ColorModel::bits);
        bits
    }
}
