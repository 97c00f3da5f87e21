//! What a scene says wrongly, and the line that it is refused with.

use super::file;
use crate::scene::read;

/// The one line that a text is refused with, behind its path.
pub(super) fn refusal(bytes: impl AsRef<[u8]>) -> String {
    let (_folder, path) = file(bytes);
    let error = read(&path).unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    error.strip_prefix(&path.display().to_string()).unwrap().to_owned()
}

/// How a line behind `format = 1` is refused.
#[track_caller]
fn refused(line: &str, expected: &str) {
    let found = refusal(format!("format = 1\n{line}\n"));
    assert_eq!(found, format!(":{expected}"), "{line}");
}

#[test]
fn what_is_no_scene_is_told_so() {
    let none =
        ": expected a scene, which has a line `format = 1`, found none; if it is one, add it";
    assert_eq!(refusal(""), none);
    assert_eq!(refusal("[package]\nname = 'a'"), none);
    let newer = ":2:10: expected a scene of format 1, found format 7 of a newer Surfelshop; open it \
                 with that version or a later one";
    assert_eq!(refusal("camera = 'all new'\nformat = 7"), newer);
    assert_eq!(refusal("format = 0"), ":1:10: `format`: expected 1, found `0`");
    assert_eq!(refusal("format = '1'"), ":1:10: `format`: expected 1, found `'1'`");
    let text = refusal(b"format = 1\n# gr\xfcn\n");
    assert_eq!(text, ":2:5: expected UTF-8 text, found the byte 0xfc; save the file as UTF-8");
}

#[test]
fn mistakes_in_toml_are_told_with_their_place() {
    for (line, place, what) in [
        ("a = ", "2:5", "string values must be quoted, expected literal string"),
        ("a = hello", "2:5", "string values must be quoted, expected literal string at `hello`"),
        ("a 3", "2:3", "key with no value, expected `=`"),
        ("name = \"x", "2:10", "invalid basic string, expected `\"`"),
        ("camera = {", "2:11", "unclosed inline table, expected `}`"),
        ("exposure = 1.2.3", "2:15", "invalid float, expected nothing at `.3`"),
        ("a = 1\na = 2", "3:1", "duplicate key at `a`"),
        ("[camera]\n[camera]", "3:2", "duplicate key at `camera`"),
        ("camera = {}\n[[camera]]", "3:3", "duplicate key at `camera`"),
    ] {
        refused(line, &format!("{place}: not valid TOML: {what}; correct it here"));
    }
}

#[test]
fn deep_nesting_is_refused_before_it_harms() {
    for line in [
        format!("a = {}1{}", "[".repeat(40), "]".repeat(40)),
        format!("a = {}1{}", "[".repeat(1_000_000), "]".repeat(1_000_000)),
        format!("layout.{}b = 1", "a.".repeat(40)),
        format!("[{}b]", "a.".repeat(1_000_000)),
    ] {
        let found = refusal(format!("format = 1\n{line}\n"));
        let words = ["32 tables and arrays", "max recursion depth", "recursion limit"];
        assert!(words.iter().any(|word| found.contains(word)), "{found}");
    }
    assert!(refusal("a = [{ b = ".repeat(300_000)).contains("not valid TOML"));
}

