//! How the techniques were checked: the invariants that tests hold, by technique.

use super::html::{attribute, marked, text};
use anyhow::Context as _;
use std::fmt::Write as _;
use surfelshop_session::manual;

/// A technique, the beginning of the places of its tests, and what it is.
struct Technique {
    id: &'static str,
    name: &'static str,
    places: &'static [&'static str],
    words: &'static [&'static str],
}

/// The techniques of the papers, and what all of them stand on.
const TECHNIQUES: [Technique; 7] = [
    Technique {
        id: "environment",
        name: "Environment lighting",
        places: &[
            "tests/render/environment",
            "host/cloud/src/environment_map",
            "host/sdk/geometry/src/harmonics",
            "host/sdk/shading",
            "plugins/environment",
        ],
        words: &["probe", "environment", "harmonic"],
    },
    Technique {
        id: "ambient-occlusion",
        name: "Ambient occlusion",
        places: &[
            "tests/pure/ambient_occlusion",
            "plugins/ambient-occlusion",
            "tests/render/occlusion",
        ],
        words: &["occlusion", "accessib"],
    },
    Technique {
        id: "procedural",
        name: "Procedural textures",
        places: &["tests/render/procedural", "plugins/procedural"],
        words: &["pattern", "noise of"],
    },
    Technique {
        id: "phong-splatting",
        name: "Phong splatting",
        places: &["tests/render/splats", "plugins/phong-splatting"],
        words: &["normal field", "phong splat"],
    },
    Technique {
        id: "global-illumination",
        name: "Global illumination",
        places: &["tests/render/gi", "plugins/global-illumination"],
        words: &["virtual light", "bounce"],
    },
    Technique {
        id: "reference",
        name: "The path tracer that others are measured against",
        places: &["tests/pure/reference", "plugins/reference"],
        words: &["path trac", "tracer"],
    },
    Technique {
        id: "surfels",
        name: "Drawing surfels, and metrics",
        places: &[
            "tests/render/surfels",
            "host/image/src/metrics",
            "host/raster",
            "tests/render/precision",
        ],
        words: &[],
    },
];

/// The page's body.
pub(super) fn body() -> anyhow::Result<String> {
    let page = manual::page("invariants").context("the manual has no page of invariants")?;
    let rows: Vec<[&str; 3]> = page
        .text
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"))
        .filter_map(|line| {
            let mut cells = line.rsplitn(3, " | ");
            let (file, test, invariant) = (cells.next()?, cells.next()?, cells.next()?);
            (file.starts_with('`')).then_some([invariant, test, file])
        })
        .collect();
    let mut body = "<p>What the program's tests hold true, by technique: exact answers, twins in double precision, \
                    extreme cases, limits. The list is made from the tests; each line is a test that fails where \
                    it is not so. <a href=\"index.html\">All figures.</a></p>"
        .to_owned();
    for technique in &TECHNIQUES {
        let belongs = |[invariant, _, file]: &&[&str; 3]| {
            let file = file.trim_matches('`');
            let line = invariant.to_lowercase();
            technique.places.iter().any(|place| file.starts_with(place))
                || technique.words.iter().any(|word| line.contains(word))
        };
        write!(
            body,
            "<section id=\"{}\"><h2>{}</h2><div class=\"wide\"><table><tr><th>what is true</th><th class=\"words\">test</th></tr>",
            attribute(technique.id),
            text(technique.name)
        )?;
        for [invariant, test, file] in rows.iter().filter(belongs) {
            write!(
                body,
                "<tr><td class=\"words\">{}</td><td class=\"words\">{} in {}</td></tr>",
                marked(invariant),
                marked(test),
                marked(file)
            )?;
        }
        body += "</table></div></section>";
    }
    Ok(body)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_has_tests() {
        let body = body().unwrap();
        for technique in &TECHNIQUES {
            let section = format!("<section id=\"{}\">", technique.id);
            let section = body.split_once(&section).unwrap().1;
            let section = section.split_once("</section>").unwrap().0;
            assert!(section.matches("<tr>").count() > 3, "{}", technique.id);
        }
    }
}
