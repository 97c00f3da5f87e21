//! `surfelshop share`: what is on the page, how it fits, and with `SURFELSHOP_LONG` what a browser makes of it. Costs 5 s.

use crate::cli::program::{TestFolder, facing_front};
use serde_json::Value;
use std::process::Command;

fn two() -> TestFolder {
    let folder = TestFolder::new();
    folder.put_cloud("two.ply", &[facing_front(-0.5, 0.0, 1.0), facing_front(0.7, 0.2, 0.6)]);
    folder
}

const LINE: &str = "share two.ply -r flat -r ewa-phong --path orbit:6 --size 96 -o two.html";

/// The data of a page.
fn data(html: &str) -> Value {
    let (_, rest) = html.split_once("<script id=\"data\" type=\"application/json\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn a_page_has_all_pictures_legend_and_numbers_in_one_file() {
    let folder = two();
    let line = format!("{LINE} --color-by height --up y");
    let told = folder.run(&format!("{line} --json")).json();
    let html = std::fs::read_to_string(folder.at("two.html")).unwrap();
    assert_eq!(told["bytes"].as_u64().unwrap(), html.len() as u64);
    assert_eq!((&told["quality"], &told["size"][0]), (&92.into(), &96.into()), "there is room");
    let page = data(&html);
    let renderers = page["renderers"].as_array().unwrap();
    assert_eq!(renderers.len(), 2);
    for renderer in renderers {
        let pictures = renderer["pictures"].as_array().unwrap();
        assert_eq!(pictures.len(), 6);
        assert!(
            pictures.iter().all(|p| p.as_str().unwrap().starts_with("data:image/jpeg;base64,/9j/"))
        );
        assert_ne!(pictures[0], pictures[3], "another side");
        assert!(renderer["ms"].as_f64().unwrap() > 0.0);
    }
    assert_ne!(renderers[0]["pictures"][0], renderers[1]["pictures"][0]);
    assert!(page["legend"]["title"].as_str().unwrap().contains("height"), "{}", page["legend"]);
    assert!(page["legend"]["colors"].as_array().unwrap().len() > 4);
    assert!(page["notes"][0].as_str().unwrap().starts_with("2 surfels"), "{}", page["notes"]);
    for remote in ["http://", "https://", "src=\"/", "@import", "url("] {
        assert!(!html.contains(remote), "{remote}");
    }
    // Whatever the pictures cost, the page keeps to what was allowed.
    let most = told["bytes"].as_u64().unwrap() / 1000 - 1;
    let small = folder.run(&format!("{line} --most {most}kB --json")).json();
    assert!(small["bytes"].as_u64().unwrap() <= 1000 * most, "{small}");
    assert!(small["quality"].as_u64() < told["quality"].as_u64(), "{small}");
    folder.run(&format!("{LINE} --most 1kB")).failed(&["do not fit", "--most"]);
    folder.run(&LINE.replace(".html", ".png")).misused(&[".html"]);
    folder.run(&LINE.replace("flat", "none")).failed(&["none"]);
}

/// Renderers are switched by clicks and keys, the wipe by its slider, and an address says what is seen first.
#[test]
fn a_browser_shows_it_and_asks_for_nothing() {
    if std::env::var_os("SURFELSHOP_LONG").is_none() {
        return;
    }
    let folder = two();
    folder.run(LINE).done();
    let html = std::fs::read_to_string(folder.at("two.html")).unwrap();
    let script = "<script>
addEventListener('load', () => setTimeout(() => {
  const said = [], note = () => said.push(location.hash + ' ' + document.getElementById('stage').getAttribute('aria-label'));
  const click = (side, value) => document.querySelector(`#${side} button[value='${value}']`).click();
  const key = (name) => document.getElementById('stage').dispatchEvent(new KeyboardEvent('keydown', { key: name }));
  note(); click('left', 1); note(); click('right', 0); note(); key('ArrowLeft'); note(); key(' '); note();
  const wipe = document.getElementById('wipe'); wipe.value = 20; wipe.dispatchEvent(new Event('input')); note();
  click('right', -1); note();
  said.push('requests ' + performance.getEntriesByType('resource').filter((e) => !e.name.startsWith('data:')).length);
  const canvas = document.getElementById('canvas'), pixel = canvas.getContext('2d').getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data;
  said.push('middle ' + Array.from(pixel).join(','));
  document.title = said.join('|');
}, 300));
</script></body>";
    folder.put("driven.html", &html.replace("</body>", script));
    let address = format!("file://{}#frame=2", folder.at("driven.html").display());
    let ended = Command::new("chromium")
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--virtual-time-budget=4000",
            "--dump-dom",
        ])
        .arg(address)
        .output()
        .expect("chromium is installed");
    let dom = String::from_utf8_lossy(&ended.stdout);
    let title = dom.split_once("<title>").unwrap().1.split_once("</title>").unwrap().0;
    let said: Vec<&str> = title.split('|').collect();
    assert_eq!(said.len(), 9, "{title}");
    let starts = [
        "#left=0&amp;right=1&amp;frame=2&amp;wipe=0.50",
        "#left=1&amp;right=1&amp;frame=2",
        "#left=1&amp;right=0&amp;frame=2",
        "#left=1&amp;right=0&amp;frame=1",
        "#left=0&amp;right=1&amp;frame=1",
        "#left=0&amp;right=1&amp;frame=1&amp;wipe=0.20",
        "#left=0&amp;right=-1&amp;frame=1",
        "requests 0",
    ];
    for (found, expected) in said.iter().zip(starts) {
        assert!(found.starts_with(expected), "{found}, expected {expected}");
    }
    assert!(said[2].contains("ewa-phong left and flat right of the line"), "{title}");
    let background = "middle 232,230,225,255";
    assert!(said[8].starts_with("middle ") && said[8] != background, "a surfel is seen: {title}");
}
