//! Text over a picture: glyphs of the window's font as coverage, drawn pixel by pixel.

use crate::Image;
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider as _};

/// Fonts in the order in which they are asked for a letter.
const FONTS: [&[u8]; 2] = [epaint_default_fonts::UBUNTU_LIGHT, epaint_default_fonts::HACK_REGULAR];

/// A line of text of one size.
pub struct Line {
    /// The letters, each where it begins from the left end.
    glyphs: Vec<Glyph>,
    /// Width in pixels.
    pub width: f32,
}

/// A letter.
struct Glyph {
    x: f32,
    font: usize,
    id: GlyphId,
    size: f32,
}

impl Line {
    /// A text of a size in pixels, from one line to the next. Control characters are left out, and letters that
    /// the fonts lack are boxes.
    #[must_use]
    pub fn new(text: &str, size: f32) -> Self {
        let fonts = FONTS.map(|bytes| FontRef::new(bytes).ok());
        let (mut glyphs, mut width) = (Vec::new(), 0.0);
        for letter in text.chars().filter(|letter| !letter.is_control()) {
            let found = fonts
                .iter()
                .enumerate()
                .find_map(|(font, loaded)| Some((font, loaded.as_ref()?.charmap().map(letter)?)));
            let (font, id) = found.unwrap_or((0, GlyphId::NOTDEF));
            let metrics = fonts.get(font).and_then(Option::as_ref);
            let metrics = metrics.map(|f| f.glyph_metrics(Size::new(size), LocationRef::default()));
            let advance = metrics.and_then(|metrics| metrics.advance_width(id));
            glyphs.push(Glyph { x: width, font, id, size });
            width += advance.unwrap_or(0.5 * size);
        }
        Self { glyphs, width }
    }

    /// Draws the text over a picture of straight alpha, from the left end of its base line.
    pub fn draw(&self, image: &mut Image, [x, y]: [f32; 2], color: [f32; 3]) {
        for glyph in &self.glyphs {
            let mut outline =
                Outline { at: [x + glyph.x, y], edges: Vec::new(), pen: [0.0; 2], start: [0.0; 2] };
            let font = FONTS.get(glyph.font).and_then(|bytes| FontRef::new(bytes).ok());
            let shape = font.as_ref().and_then(|font| font.outline_glyphs().get(glyph.id));
            let settings = DrawSettings::unhinted(Size::new(glyph.size), LocationRef::default());
            // A glyph that the font draws wrongly is left out.
            if shape.is_some_and(|shape| shape.draw(settings, &mut outline).is_ok()) {
                outline.fill(image, color);
            }
        }
    }
}

/// Straight pieces of each curve: at a hundred pixels they deviate by a tenth.
const PIECES: u16 = 8;

/// The edges of a letter in pixels, y downwards.
struct Outline {
    at: [f32; 2],
    edges: Vec<[[f32; 2]; 2]>,
    pen: [f32; 2],
    start: [f32; 2],
}

impl Outline {
    fn place(&self, x: f32, y: f32) -> [f32; 2] {
        [self.at[0] + x, self.at[1] - y]
    }

    fn edge_to(&mut self, to: [f32; 2]) {
        self.edges.push([self.pen, to]);
        self.pen = to;
    }

    /// Paints what the edges enclose.
    fn fill(&self, image: &mut Image, color: [f32; 3]) {
        let corners = || self.edges.iter().flatten();
        let least = |axis: usize| corners().map(|p| p[axis]).fold(f32::INFINITY, f32::min).floor();
        let most =
            |axis: usize| corners().map(|p| p[axis]).fold(f32::NEG_INFINITY, f32::max).ceil();
        let (left, top) = (least(0), least(1));
        let (width, height) = (most(0) - left, most(1) - top);
        // Nothing to be seen, or not a letter.
        if !(width > 0.0 && height > 0.0 && width < 1e4 && height < 1e4) {
            return;
        }
        let mut coverage = Coverage::new(width as usize, height as usize);
        for edge in &self.edges {
            coverage.add(edge.map(|[x, y]| [x - left, y - top]));
        }
        coverage.paint(image, [left as i64, top as i64], color);
    }
}

