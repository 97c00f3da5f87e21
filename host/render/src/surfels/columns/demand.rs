//! Which of the columns that a cloud can do without are drawn with: those that something drawn of late
//! reads.

use surfelshop_api::columns;

/// Frames a column survives without being drawn.
pub(crate) const KEPT_FRAMES: u64 = 64;

/// Columns that drawing can do without, and whether they are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ColumnDemand {
    pub(crate) color: bool,
    pub(crate) ao: bool,
    pub(crate) material: bool,
    /// Normal fields.
    pub(crate) fields: bool,
}

impl ColumnDemand {
    /// All of them.
    pub(crate) const ALL: Self = Self { color: true, ao: true, material: true, fields: true };

    /// Whether a column of this name is wanted; surfels cannot be drawn without the others.
    pub(crate) fn reads(self, name: &str) -> bool {
        match name {
            columns::COLOR => self.color,
            columns::AO => self.ao,
            columns::MATERIAL => self.material,
            columns::NORMAL_FIELD => self.fields,
            _ => true,
        }
    }

    /// What either wants.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            color: self.color || other.color,
            ao: self.ao || other.ao,
            material: self.material || other.material,
            fields: self.fields || other.fields,
        }
    }

    /// The same where surfels are merged: never those of different materials.
    pub(crate) fn for_merged(self, merged: bool) -> Self {
        Self { material: self.material || merged, ..self }
    }
}

/// When each was wanted last. Views that are drawn in turns want different ones, and a column that came
/// and went with each would cost more than it takes.
#[derive(Clone, Debug, Default)]
pub(crate) struct DemandHistory {
    /// Of colour, accessibility, material and normal fields; nothing before the first frame.
    last: Option<[u64; 4]>,
}

impl DemandHistory {
    /// Hears what a frame wants. Frames are numbered from 1.
    pub(crate) fn hear(&mut self, wanted: ColumnDemand, frame: u64) {
        let last = self.last.get_or_insert_default();
        let all = [wanted.color, wanted.ao, wanted.material, wanted.fields];
        for (last, wanted) in last.iter_mut().zip(all) {
            if wanted {
                *last = frame;
            }
        }
    }

    /// Lets a frame pass that reads nothing of its own.
    pub(crate) fn wait(&mut self) {
        for last in self.last.iter_mut().flatten().filter(|last| **last > 0) {
            *last += 1;
        }
    }

    /// What is wanted now: everything, as long as nothing is known.
    pub(crate) fn at(&self, frame: u64) -> ColumnDemand {
        let Some(last) = self.last else { return ColumnDemand::ALL };
        let oldest = frame.saturating_sub(KEPT_FRAMES).max(1);
        let [color, ao, material, fields] = last.map(|last| last >= oldest);
        ColumnDemand { color, ao, material, fields }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_last_a_while() {
        let mut wishes = DemandHistory::default();
        assert_eq!(wishes.at(0), ColumnDemand::ALL, "nothing is known yet");
        let color = ColumnDemand { color: true, ..ColumnDemand::default() };
        wishes.hear(color, 1);
        assert_eq!(wishes.at(1), color);
        let ao = ColumnDemand { ao: true, ..ColumnDemand::default() };
        wishes.hear(ao, 2);
        assert_eq!(wishes.at(2), ColumnDemand { color: true, ao: true, ..ColumnDemand::default() });
        assert_eq!(
            wishes.at(1 + KEPT_FRAMES),
            ColumnDemand { color: true, ao: true, ..ColumnDemand::default() }
        );
        assert_eq!(wishes.at(2 + KEPT_FRAMES), ao);
        assert_eq!(wishes.at(3 + KEPT_FRAMES), ColumnDemand::default());
        wishes.wait();
        assert_eq!(
            wishes.at(3 + KEPT_FRAMES),
            ao,
            "frames that read nothing of their own do not count"
        );
        assert!(ColumnDemand::default().reads(columns::NORMAL) && !ao.reads(columns::COLOR));
    }
}
