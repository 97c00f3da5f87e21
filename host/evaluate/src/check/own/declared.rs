//! Where own cases are declared: on the command line, and in a file `check.toml` beside a plugin's project.

use crate::check::CheckArguments;
use anyhow::{anyhow, ensure};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use surfelshop_api::UnitKind;
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_session::options::values::Size;
use surfelshop_session::output::files;
use surfelshop_session::{input::scenes, parameters, setup};

/// A scene, and the picture that is expected of it.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::check) struct OwnCase {
    /// Its name, of letters, digits, - and _.
    pub(in crate::check) name: String,
    /// The scene or cloud.
    pub(super) scene: PathBuf,
    /// The picture, .exr or .png.
    pub(super) expect: PathBuf,
    /// The least PSNR, dB.
    pub(super) psnr: f64,
    /// Width and height, where they are said.
    pub(super) size: Option<[u32; 2]>,
    /// The renderer or tracer, where one is named.
    renderer: Option<String>,
    /// Where it is declared, for messages.
    place: String,
}

impl OwnCase {
    /// What must hold, in a sentence.
    pub(in crate::check) fn about(&self) -> String {
        let (scene, expect) = (self.scene.display(), self.expect.display());
        format!("{scene} looks as {expect}, to {} dB of PSNR at least", self.psnr)
    }
}

/// The least PSNR where none is said: what differs by more is seen.
const PSNR: f64 = 40.0;

/// The name of the file in a project.
const FILE: &str = "check.toml";

/// Longest such file, bytes.
const LONGEST: u64 = 1 << 20;

/// A file of cases.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseFile {
    #[serde(default)]
    case: Vec<CaseEntry>,
}

/// A case in a file; paths are from its folder.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseEntry {
    name: Option<String>,
    scene: PathBuf,
    expect: PathBuf,
    psnr: Option<f64>,
    size: Option<[u32; 2]>,
    renderer: Option<String>,
}

/// All cases, each with the unit that draws it.
pub(super) fn all(
    arguments: &CheckArguments,
    units: &[UnitRef],
) -> anyhow::Result<Vec<(OwnCase, UnitRef)>> {
    if let (Some(scene), Some(expect)) = (&arguments.scene, &arguments.expect) {
        let case = OwnCase {
            name: stem(scene),
            scene: scene.clone(),
            expect: expect.clone(),
            psnr: arguments.psnr.unwrap_or(PSNR),
            size: arguments.size.map(|Size(size)| size),
            renderer: None,
            place: "--scene".to_owned(),
        };
        check(&case)?;
        let drawer = drawer(&case, units)?;
        return Ok(vec![(case, drawer)]);
    }
    let mut all: Vec<(OwnCase, UnitRef)> = Vec::new();
    for (file, units) in case_files(arguments, units) {
        for case in read(&file)? {
            let drawer = drawer(&case, &units)?;
            let is_taken =
                all.iter().any(|(other, unit)| other.name == case.name && *unit == drawer);
            ensure!(
                !is_taken,
                "{}: there is another case `{}` of {}; give each a `name` of its own",
                case.place,
                case.name,
                drawer.id
            );
            all.push((case, drawer));
        }
    }
    Ok(all)
}

/// The files of cases, each with the units that it is for.
fn case_files(arguments: &CheckArguments, units: &[UnitRef]) -> Vec<(PathBuf, Vec<UnitRef>)> {
    if let Some(file) = &arguments.cases {
        return vec![(file.clone(), units.to_vec())];
    }
    let mut all: Vec<(PathBuf, Vec<UnitRef>)> = Vec::new();
    for unit in units {
        let Some(file) = beside(&unit.path) else { continue };
        match all.iter_mut().find(|(known, _)| *known == file) {
            Some((_, of_file)) => of_file.push(unit.clone()),
            None => all.push((file, vec![unit.clone()])),
        }
    }
    all
}

/// The file of a library's project: beside the library, or beside the folder `target` that it lies in.
fn beside(library: &Path) -> Option<PathBuf> {
    let library = std::path::absolute(library).ok()?;
    let own = library.parent()?;
    let target = own.ancestors().take(4).find(|folder| folder.ends_with("target"));
    let folders = [Some(own), target.and_then(Path::parent)];
    folders.into_iter().flatten().map(|folder| folder.join(FILE)).find(|file| file.is_file())
}

/// The cases of a file.
fn read(file: &Path) -> anyhow::Result<Vec<OwnCase>> {
    let name = file.display();
    let bytes = files::read_short(file, LONGEST)?;
    let text = std::str::from_utf8(&bytes)
        .map_err(|_other| anyhow!("{name}: expected text in UTF-8, found other bytes"))?;
    let parsed: CaseFile = toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start);
        let line = text.get(..start).unwrap_or_default().matches('\n').count() + 1;
        anyhow!("{name}:{line}: {}", error.message().replace('\n', " "))
    })?;
    let folder = file.parent().unwrap_or(Path::new("."));
    let mut all = Vec::with_capacity(parsed.case.len());
    for entry in parsed.case {
        let case = OwnCase {
            name: entry.name.unwrap_or_else(|| stem(&entry.scene)),
            scene: folder.join(entry.scene),
            expect: folder.join(entry.expect),
            psnr: entry.psnr.unwrap_or(PSNR),
            size: entry.size,
            renderer: entry.renderer,
            place: file.display().to_string(),
        };
        check(&case)?;
        all.push(case);
    }
    Ok(all)
}

