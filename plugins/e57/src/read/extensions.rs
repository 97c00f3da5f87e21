//! Columns of the fields of extensions.

use crate::read::fields::Field;
use crate::read::layout::{Column, NORMALS, Taker, own_element, vector};
use e57::RecordName;
use std::collections::HashSet;
use surfelshop_api::columns::{
    AO, CLIP, COLOR, Element, MATERIAL, NORMAL, NORMAL_FIELD, POSITION, RADIUS, TANGENT_U,
    TANGENT_V,
};

/// Most columns of fields of extensions.
const MOST_OTHERS: usize = 1000;
/// Most components of a column.
const MOST_COMPONENTS: usize = 1000;
/// Most letters of a column's name.
const LONGEST_NAME: usize = 100;

impl Taker<'_> {
    /// The column of the extension for normals.
    pub(super) fn normals(&mut self) -> Option<Column> {
        let field = |name: &str| RecordName::Unknown {
            namespace: NORMALS.to_owned(),
            name: name.to_owned(),
        };
        let fields = self.three(&[field("normalX"), field("normalY"), field("normalZ")])?;
        let all_f32 = fields.iter().all(|&i| own_element(&self.fields[i]) == Element::F32);
        let element = if all_f32 { Element::F32 } else { Element::F64 };
        Some(vector(NORMAL, element, fields.to_vec()))
    }

    /// The columns of fields of extensions: those called `NAME-0`, `NAME-1` and so on together.
    pub(super) fn others(&mut self, columns: &[Column]) -> Vec<Column> {
        // Names that differ in their case alone are the same to the host.
        let mut names: HashSet<String> = columns.iter().map(|c| c.file.name.clone()).collect();
        names.insert(POSITION.to_owned());
        let (mut others, mut next) = (Vec::new(), 0);
        while let Some(field) = self.fields.get(next).filter(|_| others.len() < MOST_OTHERS) {
            let first = next;
            next += 1;
            let RecordName::Unknown { namespace, name } = &field.name else { continue };
            if self.taken[first] {
                continue;
            }
            let base = name.strip_suffix("-0").filter(|base| !base.is_empty());
            let same = base.map_or(1, |base| self.components(first, namespace, base));
            next = first + same;
            self.taken[first..next].fill(true);
            let name = base.filter(|_| same > 1).unwrap_or(name);
            let mut unique: String = name.chars().take(LONGEST_NAME).collect();
            if !may_have(&unique, same) || names.contains(&unique.to_lowercase()) {
                let prefix = namespace.chars().take(LONGEST_NAME);
                unique = prefix.chain(['_']).chain(unique.chars()).collect();
            }
            let plain = unique.clone();
            for number in 2.. {
                if names.insert(unique.to_lowercase()) {
                    break;
                }
                unique = format!("{plain}_{number}");
            }
            let element = own_element(field);
            let all_same = self.fields[first..next].iter().all(|f| own_element(f) == element);
            let element = if all_same { element } else { Element::F64 };
            others.push(vector(&unique, element, (first..next).collect()));
        }
        others
    }

    /// How many fields from here on are the components of one column.
    fn components(&self, first: usize, namespace: &str, base: &str) -> usize {
        let rest = self.fields[first..].iter().zip(&self.taken[first..]);
        let is_next = |(i, (field, taken)): &(usize, (&Field, &bool))| match &field.name {
            RecordName::Unknown { namespace: found, name } => {
                !**taken && found == namespace && *name == format!("{base}-{i}")
            }
            _ => false,
        };
        rest.enumerate().take(MOST_COMPONENTS).take_while(is_next).count().max(1)
    }
}

/// Whether a column of an extension may have this name with so many components: some have a meaning.
fn may_have(name: &str, components: usize) -> bool {
    match name.to_lowercase().as_str() {
        POSITION | COLOR => false,
        NORMAL | TANGENT_U | TANGENT_V => components == 3,
        RADIUS | AO | MATERIAL => components == 1,
        NORMAL_FIELD => components == 4,
        CLIP => components == 7,
        _ => true,
    }
}
