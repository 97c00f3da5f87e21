//! Colours by attributes, filters and legends: what `render` and others make of them.

use crate::cli::program::{TestFolder, read_png};
use surfelshop_cloud::display::{ColorMap, Palette};

/// Columns of the cloud besides what a surfel needs: a number, and a class.
const COLUMNS: [&str; 2] = ["property float heat", "property uchar classification"];

/// A row of five discs that do not touch, from left to right 0 to 4 high, with a number and a class each.
fn row() -> TestFolder {
    let folder = TestFolder::new();
    let mut text = "ply\nformat ascii 1.0\nelement vertex 5\n".to_owned();
    for property in ["x", "y", "z", "nx", "ny", "nz", "radius"] {
        text += &format!("property float {property}\n");
    }
    text += &format!("{}\nend_header\n", COLUMNS.join("\n"));
    for (i, (heat, class)) in
        [("1", 2), ("10", 6), ("100", 2), ("nan", 7), ("-5", 6)].iter().enumerate()
    {
        text += &format!("{} {i} 0 0 0 1 0.9 {heat} {class}\n", 2 * i);
    }
    folder.put("row.ply", &text);
    // All lie on a line through the middle of the picture; nothing shades them.
    folder.put(
        "row.scene.toml",
        "format = 1\nlights = []\n[camera]\neye = [4, 2, 9]\ntarget = [4, 2, 0]\nup = [-4, 8, 0]\n\
         height = 4\n[[clouds]]\npath = 'row.ply'\n[[views]]\nrenderer = 'flat'\nvalues.ambient = 1.0\n",
    );
    folder
}

/// The colours of the discs, from left to right; `None` where there is none.
fn discs(folder: &TestFolder, options: &str) -> [Option<[u8; 3]>; 5] {
    folder.run(&format!("render row.scene.toml -o a.png --size 240x80 {options}")).done();
    let picture = read_png(&folder.at("a.png"));
    std::array::from_fn(|i| {
        // 80 pixels are 4 units, and discs are sqrt(5) apart.
        let x = 120.0 + (i as f64 - 2.0) * 5f64.sqrt() * 20.0;
        let [red, green, blue, alpha] = picture.get_pixel(x as u32, 40).0;
        (alpha == 255).then_some([red, green, blue])
    })
}

fn map(map: ColorMap, share: f64) -> Option<[u8; 3]> {
    Some(map.color(share))
}

#[test]
fn backs_are_tinted_by_option_and_by_scene() {
    let folder = row();
    let text = std::fs::read_to_string(folder.at("row.ply")).unwrap();
    // The second disc is turned away.
    let turned = text.replace("2 1 0 0 0 1", "2 1 0 0 0 -1");
    assert_ne!(turned, text);
    folder.put("row.ply", &turned);
    let (plain, tinted) = (discs(&folder, ""), discs(&folder, "--tint-backs"));
    let back = tinted[1].unwrap();
    assert!(back[0] > 200 && back[1] < 80 && back[2] > 150, "{back:?}");
    assert_eq!([0, 2, 3, 4].map(|i| tinted[i]), [0, 2, 3, 4].map(|i| plain[i]));
    assert!(plain.iter().all(|disc| *disc == plain[0]), "{plain:?}");
    let scene = std::fs::read_to_string(folder.at("row.scene.toml")).unwrap();
    folder
        .put("row.scene.toml", &scene.replace("[camera]", "[splats]\ntint_backs = true\n[camera]"));
    assert_eq!(discs(&folder, ""), tinted);
    assert_eq!(discs(&folder, "--tint-backs=false"), plain);
}

/// Invariant: what nothing shades has the colours of the map, to the last bit
#[test]
fn pictures_have_the_colours_of_the_map() {
    let folder = row();
    let found = discs(&folder, "--color-by height --color-range 0,4");
    assert_eq!(found, [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| map(ColorMap::Viridis, share)));
    // NaN is neutral, and what is not above 0 has the colour of the lower end.
    let found =
        discs(&folder, "--color-by heat --color-map turbo --color-scale log --color-range 1,100");
    let turbo = |share| map(ColorMap::Turbo, share);
    assert_eq!(found, [turbo(0.0), turbo(0.5), turbo(1.0), Some([188; 3]), turbo(0.0)]);
    let classes = [2, 6, 2, 7, 6].map(|class| Some(Palette::Classes.color(class)));
    assert_eq!(discs(&folder, "--color-by classification"), classes);
    assert_eq!(discs(&folder, "--color-by #102030"), [Some([16, 32, 48]); 5]);
    let found = discs(&folder, "--color-by classification --color-map grey --color-range 2,7");
    assert_eq!(found[1], map(ColorMap::Grey, 0.8));
    // Normals of all are the same.
    let found = discs(&folder, "--color-by normal");
    assert!(found.iter().all(|color| color.is_some() && *color == found[0]), "{found:?}");
}

