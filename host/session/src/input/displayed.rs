//! The clouds as they are displayed: coloured and filtered by their attributes.

use crate::input::clouds::Clouds;
use crate::input::formats::SessionFormats;
use crate::input::scenes::Source;
use crate::output::terminal;
use anyhow::Context as _;
use serde_json::{Value, json};
use std::sync::Arc;
use surfelshop_cloud::display::{
    Colors, Display, DisplayError, DisplaySettings, Legend, Scale, Statistics, hiding,
};
use surfelshop_cloud::selection::{
    RegionSelection, Selection, SelectionError, SurfelRuns, Tint, tinted,
};
use surfelshop_cloud::{Cloud, Loaded, Summary};

/// Clouds as they are displayed.
pub struct DisplayedClouds {
    /// The clouds that renderers and tracers get.
    pub clouds: Arc<Clouds>,
    /// For each the indices of its surfels in the cloud that it was made of; `None` where it has all.
    kept: Vec<Option<Arc<[u32]>>>,
    display: Arc<Display>,
    /// Surfels of all clouds, hidden ones too.
    n_surfels: u64,
}

impl DisplayedClouds {
    /// Reads clouds, and displays them as settings say.
    pub fn read(
        sources: &[Source],
        settings: &DisplaySettings,
        formats: &SessionFormats,
    ) -> anyhow::Result<Self> {
        Self::shown(Self::read_whole(sources, formats)?, settings)
    }

    /// Reads clouds, with what a scene hides by hand.
    pub(crate) fn read_whole(
        sources: &[Source],
        formats: &SessionFormats,
    ) -> anyhow::Result<Clouds> {
        let mut clouds = Clouds::read(sources, formats)?;
        for (source, loaded) in sources.iter().zip(&mut clouds.loaded) {
            if let Some(hidden) = &source.hidden {
                hide(loaded, hidden, source.place.as_deref())?;
            }
        }
        Ok(clouds)
    }

    /// Displays clouds as settings say, and says where nothing is shown.
    pub(crate) fn shown(clouds: Clouds, settings: &DisplaySettings) -> anyhow::Result<Self> {
        let clouds = Arc::new(clouds);
        let displayed = Self::new(&clouds, settings)?;
        if let Some(line) = below_the_scale(displayed.display.colors(), &clouds, settings) {
            terminal::note(line);
        }
        let n = displayed.n_surfels;
        // Of a pyramid the merged surfels do not say what is shown.
        if displayed.clouds.facts.n_surfels == 0 && n > 0 && displayed.clouds.pyramids.is_empty() {
            terminal::note(format!("nothing is shown: the filters hide all {n} surfels"));
        }
        Ok(displayed)
    }

    /// Clouds as they are.
    pub fn plain(whole: &Arc<Clouds>) -> Self {
        let (clouds, n_surfels) = (whole.clone(), whole.facts.n_surfels);
        Self { clouds, kept: vec![None; whole.loaded.len()], display: Arc::default(), n_surfels }
    }

    /// Clouds as settings say. What is plain is displayed as it is.
    ///
    /// # Errors
    /// Where a column is in none of them, or its numbers cannot be displayed as asked.
    pub fn new(whole: &Arc<Clouds>, settings: &DisplaySettings) -> Result<Self, DisplayError> {
        let n_surfels = whole.facts.n_surfels;
        if settings.is_plain(whole.loaded.iter().map(|loaded| &loaded.cloud)) {
            return Ok(Self::plain(whole));
        }
        let clouds: Vec<&Cloud> = whole.loaded.iter().map(|loaded| &loaded.cloud).collect();
        let display = Arc::new(Display::new(settings, &clouds)?);
        let (mut loaded, mut kept) =
            (Vec::with_capacity(clouds.len()), Vec::with_capacity(clouds.len()));
        let mut pyramids = Vec::new();
        for Loaded { cloud, summary } in &whole.loaded {
            let displayed = display.of(cloud)?;
            let shown = whole
                .pyramid_of(cloud)
                .map(|pyramid| pyramid.displayed(&display, &displayed.cloud));
            pyramids.extend(shown.map(Arc::new));
            loaded.push(Loaded { cloud: displayed.cloud, summary: summary.clone() });
            kept.push(displayed.kept);
        }
        let clouds = Clouds { standpoint: whole.standpoint, pyramids, ..Clouds::of(loaded) };
        Ok(Self { clouds: Arc::new(clouds), kept, display, n_surfels })
    }