impl OutlinePen for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.pen = self.place(x, y);
        self.start = self.pen;
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.edge_to(self.place(x, y));
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let (from, control, to) = (self.pen, self.place(cx, cy), self.place(x, y));
        for i in 1..=PIECES {
            let t = f32::from(i) / f32::from(PIECES);
            let [a, b, c] = [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
            self.edge_to(std::array::from_fn(|k| a * from[k] + b * control[k] + c * to[k]));
        }
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        let (from, to) = (self.pen, self.place(x, y));
        let controls = [self.place(cx0, cy0), self.place(cx1, cy1)];
        for i in 1..=PIECES {
            let t = f32::from(i) / f32::from(PIECES);
            let s = 1.0 - t;
            let [a, b, c, d] = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
            self.edge_to(std::array::from_fn(|k| {
                a * from[k] + b * controls[0][k] + c * controls[1][k] + d * to[k]
            }));
        }
    }

    fn close(&mut self) {
        self.edge_to(self.start);
    }
}

/// How much of each pixel lies within edges: exact areas. In each row a cell has the change of what lies
/// right of it, so that the sum from the left is the coverage.
struct Coverage {
    width: usize,
    /// Cells of a row: a change may fall behind the last pixel.
    stride: usize,
    cells: Vec<f32>,
}

impl Coverage {
    fn new(width: usize, height: usize) -> Self {
        let stride = width + 2;
        Self { width, stride, cells: vec![0.0; stride * height] }
    }

    /// Adds an edge, row by row and in each row pixel by pixel.
    fn add(&mut self, [from, to]: [[f32; 2]; 2]) {
        let (sign, [top, bottom]) =
            if from[1] < to[1] { (1.0, [from, to]) } else { (-1.0, [to, from]) };
        let per_row = (bottom[0] - top[0]) / (bottom[1] - top[1]);
        // A horizontal edge covers nothing.
        if !per_row.is_finite() {
            return;
        }
        for row in top[1] as usize..bottom[1].ceil() as usize {
            let begin = top[1].max(row as f32);
            let end = bottom[1].min(row as f32 + 1.0);
            let at = |y: f32| top[0] + per_row * (y - top[1]);
            self.add_in_row(row, sign * (end - begin), [at(begin), at(end)]);
        }
    }

    /// Adds a piece within a row, of this height, between two places.
    fn add_in_row(&mut self, row: usize, height: f32, ends: [f32; 2]) {
        let low = ends[0].min(ends[1]).max(0.0);
        let high = ends[0].max(ends[1]).min(self.width as f32);
        let size = high - low;
        for pixel in low as usize..=(high as usize).min(self.width) {
            let left = low.max(pixel as f32);
            let right = high.min(pixel as f32 + 1.0);
            let part = if size > 0.0 { height * (right - left).max(0.0) / size } else { height };
            let middle = 0.5 * (left + right) - pixel as f32;
            let place = row * self.stride + pixel;
            if let Some([here, next]) = self.cells.get_mut(place..place + 2) {
                *here += part * (1.0 - middle);
                *next += part * middle;
            }
            if size <= 0.0 {
                return;
            }
        }
    }

    /// Paints what is covered over a picture, from a corner that may lie outside of it.
    fn paint(&self, image: &mut Image, [left, top]: [i64; 2], color: [f32; 3]) {
        for (row, cells) in self.cells.chunks_exact(self.stride).enumerate() {
            let mut sum = 0.0f32;
            for (column, change) in cells.iter().take(self.width).enumerate() {
                sum += change;
                let place = [left + column as i64, top + row as i64];
                over(image, place, color, sum.abs().min(1.0));
            }
        }
    }
}

/// Paints a rectangle from one corner to the other over a picture; parts of pixels are covered in part.
pub fn fill(image: &mut Image, [low, high]: [[f32; 2]; 2], color: [f32; 3], alpha: f32) {
    let part =
        |from: f32, to: f32, pixel: f32| (to.min(pixel + 1.0) - from.max(pixel)).clamp(0.0, 1.0);
    let rows = low[1].max(0.0).floor() as i64..high[1].min(image.height as f32).ceil() as i64;
    for y in rows {
        let columns = low[0].max(0.0).floor() as i64..high[0].min(image.width as f32).ceil() as i64;
        for x in columns {
            let covered = part(low[0], high[0], x as f32) * part(low[1], high[1], y as f32);
            over(image, [x, y], color, alpha * covered);
        }
    }
}