/// A scene's name without folder and ending.
fn stem(scene: &Path) -> String {
    let name = scene.file_name().unwrap_or_default().to_string_lossy();
    name.split('.').next().unwrap_or_default().to_owned()
}

/// Whether a picture is one of EXR.
pub(super) fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr"))
}

fn check(case: &OwnCase) -> anyhow::Result<()> {
    let OwnCase { name, expect, psnr, size, place, .. } = case;
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    ensure!(
        !name.is_empty() && name.chars().all(plain),
        "{place}: expected a case's name of letters, digits, - and _, found `{}`",
        name.escape_debug()
    );
    let is_png = expect.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    ensure!(
        is_exr(expect) || is_png,
        "{place}: case `{name}` expects {}; name a picture that ends in .exr or .png",
        expect.display()
    );
    ensure!(
        psnr.is_finite() && (0.0..=1000.0).contains(psnr),
        "{place}: case `{name}`: expected a PSNR of 0 to 1000 dB, found {psnr}"
    );
    let sides = size.unwrap_or([1, 1]);
    ensure!(
        sides.iter().all(|side| (1..=8192).contains(side)),
        "{place}: case `{name}`: expected a size of 1 to 8192 pixels a side, found {} x {}",
        sides[0],
        sides[1]
    );
    Ok(())
}

/// Who draws a case: who it names, else who a view of its scene names, else the only one that can.
fn drawer(case: &OwnCase, units: &[UnitRef]) -> anyhow::Result<UnitRef> {
    let draws = |unit: &&UnitRef| matches!(unit.kind, UnitKind::Renderer | UnitKind::Tracer);
    let drawers: Vec<&UnitRef> = units.iter().filter(draws).collect();
    let (place, name) = (&case.place, &case.name);
    let ids = || drawers.iter().map(|unit| unit.id.as_str()).collect::<Vec<_>>().join(", ");
    if let Some(wanted) = &case.renderer {
        let found = drawers.iter().find(|unit| parameters::names(unit, wanted));
        return found.map(|unit| (*unit).clone()).ok_or_else(|| {
            anyhow!("{place}: case `{name}` names the renderer `{wanted}`; checked are: {}", ids())
        });
    }
    if let [only] = drawers[..] {
        return Ok(only.clone());
    }
    if surfelshop_cloud::scene::is_scene(&case.scene) {
        let opened = scenes::open(&case.scene)?;
        let of_view = drawers.iter().find(|unit| setup::view_of(Some(&opened), unit).is_some());
        if let Some(unit) = of_view {
            return Ok((*unit).clone());
        }
    }
    match drawers.is_empty() {
        true => Err(anyhow!(
            "{place}: case `{name}` needs a renderer or tracer, of which none is checked"
        )),
        false => Err(anyhow!(
            "{place}: case `{name}` can be drawn by {}; name the one to check, or have a view of the \
             scene or `renderer` name it",
            ids()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(text: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(FILE);
        std::fs::write(&file, text).unwrap();
        (folder, file)
    }

    #[test]
    fn cases_are_read_with_paths_from_their_file() {
        let text = "[[case]]\nscene = \"cases/ball.scene.toml\"\nexpect = \"cases/ball.exr\"\n\
                    [[case]]\nname = \"edge\"\nscene = \"a.ply\"\nexpect = \"b.png\"\npsnr = 30\nsize = [64, 32]\n";
        let (folder, file) = written(text);
        let cases = read(&file).unwrap();
        assert_eq!((cases[0].name.as_str(), cases[0].psnr, cases[0].size), ("ball", PSNR, None));
        assert_eq!(cases[0].expect, folder.path().join("cases/ball.exr"));
        assert_eq!(
            (cases[1].name.as_str(), cases[1].psnr, cases[1].size),
            ("edge", 30.0, Some([64, 32]))
        );
    }

    #[test]
    fn mistakes_are_one_line_with_their_place() {
        for (text, expected) in [
            ("[[case]]\nscene = \"a.ply\"\n", "check.toml:1: missing field `expect`"),
            ("[[case]]\nscene = \"a.ply\"\nexpect = \"a.exr\"\nsnr = 3\n", "unknown field `snr`"),
            ("[[case]]\nscene = \"a.ply\"\nexpect = \"a.jpg\"\n", "ends in .exr or .png"),
            (
                "[[case]]\nscene = \"a b.ply\"\nexpect = \"a.exr\"\n",
                "letters, digits, - and _, found `a b`",
            ),
            ("[[case]]\nscene = \"a.ply\"\nexpect = \"a.exr\"\npsnr = -1.0\n", "0 to 1000 dB"),
            ("[[case]]\nscene = \"a.ply\"\nexpect = \"a.exr\"\nsize = [0, 4]\n", "found 0 x 4"),
        ] {
            let (_folder, file) = written(text);
            let line = read(&file).unwrap_err().to_string();
            assert!(line.contains(expected) && !line.contains('\n'), "{line}");
        }
    }

    #[test]
    fn a_project_s_file_is_beside_its_target_folder() {
        let (folder, file) = written("");
        let library = folder.path().join("target/release/librim.so");
        std::fs::create_dir_all(library.parent().unwrap()).unwrap();
        assert_eq!(beside(&library), Some(file));
        let other = tempfile::tempdir().unwrap();
        assert_eq!(beside(&other.path().join("librim.so")), None);
    }
}
