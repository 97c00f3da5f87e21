//! Tools over pyramids through the program, beside the same tools in memory. Costs 14 s.

use crate::cli::program::TestFolder;
use crate::cli::pyramids::killed_at;
use std::collections::HashMap;
use surfelshop_cloud::{Buffer, Cloud, Column, ReadOptions, WriteOptions};
use surfelshop_pyramid::Pyramid;
use surfelshop_tests::clouds;

/// Surfels in a file, and a pyramid of several parts that is made of it.
fn put(desk: &TestFolder, n: usize) {
    let cloud = clouds::wavy_sphere(n);
    surfelshop_cloud::write(desk.at("a.ply"), &cloud, &WriteOptions::default()).unwrap();
    desk.run("index a.ply -o a.surfels --memory 64MB").done();
}

fn leaves(desk: &TestFolder, name: &str) -> Vec<Cloud> {
    let pyramid = Pyramid::open(&desk.at(name)).unwrap();
    let leaves = (0..).zip(pyramid.nodes()).filter(|(_, node)| node.is_leaf());
    leaves.map(|(number, _)| pyramid.read(number).unwrap()).collect()
}

fn read(desk: &TestFolder, name: &str) -> Cloud {
    surfelshop_cloud::read(desk.at(name), &ReadOptions::default()).unwrap().cloud
}

type Place = [u32; 3];

fn place(cloud: &Cloud, i: usize) -> Place {
    cloud.world_position(i).unwrap().as_vec3().to_array().map(f32::to_bits)
}

/// A number of each surfel of a file by its place.
fn numbers(cloud: &Cloud, name: &str) -> HashMap<Place, f64> {
    let values = cloud.column(name).unwrap().values();
    (0..cloud.len()).map(|i| (place(cloud, i), values.get_f64(i).unwrap())).collect()
}

#[test]
fn ambient_occlusion_of_parts_is_that_of_the_whole() {
    let desk = TestFolder::new();
    // A ball with a deep dent.
    let ball = clouds::wavy_sphere(150_000);
    let dented = |p: &glam::Vec3| *p * (1.0 - 0.8 * (-6.0 * p.distance(glam::Vec3::Y)).exp());
    let places = ball.positions().iter().flat_map(|p| dented(p).to_array()).collect();
    let bare = vec![Column::new("position", 3, Buffer::F32(places))];
    let bare = Cloud::new(ball.origin(), bare).unwrap();
    surfelshop_cloud::write(desk.at("bare.ply"), &bare, &WriteOptions::default()).unwrap();
    desk.run("convert bare.ply a.ply --estimate").done();
    desk.run("index a.ply -o a.surfels --memory 64MB").done();
    let object =
        desk.run("bake a.surfels -t ambient-occlusion -o ao.surfels --memory 64MB --json").json();
    assert!(object["steps"][0]["parts"].as_u64().unwrap() > 2, "{object}");
    assert_eq!(object["steps"][0]["columns"][0], "ao");
    desk.run("bake a.ply -t ambient-occlusion -o ao.ply").done();
    let known = numbers(&read(&desk, "ao.ply"), "ao");
    let (mut squares, mut worst, mut n) = (0.0, 0f64, 0);
    let (mut darkest, mut sum) = (1f64, 0.0);
    for leaf in leaves(&desk, "ao.surfels") {
        for (i, &ao) in leaf.floats("ao", 1).iter().enumerate() {
            let expected = known[&place(&leaf, i)];
            let off = f64::from(ao) - expected;
            (squares, worst, n) = (squares + off * off, worst.max(off.abs()), n + 1);
            (darkest, sum) = (darkest.min(expected), sum + expected);
        }
    }
    assert_eq!(n, 150_000);
    // Otherwise anything would do.
    assert!(darkest < 0.8 && sum / f64::from(n) < 0.99, "{darkest}, {}", sum / f64::from(n));
    let rms = (squares / f64::from(n)).sqrt();
    // Far less than the 0.005 to 0.01 by which the method is off. Where rays are traced both have a standard error of up
    // to 0.03, by other rays: four of their difference.
    assert!(rms < 0.002 && worst < 0.17, "{rms}, at worst {worst}");
}