/// Paints a colour over a pixel of straight alpha; nothing outside of the picture.
pub(crate) fn over(image: &mut Image, [x, y]: [i64; 2], color: [f32; 3], alpha: f32) {
    let is_inside =
        (0..i64::from(image.width)).contains(&x) && (0..i64::from(image.height)).contains(&y);
    if !is_inside || alpha <= 0.0 || image.components != 4 {
        return;
    }
    let first = 4 * (y as usize * image.width as usize + x as usize);
    let Some([red, green, blue, behind]) = image.data.get_mut(first..first + 4) else { return };
    let below = *behind * (1.0 - alpha);
    let whole = alpha + below;
    for (channel, painted) in [red, green, blue].into_iter().zip(color) {
        *channel = (painted * alpha + *channel * below) / whole;
    }
    *behind = whole;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32) -> Image {
        let data = [0.0, 0.0, 0.0, 1.0].repeat((width * height) as usize);
        Image { width, height, components: 4, data }
    }

    /// Sum of the red channel.
    fn painted(image: &Image) -> f32 {
        image.data.chunks(4).map(|pixel| pixel[0]).sum()
    }

    #[test]
    fn areas_are_exact() {
        // A triangle and a square in it that is cut out, turned the other way.
        let mut coverage = Coverage::new(9, 8);
        let corners = [[0.5, 0.25], [8.75, 0.25], [0.5, 7.75]];
        let hole = [[1.5, 1.0], [1.5, 3.25], [3.75, 3.25], [3.75, 1.0]];
        for shape in [&corners[..], &hole] {
            for (i, from) in shape.iter().enumerate() {
                coverage.add([*from, shape[(i + 1) % shape.len()]]);
            }
        }
        let mut image = picture(9, 8);
        coverage.paint(&mut image, [0, 0], [1.0; 3]);
        let expected = 0.5 * 8.25 * 7.5 - 2.25 * 2.25;
        assert!((painted(&image) - expected).abs() < 1e-4, "{} {expected}", painted(&image));
        // Within the hole there is nothing.
        assert!(image.pixel(2, 2)[0].abs() < 1e-6);
    }

    #[test]
    fn text_is_as_large_as_it_says_and_stays_in_the_picture() {
        let line = Line::new("Hallo 0.5°", 20.0);
        assert!((60.0..120.0).contains(&line.width), "{}", line.width);
        assert!((Line::new("Hallo 0.5°", 40.0).width - 2.0 * line.width).abs() < 1.0);
        let mut image = picture(140, 30);
        line.draw(&mut image, [4.0, 22.0], [1.0; 3]);
        let inside = painted(&image);
        assert!(inside > 100.0, "{inside}");
        let column = |x: u32| (0..30).map(|y| image.pixel(x, y)[0]).sum::<f32>();
        assert!((0..4).all(|x| column(x) == 0.0));
        assert!((line.width as u32 + 6..140).all(|x| column(x) == 0.0));
        // Moved out of it, nothing is painted, and nothing fails.
        for place in [[-500.0, 10.0], [5.0, -90.0], [500.0, 10.0], [5.0, 900.0]] {
            let mut image = picture(16, 16);
            line.draw(&mut image, place, [1.0; 3]);
            assert_eq!(painted(&image), 0.0);
        }
    }

    #[test]
    fn every_text_has_a_width() {
        assert_eq!(Line::new("", 20.0).width, 0.0);
        assert_eq!(Line::new("\n\u{7}", 20.0).width, 0.0);
        for text in ["漢字", "\u{10FFFF}", "é−–…"] {
            let line = Line::new(text, 20.0);
            assert!(line.width > 5.0, "{text}");
            line.draw(&mut picture(64, 32), [0.0, 20.0], [1.0; 3]);
        }
    }

    #[test]
    fn what_is_painted_over_nothing_has_its_own_colour() {
        let mut image = Image { width: 2, height: 1, components: 4, data: vec![0.0; 8] };
        fill(&mut image, [[0.0, 0.0], [1.5, 1.0]], [0.25, 0.5, 1.0], 0.5);
        assert_eq!(image.pixel(0, 0), [0.25, 0.5, 1.0, 0.5]);
        assert_eq!(image.pixel(1, 0), [0.25, 0.5, 1.0, 0.25]);
        fill(&mut image, [[-9.0, -9.0], [9.0, 9.0]], [1.0; 3], 1.0);
        assert_eq!(image.data, [1.0; 8]);
    }
}
