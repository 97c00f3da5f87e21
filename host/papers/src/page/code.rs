//! Formulas in the code: the lines of a function, a type or a constant, as this program was built from them.

/// The files that entries name, with what is in them.
macro_rules! sources {
    ($($path:literal,)*) => {
        [$(($path, include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../", $path)))),*]
    };
}

/// Files of the repository and what is in them.
const SOURCES: &[(&str, &str)] = &sources![
    "host/cloud/src/environment_map/mapping.rs",
    "host/cloud/src/environment_map/solid_angle.rs",
    "host/cloud/src/environment_map/texels.rs",
    "host/render/src/surfels/quads/disc.wgsl",
    "host/render/src/surfels/quads/footprint.wgsl",
    "host/render/src/surfels/quads/local.wgsl",
    "host/sdk/geometry/src/areas.rs",
    "host/sdk/geometry/src/harmonics/mod.rs",
    "host/sdk/shading/src/natural.wgsl",
    "plugins/ambient-occlusion/src/form_factor.rs",
    "plugins/ambient-occlusion/src/hierarchy.rs",
    "plugins/ambient-occlusion/src/hybrid.rs",
    "plugins/ambient-occlusion/src/octree.rs",
    "plugins/ambient-occlusion/src/passes.rs",
    "plugins/ambient-occlusion/src/rays.rs",
    "plugins/environment/src/environment.wgsl",
    "plugins/flat/src/flat.wgsl",
    "plugins/global-illumination/src/passes.rs",
    "plugins/global-illumination/src/shading/material.wgsl",
    "plugins/global-illumination/src/shading/mod.rs",
    "plugins/global-illumination/src/shading/shade.wgsl",
    "plugins/global-illumination/src/shadow_maps/fill.wgsl",
    "plugins/global-illumination/src/shadow_maps/splat.wgsl",
    "plugins/global-illumination/src/vpls/bounce.wgsl",
    "plugins/global-illumination/src/vpls/importance.wgsl",
    "plugins/global-illumination/src/vpls/mod.rs",
    "plugins/global-illumination/src/vpls/vpl.wgsl",
    "plugins/phong-splatting/src/tool/clip.rs",
    "plugins/phong-splatting/src/tool/normal_field.rs",
    "plugins/phong-splatting/src/tool/plane.rs",
    "plugins/procedural/src/patterns/plaid.wgsl",
    "plugins/procedural/src/patterns/simple_marble.wgsl",
    "plugins/procedural/src/patterns/veined_marble.wgsl",
    "plugins/procedural/src/placement.rs",
    "shaders/lighting/environment.wgsl",
    "shaders/lighting/phong.wgsl",
    "shaders/lighting/sh.wgsl",
    "shaders/noise/noise.wgsl",
    "shaders/surface/view.wgsl",
];

/// The lines of an item, called `path: name`, with what is said of it; none where the file or the item is not known.
pub(super) fn excerpt(place: &str) -> Option<String> {
    let (path, name) = place.split_once(": ")?;
    let (_, source) = SOURCES.iter().find(|(known, _)| *known == path)?;
    item(source, name)
}

/// The lines of an item in formatted Rust or WGSL, from the margin on.
fn item(source: &str, name: &str) -> Option<String> {
    let lines: Vec<&str> = source.lines().collect();
    let head = lines.iter().position(|line| declares(line, name))?;
    let indent = lines[head].len() - lines[head].trim_start().len();
    let is_said = |line: &&&str| ["//", "#[", "@"].iter().any(|mark| line.trim().starts_with(mark));
    let first = head - lines[..head].iter().rev().take_while(is_said).count();
    let ends = |line: &str| line.ends_with(';') || line.ends_with('}');
    let closes = |line: &&str| {
        line.len() > indent && line[..indent].trim().is_empty() && line[indent..].starts_with('}')
            || line.get(indent..).is_some_and(|rest| rest.starts_with("];"))
    };
    let n_lines = match ends(lines[head]) {
        true => 1,
        false => 1 + lines[head..].iter().position(closes)?,
    };
    let flush = |line: &&str| line.get(indent..).unwrap_or_default().to_owned();
    Some(lines[first..head + n_lines].iter().map(flush).collect::<Vec<_>>().join("\n"))
}

/// Whether a line begins the item.
fn declares(line: &str, name: &str) -> bool {
    let words = line.split_whitespace();
    let mut words = words.skip_while(|word| word.starts_with("pub") || word.starts_with("in "));
    let mut kind = words.next();
    let mut called = words.next();
    if (kind, called) == (Some("const"), Some("fn")) {
        (kind, called) = (called, words.next());
    }
    let is_item = matches!(kind, Some("fn" | "struct" | "enum" | "const" | "override"));
    let rest = called.and_then(|called| called.strip_prefix(name));
    is_item && rest.is_some_and(|rest| !rest.starts_with(|c: char| c == '_' || c.is_alphanumeric()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entries::papers;

    #[test]
    fn every_formula_is_found_and_no_file_is_carried_for_nothing() {
        let mut used = Vec::new();
        for paper in papers().unwrap() {
            for entry in paper.entry {
                for place in &entry.formula {
                    let lines = excerpt(place).unwrap_or_default();
                    let n_lines = lines.lines().count();
                    assert!((1..=120).contains(&n_lines), "{}: {place}: {n_lines}", entry.id);
                    used.push(place.split(": ").next().unwrap_or_default().to_owned());
                }
            }
        }
        for (path, _) in SOURCES {
            assert!(used.iter().any(|place| place == path), "{path} is named by no entry");
        }
    }

    #[test]
    fn an_item_has_its_words_and_ends_where_it_ends() {
        let source = "fn one_more() {}\n\nimpl A {\n    /// Said.\n    #[inline]\n    pub(crate) const fn one(\n        self,\n    ) -> u32 {\n        \
                      if true { 1 } else { 2 }\n    }\n\n    fn two() {}\n}\nconst THREE: u32 = 3;\n";
        let one = "/// Said.\n#[inline]\npub(crate) const fn one(\n    self,\n) -> u32 {\n    if true { 1 } else { 2 }\n}";
        assert_eq!(item(source, "one").as_deref(), Some(one));
        assert_eq!(item(source, "two").as_deref(), Some("fn two() {}"));
        assert_eq!(item(source, "THREE").as_deref(), Some("const THREE: u32 = 3;"));
        assert_eq!(item(source, "four"), None);
    }
}
