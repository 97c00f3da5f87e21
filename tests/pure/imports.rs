//! No circle of imports of more than two files, in any crate: read from the `use` lines.
//!
//! A file may import from the folder's file that declares it, which may call it: two files. Three that
//! import in a circle are one file in three places. What `pub use` passes on counts as imported from the
//! file that defines it; modules of tests are not counted. Costs 1 s.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};
use syn::{Item, UseTree};

/// A module's path within its crate.
type Module = Vec<String>;

/// The imports of a file: of its own, and what it passes on, by name.
#[derive(Default)]
struct Imports {
    own: Vec<Vec<String>>,
    passed_on: BTreeMap<String, Vec<String>>,
}

/// The files of a crate by their modules.
fn modules(src: &Path) -> BTreeMap<Module, PathBuf> {
    let mut found = BTreeMap::new();
    let mut folders = vec![src.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && !path.ends_with("template") {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let inside = path.strip_prefix(src).unwrap().with_extension("");
                let mut module: Module =
                    inside.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
                let is_root = module.len() == 1 && ["lib", "main"].contains(&module[0].as_str());
                if is_root || module.last().is_some_and(|last| last == "mod") {
                    module.pop();
                }
                found.insert(module, path);
            }
        }
    }
    found
}

/// The paths of a `use`, and whether each is renamed.
fn paths(tree: &UseTree, before: &[String], found: &mut Vec<(Vec<String>, String)>) {
    let with = |name: &str| before.iter().cloned().chain([name.to_owned()]).collect::<Vec<_>>();
    match tree {
        UseTree::Path(path) => paths(&path.tree, &with(&path.ident.to_string()), found),
        UseTree::Group(group) => group.items.iter().for_each(|item| paths(item, before, found)),
        UseTree::Name(name) if name.ident == "self" => {
            found.push((before.to_vec(), before.last().cloned().unwrap_or_default()));
        }
        UseTree::Name(name) => found.push((with(&name.ident.to_string()), name.ident.to_string())),
        UseTree::Rename(name) => {
            found.push((with(&name.ident.to_string()), name.rename.to_string()));
        }
        UseTree::Glob(_) => found.push((before.to_vec(), "*".to_owned())),
    }
}

fn imports(path: &Path) -> Imports {
    let text = fs::read_to_string(path).unwrap();
    let file = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut imports = Imports::default();
    for item in &file.items {
        let Item::Use(item) = item else { continue };
        // Those of tests are not counted.
        if item.attrs.iter().any(|attribute| attribute.path().is_ident("cfg")) {
            continue;
        }
        let mut found = Vec::new();
        paths(&item.tree, &[], &mut found);
        match item.vis {
            syn::Visibility::Inherited => {
                imports.own.extend(found.into_iter().map(|(path, _)| path))
            }
            _ => imports.passed_on.extend(found.into_iter().map(|(path, name)| (name, path))),
        }
    }
    imports
}

/// The module that defines what a path of this module leads to; `None` where it leads out of the crate.
fn defining(
    files: &BTreeMap<Module, Imports>,
    module: &[String],
    path: &[String],
    depth: usize,
) -> Option<Module> {
    let mut rest = path;
    let mut at: Module = match path.first()?.as_str() {
        "crate" => Vec::new(),
        "self" | "super" => module.to_vec(),
        first => {
            let child: Module = module.iter().cloned().chain([first.to_owned()]).collect();
            files.contains_key(&child).then(|| module.to_vec())?
        }
    };
    while let Some(step) = rest.first().filter(|s| ["crate", "self", "super"].contains(&s.as_str()))
    {
        if step == "super" {
            at.pop();
        }
        rest = &rest[1..];
    }
    while let Some((first, others)) = rest.split_first() {
        let child: Module = at.iter().cloned().chain([first.clone()]).collect();
        if files.contains_key(&child) {
            (at, rest) = (child, others);
            continue;
        }
        let passed_on = files.get(&at)?.passed_on.get(first);
        return match passed_on.filter(|_| depth < 8) {
            Some(path) => defining(files, &at, path, depth + 1),
            None => Some(at),
        };
    }
    Some(at)
}

