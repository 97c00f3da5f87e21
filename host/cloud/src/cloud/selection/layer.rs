//! Edits of clouds that are larger than memory: what is done where, kept beside the cloud and done to what is read of
//! it.

use super::{
    NamedStroke, Reach, RegionSelection, Selection, SelectionError, StrokeTools, set_column,
};
use crate::cloud::Cloud;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::hash::{Hash as _, Hasher as _};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use surfelshop_api::columns::{POSITION, RADIUS, TANGENT_U, TANGENT_V};

/// What an edit does with what is selected and not hidden.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LayerChange {
    /// It is no more there.
    Delete,
    /// It is not shown, and edits leave it alone until all is shown.
    Hide,
    /// All that is hidden is shown again, whatever is selected.
    ShowAll,
    /// A column gets values, one for each component; see [`with_value`](super::with_value).
    Set {
        /// The column; none that says where surfels are and how large.
        column: String,
        /// The values.
        values: Vec<f64>,
    },
    /// A tool is led along a stroke. It changes values or takes surfels away, and moves none.
    Stroke(NamedStroke),
}

/// An edit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LayerEdit {
    /// Tells edits apart that are in memory; none has 0.
    #[serde(skip, default = "next_id")]
    id: u64,
    /// What is edited.
    select: RegionSelection,
    /// What is done with it.
    change: LayerChange,
}

/// Edits, one after the other. A clone shares them.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(into = "Vec<LayerEdit>", from = "Vec<LayerEdit>")]
pub struct EditLayer {
    edits: Vec<Arc<LayerEdit>>,
    /// What runs the tools of strokes.
    tools: Option<Arc<dyn StrokeTools>>,
}

/// What becomes of surfels that edits hide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HiddenOnes {
    /// They are left out.
    LeftOut,
    /// They stay.
    Stay,
}

/// A ball around all surfels that are looked at: its middle in the coordinates of the cloud's file, and its radius.
pub type Ball = (DVec3, f64);

/// Columns that nodes of pyramids are placed by.
const PLACES: [&str; 4] = [POSITION, RADIUS, TANGENT_U, TANGENT_V];

/// Components of a column that an edit makes, at most: those of harmonics have 45.
const MOST_COMPONENTS: usize = 64;

fn next_id() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

impl From<EditLayer> for Vec<LayerEdit> {
    fn from(layer: EditLayer) -> Self {
        layer.edits.iter().map(|edit| LayerEdit::clone(edit)).collect()
    }
}

impl From<Vec<LayerEdit>> for EditLayer {
    fn from(edits: Vec<LayerEdit>) -> Self {
        Self { edits: edits.into_iter().map(Arc::new).collect(), tools: None }
    }
}

/// Equal where they have the same edits, made or read at the same time.
impl PartialEq for EditLayer {
    fn eq(&self, other: &Self) -> bool {
        let ids = |layer: &Self| layer.edits.iter().map(|edit| edit.id).collect::<Vec<_>>();
        ids(self) == ids(other)
    }
}

