//! The entry in the desktop's menu, the kinds of files that it opens, and the icon.

use super::File;
use anyhow::ensure;
use std::path::PathBuf;

/// A kind of file: its name, what it is, and the endings of its names.
struct MimeType {
    name: &'static str,
    about: &'static str,
    endings: &'static [&'static str],
}

/// What the program opens.
///
/// Source: registered media types: IANA, application/vnd.las, application/vnd.laszip and model/e57; the others are
/// unregistered names.
const TYPES: [MimeType; 7] = [
    MimeType {
        name: "application/x-surfelshop-scene",
        about: "Surfelshop scene",
        endings: &["scene.toml"],
    },
    MimeType {
        name: "application/x-surfelshop-pyramid",
        about: "Surfelshop pyramid of surfels",
        endings: &["surfels"],
    },
    MimeType { name: "application/vnd.las", about: "LAS point cloud", endings: &["las"] },
    MimeType { name: "application/vnd.laszip", about: "LAZ point cloud", endings: &["laz"] },
    MimeType { name: "model/e57", about: "E57 point cloud", endings: &["e57"] },
    MimeType { name: "application/x-pcd", about: "PCD point cloud", endings: &["pcd"] },
    MimeType { name: "application/x-ply", about: "PLY cloud or mesh", endings: &["ply"] },
];

/// The files for a desktop that starts the program like this.
pub(super) fn files(program: &str) -> anyhow::Result<Vec<File>> {
    let file =
        |path: &str, text: String| File { path: PathBuf::from(path), bytes: text.into_bytes() };
    Ok(vec![
        file("share/applications/surfelshop.desktop", entry(program)?),
        file("share/mime/packages/surfelshop.xml", mime_types()),
        file(
            "share/icons/hicolor/scalable/apps/surfelshop.svg",
            include_str!("surfelshop.svg").to_owned(),
        ),
    ])
}

/// Source: freedesktop.org, Desktop Entry Specification 1.5.
fn entry(program: &str) -> anyhow::Result<String> {
    ensure!(
        !program.is_empty() && !program.contains(|c: char| c.is_control()),
        "--program: expected how the program is started, found `{}`",
        program.escape_debug()
    );
    let types: String = TYPES.iter().map(|of| format!("{};", of.name)).collect();
    Ok(format!(
        "[Desktop Entry]\n\
         Type=Application\n\
         Version=1.5\n\
         Name=Surfelshop\n\
         GenericName=Point cloud viewer\n\
         Comment=Render point clouds as surfaces, with renderers that are plugins\n\
         Exec={} %F\n\
         Icon=surfelshop\n\
         Terminal=false\n\
         Categories=Graphics;3DGraphics;Science;\n\
         Keywords=point cloud;surfels;splats;scan;lidar;\n\
         MimeType={types}\n",
        quoted(program)
    ))
}

/// An argument of `Exec`: in quotes where it has other than plain characters. A percent sign is doubled, and the value is
/// unescaped twice: once as a text, once as an argument.
fn quoted(argument: &str) -> String {
    let percent = argument.replace('%', "%%");
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+%".contains(c);
    if percent.chars().all(is_plain) {
        return percent;
    }
    let mut escaped = String::new();
    for c in percent.chars() {
        if "\"`$\\".contains(c) {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    format!("\"{}\"", escaped.replace('\\', "\\\\"))
}

/// Source: freedesktop.org, Shared MIME-info Database specification.
fn mime_types() -> String {
    let one = |of: &MimeType| {
        let globs: String = of
            .endings
            .iter()
            .map(|ending| format!("    <glob pattern=\"*.{ending}\"/>\n"))
            .collect();
        format!(
            "  <mime-type type=\"{}\">\n    <comment>{}</comment>\n{globs}  </mime-type>\n",
            of.name, of.about
        )
    };
    let types: String = TYPES.iter().map(one).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <mime-info xmlns=\"http://www.freedesktop.org/standards/shared-mime-info\">\n{types}</mime-info>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_are_quoted_as_the_desktop_reads_them() {
        assert_eq!(quoted("/opt/surfelshop/surfelshop"), "/opt/surfelshop/surfelshop");
        assert_eq!(quoted("/opt/a b/100%"), "\"/opt/a b/100%%\"");
        assert_eq!(quoted("a$b"), "\"a\\\\$b\"");
        assert!(entry("").is_err() && entry("a\nExec=b").is_err());
    }

    #[test]
    fn the_entry_opens_every_kind_that_is_declared() {
        let (entry, types) = (entry("surfelshop").unwrap(), mime_types());
        for of in TYPES {
            assert!(entry.contains(&format!("{};", of.name)) && types.contains(of.name));
        }
        assert!(entry.contains("\nExec=surfelshop %F\n"), "{entry}");
    }
}