#[test]
fn every_value_of_colours_and_filters_is_checked() {
    for (line, expected) in [
        (
            "up = 'w'",
            "2:6: `up`: expected \"y\", \"z\", \"-y\", \"-z\", \"x\" or \"-x\", found `'w'`",
        ),
        (
            "color = {}",
            "2:9: `color.by`: expected \"file\", \"uniform\", \"normal\", \"height\" or the name of a \
             column, found no such key; add it",
        ),
        (
            "color = { by = 'uniform' }",
            "2:9: `color.color`: expected a colour as \"#rrggbb\", found no such key; add it",
        ),
        (
            "color = { by = 'a', color = '#000000' }",
            "2:29: `color.color`: expected `by = \"uniform\"` beside it, found `'#000000'`",
        ),
        (
            "color = { by = 'a', map = 'jet' }",
            "2:27: `color.map`: expected one of viridis, turbo, grey, diverging, categories, found \
             `'jet'`",
        ),
        (
            "color = { by = 'a', scale = 'cubic' }",
            "2:29: `color.scale`: expected \"linear\" or \"log\", found `'cubic'`",
        ),
        (
            "color = { by = 'a', range = ['5%', '101%'] }",
            "2:29: `color.range`: expected two numbers or percentages such as \"5%\", the lower \
             first, found `['5%', '101%']`",
        ),
        (
            "color = { by = 'a', range = [3, 2] }",
            "2:29: `color.range`: expected two numbers or percentages such as \"5%\", the lower \
             first, found `[3, 2]`",
        ),
        (
            "color = { by = 'height', component = 1 }",
            "2:38: `color.component`: expected the name of a column beside it: heights have no \
             components, found `1`",
        ),
        (
            "color = { by = 'a', component = -1 }",
            "2:33: `color.component`: expected a component, counted from 0, found `-1`",
        ),
        (
            "filter = [{ column = 'a', action = 'keep' }]",
            "2:11: `filter[1].range`: expected two numbers, or `values` with whole numbers, found no \
             such key; add it",
        ),
        (
            "filter = [{ column = 'a', action = 'show', values = [1] }]",
            "2:36: `filter[1].action`: expected \"keep\" or \"hide\", found `'show'`",
        ),
        (
            "filter = [{ column = 'a', action = 'keep', values = [1.5] }]",
            "2:53: `filter[1].values`: expected whole numbers, at least one, found `[1.5]`",
        ),
        (
            "filter = [{ column = 'a', action = 'hide', range = [2, nan] }]",
            "2:52: `filter[1].range`: expected two numbers, the lower first, which may be inf, found \
             `[2, nan]`",
        ),
        (
            "filter = [{ column = 'a', action = 'hide', range = [2, 3], values = [1] }]",
            "2:69: `filter[1].values`: expected either `range` or `values`, not both, found `[1]`",
        ),
        (
            "clouds = [{ path = 'a', renderer = ' ' }]",
            "2:36: `clouds[1].renderer`: expected the id of a renderer, found `' '`",
        ),
        (
            "clouds = [{ path = 'a', values = { order = 1 } }]",
            "2:34: `clouds[1].values`: expected `renderer` beside it, whose parameters these are, found \
             a table",
        ),
    ] {
        refused(line, expected);
    }
}

#[test]
fn more_filters_and_values_than_anyone_needs_are_refused() {
    let table = "{ column = 'a', action = 'keep', values = [1] },";
    let many = refusal(format!("format = 1\nfilter = [{}]\n", table.repeat(65)));
    assert!(many.contains("`filter`: expected at most 64 filters, found 65"), "{many}");
    let values = format!("[{}]", "1,".repeat(1025));
    let line = format!("filter = [{{ column = 'a', action = 'keep', values = {values} }}]");
    let many = refusal(format!("format = 1\n{line}\n"));
    assert!(
        many.contains("`filter[1].values`: expected at most 1024 values, found 1025"),
        "{many}"
    );
}

#[test]
fn every_value_is_checked() {
    for (line, expected) in [
        (
            "exposure = 61",
            "2:12: `exposure`: expected a number of stops from -60 to 60, found `61`",
        ),
        (
            "exposure = nan",
            "2:12: `exposure`: expected a number of stops from -60 to 60, found `nan`",
        ),
        (
            "tone_map = 'film'",
            "2:12: `tone_map`: expected \"clamp\" or \"neutral\", found `'film'`",
        ),
        (
            "eye_dome_lighting = true",
            "2:21: `eye_dome_lighting`: expected \"automatic\", \"off\" or \"on\", found `true`",
        ),
        (
            "eye_dome_strength = -1",
            "2:21: `eye_dome_strength`: expected a strength from 0 to 100, found `-1`",
        ),
        (
            "eye_dome_radius = 0",
            "2:19: `eye_dome_radius`: expected a number of pixels above 0, at most 32, found `0`",
        ),
        (
            "background = '#12345'",
            "2:14: `background`: expected \"transparent\", \"#rrggbb\" or a linear colour of three \
             numbers from 0 to 1, or two colours: [upper edge, lower edge], found `'#12345'`",
        ),
        (
            "background = [0, 2, 0]",
            "2:14: `background`: expected \"transparent\", \"#rrggbb\" or a linear colour of three \
             numbers from 0 to 1, or two colours: [upper edge, lower edge], found `[0, 2, 0]`",
        ),
        (
            "background = ['#123456', 'mauve']",
            "2:26: `background`: expected \"#rrggbb\" or a linear colour of three numbers from 0 to 1, \
             found `'mauve'`",
        ),
        ("camera = 3", "2:10: `camera`: expected a table, found `3`"),
        (
            "camera = {}",
            "2:10: `camera.eye`: expected a place of three numbers, found no such key; add it",
        ),
        (
            "lights = { towards = [0, 1, 0] }",
            "2:10: `lights`: expected tables that begin with [[lights]], found a table",
        ),
        (
            "lights = [1]",
            "2:11: `lights[1]`: expected tables that begin with [[lights]], found `1`",
        ),
        (
            "lights = [{}]",
            "2:11: `lights[1].towards`: expected the direction towards the light, or `position` \
             where it has a place, found no such \
             key; add it",
        ),
        ("layout = 3", "2:10: `layout`: expected a table, found `3`"),
        ("more = 1e999", "2:8: `more`: expected a number below 1.8e308, found `1e999`"),
        (
            "more = 99999999999999999999",
            "2:8: `more`: expected a whole number of 64 bits, found `99999999999999999999`",
        ),
    ] {
        refused(line, expected);
    }
    let lights = "[[lights]]\ntowards = [0, 1, 0]\n".repeat(9);
    refused(
        &lights,
        "2:1: `lights`: expected at most 8 lights, found 9; remove some, or split the scene",
    );
}

