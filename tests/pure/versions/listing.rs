//! Everything that plugins can name, a line each: items of the API crate with their fields, variants and
//! methods, and what shader modules offer.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use syn::{Attribute, Fields, ImplItem, Item, TraitItem, Visibility};

/// The lines of this checkout.
pub(crate) fn listing() -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut lines = BTreeSet::new();
    let mut sources = files(&root.join("host/sdk/api/src"), "rs");
    // The host's half of the boundary, which was in the same crate before 3.7.
    sources.extend(files(&root.join("host/runtime/src/boundary"), "rs"));
    for file in sources.iter().filter(|file| !file.ends_with("guide.rs")) {
        let text = fs::read_to_string(file).unwrap();
        let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        items("", &parsed.items, &mut lines);
    }
    // Pages to read, which no plugin names.
    lines.retain(|line| !line.starts_with("mod guide"));

    let shaders = root.join("shaders");
    for file in files(&shaders, "wgsl") {
        wgsl(&fs::read_to_string(file).unwrap(), &mut lines);
    }
    lines
}

/// The files of a folder and its folders, but for tests.
fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.extension().is_some_and(|e| e == ending) && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

/// Attributes that decide how something crosses the boundary.
fn wire(attributes: &[Attribute]) -> String {
    let of_wire = |attribute: &&Attribute| {
        ["serde", "repr"].iter().any(|name| attribute.path().is_ident(name))
    };
    let texts = attributes.iter().filter(of_wire).map(|a| format!("{} ", text(&a.meta)));
    texts.collect()
}

/// Tokens with single spaces between them.
fn text(tokens: &impl quote::ToTokens) -> String {
    tokens.to_token_stream().to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

fn items(inside: &str, items_of: &[Item], lines: &mut BTreeSet<String>) {
    for item in items_of {
        match item {
            Item::Struct(item) if is_public(&item.vis) => {
                let name = format!("{inside}{}", item.ident);
                let generics = text(&item.generics);
                lines.insert(format!("{}struct {name}{generics}", wire(&item.attrs)));
                fields(&name, &item.fields, false, lines);
            }
            Item::Enum(item) if is_public(&item.vis) => {
                let name = format!("{inside}{}", item.ident);
                lines.insert(format!("{}enum {name}", wire(&item.attrs)));
                for variant in &item.variants {
                    let wire = wire(&variant.attrs);
                    let value = variant.discriminant.as_ref().map(|(_, value)| text(value));
                    let value = value.map(|value| format!(" = {value}")).unwrap_or_default();
                    lines.insert(format!("{wire}variant {name}::{}{value}", variant.ident));
                    fields(&format!("{name}::{}", variant.ident), &variant.fields, true, lines);
                }
            }
            Item::Trait(item) if is_public(&item.vis) => {
                let name = format!("{inside}{}", item.ident);
                lines.insert(format!("trait {name}: {}", text(&item.supertraits)));
                for part in &item.items {
                    let part = match part {
                        // A default may become another; that there is one may not change.
                        TraitItem::Fn(f) => {
                            let given = if f.default.is_some() { " (given)" } else { "" };
                            format!("{}{given}", text(&f.sig))
                        }
                        TraitItem::Const(c) => {
                            let given = if c.default.is_some() { " (given)" } else { "" };
                            format!("const {}: {}{given}", c.ident, text(&c.ty))
                        }
                        other => text(other),
                    };
                    lines.insert(format!("{name}::{part}"));
                }
            }
            Item::Impl(item) => {
                let of = text(&item.self_ty);
                match &item.trait_ {
                    Some((_, path, _)) => {
                        lines.insert(format!("impl {} for {of}", text(path)));
                    }
                    None => methods(&of, &item.items, lines),
                }
            }
            Item::Fn(item) if is_public(&item.vis) => {
                lines.insert(format!("{inside}{}", text(&item.sig)));
            }
            Item::Const(item) if is_public(&item.vis) => {
                lines.insert(format!("const {inside}{}: {}", item.ident, text(&item.ty)));
            }
            Item::Macro(item) if item.attrs.iter().any(|a| a.path().is_ident("macro_export")) => {
                let name = item.ident.as_ref().map(ToString::to_string).unwrap_or_default();
                lines.insert(format!("macro {name}!"));
            }
            Item::Use(item) if is_public(&item.vis) => {
                lines.extend(names_of_use(&text(&item.tree)));
            }
            Item::Mod(item) if is_public(&item.vis) => {
                lines.insert(format!("mod {inside}{}", item.ident));
                if let Some((_, inner)) = &item.content {
                    items(&format!("{inside}{}::", item.ident), inner, lines);
                }
            }
            _ => {}
        }
    }
}

/// The names that a `use` makes known, a line each: which private modules they come from is no part of the
/// interface.
pub(crate) fn names_of_use(tree: &str) -> Vec<String> {
    let words: Vec<&str> = tree.split_whitespace().collect();
    let is_name = |word: &str| word.starts_with(|c: char| c.is_alphabetic() || c == '_');
    let mut names = Vec::new();
    for (i, word) in words.iter().enumerate() {
        let next = words.get(i + 1).copied().unwrap_or_default();
        if is_name(word)
            && !["self", "as", "crate", "super"].contains(word)
            && next != "::"
            && next != "as"
        {
            names.push(format!("use {word}"));
        }
    }
    names
}

/// Fields, a line each: those of variants are public.
fn fields(of: &str, fields: &Fields, all: bool, lines: &mut BTreeSet<String>) {
    for (i, field) in fields.iter().enumerate().filter(|(_, field)| all || is_public(&field.vis)) {
        let name = field.ident.as_ref().map_or_else(|| i.to_string(), ToString::to_string);
        lines.insert(format!("{}field {of}.{name}: {}", wire(&field.attrs), text(&field.ty)));
    }
}

fn methods(of: &str, parts: &[ImplItem], lines: &mut BTreeSet<String>) {
    for part in parts {
        match part {
            ImplItem::Fn(f) if is_public(&f.vis) => {
                lines.insert(format!("{of}::{}", text(&f.sig)));
            }
            ImplItem::Const(c) if is_public(&c.vis) => {
                lines.insert(format!("{of}::const {}: {}", c.ident, text(&c.ty)));
            }
            _ => {}
        }
    }
}

/// What a shader module offers: functions, structures with members, constants and variables.
fn wgsl(module: &str, lines: &mut BTreeSet<String>) {
    let path = module.lines().find_map(|line| line.strip_prefix("#define_import_path "));
    let path = path.expect("a module has a path").trim();
    let code: String = module
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default().trim())
        .filter(|line| !line.starts_with('#'))
        .collect::<Vec<_>>()
        .join(" ");
    for start in ["fn ", "struct ", "const ", "override ", "var<", "var "] {
        for (at, _) in code.match_indices(start) {
            // Only at the top: as many braces closed as opened before.
            let before = &code[..at];
            let depth = before.matches('{').count() - before.matches('}').count();
            let begins = before.is_empty() || before.ends_with(' ');
            if depth != 0 || !begins {
                continue;
            }
            let rest = &code[at..];
            let end = match start {
                "struct " => rest.find('}').map(|end| end + 1),
                "fn " => rest.find('{'),
                // The value of a constant may be improved; its name and type stay.
                _ => rest.find([';', '=']),
            };
            let item = rest[..end.unwrap_or(rest.len())].split_whitespace();
            lines.insert(format!("wgsl {path} {}", item.collect::<Vec<_>>().join(" ")));
        }
    }
}