/// Circles of three or more files, each once, as the shortest that leads back to an import.
fn circles(src: &Path) -> BTreeSet<Vec<String>> {
    let files: BTreeMap<Module, Imports> =
        modules(src).into_iter().map(|(module, path)| (module, imports(&path))).collect();
    let edges: BTreeMap<&Module, BTreeSet<Module>> = files
        .iter()
        .map(|(module, imports)| {
            let targets = imports.own.iter().filter_map(|path| defining(&files, module, path, 0));
            (module, targets.filter(|target| target != module).collect())
        })
        .collect();
    let none = BTreeSet::new();
    let of = |module: &Module| edges.get(module).unwrap_or(&none);
    let mut found = BTreeSet::new();
    for (from, to) in edges.iter().flat_map(|(from, all)| all.iter().map(move |to| (*from, to))) {
        // The shortest way back that is not the way there turned round.
        let mut ways = VecDeque::from([vec![to.clone()]]);
        let mut seen = BTreeSet::from([to.clone()]);
        'search: while let Some(way) = ways.pop_front() {
            for next in of(way.last().unwrap()) {
                if next == from && way.len() >= 2 {
                    let mut circle: Vec<String> =
                        [from].into_iter().chain(&way).map(|module| module.join("/")).collect();
                    let least = (0..circle.len()).min_by_key(|&i| circle[i].clone()).unwrap();
                    circle.rotate_left(least);
                    found.insert(circle);
                    break 'search;
                }
                if next != from && seen.insert(next.clone()) {
                    ways.push_back(way.iter().cloned().chain([next.clone()]).collect());
                }
            }
        }
    }
    found
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// Invariant: no circle of imports holds more than two files.
#[test]
fn no_circle_of_imports_holds_more_than_two_files() {
    let metadata = crate::dependencies::cargo_metadata(&["--no-deps"]);
    let mut n_crates = 0;
    let mut found = Vec::new();
    for package in metadata["packages"].as_array().unwrap() {
        for target in package["targets"].as_array().unwrap() {
            let path = Path::new(target["src_path"].as_str().unwrap());
            let is_crate = ["lib.rs", "main.rs"].iter().any(|name| path.ends_with(name));
            let inside = path.strip_prefix(root()).expect("packages lie in the repository");
            if !is_crate || inside.starts_with("tests/fixtures") {
                continue;
            }
            n_crates += 1;
            let folder = path.parent().unwrap();
            found.extend(circles(folder).into_iter().map(|circle| {
                format!(
                    "{}: {}",
                    folder.strip_prefix(root()).unwrap().display(),
                    circle.join(" -> ")
                )
            }));
        }
    }
    assert!(n_crates > 20, "only {n_crates} crates were read");
    assert!(found.is_empty(), "imports in circles:\n{}", found.join("\n"));
}

#[test]
fn circles_are_found_through_parents_and_what_they_pass_on() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    fs::create_dir(folder.path().join("a")).unwrap();
    write("lib.rs", "mod a; mod b;\npub use a::deep::Deep;\n");
    write("a/mod.rs", "mod deep;\nuse crate::b::B;\npub struct A;\n");
    write(
        "a/deep.rs",
        "use super::A;\npub struct Deep;\n#[cfg(test)]\nmod tests { use crate::b::B; }\n",
    );
    write("b.rs", "use crate::Deep;\npub struct B;\n");
    let found = circles(folder.path());
    assert_eq!(
        found.into_iter().collect::<Vec<_>>(),
        [["a", "b", "a/deep"].map(str::to_owned).to_vec()]
    );
    // Two files are no such circle, and neither is an import of another crate.
    write("b.rs", "use crate::a::A;\nuse std::fmt;\npub struct B;\n");
    assert_eq!(circles(folder.path()), BTreeSet::new());
}
