//! Splats as trainers write them, or in properties, that go from file to file: batch by batch they become what a load
//! makes of them.

use super::lanes::FileColumns;
use super::plan::Plan;
use super::{Damage, FileValues, Gaussians};
use crate::cloud::buffer::{Buffer, unweave};
use crate::error::ReadFault;
use crate::formats::table_sink::names_of;
use crate::table::Field;
use std::collections::HashSet;
use surfelshop_api::columns::{
    Element, NORMAL, OPACITY, SH, SPLAT_ROTATION, SPLAT_SCALE, TANGENT_U, TANGENT_V, Values,
};
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_geometry::silent;

/// A cloud of splats as their trainer wrote them, or as the host has them with each component by itself.
pub(crate) struct TrainedSplats {
    plan: Plan,
    /// The cloud with the columns that the host has for splats.
    header: CloudHeader,
    /// Components of each column of the file.
    components: Vec<usize>,
    /// Columns that are no part of splats, each with its component where only that is none.
    others: Vec<(usize, Option<usize>)>,
    damage: Damage,
}

impl TrainedSplats {
    /// A cloud whose columns are such splats; `None` where they are not. What is odd about them becomes a warning.
    pub(crate) fn of(header: &CloudHeader, warnings: &mut Vec<String>) -> Option<Self> {
        let field = |column: &FileColumn| Field {
            names: names_of(column),
            values: Buffer::with_capacity(column.element, 0),
        };
        let fields: Vec<Field> = header.columns.iter().map(field).collect();
        if header.column(SPLAT_SCALE).is_some() {
            return None;
        }
        let plan = Plan::find(&fields, warnings)?;
        let splats = columns(&plan);
        let mut taken: HashSet<String> =
            splats.iter().map(|column| column.name.to_lowercase()).collect();
        let (mut kept, others): (Vec<FileColumn>, Vec<_>) =
            others(header, &fields, &plan).into_iter().unzip();
        let own: HashSet<String> = kept.iter().map(|column| column.name.to_lowercase()).collect();
        for column in &mut kept {
            let own_name = column.name.clone();
            while taken.contains(&column.name.to_lowercase())
                || (column.name != own_name && own.contains(&column.name.to_lowercase()))
            {
                column.name.push('_');
            }
            if column.name != own_name {
                *column = FileColumn::new(column.name.as_str(), column.components, column.element);
                warnings.push(format!(
                    "property `{own_name}` does not have the form of the column of that name and was kept as `{}`",
                    column.name
                ));
            }
            taken.insert(column.name.to_lowercase());
        }
        kept.extend(splats);
        let components = fields.iter().map(|field| field.names.len()).collect();
        let header = CloudHeader { columns: kept, ..header.clone() };
        Some(Self { plan, header, components, others, damage: Damage::default() })
    }

    /// Whether they have a trainer's names and numbers.
    pub(crate) fn are_raw(&self) -> bool {
        self.plan.is_raw
    }

    /// The cloud with the columns that the host has for splats.
    pub(crate) fn header(&self) -> &CloudHeader {
        &self.header
    }

    /// So many rows of the file's columns as those of [`header`](Self::header).
    ///
    /// # Errors
    /// Where memory runs out.
    pub(crate) fn batch(&self, values: &[Values<'_>], n: usize) -> Result<Vec<Buffer>, ReadFault> {
        let given: Vec<FileValues<'_>> =
            values.iter().copied().zip(self.components.iter().copied()).collect();
        let splats =
            Gaussians::of(&self.plan, FileColumns::Lent(&given), n, &self.damage, &silent)?;
        let mut made = Vec::with_capacity(self.header.columns.len());
        for &(column, component) in &self.others {
            let Some((values, step)) = given.get(column) else { continue };
            let mut whole = Buffer::with_capacity(values.element(), 0);
            whole.append(values).map_err(ReadFault::memory(n))?;
            made.push(match component {
                None => whole,
                Some(component) => unweave(&whole, *step).swap_remove(component),
            });
        }
        made.extend(splats.values().map(|(_, _, values)| Buffer::F32(values)));
        Ok(made)
    }

    /// What was wrong with all splats that came.
    pub(crate) fn tell(self, warnings: &mut Vec<String>) {
        self.damage.tell(warnings);
    }
}

/// The columns of the splats themselves, in the order of [`Gaussians::values`].
fn columns(plan: &Plan) -> Vec<FileColumn> {
    let own = [(OPACITY, 1), (SPLAT_SCALE, plan.scales.len()), (SPLAT_ROTATION, 4)];
    let harmonics = SH.iter().zip(&plan.harmonics).map(|(name, lanes)| (*name, lanes.len()));
    let column = |(name, n): (&str, usize)| FileColumn::new(name, n as u32, Element::F32);
    own.into_iter().chain(harmonics).map(column).collect()
}

/// What is no part of splats, with its place. Normals without tangents say nothing: trainers write zeros.
fn others(
    header: &CloudHeader,
    fields: &[Field],
    plan: &Plan,
) -> Vec<(FileColumn, (usize, Option<usize>))> {
    let has_tangents = [TANGENT_U, TANGENT_V].iter().all(|name| header.column(name).is_some());
    let used: HashSet<(usize, usize)> = plan.lanes().map(|lane| (lane.field, lane.place)).collect();
    let mut others = Vec::new();
    for (i, (column, field)) in header.columns.iter().zip(fields).enumerate() {
        let free: Vec<usize> =
            (0..field.names.len()).filter(|place| !used.contains(&(i, *place))).collect();
        if column.name == NORMAL && !has_tangents {
            continue;
        }
        if free.len() == field.names.len() {
            others.push((column.clone(), (i, None)));
            continue;
        }
        let single = |place: usize| {
            let name = field.names[place].as_str();
            (FileColumn::new(name, 1, column.element), (i, Some(place)))
        };
        others.extend(free.into_iter().map(single));
    }
    others
}