impl EditLayer {
    /// Whether nothing is edited.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.edits.is_empty()
    }

    /// How many edits there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.edits.len()
    }

    /// The same with another edit.
    #[must_use]
    pub fn with(&self, select: RegionSelection, change: LayerChange) -> Self {
        let edit = LayerEdit { id: next_id(), select, change };
        let edits = self.edits.iter().cloned().chain([Arc::new(edit)]).collect();
        Self { edits, tools: self.tools.clone() }
    }

    /// The same, with strokes done by these tools.
    #[must_use]
    pub fn with_tools(self, tools: Arc<dyn StrokeTools>) -> Self {
        Self { tools: Some(tools), ..self }
    }

    /// The edits that follow those of another layer, where it has these first.
    #[must_use]
    pub fn since(&self, before: &Self) -> Option<Self> {
        let (first, rest) = self.edits.split_at_checked(before.edits.len())?;
        let ids = |edits: &[Arc<LayerEdit>]| edits.iter().map(|edit| edit.id).collect::<Vec<_>>();
        (ids(first) == ids(&before.edits))
            .then(|| Self { edits: rest.to_vec(), tools: self.tools.clone() })
    }

    /// The same with all shown that is hidden.
    #[must_use]
    pub fn showing_all(&self) -> Self {
        match self.hides() {
            true => self.with(RegionSelection::default(), LayerChange::ShowAll),
            false => self.clone(),
        }
    }

    /// Whether the last edit changes values; an eraser that is led may take surfels away, too.
    #[must_use]
    pub fn sets_values(&self) -> bool {
        let sets = |change: &LayerChange| {
            matches!(change, LayerChange::Set { .. } | LayerChange::Stroke(_))
        };
        self.edits.last().is_some_and(|edit| sets(&edit.change))
    }

    /// Whether something may be hidden.
    #[must_use]
    pub fn hides(&self) -> bool {
        self.edits.iter().fold(false, |hides, edit| match edit.change {
            LayerChange::Hide => true,
            LayerChange::ShowAll => false,
            LayerChange::Delete | LayerChange::Set { .. } | LayerChange::Stroke(_) => hides,
        })
    }

    /// Whether all edits can be done to a cloud with these columns, of which one surfel is enough.
    ///
    /// # Errors
    /// Where a value does not fit its column or is no number, a column says where surfels are or how large, or a tool is not
    /// there.
    pub fn check(&self, cloud: &Cloud) -> Result<(), SelectionError> {
        let mask: Vec<bool> = (0..cloud.len()).map(|i| i == 0).collect();
        let one = cloud.keep(&mask)?;
        let all = Selection::of(one.len(), |_| true)?;
        for edit in &self.edits {
            one.transformed(&edit.select.placed)?;
        }
        self.edits.iter().try_fold(one, |one, edit| match &edit.change {
            LayerChange::Delete | LayerChange::Hide | LayerChange::ShowAll => Ok(one),
            LayerChange::Stroke(led) => {
                let failed = |line| SelectionError::Tool { tool: led.tool.clone(), line };
                self.tools(led)?.check(led).map_err(failed)?;
                led.check(&one)?;
                Ok(one)
            }
            LayerChange::Set { column, values } => {
                let wrong = |expected: &str, found: String| SelectionError::Value {
                    column: column.clone(),
                    expected: expected.to_owned(),
                    found,
                };
                if PLACES.contains(&column.as_str()) {
                    let expected = "a column that does not say where surfels are or how large";
                    return Err(wrong(expected, format!("`{column}`")));
                }
                if !(1..=MOST_COMPONENTS).contains(&values.len()) {
                    let expected = format!("1 to {MOST_COMPONENTS} values");
                    return Err(wrong(&expected, values.len().to_string()));
                }
                if let Some(value) = values.iter().find(|value| !value.is_finite()) {
                    return Err(wrong("a number", value.to_string()));
                }
                set_column(&one, &all, column, values)
            }
        })?;
        Ok(())
    }

    /// Tells apart what edits make of what is within a ball: equal numbers come from the same edits, and none does
    /// anything where it is 0. `has` says which columns the cloud has: one that is made is made everywhere.
    #[must_use]
    pub fn version(&self, ball: Ball, has: impl Fn(&str) -> bool) -> u64 {
        let mut hasher = siphasher::sip::SipHasher13::new();
        let mut n = 0;
        for edit in &self.edits {
            let concerns = match &edit.change {
                LayerChange::ShowAll => n > 0,
                LayerChange::Set { column, .. } => !has(column) || edit.reaches(ball),
                LayerChange::Delete | LayerChange::Hide | LayerChange::Stroke(_) => {
                    edit.reaches(ball)
                }
            };
            if concerns {
                edit.id.hash(&mut hasher);
                n += 1;
            }
        }
        if n == 0 { 0 } else { hasher.finish() }
    }

    /// Whether nothing is left of what is within a ball, as far as that is told quickly.
    #[must_use]
    pub fn removes(&self, ball: Ball, hidden: HiddenOnes) -> bool {
        // Whether surfels may be shown, and may be hidden.
        let (mut shown, mut hides) = (true, false);
        for edit in &self.edits {
            match edit.change {
                LayerChange::Set { .. } | LayerChange::Stroke(_) => {}
                LayerChange::ShowAll => (shown, hides) = (shown || hides, false),
                LayerChange::Delete => shown &= edit.select.reach(ball.0, ball.1) != Reach::All,
                LayerChange::Hide => {
                    let reach = edit.select.reach(ball.0, ball.1);
                    hides |= shown && reach != Reach::Nothing;
                    shown &= reach != Reach::All;
                }
            }
        }
        !shown && (hidden == HiddenOnes::LeftOut || !hides)
    }

    /// A cloud, or a part of it, as its file has it, with the edits done. All of its surfels are within a ball, where
    /// one is given. What remains may be empty.
    ///
    /// # Errors
    /// Where the cloud lacks an attribute, a value does not fit its column, or there is no memory.
    pub fn applied(
        &self,
        cloud: Cloud,
        ball: Option<Ball>,
        hidden: HiddenOnes,
    ) -> Result<Cloud, SelectionError> {
        let mut edited = Edited { cloud, hidden: None };
        for edit in &self.edits {
            let reaches = ball.is_none_or(|ball| edit.reaches(ball));
            edited = match &edit.change {
                LayerChange::Stroke(led) => edit.led(edited, reaches, led, self.tools(led)?)?,
                _ => edit.applied(edited, reaches)?,
            };
        }
        match edited {
            Edited { cloud, hidden: Some(some) } if hidden == HiddenOnes::LeftOut => {
                Ok(cloud.keep(&some.inverted().mask())?)
            }
            Edited { cloud, .. } => Ok(cloud),
        }
    }

    /// What runs the tool of a stroke.
    fn tools(&self, led: &NamedStroke) -> Result<&dyn StrokeTools, SelectionError> {
        self.tools.as_deref().ok_or_else(|| SelectionError::Tool {
            tool: led.tool.clone(),
            line: "no tools are run here".to_owned(),
        })
    }
}