#[test]
fn tools_of_a_surfel_and_of_its_neighbours_do_what_they_do_in_memory() {
    let desk = TestFolder::new();
    put(&desk, 120_000);
    // One after the other, and nothing is left of what was between them.
    desk.run_with(&[
        "bake",
        "a.surfels",
        "-t",
        "normals",
        "-t",
        "radii",
        "-o",
        "b.surfels",
        "--memory",
        "64MB",
        "--set",
        "normals:orientation=keep",
        "--set",
        "radii:factor=1.5",
    ])
    .done();
    let is_left = |name: &String| name.contains(".bake") || name.contains(".index");
    assert!(!desk.files().iter().any(is_left), "{:?}", desk.files());
    desk.run_with(&[
        "bake",
        "a.ply",
        "-t",
        "normals",
        "-t",
        "radii",
        "-o",
        "b.ply",
        "--set",
        "normals:orientation=keep",
        "--set",
        "radii:factor=1.5",
    ])
    .done();
    let whole = read(&desk, "b.ply");
    let by_place: HashMap<Place, usize> = (0..whole.len()).map(|i| (place(&whole, i), i)).collect();
    let (mut n, mut n_off) = (0, 0);
    for leaf in leaves(&desk, "b.surfels") {
        for i in 0..leaf.len() {
            let known = by_place[&place(&leaf, i)];
            let is_off = leaf.normals()[i].dot(whole.normals()[known]) < 0.999
                || (leaf.radii()[i] / whole.radii()[known] - 1.0).abs() > 0.05;
            (n, n_off) = (n + 1, n_off + usize::from(is_off));
        }
    }
    assert_eq!(n, 120_000);
    assert!(n_off < 30, "{n_off} differ");
    let told = desk.run("info b.surfels").done().stdout;
    assert!(told.contains("orientation keep") && told.contains("factor 1.5"), "{told}");

    // Which have companions follows from what is around alone.
    let outliers = "-t outliers --set method=radius --set radius=0.012 --set companions=4";
    desk.run(&format!("bake a.surfels {outliers} -o c.surfels --memory 64MB")).done();
    desk.run(&format!("bake a.ply {outliers} -o c.ply")).done();
    let mut kept: Vec<Place> = leaves(&desk, "c.surfels")
        .iter()
        .flat_map(|leaf| (0..leaf.len()).map(|i| place(leaf, i)).collect::<Vec<_>>())
        .collect();
    let whole = read(&desk, "c.ply");
    let mut expected: Vec<Place> = (0..whole.len()).map(|i| place(&whole, i)).collect();
    kept.sort_unstable();
    expected.sort_unstable();
    assert!(kept == expected, "{} and {} of 120000", kept.len(), expected.len());
    assert!((1_000..119_000).contains(&kept.len()), "{}", kept.len());
}

#[test]
fn textures_go_on_across_parts_and_splats_stand_for_all() {
    let desk = TestFolder::new();
    put(&desk, 120_000);
    desk.run("bake a.surfels -t procedural -o p.surfels --memory 64MB").done();
    desk.run("bake a.ply -t procedural -o p.ply").done();
    let whole = read(&desk, "p.ply");
    let colors: HashMap<Place, [f32; 3]> = whole
        .linear_colors()
        .unwrap()
        .into_iter()
        .enumerate()
        .map(|(i, c)| (place(&whole, i), c))
        .collect();
    let mut off = 0f32;
    for leaf in leaves(&desk, "p.surfels") {
        for (i, color) in leaf.linear_colors().unwrap().into_iter().enumerate() {
            let known = colors[&place(&leaf, i)];
            off = (0..3).map(|c| (color[c] - known[c]).abs()).fold(off, f32::max);
        }
    }
    // PLY rounds floats to nothing; what differs is where positions are from.
    assert!(off < 0.02, "{off}");

    // Of a part the tolerance is a share of the largest extent, of a cube's diagonal by the root of three less.
    let splats = "bake a.surfels -t splats --set tolerance=8.66e-4";
    let made = desk.run(&format!("{splats} -o s.surfels --memory 64MB --json")).json();
    let n_parts = made["surfels"].as_u64().unwrap();
    let n_whole =
        desk.run("bake a.ply -t splats -o s.ply --json").json()["surfels"].as_u64().unwrap();
    assert!(n_parts < 120_000 / 4, "{n_parts} splats");
    let more = n_parts as f64 / n_whole as f64;
    assert!((0.9..1.4).contains(&more), "{n_parts} in parts, {n_whole} as a whole");
    let ellipses = leaves(&desk, "s.surfels");
    assert!(ellipses.iter().all(|leaf| leaf.column("tangent_u").is_some()));
}

