//! The page: pictures of each renderer along a path, legends and numbers, all in one file.

use base64::display::Base64Display;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;
use serde_json::{Value, json};
use surfelshop_cloud::display::{Legend, LegendBody};
use surfelshop_session::output::legend::{heading, listed};

const TEMPLATE: &str = include_str!("page.html");

/// Most entries of a legend.
const MOST_LISTED: usize = 24;

/// What a page shows.
#[derive(Debug, Serialize)]
pub(super) struct SharedPage {
    pub(super) title: String,
    /// What was shown, in sentences.
    pub(super) notes: Vec<String>,
    pub(super) command: String,
    pub(super) version: &'static str,
    /// Width and height of the pictures.
    pub(super) size: [u32; 2],
    /// Whether the last picture is a step before the first.
    pub(super) goes_around: bool,
    /// The name of each picture of the path.
    pub(super) frames: Vec<String>,
    pub(super) renderers: Vec<SharedRenderer>,
    pub(super) legend: Value,
}

/// A renderer, and its pictures.
#[derive(Debug, Serialize)]
pub(super) struct SharedRenderer {
    pub(super) name: String,
    /// Milliseconds of a picture, the first left out: the median.
    pub(super) ms: Option<f64>,
    /// Milliseconds of the first, with all that had to be made.
    pub(super) first_ms: f64,
    /// Its parameters as they are set.
    pub(super) parameters: Value,
    /// Data addresses.
    pub(super) pictures: Vec<String>,
}

/// A picture as an address that holds it.
pub(super) fn address(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", Base64Display::new(jpeg, &BASE64_STANDARD))
}

/// A legend as the page draws it; null where there is none.
pub(super) fn legend(legend: Option<&Legend>) -> Value {
    let Some(legend) = legend else { return Value::Null };
    let color = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
    match &legend.body {
        LegendBody::Ramp { colors, ticks, beyond } => json!({
            "title": heading(legend),
            "colors": colors.iter().copied().map(color).collect::<Vec<_>>(),
            "beyond": beyond,
            "ticks": ticks.iter().map(|tick| json!([tick.share, tick.label])).collect::<Vec<_>>(),
        }),
        LegendBody::List(entries) => {
            let (shown, n_more) = listed(entries, MOST_LISTED);
            let entry = |entry: &&surfelshop_cloud::display::LegendEntry| {
                json!([color(entry.color), entry.label])
            };
            json!({
                "title": heading(legend),
                "entries": shown.iter().map(entry).collect::<Vec<_>>(),
                "more": n_more,
            })
        }
    }
}

impl SharedPage {
    /// The page's bytes.
    pub(super) fn html(&self) -> anyhow::Result<String> {
        // Nothing in the data can end the element it stands in.
        let data = serde_json::to_string(self)?.replace('<', "\\u003c");
        let (before, after) = TEMPLATE.split_once("DATA").unwrap_or((TEMPLATE, ""));
        Ok(format!("{before}{data}{after}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_all_and_asks_for_nothing() {
        let page = SharedPage {
            title: "</script><script>alert(1)</script>".to_owned(),
            notes: Vec::new(),
            command: String::new(),
            version: "0",
            size: [1; 2],
            goes_around: true,
            frames: vec!["1".to_owned()],
            renderers: vec![SharedRenderer {
                name: "flat".to_owned(),
                ms: None,
                first_ms: 1.0,
                parameters: json!({}),
                pictures: vec![address(b"jpg")],
            }],
            legend: Value::Null,
        };
        let html = page.html().unwrap();
        assert!(!html.contains("alert(1)</script>"));
        assert!(html.contains("data:image/jpeg;base64,anBn"));
        assert!(html.contains("default-src 'none'"), "the browser itself refuses requests");
        for remote in ["http://", "https://", "src=\"/", "@import", "url("] {
            assert!(!html.contains(remote), "{remote}");
        }
        assert_eq!(html.matches("DATA").count(), 0);
    }
}