    /// The same with what is selected tinted; for each cloud a selection of the cloud that it was made of, or of a
    /// pyramid, which is tinted in full. What is not selected stays as it is.
    ///
    /// # Errors
    /// Where a pyramid lacks an attribute, or there is no memory.
    pub fn tinted(
        self,
        selections: &[Option<Selected>],
        tint: Tint,
    ) -> Result<Self, SelectionError> {
        if selections.iter().flatten().all(Selected::is_empty) {
            return Ok(self);
        }
        let (mut loaded, mut pyramids) = (self.clouds.loaded.clone(), self.clouds.pyramids.clone());
        for (i, shown) in loaded.iter_mut().enumerate() {
            match selections.get(i).and_then(Option::as_ref) {
                None => {}
                Some(Selected::Surfels(selection)) => {
                    shown.cloud = tinted(&shown.cloud, selection, self.rows(i), tint)?;
                }
                Some(Selected::Regions(regions, _)) => {
                    let own = pyramids.iter_mut().find(|own| own.is_seen_as(&shown.cloud));
                    if let Some(own) = own {
                        *own = Arc::new(own.selecting(regions));
                    }
                    let selection = regions.select_in_world(&shown.cloud)?;
                    shown.cloud = tinted(&shown.cloud, &selection, None, Tint::Full)?;
                }
            }
        }
        let standpoint = self.clouds.standpoint;
        let clouds = Clouds { standpoint, pyramids, ..Clouds::of(loaded) };
        Ok(Self { clouds: Arc::new(clouds), ..self })
    }

    /// The surfels of a cloud that are shown, ascending; `None` where all are.
    pub fn rows(&self, cloud: usize) -> Option<&[u32]> {
        self.kept.get(cloud).and_then(Option::as_deref)
    }

    /// How the load of each cloud went.
    pub fn summaries(&self) -> Vec<&Summary> {
        self.clouds.loaded.iter().map(|loaded| &loaded.summary).collect()
    }

    /// What colours and filters them.
    pub fn display(&self) -> &Display {
        &self.display
    }

    /// The index of a cloud's surfel in the cloud that it was made of.
    pub fn source_index(&self, cloud: usize, index: usize) -> usize {
        let kept = self.kept.get(cloud).and_then(Option::as_ref);
        kept.and_then(|kept| kept.get(index)).map_or(index, |source| *source as usize)
    }

    /// What the colours mean; `None` where they are no numbers.
    pub fn legend(&self) -> Option<Legend> {
        self.display.legend()
    }

    /// Surfels that filters hide.
    pub fn n_hidden(&self) -> u64 {
        self.n_surfels - self.clouds.facts.n_surfels
    }

    /// What colours and filters them, in one line; `None` where nothing does.
    pub fn line(&self) -> Option<String> {
        let colored = match self.display.colors() {
            Colors::File => None,
            Colors::Uniform([red, green, blue]) => Some(format!("#{red:02x}{green:02x}{blue:02x}")),
            Colors::Normal(_) => Some("normal".to_owned()),
            Colors::Ramp(ramp) => {
                let [low, high] = ramp.range;
                let (title, map) = (ramp.attribute.title(), ramp.map.name());
                Some(format!("{title} from {low} to {high}, {map}, {}", ramp.scale.name()))
            }
            Colors::Categories(categories) => {
                Some(format!("{}, categories", categories.attribute.title()))
            }
        };
        let colored = colored.map(|by| format!("Coloured by {by}."));
        let filters = self.display.filters();
        let filtered = (!filters.is_empty()).then(|| {
            let filters: Vec<String> = filters.iter().map(ToString::to_string).collect();
            format!("Filters, which hide {} surfels: {}.", self.n_hidden(), filters.join(", "))
        });
        let splats = self.display.splats().to_string();
        let shaped = (!splats.is_empty()).then(|| format!("Drawn as {splats}."));
        let lines: Vec<String> = colored.into_iter().chain(filtered).chain(shaped).collect();
        (!lines.is_empty()).then(|| lines.join(" "))
    }