#[test]
fn a_bake_that_is_killed_goes_on_to_the_same_bytes() {
    let desk = TestFolder::new();
    put(&desk, 200_000);
    let bake = "bake a.surfels -t normals --memory 64MB -o";
    desk.run(&format!("{bake} whole.surfels")).done();
    killed_at(&desk, &format!("{bake} parts.surfels"), "parts.surfels", &[150, 400, 800]);
    let bytes = |name: &str| std::fs::read(desk.at(name)).unwrap();
    assert!(bytes("whole.surfels") == bytes("parts.surfels"));
    assert!(!desk.files().iter().any(|name| name.contains(".index")));
    // Of several tools those that are done are not done again.
    std::fs::create_dir(desk.at("two.surfels.bake")).unwrap();
    std::fs::write(desk.at("two.surfels.bake/mine.txt"), "").unwrap();
    let two =
        "bake a.surfels -t radii -t outliers --set outliers:method=radius --set outliers:radius=";
    desk.run(&format!("{two}1 -o two.surfels")).failed(&["two.surfels.bake", "remove it"]);
    assert!(desk.at("two.surfels.bake/mine.txt").exists());
    std::fs::remove_dir_all(desk.at("two.surfels.bake")).unwrap();
    desk.run(&format!("{two}1e-9 -o two.surfels")).failed(&["a.surfels", "none left"]);
    let step = desk.at("two.surfels.bake/step-1.surfels");
    let made = step.metadata().unwrap().modified().unwrap();
    desk.run(&format!("{two}1e-9 -o two.surfels")).failed(&["a.surfels", "none left"]);
    assert_eq!(step.metadata().unwrap().modified().unwrap(), made);
    desk.run(&format!("{two}1 -o two.surfels")).done();
    assert!(!desk.at("two.surfels.bake").exists());
    // In its own place.
    desk.run("bake a.surfels -t normals -o a.surfels --memory 64MB").done();
    let n: usize = leaves(&desk, "a.surfels").iter().map(Cloud::len).sum();
    assert_eq!(n, 200_000);
}

#[test]
fn what_tools_cannot_do_to_pyramids_is_one_line() {
    let desk = TestFolder::new();
    put(&desk, 70_000);
    desk.run("bake a.surfels -t normals -o b.ply").failed(&["b.ply", ".surfels"]);
    desk.run("bake a.ply -t normals -o b.surfels").failed(&["a.ply", "pyramid", "index"]);
    desk.run("bake a.surfels -t sample -o b.surfels").failed(&["sample", "whole", "index"]);
    desk.run("bake a.surfels -t thin --set count=1000 -o b.surfels").failed(&[
        "a.surfels",
        "spacing",
        "count",
    ]);
    desk.run("bake a.surfels -t outliers --set method=radius --set radius=0.00001 -o b.surfels")
        .failed(&["a.surfels", "none left"]);
    assert!(!desk.at("b.surfels").exists());
    desk.run("bake a.surfels -t thin --set spacing=0.05 -o few.surfels").done();
    let thinned = leaves(&desk, "few.surfels");
    let n: usize = thinned.iter().map(Cloud::len).sum();
    assert!((1_000..20_000).contains(&n), "{n}");
    assert_eq!(thinned.len(), 1, "few enough for one leaf");
    let Some(Buffer::F32(radii)) = thinned[0].column("radius").map(|c| c.values()) else {
        panic!()
    };
    assert!(radii.iter().all(|&radius| radius > 0.02), "they cover the surface");
}

