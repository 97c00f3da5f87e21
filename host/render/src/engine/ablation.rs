//! What frames do without, drawn with all the same: to see what leaving it out saves, and that it changes
//! nothing.

use crate::engine::{Engine, RenderRequest, RendererView};
use crate::surfels::ColumnDemand;
use serde::{Serialize, Serializer};
use std::borrow::Cow;
use std::collections::HashMap;
use surfelshop_api::columns::{self, CloudView, ColumnView, NEUTRAL_ALBEDO, Values};
use surfelshop_api::graph::{Output, Structure};

/// Something that a frame can do without.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Restored {
    /// A column that nothing reads, or that clouds lack: these get one that says what goes without
    /// saying.
    Column(&'static str),
    /// Radii that are all the same, each surfel's own.
    Radii,
    /// What passes guard with a feature of this name.
    Feature(String),
    /// A picture that is not asked for.
    Output(Output),
}

impl std::fmt::Display for Restored {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Column(name) => write!(f, "column {name}"),
            Self::Radii => write!(f, "a radius for each surfel"),
            Self::Feature(name) => write!(f, "feature {name}"),
            Self::Output(output) => write!(f, "output {}", output.name()),
        }
    }
}

impl Serialize for Restored {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Columns that clouds can lack, which a value that is the same for all stands for.
const COLUMNS: [&str; 3] = [columns::COLOR, columns::AO, columns::MATERIAL];

/// Values of a column that says what goes without saying.
enum Neutral {
    Floats(Vec<f32>),
    Numbers(Vec<u32>),
}

/// What is kept, and the columns made for that.
#[derive(Default)]
pub(super) struct Keeping {
    all: Vec<Restored>,
    /// By the generation of the cloud's positions, and the name.
    made: HashMap<(u64, &'static str), Neutral>,
}

impl Keeping {
    fn keeps(&self, column: &str) -> bool {
        self.all.iter().any(|kept| matches!(kept, Restored::Column(name) if *name == column))
    }

    /// The outputs that are made.
    pub(super) fn outputs<'a>(&self, asked: &'a [Output]) -> Cow<'a, [Output]> {
        let mut outputs = Cow::Borrowed(asked);
        for kept in &self.all {
            if let Restored::Output(output) = kept
                && !asked.contains(output)
            {
                outputs.to_mut().push(output.clone());
            }
        }
        outputs
    }

    /// Has a graph do what is kept.
    pub(super) fn restore(&self, structure: &mut Structure) {
        for pass in &mut structure.passes {
            let mut next = Some(pass);
            while let Some(pass) = next {
                for (name, is_there) in &mut pass.features {
                    *is_there |= (self.all.iter())
                        .any(|kept| matches!(kept, Restored::Feature(own) if own == name));
                }
                next = pass.instead.as_deref_mut();
            }
        }
    }

    /// What is wanted besides.
    pub(super) fn wanted(&self, wanted: ColumnDemand) -> ColumnDemand {
        ColumnDemand {
            color: wanted.color || self.keeps(columns::COLOR),
            ao: wanted.ao || self.keeps(columns::AO),
            material: wanted.material || self.keeps(columns::MATERIAL),
            fields: wanted.fields,
        }
    }

    /// Makes the columns that a cloud lacks.
    pub(super) fn make(&mut self, cloud: &CloudView<'_>) {
        let Some(of) = cloud.column(columns::POSITION).map(|column| column.generation) else {
            return;
        };
        for name in COLUMNS {
            if !self.keeps(name) || cloud.column(name).is_some() {
                continue;
            }
            let n = cloud.len;
            self.made.entry((of, name)).or_insert_with(|| match name {
                columns::MATERIAL => Neutral::Numbers(vec![0; n]),
                columns::AO => Neutral::Floats(vec![1.0; n]),
                _ => Neutral::Floats(NEUTRAL_ALBEDO.repeat(n)),
            });
        }
    }

    /// A cloud with the columns made for it.
    pub(super) fn with<'v, 'a>(&'a self, cloud: &'v CloudView<'a>) -> Cow<'v, CloudView<'a>> {
        if self.made.is_empty() {
            return Cow::Borrowed(cloud);
        }
        let mut cloud = cloud.clone();
        let of = cloud.column(columns::POSITION).map(|column| column.generation);
        for (at, name) in COLUMNS.into_iter().enumerate() {
            let Some(of) = of.filter(|_| cloud.column(name).is_none()) else { continue };
            let Some(made) = self.made.get(&(of, name)) else { continue };
            let (components, values) = match made {
                Neutral::Floats(values) if name == columns::AO => (1, Values::F32(values)),
                Neutral::Floats(values) => (3, Values::F32(values)),
                Neutral::Numbers(values) => (1, Values::U32(values)),
            };
            // Generations are counted from 1, so that these are nobody's.
            let generation = u64::MAX - (of * COLUMNS.len() as u64 + at as u64);
            cloud.columns.push(ColumnView { name, components, generation, values });
        }
        Cow::Owned(cloud)
    }
}

impl Engine {
    /// Has frames drawn with these from now on, which they can do without; nothing for the usual.
    pub fn keep(&mut self, kept: Vec<Restored>) {
        self.columns.keep_radii(!self.constant_radii || kept.contains(&Restored::Radii));
        self.keeping = Keeping { all: kept, ..Keeping::default() };
        // Plans and surfaces were made without.
        self.serial = crate::engine::renderer_view::next_serial();
        self.surfaces.forget();
    }

    /// What the frame that a renderer made last did without, and could be drawn with.
    #[must_use]
    pub fn left_out(&self, renderer: &RendererView, request: &RenderRequest<'_>) -> Vec<Restored> {
        let wanted = self.columns.wanted();
        let lacks = |name: &&str| {
            let lacked = request.clouds.iter().any(|cloud| cloud.column(name).is_none());
            lacked || !wanted.reads(name)
        };
        let mut all: Vec<Restored> =
            COLUMNS.into_iter().filter(lacks).map(Restored::Column).collect();
        if request.clouds.iter().any(|cloud| self.columns.has_equal_radii(cloud)) {
            all.push(Restored::Radii);
        }
        let structure = renderer.plan.as_ref().map(|plan| &plan.structure);
        let passes = structure.into_iter().flat_map(|structure| &structure.passes);
        for (name, is_there) in passes.flat_map(|pass| &pass.features) {
            let kept = Restored::Feature(name.clone());
            if !is_there && !all.contains(&kept) {
                all.push(kept);
            }
        }
        let own = structure.into_iter().flat_map(|structure| &structure.outputs);
        let own = own.map(|(output, _)| output.clone());
        let of_host = [Output::Depth, Output::Normal, Output::Albedo, Output::Ao];
        for output in own.chain(of_host) {
            let kept = Restored::Output(output.clone());
            if !request.outputs.contains(&output) && !all.contains(&kept) {
                all.push(kept);
            }
        }
        all
    }
}