    /// What colours and filters them, in JSON.
    pub fn object(&self) -> Value {
        let filters: Vec<String> = self.display.filters().iter().map(ToString::to_string).collect();
        json!({
            "color": color_object(self.display.colors()),
            "filters": filters,
            "splats": self.display.splats().to_string(),
            "surfels_hidden": self.n_hidden(),
        })
    }
}

/// The share of the surfels that stand for a pyramid which is selected, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelectedShare(pub f64);

/// What is selected of a cloud.
#[derive(Clone)]
pub enum Selected {
    /// Some of its surfels.
    Surfels(Arc<Selection>),
    /// What lies in regions, of a pyramid.
    Regions(Arc<RegionSelection>, SelectedShare),
}

impl Selected {
    /// Whether both share what is selected.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Surfels(one), Self::Surfels(other)) => Arc::ptr_eq(one, other),
            (Self::Regions(one, _), Self::Regions(other, _)) => Arc::ptr_eq(one, other),
            _ => false,
        }
    }

    /// Whether surely nothing is selected.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Surfels(selection) => selection.is_empty(),
            Self::Regions(regions, _) => regions.steps.is_empty(),
        }
    }
}

/// Hides surfels of a cloud that was read.
///
/// # Errors
/// Where the cloud has another number of surfels than the scene says: its file was changed since.
pub fn hide(loaded: &mut Loaded, hidden: &SurfelRuns, place: Option<&str>) -> anyhow::Result<()> {
    let said = || {
        let file = place.unwrap_or(&loaded.summary.file);
        format!(
            "{file}: `hidden` is of another state of the cloud's file; remove the line, and hide surfels again"
        )
    };
    let selection = hidden.selection(loaded.cloud.len()).with_context(said)?;
    let cloud = hiding(&loaded.cloud, &selection).with_context(said)?;
    loaded.cloud = cloud;
    Ok(())
}

/// What a logarithmic scale does not tell apart, in a line.
fn below_the_scale(colors: &Colors, clouds: &Clouds, settings: &DisplaySettings) -> Option<String> {
    let Colors::Ramp(ramp) = colors else { return None };
    if ramp.scale != Scale::Logarithmic {
        return None;
    }
    let all: Vec<&Cloud> = clouds.loaded.iter().map(|loaded| &loaded.cloud).collect();
    let known = Statistics::of(&all, &ramp.attribute, settings.up).ok()?;
    let [least, _] = known.ends()?;
    (least <= 0.0).then(|| {
        let name = ramp.attribute.title();
        format!("the scale of `{name}` is logarithmic: what is 0 or less has the colour of its lower end")
    })
}

/// What colours surfels, in JSON.
fn color_object(colors: &Colors) -> Value {
    match colors {
        Colors::File => json!({ "by": "file" }),
        Colors::Uniform(color) => json!({ "by": "uniform", "color": color }),
        Colors::Normal(up) => json!({ "by": "normal", "up": up.name() }),
        Colors::Ramp(ramp) => json!({
            "by": ramp.attribute.name(),
            "component": ramp.attribute.component(),
            "map": ramp.map.name(),
            "scale": ramp.scale.name(),
            "range": ramp.range,
        }),
        Colors::Categories(categories) => json!({
            "by": categories.attribute.name(),
            "component": categories.attribute.component(),
            "map": "categories",
            "surfels": categories.counts.iter()
                .map(|(value, n)| (value.to_string(), json!(n)))
                .collect::<serde_json::Map<_, _>>(),
        }),
    }
}