#[test]
fn surfaces_are_checked() {
    for (line, expected) in [
        (
            "surface.depth_tolerance = 17",
            "2:27: `surface.depth_tolerance`: expected a number of radii from 0 to 16, found `17`",
        ),
        ("surface.two_sided = 1", "2:21: `surface.two_sided`: expected true or false, found `1`"),
        (
            "surface.radius_scale = 0",
            "2:24: `surface.radius_scale`: expected a factor above 0, at most 1000, found `0`",
        ),
        (
            "surface.low_pass = inf",
            "2:20: `surface.low_pass`: expected a number of pixels from 0 to 4, found `inf`",
        ),
    ] {
        refused(line, expected);
    }
}

#[test]
fn splats_are_checked() {
    for (line, expected) in [
        (
            "splats.look = \"dots\"",
            "2:15: `splats.look`: expected \"surface\" or \"points\", found `\"dots\"`",
        ),
        (
            "splats.point_radius = 1",
            "2:23: `splats.point_radius`: expected `look = \"points\"` beside it, found `1`",
        ),
        (
            "splats.round_below = 1.5",
            "2:22: `splats.round_below`: expected a planarity from 0 to 1, found `1.5`",
        ),
        (
            "splats.largest_radius = 0",
            "2:25: `splats.largest_radius`: expected a radius above 0, at most 1e37, found `0`",
        ),
    ] {
        refused(line, expected);
    }
}

#[test]
fn cameras_are_checked() {
    for (rest, expected) in [
        ("[0, 0]", "2:16: `camera.eye`: expected three numbers from -1e37 to 1e37, found `[0, 0]`"),
        (
            "[0, nan, 0]",
            "2:16: `camera.eye`: expected three numbers from -1e37 to 1e37, found `[0, nan, 0]`",
        ),
        (
            "[0, 1e300, 0]",
            "2:16: `camera.eye`: expected three numbers from -1e37 to 1e37, found `[0, 1e300, 0]`",
        ),
        (
            "[1, 2, 3], target = [1, 2, 3]",
            "2:36: `camera.target`: expected another place than `eye`, found `[1, 2, 3]`",
        ),
        (
            "[1, 2, 3], target = [0, 0, 0], up = [0, 0, 0]",
            "2:52: `camera.up`: expected a direction, whose three numbers are not all zero, found \
             `[0, 0, 0]`",
        ),
        (
            "[1, 2, 3], target = [0, 0, 0], fov = 180",
            "2:53: `camera.fov`: expected an angle in degrees from 0.01 to 179, found `180`",
        ),
        (
            "[1, 2, 3], target = [0, 0, 0], height = 0",
            "2:56: `camera.height`: expected a height from 1e-30 to 1e37, found `0`",
        ),
        (
            "[1, 2, 3], target = [0, 0, 0], height = 1, fov = 30",
            "2:56: `camera.height`: expected either `fov` (perspective) or `height` (parallel), \
             not both, found `1`",
        ),
    ] {
        refused(&format!("camera={{ eye = {rest} }}"), expected);
    }
}

#[test]
fn lights_clouds_and_views_are_checked() {
    for (text, expected) in [
        (
            "[[lights]]\ntowards = [0, 0, 0]",
            "3:11: `lights[1].towards`: expected a direction, whose three numbers are not all zero, \
             found `[0, 0, 0]`",
        ),
        (
            "[[lights]]\ntowards = [0, 1, 0]\nradiance = [1, -1, 1]",
            "4:12: `lights[1].radiance`: expected three numbers of 0 or more, found `[1, -1, 1]`",
        ),
        (
            "[[lights]]\ntowards = [0, 1, 0]\nradiance = [1, 1e39, 1]",
            "4:12: `lights[1].radiance`: expected three numbers of 0 or more, found `[1, 1e39, 1]`",
        ),
        (
            "[[clouds]]\nname = 'a'",
            "2:1: `clouds[1].path`: expected the path of a cloud, found no such key; add it",
        ),
        (
            "[[clouds]]\npath = ' '",
            "3:8: `clouds[1].path`: expected the path of a cloud, found `' '`",
        ),
        ("[[clouds]]\npath = 'a'\nname = 3", "4:8: `clouds[1].name`: expected a name, found `3`"),
        (
            "[[clouds]]\npath = 'a'\nvisible = 'no'",
            "4:11: `clouds[1].visible`: expected true or false, found `'no'`",
        ),
        (
            "[[views]]\nrenderer = ''",
            "3:12: `views[1].renderer`: expected the id of a renderer, found `''`",
        ),
        (
            "[[views]]\nrenderer = 'a'\n[[views]]\noutput = 'depth'",
            "4:1: `views[2].renderer`: expected the id of a renderer, found no such key; add it",
        ),
        (
            "[[views]]\nrenderer = 'a'\noutput = 'heat'",
            "4:10: `views[1].output`: expected color, depth, normal, albedo, ao or debug.NAME, \
             found `'heat'`",
        ),
        (
            "[[views]]\nrenderer = 'a'\nvalues = { g = [1, 2] }",
            "4:16: `views[1].values.g`: expected true, false, a finite number, a text or a colour \
             of three numbers, found `[1, 2]`",
        ),
        (
            "[[views]]\nrenderer = 'a'\nvalues = { g = inf }",
            "4:16: `views[1].values.g`: expected true, false, a finite number, a text or a colour \
             of three numbers, found `inf`",
        ),
        (
            "[[views]]\nrenderer = 'a'\nvalues = [1]",
            "4:10: `views[1].values`: expected a table, found `[1]`",
        ),
    ] {
        refused(text, expected);
    }
}