#[test]
fn filters_hide_what_they_say() {
    let folder = row();
    let shown = |options: &str| discs(&folder, options).map(|color| color.is_some());
    assert_eq!(shown("--hide classification=7,2"), [false, true, false, false, true]);
    assert_eq!(shown("--only height=..2"), [true, true, true, false, false]);
    assert_eq!(shown("--only heat=1.. --hide heat=10..50"), [true, false, true, false, false]);
    assert_eq!(shown("--only heat=-9..1e9"), [true, true, true, false, true], "NaN is in no range");
    let report = folder
        .run("render row.scene.toml -o a.png --size 8 --json --only height=1.. --color-by heat")
        .json();
    assert_eq!(report["facts"]["n_surfels"], 4);
    let display = &report["display"];
    assert_eq!(
        (&display["surfels_hidden"], &display["filters"][0]),
        (&1.into(), &"keep height=1..".into())
    );
    assert_eq!(
        (&display["color"]["by"], &display["color"]["map"]),
        (&"heat".into(), &"viridis".into())
    );
    // Percentiles are those of all surfels, hidden or not: 2 % and 98 % of -5, 1, 10 and 100.
    let range = display["color"]["range"].as_array().unwrap();
    assert!((range[0].as_f64().unwrap() + 4.64).abs() < 1e-9, "{range:?}");
    let ended = folder.run("render row.ply -o a.png --size 8 --only height=90..").done();
    assert!(ended.stderr.contains("nothing is shown: the filters hide all 5 surfels"), "{ended:?}");
}

/// Invariant: a scene with colours and filters, and the same options, give the same pixels; what is typed
/// counts instead of what the scene says
#[test]
fn scenes_say_the_same_as_options() {
    let folder = row();
    let scene = std::fs::read_to_string(folder.at("row.scene.toml")).unwrap();
    let pixels = |options: &str| discs(&folder, options);
    let expected = pixels("--color-by heat --color-scale log --color-range 5%,50 --only heat=2..");
    folder.put(
        "row.scene.toml",
        &format!(
            "{scene}\n[color]\nby = 'heat'\nscale = 'log'\nrange = ['5%', 50]\n[[filter]]\n\
             column = 'heat'\naction = 'keep'\nrange = [2, inf]\n"
        ),
    );
    assert_eq!(pixels(""), expected);
    assert_eq!(pixels("--hide none").map(|color| color.is_some()), [true; 5]);
    let found = pixels("--hide none --color-by height --color-range 0,4");
    assert_eq!(
        found[4],
        map(ColorMap::Viridis, 1.0),
        "the scene's scale is that of its own column"
    );
    let info = folder.run("info row.scene.toml").done().stdout;
    assert!(info.contains("colours   heat, log, from 5% to 50.0\n"), "{info}");
    assert!(info.contains("filters   keep heat=2..\n"), "{info}");
}

/// Invariant: colours of the file are drawn as if there were no others, to the last bit
#[test]
fn what_is_off_changes_no_pixel() {
    let folder = row();
    for renderer in ["flat", "ewa-phong"] {
        let bytes = |options: &str| {
            folder
                .run(&format!("render row.ply -r {renderer} -o a.png --size 64 {options}"))
                .done();
            std::fs::read(folder.at("a.png")).unwrap()
        };
        assert!(bytes("") == bytes("--color-by file"), "{renderer}");
        assert!(bytes("") == bytes("--only height=-9..9"), "{renderer}");
        assert!(bytes("") != bytes("--color-by height"), "{renderer}");
    }
}

#[test]
fn tracers_show_colours_and_filters() {
    let folder = row();
    let line = "render row.ply -r reference --set samples=1 -o a.png --size 64x32";
    let covered = |options: &str| {
        folder.run(&format!("{line} {options}")).done();
        let picture = read_png(&folder.at("a.png"));
        let covered = picture.pixels().filter(|pixel| pixel[3] > 0);
        let colors: Vec<[u8; 4]> = covered.map(|pixel| pixel.0).collect();
        assert!(colors.len() > 20, "{}", colors.len());
        colors
    };
    assert!(covered("--camera front").iter().all(|color| color[0] == color[1]), "neutral");
    assert!(
        covered("--camera front --color-by #00ff00")
            .iter()
            .all(|color| color[0] == 0 && color[1] > 0)
    );
    let half = covered("--only height=..1 --camera 4,2,12;4,2,0").len();
    let all = covered("--camera 4,2,12;4,2,0").len();
    assert!((0.3..0.5).contains(&(half as f64 / all as f64)), "{half} of {all}");
}

