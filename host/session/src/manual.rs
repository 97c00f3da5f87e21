//! The manual: one page a topic, as it is printed and shown in the window.

/// A page of the manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Page {
    /// The part of the manual that it belongs to.
    pub part: &'static str,
    /// The word that it is found by: `surfelshop help TOPIC`.
    pub topic: &'static str,
    /// Its title.
    pub title: &'static str,
    /// Its file in `host/manual`, without the ending.
    pub file: &'static str,
    /// Its text, in Markdown.
    pub text: &'static str,
}

macro_rules! pages {
    ($($part:literal, $topic:literal, $title:literal, $file:literal;)*) => {
        &[$(Page {
            part: $part,
            topic: $topic,
            title: $title,
            file: $file,
            text: include_str!(concat!("../../manual/", $file, ".md")),
        }),*]
    };
}

/// All pages, in the order of the contents.
pub const PAGES: &[Page] = pages! {
    "Use", "viewer", "The window", "use/viewer";
    "Use", "hands", "Hands on the cloud", "use/hands";
    "Use", "dimensions", "Measuring by hand", "use/dimensions";
    "Use", "render", "Render pictures", "use/render";
    "Use", "share", "A page to show people", "use/share";
    "Use", "colours", "Colours and filters", "use/colours";
    "Use", "lights", "Lights", "use/lights";
    "Use", "environments", "Environment maps", "use/environments";
    "Use", "patterns", "Solid textures", "use/patterns";
    "Use", "splats", "Phong splats", "use/splats";
    "Use", "gaussians", "Gaussian splats", "use/gaussians";
    "Use", "gi", "Global illumination", "use/gi";
    "Use", "reference", "The path tracer", "use/reference";
    "Clouds", "info", "What is in a file", "clouds/info";
    "Clouds", "convert", "Convert", "clouds/convert";
    "Clouds", "formats", "File formats", "clouds/formats";
    "Clouds", "readers", "Readers beside other programs", "clouds/readers";
    "Clouds", "surfaces", "From bare points to a surface", "clouds/surfaces";
    "Clouds", "pyramids", "Clouds larger than memory", "clouds/pyramids";
    "Clouds", "prepare", "Prepare a cloud", "clouds/prepare";
    "Clouds", "pointshop", "Edit a cloud", "clouds/pointshop";
    "Clouds", "bake", "Bake", "clouds/bake";
    "Clouds", "ambient-occlusion", "Ambient occlusion", "clouds/ambient-occlusion";
    "Measure", "compare", "Compare renderers", "measure/compare";
    "Measure", "report", "Error against time", "measure/report";
    "Measure", "papers", "The papers, made again", "measure/papers";
    "Measure", "papers-tables", "The papers: what is made", "measure/papers-tables";
    "Measure", "bench", "Measure speed", "measure/bench";
    "Measure", "measuring", "Measure in the window", "measure/measuring";
    "Measure", "explain", "What a frame is made of", "measure/explain";
    "Measure", "check", "Check a plugin", "measure/check";
    "Measure", "precision", "Precision", "measure/precision";
    "Reference", "install", "Install", "reference/install";
    "Reference", "scenes", "Scene files", "reference/scenes";
    "Reference", "scripts", "In scripts", "reference/scripts";
    "Reference", "python", "Python", "reference/python";
    "Reference", "farms", "More machines than one", "reference/farms";
    "Reference", "devices", "Graphics devices", "reference/devices";
    "Reference", "strategies", "Ways to draw surfels", "reference/strategies";
    "Reference", "trust", "Plugins and trust", "reference/trust";
    "Reference", "sandbox", "The sandbox", "reference/sandbox";
    "Reference", "conventions", "Conventions", "reference/conventions";
    "Reference", "architecture", "Architecture", "reference/architecture";
    "Reference", "invariants", "Invariants", "reference/invariants";
    "Reference", "limits", "Limits", "reference/limits";
    "Plugins", "new-plugin", "A plugin in five minutes", "plugins/start";
    "Plugins", "plugin-guide", "Writing plugins", "plugins/index";
    "Plugins", "shading", "A renderer of one WGSL function", "plugins/shading";
    "Plugins", "graphs", "A graph of your own", "plugins/graph";
    "Plugins", "splat-function", "A splat function", "plugins/splats";
    "Plugins", "tools", "A tool", "plugins/tool";
    "Plugins", "hand-tools", "An interactive tool", "plugins/hands";
    "Plugins", "tracers", "A tracer", "plugins/tracer";
    "Plugins", "new-format", "A file format", "plugins/format";
    "Plugins", "may-use", "What a shader may use", "plugins/may-use";
    "Plugins", "shaders", "Reference of the WGSL modules", "plugins/shaders";
    "Plugins", "boundary", "What crosses the boundary", "plugins/wire";
    "Plugins", "versions", "Versions", "plugins/versions";
    "Words", "glossary", "Glossary", "glossary";
};

/// The page of a topic; `None` where there is none.
#[must_use]
pub fn page(topic: &str) -> Option<&'static Page> {
    PAGES.iter().find(|page| page.topic == topic)
}

/// The contents: a line for each page, by part.
#[must_use]
pub fn contents() -> String {
    let mut text = "Topics, each for `surfelshop help TOPIC`:\n".to_owned();
    let mut part = "";
    for page in PAGES {
        if page.part != part {
            part = page.part;
            text.push_str(&format!("\n{part}\n"));
        }
        text.push_str(&format!("  {:<18} {}\n", page.topic, page.title));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn every_page_of_the_manual_is_printed_and_in_the_contents_once() {
        let manual = Path::new(env!("CARGO_MANIFEST_DIR")).join("../manual");
        let summary = std::fs::read_to_string(manual.join("SUMMARY.md")).unwrap();
        let mut n_files = 0;
        let folders = std::fs::read_dir(&manual).unwrap().map(|entry| entry.unwrap().path());
        let folders: Vec<_> =
            folders.filter(|path| path.is_dir()).chain([manual.clone()]).collect();
        for folder in folders {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let inside = path.strip_prefix(&manual).unwrap().with_extension("");
                let is_page = path.extension().is_some_and(|ending| ending == "md");
                if !is_page || inside == Path::new("SUMMARY") {
                    continue;
                }
                let pages = PAGES.iter().filter(|page| Path::new(page.file) == inside);
                let pages: Vec<&Page> = pages.collect();
                assert_eq!(pages.len(), 1, "{}", inside.display());
                let line = format!("[{}]({}.md)", pages[0].title, pages[0].file);
                assert!(summary.contains(&line), "the contents lack {line}");
                assert!(pages[0].text.starts_with(&format!("# {}\n", pages[0].title)), "{line}");
                n_files += 1;
            }
        }
        assert_eq!(n_files, PAGES.len());
        let mut topics: Vec<&str> = PAGES.iter().map(|page| page.topic).collect();
        topics.sort_unstable();
        topics.dedup();
        assert_eq!(topics.len(), PAGES.len(), "topics are told apart");
    }
}
