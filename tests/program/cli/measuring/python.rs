//! The Python package: its pictures are the program's, bit for bit, its errors are the program's lines, and its notebook
//! runs. Costs 10 s; with `SURFELSHOP_LONG` 20 s more, for a wheel that is built and installed.

use crate::cli::program::{TestFolder, facing_front};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use surfelshop_tests::stage::build_folder;

fn package() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("host/python")
}

/// A Python that has `NumPy`.
fn python() -> &'static str {
    let has = |python: &&&str| {
        let ended = Command::new(python).args(["-c", "import numpy"]).output();
        ended.is_ok_and(|ended| ended.status.success())
    };
    ["python3", "/usr/bin/python3"].iter().find(has).expect(
        "a python3 with NumPy; `cargo verify` installs it, or `apt-get install python3-numpy`",
    )
}

/// Runs a script that imports the package.
fn run(folder: &TestFolder, script: &str) -> Output {
    let mut command = Command::new(python());
    for (name, value) in folder.command().get_envs() {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    command
        .current_dir(folder.at(""))
        .env("PYTHONPATH", package())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("SURFELSHOP", build_folder().join("surfelshop"))
        .args(["-c", script])
        .output()
        .unwrap()
}

#[track_caller]
fn said(ended: &Output) -> String {
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    String::from_utf8_lossy(&ended.stdout).trim().to_owned()
}

fn two() -> TestFolder {
    let folder = TestFolder::new();
    folder.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    folder
}

/// Invariant: pictures in Python are the program's, bit for bit
#[test]
#[cfg(unix)]
fn pictures_are_those_of_the_program_bit_for_bit() {
    let folder = two();
    folder.run("render two.ply -r ewa-phong --size 70x50 --background white -o two.exr").done();
    // What another reader finds in the file.
    let read = exr::prelude::read_first_flat_layer_from_file(folder.at("two.exr")).unwrap();
    let channels = &read.layer_data.channel_data.list;
    let mut expected = Vec::new();
    for channel in channels {
        let exr::prelude::FlatSamples::F32(values) = &channel.sample_data else { panic!("floats") };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        std::fs::write(folder.at(&format!("{}.raw", channel.name)), bytes).unwrap();
        expected.push(channel.name.to_string());
    }
    assert!(expected.len() > 4, "{expected:?}");
    let script = "
import surfelshop, numpy
options = dict(size=(70, 50), background='white')
layers = surfelshop.render('two.ply', 'ewa-phong', layers=True, **options)
for name, values in layers.items():
    assert values.shape == (50, 70), values.shape
    assert values.tobytes() == open(name + '.raw', 'rb').read(), name
picture = surfelshop.Cloud('two.ply').render('ewa-phong', **options)
assert picture.dtype == numpy.float32 and picture.shape == (50, 70, 4)
for i, name in enumerate('RGBA'):
    assert picture[..., i].tobytes() == open(name + '.raw', 'rb').read(), name
assert 0.05 < (picture[..., 3] > 0.5).mean() < 0.95
print(' '.join(sorted(layers)))
";
    expected.sort();
    assert_eq!(said(&run(&folder, script)), expected.join(" "));
}

#[test]
#[cfg(unix)]
fn clouds_reports_and_failures_are_those_of_the_program() {
    let folder = two();
    let failed = folder.run("render two.ply -r none -o a.png");
    folder.put("expected.txt", failed.stderr.trim_end());
    let script = "
import surfelshop, numpy
cloud = surfelshop.Cloud('two.ply')
assert cloud.info()['command'] == 'info'
columns = cloud.columns()
assert numpy.allclose(columns['position'], [[-0.5, 0, 0], [0.7, 0.2, 0]])
assert numpy.allclose(columns['radius'], [1, 0.6])
shaded = cloud.bake('ambient-occlusion', rays=4)
assert shaded.columns()['ao'].shape == (2,)
rows = cloud.report('ewa-phong', knobs={'ambient': [0, 0.5]}, reference='flat', size=24, repeats=2)
assert [row['value'] for row in rows] == [0.0, 0.5] and all(row['rmse'] > 0 and row['ms'] > 0 for row in rows)
assert '<td>ambient</td>' in rows._repr_html_()
told = cloud.compare({'a': 'flat', 'b': 'ewa-phong'}, size=24, repeats=0, out='kept')
assert [one['name'] for one in told['renderers']] == ['a', 'b']
try:
    cloud.render('none')
except surfelshop.SurfelshopError as error:
    assert str(error) == open('expected.txt').read(), error
    assert error.code == 1
else:
    assert False, 'an exception'
try:
    cloud.render(sizes=3)
except surfelshop.SurfelshopError as error:
    assert error.code == 2 and '--sizes' in str(error), error
for call, words in [
    (lambda: surfelshop.bake('two.ply', out='a.ply'), '--tool'),
    (lambda: surfelshop.report('two.ply'), '--renderer'),
    (lambda: surfelshop.bake(['two.ply', 'two.ply'], 'ambient-occlusion', out='a.ply'), 'two.ply'),
    (lambda: cloud.render(path='orbit:2'), '--path'),
    (lambda: cloud.report('flat', part='1/2'), '--part'),
]:
    try:
        call()
    except surfelshop.SurfelshopError as error:
        assert error.code == 2 and words in str(error) and str(error).startswith('surfelshop: '), error
    else:
        assert False, words
assert len(cloud.report('ewa-phong', knobs={'ambient': 0.5}, reference='flat', size=[24, 20], repeats=1)) == 1
print('done')
";
    assert_eq!(said(&run(&folder, script)), "done");
    assert!(folder.at("kept/index.html").is_file());
}

/// The cells of the notebook, one after the other, as a notebook's kernel runs them.
#[test]
#[cfg(unix)]
fn the_notebook_runs() {
    let folder = two();
    let notebook = package().join("examples/cloud.ipynb");
    let script = format!(
        "
import json, os
os.environ['CLOUD'] = 'two.ply'
cells, names = json.load(open({notebook:?}))['cells'], {{}}
sources = [''.join(cell['source']) for cell in cells if cell['cell_type'] == 'code']
assert len(sources) >= 7
for source in sources:
    exec(source, names)
assert names['picture'].shape == (160, 160, 4) and names['covered'] > 0.05
assert len(names['rows']) == 3 and 'no-such-renderer' in names['line']
print('done')
"
    );
    assert!(said(&run(&folder, &script)).ends_with("done"));
}

/// `pip install` makes a wheel of it that works elsewhere.
#[test]
#[cfg(unix)]
fn a_wheel_is_built_and_works() {
    if std::env::var_os("SURFELSHOP_LONG").is_none() {
        return;
    }
    let folder = two();
    let place = folder.at("venv");
    let status = |command: &mut Command| assert!(command.status().unwrap().success());
    status(Command::new("python3").args(["-m", "venv"]).arg(&place));
    // A copy: building leaves files behind.
    status(Command::new("cp").arg("-r").arg(package()).arg(folder.at("python")));
    status(Command::new(place.join("bin/pip")).args(["-q", "install"]).arg(folder.at("python")));
    let script = "import surfelshop; print(surfelshop.render('two.ply', 'flat', size=8).shape)";
    let ended = Command::new(place.join("bin/python"))
        .current_dir(folder.at(""))
        .env_remove("PYTHONPATH")
        .env("SURFELSHOP", build_folder().join("surfelshop"))
        .args(["-c", script])
        .output()
        .unwrap();
    assert_eq!(said(&ended), "(8, 8, 4)");
}