/// Costs 6 s.
#[test]
fn what_is_selected_of_a_pyramid_is_that_of_its_cloud() {
    let desk = TestFolder::new();
    put(&desk, 120_000);
    let count = |line: &str| {
        let object = desk.run(line).json();
        (object["selected"].as_u64().unwrap(), object["surfels"].as_u64().unwrap())
    };
    for what in [
        "all",
        "box:-2,-2,-2:0,2,2",
        "box:-0.4,-2,-0.4:0.4,2,0.4:30",
        "sphere:0,1,0:0.7 not:plane:0.1,0,0:1,0,0",
        "height=0.2..0.6 and:sphere:1,0,0:0.9 invert",
        "not:height=..0",
    ] {
        let [own, expected] =
            ["a.surfels", "a.ply"].map(|file| count(&format!("select {file} {what} --json")));
        assert_eq!(own, expected, "{what}");
        assert!(own.0 > 0 && own.1 == 120_000, "{what}: {own:?}");
    }
    // Measures are of the same surfels.
    for measure in [
        "--profile=-0.9,0.1,0.2:0.8,0.3,-0.4 --thickness 0.1",
        "--volume 0.1,0.9,0.1:0.3,0.9,0.1:0.3,0.9,0.4:0.1,0.9,0.4",
    ] {
        let numbers = |file: &str| -> Vec<f64> {
            let object = desk.run(&format!("measure {file} {measure} --json")).json();
            let numbers = object["measures"][0]["quantities"].as_array().unwrap();
            numbers.iter().map(|number| number["value"].as_f64().unwrap()).collect()
        };
        let (own, expected) = (numbers("a.surfels"), numbers("a.ply"));
        // Sums are of another order.
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-9 * b.abs().max(1e-3);
        assert!(own.len() > 3 && own.iter().zip(&expected).all(is_near), "{own:?}, {expected:?}");
    }
    // Two edits, one after the other, beside the pyramid.
    desk.run("select a.surfels sphere:0,1,0:0.8 --delete -o a.layer.json").done();
    let told = desk
        .run("select a.surfels height=..-0.5 --layer a.layer.json --set class=7 -o b.layer.json")
        .done()
        .stdout;
    desk.run("select a.ply sphere:0,1,0:0.8 --delete -o a1.ply").done();
    desk.run("select a1.ply height=..-0.5 --set class=7 -o b.ply").done();
    let expected = numbers(&read(&desk, "b.ply"), "class");
    assert!(told.contains(&format!("edits that leave {} surfels", expected.len())), "{told}");
    // Leaves that are empty by then have the new column as well.
    let sevens = expected.values().filter(|class| **class == 7.0).count() as u64;
    let counted = count("select a.surfels class=7 --layer b.layer.json --json");
    assert_eq!(counted, (sevens, expected.len() as u64));
    let baked = desk.run("select a.surfels all --layer b.layer.json -o b.surfels --memory 64MB");
    assert!(baked.done().stdout.contains(&format!("b.surfels: {} surfels", expected.len())));
    let mut found = HashMap::new();
    leaves(&desk, "b.surfels").iter().for_each(|leaf| found.extend(numbers(leaf, "class")));
    assert!(found == expected && expected.values().any(|&class| class == 7.0));
    desk.run("select a.surfels all --layer b.layer.json -o b.layer.json").failed(&["b.layer.json"]);
    // A scene names them.
    let scene = "format = 1\n[[clouds]]\npath = \"a.surfels\"\nlayer = \"b.layer.json\"\n";
    std::fs::write(desk.at("s.scene.toml"), scene).unwrap();
    assert_eq!(count("select s.scene.toml all --json").1, expected.len() as u64);
    what_layers_cannot_do_is_a_line(&desk, scene);
}

/// With a pyramid, its cloud, and a layer of it.
fn what_layers_cannot_do_is_a_line(desk: &TestFolder, scene: &str) {
    let wrong = |line: &str, said: &str| {
        desk.run(line).failed(&[said]);
    };
    wrong("select a.surfels all grow", "want all surfels in memory");
    wrong("select a.surfels all --delete -o none.layer.json", "nothing would be left");
    wrong("select a.surfels all -o some.ply", "writes another one, .surfels, or its edits");
    wrong(
        "select a.ply all --layer b.layer.json",
        "expected a pyramid, which layers of edits belong to",
    );
    wrong("select b.surfels all --layer b.layer.json", "expected the layer of a cloud of");
    wrong("select a.surfels klass=1", "no cloud has a column `klass`");
    std::fs::write(desk.at("s.scene.toml"), scene.replace("a.surfels", "a.ply")).unwrap();
    wrong("render s.scene.toml -o x.png", "found a cloud that memory holds");
    let text = std::fs::read_to_string(desk.at("b.layer.json")).unwrap();
    for (from, to, said) in [
        ("surfelshop layer", "surfelshop", "expected \"format\""),
        ("\"version\":1", "\"version\":9", "update Surfelshop"),
        ("delete", "burn", "expected a layer of edits"),
        ("\"radius\":0.8", "\"radius\":null", "expected a layer of edits"),
        ("\"column\":\"class\"", "\"column\":\"radius\"", "where surfels are or how large"),
        ("\"values\":[7.0]", "\"values\":[]", "expected 1 to 64 values, found 0"),
        ("\"scale\":1.0", "\"scale\":-1.0", "a scale above 0"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(desk.at("wrong.layer.json"), text.replace(from, to)).unwrap();
        wrong("select a.surfels all --layer wrong.layer.json", said);
    }
}