/// A cloud while edits are done to it.
struct Edited {
    cloud: Cloud,
    /// What is hidden of it.
    hidden: Option<Selection>,
}

impl LayerEdit {
    /// Whether it may change something of a ball.
    fn reaches(&self, (middle, radius): Ball) -> bool {
        let is_near = || match &self.change {
            LayerChange::Stroke(led) => {
                let (middle, radius) = self.select.in_world(middle, radius);
                led.reaches(middle, radius)
            }
            _ => true,
        };
        self.select.reach(middle, radius) != Reach::Nothing && is_near()
    }

    /// What is selected of a cloud and not hidden.
    fn chosen(&self, edited: &Edited) -> Result<Selection, SelectionError> {
        let Edited { cloud, hidden } = edited;
        // Of nothing there are columns, too.
        let chosen = match cloud.is_empty() {
            true => Selection::none(0)?,
            false => self.select.select(cloud)?,
        };
        match hidden {
            Some(hidden) => chosen.combined(hidden, super::Combine::Subtract),
            None => Ok(chosen),
        }
    }

    /// With a tool led along a stroke.
    fn led(
        &self,
        edited: Edited,
        reaches: bool,
        led: &NamedStroke,
        tools: &dyn StrokeTools,
    ) -> Result<Edited, SelectionError> {
        if !reaches || edited.cloud.is_empty() {
            return Ok(edited);
        }
        let chosen = self.chosen(&edited)?;
        let (cloud, kept) = led.applied(tools, &edited.cloud, (&self.select.placed, &chosen))?;
        let hidden = match (kept, edited.hidden) {
            (Some(kept), Some(hidden)) => Some(of_kept(&hidden, &kept)?),
            (_, hidden) => hidden,
        };
        Ok(Edited { cloud, hidden })
    }

    fn applied(&self, edited: Edited, reaches: bool) -> Result<Edited, SelectionError> {
        let Edited { cloud, hidden } = edited;
        let is_idle = match &self.change {
            LayerChange::ShowAll => return Ok(Edited { cloud, hidden: None }),
            LayerChange::Delete | LayerChange::Hide => !reaches,
            LayerChange::Set { column, .. } => !reaches && cloud.column(column).is_some(),
            LayerChange::Stroke(_) => true,
        };
        let is_column = matches!(self.change, LayerChange::Set { .. });
        if is_idle || cloud.is_empty() && !is_column {
            return Ok(Edited { cloud, hidden });
        }
        let edited = Edited { cloud, hidden };
        let chosen = self.chosen(&edited)?;
        let Edited { cloud, hidden } = edited;
        match &self.change {
            LayerChange::Set { column, values } => {
                Ok(Edited { cloud: set_column(&cloud, &chosen, column, values)?, hidden })
            }
            LayerChange::Hide => {
                let hidden = match hidden {
                    Some(before) => before.combined(&chosen, super::Combine::Add)?,
                    None => chosen,
                };
                Ok(Edited { cloud, hidden: Some(hidden).filter(|hidden| !hidden.is_empty()) })
            }
            LayerChange::Delete if !chosen.is_empty() => {
                let mask = chosen.inverted().mask();
                let hidden = hidden.map(|hidden| of_kept(&hidden, &mask));
                Ok(Edited { cloud: cloud.keep(&mask)?, hidden: hidden.transpose()? })
            }
            LayerChange::Delete | LayerChange::ShowAll | LayerChange::Stroke(_) => {
                Ok(Edited { cloud, hidden })
            }
        }
    }
}

/// What is selected of the surfels that are kept.
fn of_kept(selection: &Selection, kept: &[bool]) -> Result<Selection, SelectionError> {
    let kept: Vec<usize> = (0..kept.len()).filter(|&i| kept[i]).collect();
    Selection::of(kept.len(), |i| selection.contains(kept[i]))
}
