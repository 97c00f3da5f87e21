//! The clouds that are open: those on show and hidden ones, as they are now and as they are on disk.

use super::recovery::Row;
use crate::clouds::Clouds;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use surfelshop_cloud::{Cloud, Column, Loaded, Summary};

/// A cloud that is open.
#[derive(Clone)]
pub(crate) struct Item {
    pub(crate) loaded: Loaded,
    pub(crate) visible: bool,
    /// Its place among the clouds of the scene; none where it came after.
    pub(crate) entry: Option<usize>,
    /// The file it was saved to since it was opened.
    pub(crate) saved_as: Option<PathBuf>,
    /// Generations of the columns that its file has.
    on_disk: Vec<u64>,
    /// Whether its edits are those of a window that is gone.
    pub(crate) recovered: bool,
}

impl Item {
    fn read(loaded: Loaded, entry: usize) -> Self {
        let on_disk = generations(&loaded.cloud);
        let (visible, entry, recovered) = (true, Some(entry), false);
        Self { loaded, visible, entry, saved_as: None, on_disk, recovered }
    }

    /// What it is called: its file's name, or that of the cloud it was made from and the tool.
    pub(crate) fn name(&self) -> String {
        let path = self.saved_as.as_deref().unwrap_or(Path::new(&self.loaded.summary.file));
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_else(|| self.loaded.summary.file.clone())
    }

    /// Whether its file does not have what it has.
    pub(crate) fn is_unsaved(&self) -> bool {
        self.on_disk != generations(&self.loaded.cloud)
    }
}

/// Equal generations mean equal values.
pub(crate) fn generations(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

/// All clouds that are open; a clone shares them.
#[derive(Clone)]
pub(crate) struct Stock {
    items: Arc<Vec<Item>>,
    /// Those on show.
    pub(crate) clouds: Arc<Clouds>,
}

/// Stocks are equal where the same is on show and the same is hidden, saved or not.
impl PartialEq for Stock {
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, b): (&Item, &Item)| {
            a.visible == b.visible && generations(&a.loaded.cloud) == generations(&b.loaded.cloud)
        };
        Arc::ptr_eq(&self.items, &other.items)
            || self.items.len() == other.items.len()
                && self.items.iter().zip(&*other.items).all(same)
    }
}

impl Stock {
    /// Clouds that were read, with their places in the scene.
    pub(crate) fn read(clouds: Clouds, entries: &[usize]) -> Self {
        let items = clouds.loaded.iter().zip(entries);
        let items = items.map(|(loaded, entry)| Item::read(loaded.clone(), *entry)).collect();
        Self { items: Arc::new(items), clouds: Arc::new(clouds) }
    }

    /// Clouds that were read again, as the rows of their places say.
    pub(crate) fn recovered(clouds: Clouds, entries: &[usize], rows: &[Row]) -> Self {
        let item = |(loaded, at): (&Loaded, &usize)| {
            let mut item = Item::read(loaded.clone(), *at);
            if let Some(row) = rows.iter().find(|row| row.at == *at) {
                (item.visible, item.saved_as) = (row.visible, row.saved_as.clone());
                item.entry = row.was_opened.then_some(*at);
                if row.file.is_some() {
                    item.loaded.summary.file.clone_from(&row.name);
                    (item.on_disk, item.recovered) = (Vec::new(), true);
                }
            }
            item
        };
        Self::of(clouds.loaded.iter().zip(entries).map(item).collect())
    }

    /// Whether it is the very same, with the same saved.
    pub(crate) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.items, &other.items)
    }

    fn of(items: Vec<Item>) -> Self {
        let shown = items.iter().filter(|item| item.visible).map(|item| item.loaded.clone());
        Self { clouds: Arc::new(Clouds::of(shown.collect())), items: Arc::new(items) }
    }

    /// The clouds, hidden ones too.
    pub(crate) fn items(&self) -> &[Item] {
        &self.items
    }

    fn changed(&self, index: usize, change: impl FnOnce(&mut Item)) -> Self {
        let mut items = self.items.to_vec();
        if let Some(item) = items.get_mut(index) {
            change(item);
        }
        Self::of(items)
    }

    /// With another cloud in the place of one.
    pub(crate) fn edited(&self, index: usize, cloud: Cloud) -> Self {
        self.changed(index, |item| item.loaded.cloud = cloud)
    }

    /// With a cloud that a tool made of another one, which is hidden.
    pub(crate) fn derived(&self, from: usize, cloud: Cloud, tool: &str) -> Self {
        let mut items = self.items.to_vec();
        let name = items.get(from).map(Item::name).unwrap_or_default();
        if let Some(item) = items.get_mut(from) {
            item.visible = false;
        }
        let summary = Summary {
            file: format!("{name} ({tool})"),
            format: "not saved".to_owned(),
            n_surfels: cloud.len() as u64,
            columns: cloud.columns().iter().map(|column| column.name().to_owned()).collect(),
            ..Summary::default()
        };
        let loaded = Loaded { cloud, summary };
        let (entry, saved_as, on_disk) = (None, None, Vec::new());
        let recovered = false;
        items.push(Item { loaded, visible: true, entry, saved_as, on_disk, recovered });
        Self::of(items)
    }

    /// With one cloud shown or hidden.
    pub(crate) fn showing(&self, index: usize, visible: bool) -> Self {
        self.changed(index, |item| item.visible = visible)
    }

    /// With one cloud noted as saved, as it was then.
    pub(crate) fn saved(&self, index: usize, path: &Path, cloud: &Cloud) -> Self {
        let mut items = self.items.to_vec();
        if let Some(item) = items.get_mut(index) {
            (item.saved_as, item.on_disk) = (Some(path.to_owned()), generations(cloud));
        }
        // What is on show is the same.
        Self { items: Arc::new(items), clouds: self.clouds.clone() }
    }

    /// Every column with its generation and bytes.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (u64, u64)> {
        let columns = self.items.iter().flat_map(|item| item.loaded.cloud.columns());
        columns.map(|column| {
            let bytes = column.values().len() * column.values().element().size();
            (column.generation(), bytes as u64)
        })
    }
}
