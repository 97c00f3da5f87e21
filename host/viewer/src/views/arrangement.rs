//! The arrangement of the views: side by side, stacked, in a grid or behind tabs.
//!
//! In a scene's `layout` a number is a view, counted from 0, and a table is a container:
//! `{ kind = "horizontal", parts = [0, 1], shares = [0.7, 0.3] }`.

use eframe::egui;
use egui_tiles::{Container, Grid, Linear, LinearDir, Tabs, Tile, TileId, Tiles, Tree};
use toml::{Table, Value as Toml};

/// Most nested containers: a file must not overflow the stack, and the window makes fewer.
const MOST_LEVELS: usize = 8;

/// The default tree of these views: two side by side, more in a grid.
pub(crate) fn default_tree(panes: &[u32]) -> Tree<u32> {
    let mut tiles = Tiles::default();
    let all: Vec<TileId> = panes.iter().map(|pane| tiles.insert_pane(*pane)).collect();
    let root = match all[..] {
        [only] => only,
        [_, _] => tiles.insert_horizontal_tile(all),
        _ => tiles.insert_grid_tile(all),
    };
    Tree::new(egui::Id::unique("panes"), root, tiles)
}

/// The description of a tree of these views; `None` where there is one view or none.
pub(crate) fn describe(tree: &Tree<u32>, panes: &[u32]) -> Option<Toml> {
    let described = part(&tree.tiles, tree.root?, panes)?;
    matches!(described, Toml::Table(_)).then_some(described)
}

fn part(tiles: &Tiles<u32>, id: TileId, panes: &[u32]) -> Option<Toml> {
    let container = match tiles.get(id)? {
        Tile::Pane(pane) => {
            let place = panes.iter().position(|other| other == pane)?;
            return Some(Toml::Integer(place as i64));
        }
        Tile::Container(container) => container,
    };
    let of = |shares: &[f32]| {
        Toml::Array(shares.iter().map(|&share| Toml::Float(f64::from(share))).collect())
    };
    let mut table = Table::new();
    let kind = match container {
        Container::Tabs(_) => "tabs",
        Container::Linear(linear) => {
            let shares: Vec<f32> = linear.children.iter().map(|id| linear.shares[*id]).collect();
            table.insert("shares".to_owned(), of(&shares));
            if linear.dir == LinearDir::Horizontal { "horizontal" } else { "vertical" }
        }
        Container::Grid(grid) => {
            table.insert("column_shares".to_owned(), of(&grid.col_shares));
            table.insert("row_shares".to_owned(), of(&grid.row_shares));
            "grid"
        }
    };
    table.insert("kind".to_owned(), Toml::String(kind.to_owned()));
    let parts = container.children().filter_map(|child| part(tiles, *child, panes)).collect();
    table.insert("parts".to_owned(), Toml::Array(parts));
    Some(Toml::Table(table))
}

/// The tree of a description; `None` unless it has each of these views exactly once.
pub(crate) fn tree(described: &Toml, panes: &[u32]) -> Option<Tree<u32>> {
    let mut tiles = Tiles::default();
    let mut placed = Vec::new();
    let root = insert(&mut tiles, described, panes, &mut placed, MOST_LEVELS)?;
    let mut expected = panes.to_vec();
    placed.sort_unstable();
    expected.sort_unstable();
    (placed == expected).then(|| Tree::new(egui::Id::unique("panes"), root, tiles))
}

/// A tree with a new view beside or below one that it has; `panes` are all views, the new one included.
pub(crate) fn beside(
    tree_of: &Tree<u32>,
    panes: &[u32],
    (old, new): (u32, u32),
    below: bool,
) -> Option<Tree<u32>> {
    let place = |pane: u32| {
        let place = panes.iter().position(|other| *other == pane)?;
        Some(Toml::Integer(place as i64))
    };
    let (old, new) = (place(old)?, place(new)?);
    let both = Table::from_iter([
        ("kind".to_owned(), Toml::String(if below { "vertical" } else { "horizontal" }.to_owned())),
        ("parts".to_owned(), Toml::Array(vec![old.clone(), new])),
    ]);
    let whole = part(&tree_of.tiles, tree_of.root?, panes)?;
    tree(&replaced(whole, &old, &Toml::Table(both)), panes)
}

/// A description with another part in the place of one.
fn replaced(described: Toml, old: &Toml, new: &Toml) -> Toml {
    match described {
        one if one == *old => new.clone(),
        Toml::Table(mut table) => {
            if let Some(Toml::Array(parts)) = table.remove("parts") {
                let parts = parts.into_iter().map(|part| replaced(part, old, new)).collect();
                table.insert("parts".to_owned(), Toml::Array(parts));
            }
            Toml::Table(table)
        }
        other => other,
    }
}

