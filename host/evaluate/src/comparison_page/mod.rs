//! One self-contained page of pictures, tables and plots: everything is in the file, and nothing is
//! asked of a network.

use base64::display::Base64Display;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;
use serde_json::Value;
use std::io::Cursor;

const TEMPLATE: &str = include_str!("page.html");

/// What a page shows.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Page {
    /// The title.
    pub title: String,
    /// Paragraphs; what stands between backquotes is code.
    pub notes: Vec<String>,
    /// The command that made it.
    pub command: String,
    /// The program's version.
    pub version: &'static str,
    /// Pictures that are compared, all of one size.
    pub pictures: Vec<Picture>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Plots.
    pub plots: Vec<Plot>,
}

/// A picture.
#[derive(Clone, Debug, Serialize)]
pub struct Picture {
    name: String,
    width: u32,
    height: u32,
    /// The bytes of a PNG, on the page a data address.
    #[serde(rename = "src", serialize_with = "address")]
    png: Vec<u8>,
}

fn address<S: serde::Serializer>(png: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&data_address(png))
}

fn data_address(png: &[u8]) -> impl std::fmt::Display {
    let bytes = Base64Display::new(png, &BASE64_STANDARD);
    std::fmt::from_fn(move |f| write!(f, "data:image/png;base64,{bytes}"))
}

impl Picture {
    /// A picture from the bytes of its PNG; the size is that which it is drawn for.
    pub fn new(name: impl Into<String>, [width, height]: [u32; 2], png: Vec<u8>) -> Self {
        Self { name: name.into(), width, height, png }
    }

    /// The picture itself as an address, for a page of another form.
    pub fn address(&self) -> String {
        data_address(&self.png).to_string()
    }

    /// Its bytes on the page.
    fn bytes(&self) -> usize {
        self.png.len().div_ceil(3) * 4
    }

    /// The same with a share of its pixels along each side.
    fn smaller(self, share: f64) -> anyhow::Result<Self> {
        let side = |side: u32| ((f64::from(side) * share) as u32).max(1);
        let whole = image::load_from_memory(&self.png)?;
        // Means of all pixels that fall into one, so that the noise of a picture stays what it is.
        let (width, height) = (side(whole.width()), side(whole.height()));
        let small = image::imageops::thumbnail(&whole.to_rgba8(), width, height);
        let mut png = Cursor::new(Vec::new());
        small.write_to(&mut png, image::ImageFormat::Png)?;
        Ok(Self { png: png.into_inner(), ..self })
    }
}

/// A table that can be sorted by each column.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// The caption.
    pub caption: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// Numbers, text, or null where there is nothing; text behind the first column says what is wrong.
    pub rows: Vec<Vec<Value>>,
}

/// A column of a table.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Column {
    /// The name.
    pub name: String,
    /// What the numbers are, in a sentence.
    pub meaning: String,
    /// `less` or `more`, where one of them is better.
    pub better: Option<&'static str>,
    /// Digits that are shown.
    pub digits: Option<u32>,
    /// Whether its texts are code.
    pub code: bool,
    /// Whether its texts are names; elsewhere they say what is wrong.
    pub plain: bool,
}

/// A drawing.
#[derive(Clone, Debug, Serialize)]
pub struct Plot {
    /// The caption.
    pub caption: String,
    /// The program's own, without scripts.
    pub svg: String,
}

impl Page {
    /// Makes all pictures smaller until they take at most so many bytes; whether it had to.
    pub fn shrink(&mut self, most: usize) -> anyhow::Result<bool> {
        let bytes = |page: &Self| page.pictures.iter().map(Picture::bytes).sum::<usize>();
        let mut has_shrunk = false;
        // Each round takes at least a tenth off each side; a picture of one pixel takes 100 bytes.
        while bytes(self) > most && self.pictures.iter().any(|picture| picture.png.len() > 100) {
            let share = (most as f64 / bytes(self) as f64).sqrt().min(0.9);
            let pictures = std::mem::take(&mut self.pictures).into_iter();
            self.pictures = pictures.map(|one| one.smaller(share)).collect::<Result<_, _>>()?;
            has_shrunk = true;
        }
        Ok(has_shrunk)
    }

    /// The page's bytes.
    pub fn html(&mut self) -> anyhow::Result<String> {
        self.version = env!("CARGO_PKG_VERSION");
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
        let mut page = Page {
            title: "</script><script>alert(1)</script>".to_owned(),
            pictures: vec![Picture::new("one", [1, 1], b"png".to_vec())],
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
    #[test]
    fn pictures_shrink_until_they_fit_and_keep_their_place() {
        let noise = |x: u32, y: u32| ((x * 7919) ^ (y * 104_729)).wrapping_mul(2_654_435_761) >> 24;
        let pixel = |x, y| image::Rgba([noise(x, y) as u8, noise(y, x) as u8, 0, 255]);
        let mut png = Cursor::new(Vec::new());
        let large = image::RgbaImage::from_fn(64, 64, pixel);
        large.write_to(&mut png, image::ImageFormat::Png).unwrap();
        let picture = Picture::new("noise", [64, 64], png.into_inner());
        let mut page = Page { pictures: vec![picture.clone(), picture], ..Page::default() };
        let before = page.pictures[0].bytes();
        assert!(!page.shrink(2 * before).unwrap(), "there is room");
        assert!(page.shrink(before).unwrap());
        assert!(page.pictures.iter().map(Picture::bytes).sum::<usize>() <= before);
        assert_eq!([page.pictures[1].width, page.pictures[1].height], [64, 64]);
        let found = image::load_from_memory(&page.pictures[0].png).unwrap();
        assert!(found.width() > 30, "no smaller than it has to be: {}", found.width());
    }
}
