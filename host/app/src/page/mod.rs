//! One self-contained page of pictures, tables and plots: everything is in the file, and nothing is
//! asked of a network.

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;
use serde_json::Value;

const TEMPLATE: &str = include_str!("page.html");

/// What a page shows.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Page {
    pub(crate) title: String,
    /// Paragraphs; what stands between backquotes is code.
    pub(crate) notes: Vec<String>,
    /// Pictures that are compared, all of one size.
    pub(crate) pictures: Vec<Picture>,
    pub(crate) tables: Vec<Table>,
    pub(crate) plots: Vec<Plot>,
}

/// A picture.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Picture {
    name: String,
    width: u32,
    height: u32,
    /// A data address.
    src: String,
}

impl Picture {
    /// A picture from the bytes of its PNG.
    pub(crate) fn new(name: impl Into<String>, [width, height]: [u32; 2], png: &[u8]) -> Self {
        let src = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png));
        Self { name: name.into(), width, height, src }
    }
}

/// A table that can be sorted by each column.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Table {
    pub(crate) caption: String,
    pub(crate) columns: Vec<Column>,
    /// Numbers, text, or null where there is nothing; text behind the first column says what is wrong.
    pub(crate) rows: Vec<Vec<Value>>,
}

/// A column of a table.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Column {
    pub(crate) name: String,
    /// What the numbers are, in a sentence.
    pub(crate) meaning: String,
    /// `less` or `more`, where one of them is better.
    pub(crate) better: Option<&'static str>,
    /// Digits that are shown.
    pub(crate) digits: Option<u32>,
}

/// A drawing.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Plot {
    pub(crate) caption: String,
    /// The program's own, without scripts.
    pub(crate) svg: String,
}

impl Page {
    /// The page's bytes.
    pub(crate) fn html(&self) -> anyhow::Result<String> {
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
        let page = Page {
            title: "</script><script>alert(1)</script>".to_owned(),
            pictures: vec![Picture::new("one", [1, 1], b"png")],
            ..Page::default()
        };
        let html = page.html().unwrap();
        assert!(!html.contains("alert(1)</script>"));
        assert!(html.contains("data:image/png;base64,cG5n"));
        for remote in ["http://", "https://", "src=\"/", "@import", "url("] {
            assert!(!html.contains(remote), "{remote}");
        }
        assert_eq!(html.matches("DATA").count(), 0);
    }
}