fn insert(
    tiles: &mut Tiles<u32>,
    described: &Toml,
    panes: &[u32],
    placed: &mut Vec<u32>,
    levels: usize,
) -> Option<TileId> {
    if let Some(place) = described.as_integer() {
        let pane = *panes.get(usize::try_from(place).ok()?)?;
        placed.push(pane);
        return Some(tiles.insert_pane(pane));
    }
    let table = described.as_table()?;
    let levels = levels.checked_sub(1)?;
    let mut children = Vec::new();
    for part in table.get("parts")?.as_array()? {
        children.push(insert(tiles, part, panes, placed, levels)?);
    }
    let shares = |key: &str| -> Vec<f32> {
        let all = table.get(key).and_then(Toml::as_array).map(Vec::as_slice).unwrap_or_default();
        let number = |value: &Toml| value.as_float().map(|share| share as f32);
        let good = |share: &f32| share.is_finite() && *share > 0.0;
        all.iter().filter_map(number).filter(good).take(panes.len()).collect()
    };
    let container = match table.get("kind")?.as_str()? {
        "tabs" => Container::Tabs(Tabs::new(children)),
        "grid" => {
            let mut grid = Grid::new(children);
            (grid.col_shares, grid.row_shares) = (shares("column_shares"), shares("row_shares"));
            Container::Grid(grid)
        }
        kind => {
            let dir = match kind {
                "horizontal" => LinearDir::Horizontal,
                "vertical" => LinearDir::Vertical,
                _ => return None,
            };
            let mut linear = Linear::new(dir, children);
            for (child, share) in linear.children.clone().into_iter().zip(shares("shares")) {
                linear.shares.set_share(child, share);
            }
            Container::Linear(linear)
        }
    };
    Some(tiles.insert_container(container))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, panes: &[u32]) -> Option<Tree<u32>> {
        let table: Table = text.parse().unwrap();
        tree(&table["a"], panes)
    }

    #[test]
    fn arrangements_come_back_as_they_were() {
        let text = "a = { kind = \"horizontal\", shares = [2.0, 1.0], parts = [1, \
                    { kind = \"vertical\", shares = [1.0, 3.0], parts = [2, 0] }] }";
        let panes = [10, 20, 30];
        let first = read(text, &panes).unwrap();
        let again = describe(&first, &panes).unwrap();
        assert_eq!(again, text.parse::<Table>().unwrap()["a"]);
        assert_eq!(describe(&tree(&again, &panes).unwrap(), &panes).unwrap(), again);
        for n in 1..=4 {
            let panes: Vec<u32> = (0..n).collect();
            let tree_of = default_tree(&panes);
            match describe(&tree_of, &panes) {
                Some(text) => {
                    assert_eq!(describe(&tree(&text, &panes).unwrap(), &panes), Some(text))
                }
                None => assert_eq!(n, 1),
            }
        }
    }

    #[test]
    fn a_new_view_stands_beside_or_below_one_and_the_others_stay() {
        let text = "a = { kind = \"horizontal\", shares = [2.0, 1.0], parts = [0, \
                    { kind = \"vertical\", shares = [1.0, 3.0], parts = [2, 1] }] }";
        let all = [10, 20, 30, 40];
        let first = read(text, &all[..3]).unwrap();
        for below in [false, true] {
            let split = beside(&first, &all, (30, 40), below).unwrap();
            let found = describe(&split, &all).unwrap();
            let kind = if below { "vertical" } else { "horizontal" };
            let inner = &found["parts"][1]["parts"][0];
            assert_eq!(inner["kind"].as_str(), Some(kind));
            assert_eq!(inner["parts"], Toml::Array(vec![Toml::Integer(2), Toml::Integer(3)]));
            assert_eq!(found["shares"][0].as_float(), Some(2.0));
            assert_eq!(found["parts"][1]["shares"][1].as_float(), Some(3.0));
        }
        let two = beside(&default_tree(&[5]), &[5, 6], (5, 6), true).unwrap();
        assert_eq!(describe(&two, &[5, 6]).unwrap()["kind"].as_str(), Some("vertical"));
        assert!(beside(&first, &all, (99, 40), false).is_none());
    }

    #[test]
    fn what_is_no_arrangement_of_the_views_is_refused() {
        let deep = format!("a = {}0{}", "{kind=\"tabs\",parts=[".repeat(40), "]}".repeat(40));
        for text in [
            "a = 7",
            "a = \"left\"",
            "a = { kind = \"horizontal\", parts = [0] }",
            "a = { kind = \"horizontal\", parts = [0, 0, 1] }",
            "a = { kind = \"round\", parts = [0, 1] }",
            "a = { parts = [0, 1] }",
        ] {
            assert!(read(text, &[5, 6]).is_none(), "{text}");
        }
        assert!(read(&deep, &[5]).is_none());
    }
}