#[test]
fn legends_stand_in_a_corner_of_png_files() {
    let folder = row();
    let pixels = |options: &str| {
        let line = "render row.scene.toml -o a.png -o a.exr --size 400x300 --background #808080";
        let ended = folder.run(&format!("{line} {options}")).done();
        (read_png(&folder.at("a.png")), std::fs::read(folder.at("a.exr")).unwrap(), ended.stderr)
    };
    let by = "--color-by heat --color-map turbo";
    let (without, plain, _) = pixels(by);
    let (with, linear, said) = pixels(&format!("{by} --legend"));
    assert_eq!(said, "");
    assert!(plain == linear, "EXR files have none");
    let changed: Vec<(u32, u32)> = with
        .enumerate_pixels()
        .filter(|(x, y, pixel)| *pixel != without.get_pixel(*x, *y))
        .map(|(x, y, _)| (x, y))
        .collect();
    assert!(changed.len() > 2000, "{}", changed.len());
    assert!(changed.iter().all(|(x, y)| *x > 250 && *y > 50), "{:?}", changed.first());
    for end in [0.0, 1.0] {
        let [red, green, blue] = ColorMap::Turbo.color(end);
        let is_end = |(x, y): &&(u32, u32)| with.get_pixel(*x, *y).0 == [red, green, blue, 255];
        assert!(changed.iter().any(|place| is_end(&place)), "{end}");
    }
    let (same, _, said) = pixels("--legend");
    assert!(said.contains("--legend draws nothing: name what colours surfels with --color-by"));
    assert!(same == pixels("").0);
}

#[test]
fn mistakes_are_one_line_that_helps() {
    let folder = row();
    let failed = |options: &str, words: &[&str]| {
        folder.run(&format!("render row.ply -o b.png --size 8 {options}")).failed(words);
        assert!(!folder.at("b.png").exists());
    };
    let columns =
        "there are `classification`, `heat`, `normal`, `position`, `radius`, and `height`";
    failed("--color-by intensity", &["no cloud has a column `intensity`", columns]);
    failed("--hide intensity=1", &["no cloud has a column `intensity`", columns]);
    failed("--color-by heat[2]", &["column `heat`: expected a component below 1, found 2"]);
    failed("--color-map turbo", &["--color-map: expected --color-by with `height`"]);
    failed(
        "--color-by radius --color-map categories",
        &["`radius`: expected at most 1024 different whole"],
    );
    let misused = |options: &str, words: &[&str]| {
        folder.run(&format!("render row.ply -o b.png {options}")).misused(words);
    };
    misused("--color-by", &["--color-by <WHAT>"]);
    misused("--color-by heat --color-map jet", &["viridis, turbo, grey, diverging, categories"]);
    misused("--color-by heat --color-range 5%", &["expected LOW,HIGH"]);
    misused("--hide heat", &["expected NAME=LOW..HIGH"]);
    for command in [
        "compare row.ply -r flat -o c",
        "report row.ply -r flat --knob ambient=0,1 --reference flat -o c",
        "explain row.ply",
    ] {
        folder.run(&format!("{command} --color-by intensity")).failed(&["`intensity`", columns]);
    }
    folder.run("bench row.ply --sizes 8 --color-by intensity").failed(&["`intensity`", columns]);
    folder.run("bench --growth --color-by height").failed(&["--growth makes clouds of its own"]);
    // NaN is no category, and all other numbers are whole.
    folder
        .run("render row.ply -o b.png --size 8 --color-by normal[2] --color-map categories")
        .done();
}

#[test]
fn compare_and_explain_draw_what_is_asked_for() {
    let folder = row();
    let report = folder
        .run("compare row.ply -r flat -o compared --size 16 --repeats 0 --color-by heat --only height=1.. --json")
        .json();
    assert_eq!(report["display"]["surfels_hidden"], 1);
    assert_eq!(report["facts"]["n_surfels"], 4);
    let page = std::fs::read_to_string(folder.at("compared/index.html")).unwrap();
    assert!(page.contains("Coloured by heat from") && page.contains("hide 1 surfels"), "no note");
    let report = folder.run("explain row.ply -r flat --color-by classification --json").json();
    assert_eq!(report["display"]["color"]["map"], "categories");
    let columns = report["explained"]["columns"].as_array().unwrap();
    assert!(columns.iter().any(|column| column["name"] == "color" && column["read"] == true));
    assert!(
        !columns.iter().any(|column| column["name"] == "classification" && column["read"] == true)
    );
}

/// Invariant: the commands of the page on colours work as they stand there
#[test]
#[cfg(unix)]
fn the_commands_of_the_page_work() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let page = std::fs::read_to_string(root.join("host/manual/use/colours.md")).unwrap();
    let folder = TestFolder::new();
    std::os::unix::fs::symlink(root.join("assets"), folder.at("assets")).unwrap();
    let lines = page.lines().filter_map(|line| line.strip_prefix("surfelshop "));
    let lines: Vec<&str> = lines.collect();
    assert!(lines.len() >= 4, "{lines:?}");
    for line in lines {
        let line = line.replace('\'', "");
        let ended = folder.run(&format!("{line} --size 192")).done();
        assert_eq!(ended.stderr, "", "{line}");
    }
    for made in ["height.png", "normals.png", "radii.png", "top.png"] {
        assert!(read_png(&folder.at(made)).pixels().any(|pixel| pixel[3] > 0), "{made}");
    }
}
