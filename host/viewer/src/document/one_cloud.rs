//! Views that show one of the clouds alone.

use super::open_clouds::OpenClouds;
use std::sync::Arc;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::scenes::NamedRenderer;

/// The clouds of views that show one of them, made once for each revision.
#[derive(Default)]
pub(crate) struct OneCloud {
    revision: u64,
    made: Vec<(usize, Arc<Clouds>)>,
}

/// What a view shows of the clouds.
pub(crate) struct Part {
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) named: Vec<Option<NamedRenderer>>,
    /// The cloud's place among the visible ones; none for all.
    pub(crate) index: Option<usize>,
}

impl OneCloud {
    /// The visible cloud of a name, of clouds as they are displayed; all of them where none is asked for, or none has
    /// that name.
    pub(crate) fn part(
        &mut self,
        (clouds, revision): (&Arc<Clouds>, u64),
        open_clouds: &OpenClouds,
        name: Option<&String>,
    ) -> Part {
        let named = open_clouds.named();
        let mut visible = open_clouds.all().iter().filter(|cloud| cloud.visible);
        let index = name.and_then(|name| visible.position(|cloud| cloud.name() == *name));
        let whole = |named| Part { clouds: clouds.clone(), named, index: None };
        let Some(index) = index.filter(|_| clouds.loaded.len() > 1) else { return whole(named) };
        let Some(loaded) = clouds.loaded.get(index) else { return whole(named) };
        if self.revision != revision {
            (self.revision, self.made) = (revision, Vec::new());
        }
        let made = match self.made.iter().find(|(other, _)| *other == index) {
            Some((_, made)) => made.clone(),
            None => {
                let (pyramids, standpoint) = (clouds.pyramids.clone(), clouds.standpoint);
                let one = Clouds::of(vec![loaded.clone()]);
                let made = Arc::new(Clouds { pyramids, standpoint, ..one });
                self.made.push((index, made.clone()));
                made
            }
        };
        let named = named.get(index).cloned().into_iter().collect();
        Part { clouds: made, named, index: Some(index) }
    }
}