#[test]
fn lights_with_a_place_are_checked() {
    for (text, expected) in [
        (
            "towards = [0, 1, 0]\nposition = [0, 1, 0]",
            "4:12: `lights[1].position`: expected either `towards` or `position`, not both, found \
             `[0, 1, 0]`",
        ),
        (
            "position = [0, 1]",
            "3:12: `lights[1].position`: expected three numbers from -1e37 to 1e37, found `[0, 1]`",
        ),
        (
            "position = [0, 1, 0]\nradiance = [1, 1, 1]",
            "4:12: `lights[1].radiance`: expected `intensity` in its place where a light has a \
             `position`, found `[1, 1, 1]`",
        ),
        (
            "position = [0, 1, 0]\nintensity = [1, -1, 1]",
            "4:13: `lights[1].intensity`: expected three numbers of 0 or more, found `[1, -1, 1]`",
        ),
        (
            "position = [0, 1, 0]\nfollows_camera = true",
            "4:18: `lights[1].follows_camera`: expected `towards` beside it, in place of \
             `position`, found `true`",
        ),
        (
            "position = [0, 1, 0]\nangle = 30",
            "4:9: `lights[1].angle`: expected `target` beside it, which makes the light a spot, \
             found `30`",
        ),
        (
            "position = [0, 1, 0]\ntarget = [0, 1, 0]",
            "4:10: `lights[1].target`: expected another place than `position`, found `[0, 1, 0]`",
        ),
        (
            "position = [0, 1, 0]\ntarget = [0, 0, 0]\nangle = 181",
            "5:9: `lights[1].angle`: expected an angle in degrees from 0 to 180, between the axis \
             and the edge, found `181`",
        ),
        (
            "position = [0, 1, 0]\ntarget = [0, 0, 0]\nsoftness = 1.5",
            "5:12: `lights[1].softness`: expected a share from 0 to 1, found `1.5`",
        ),
        (
            "towards = [0, 1, 0]\nsoftness = 0.5",
            "4:12: `lights[1].softness`: expected `position` beside it, in place of `towards`, \
             found `0.5`",
        ),
    ] {
        refused(&format!("[[lights]]\n{text}"), expected);
    }
}

#[test]
fn transforms_are_checked() {
    for (text, expected) in [
        (
            "translation = [0, 0, -inf]",
            "5:15: `clouds[1].transform.translation`: expected three numbers from -1e37 to 1e37, \
             found `[0, 0, -inf]`",
        ),
        (
            "rotation = [0, 0, 0, 1]",
            "5:12: `clouds[1].transform.rotation`: expected three angles in degrees, about x, y \
             and z, from -1e6 to 1e6, found `[0, 0, 0, 1]`",
        ),
        (
            "quaternion = [0, 0, 0, 0]",
            "5:14: `clouds[1].transform.quaternion`: expected a quaternion of four numbers x, y, \
             z, w that are not all zero, found `[0, 0, 0, 0]`",
        ),
        (
            "quaternion = [0, 0, 0, 1]\nrotation = [0, 0, 0]",
            "5:14: `clouds[1].transform.quaternion`: expected either `rotation` or `quaternion`, \
             not both, found `[0, 0, 0, 1]`",
        ),
        (
            "scale = -1",
            "5:9: `clouds[1].transform.scale`: expected a factor above 0, at most 1e37, found `-1`",
        ),
        (
            "scale = nan",
            "5:9: `clouds[1].transform.scale`: expected a factor above 0, at most 1e37, found `nan`",
        ),
    ] {
        refused(&format!("[[clouds]]\npath = 'a'\n[clouds.transform]\n{text}"), expected);
    }
}
