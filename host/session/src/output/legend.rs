//! The legend of colours, drawn into the corner of a picture that shows least, as a screen shows it.

use surfelshop_cloud::display::{Legend, LegendBody, LegendEntry, Tick};
use surfelshop_image::Image;
use surfelshop_image::text::{Line, fill};

/// Pixels of a picture's shorter side for each of a line of text.
const LINES: f32 = 46.0;

/// The smallest size of text that can be read, in pixels.
const SMALLEST: f32 = 11.0;

/// The panel behind it, and how much of the picture it hides.
const PANEL: ([f32; 3], f32) = ([0.07, 0.075, 0.085], 0.78);
const INK: [f32; 3] = [0.96; 3];

/// The size of the ramp, in lines of text: how wide, and how high at most.
const RAMP: [f32; 2] = [1.1, 11.0];

/// The largest share of a picture that a legend hides.
const LARGEST: f32 = 0.5;

/// Draws a legend into the corner where it hides least; into the lower right one where that makes no difference. Nothing
/// is drawn, and `false` returned, where it would hide more than half of the picture.
#[must_use]
pub fn draw(image: &mut Image, legend: &Legend) -> bool {
    let shorter = image.width.min(image.height) as f32;
    let text = Text { size: (shorter / LINES).max(SMALLEST).round() };
    let title = Line::new(&heading(legend), text.size);
    let drawn = match &legend.body {
        LegendBody::Ramp { colors, ticks, beyond } => {
            ramp(image, &text, &title, colors, ticks, *beyond)
        }
        LegendBody::List(entries) => list(image, &text, &title, entries),
    };
    drawn.is_some()
}

/// The title, with the unit where there is one.
pub fn heading(legend: &Legend) -> String {
    match legend.unit {
        Some(unit) => format!("{} [{unit}]", legend.title),
        None => legend.title.clone(),
    }
}

/// The entries that are listed where there is room for so many, in their order: those that most surfels
/// have; and how many others there are.
pub fn listed(entries: &[LegendEntry], most: usize) -> (Vec<&LegendEntry>, usize) {
    if entries.len() <= most {
        return (entries.iter().collect(), 0);
    }
    // The last line says how many are left out.
    let most = most.saturating_sub(1).max(1);
    let mut by_number: Vec<usize> = (0..entries.len()).collect();
    by_number.sort_by_key(|&i| std::cmp::Reverse(entries[i].n));
    by_number.truncate(most);
    by_number.sort_unstable();
    (by_number.into_iter().map(|i| &entries[i]).collect(), entries.len() - most)
}

/// Ticks that are not nearer to each other than a share.
pub fn apart(ticks: &[Tick], least: f64) -> Vec<&Tick> {
    let mut chosen: Vec<&Tick> = Vec::with_capacity(ticks.len());
    for tick in ticks {
        if chosen.last().is_none_or(|last| tick.share - last.share >= least) {
            chosen.push(tick);
        }
    }
    chosen
}

/// Lengths in terms of the size of text.
struct Text {
    size: f32,
}

impl Text {
    fn margin(&self) -> f32 {
        (0.7 * self.size).round()
    }

    fn line(&self) -> f32 {
        (1.35 * self.size).round()
    }

    /// The base line of a line of text whose middle is here.
    fn base(&self, middle: f32) -> f32 {
        middle + 0.33 * self.size
    }

    /// Draws the panel of a size in a corner, with the title; the corner of what is in it. `None` where it is too large for
    /// the picture.
    fn panel(
        &self,
        image: &mut Image,
        title: &Line,
        [width, height]: [f32; 2],
    ) -> Option<[f32; 2]> {
        let margin = self.margin();
        let size =
            [width.max(title.width).ceil() + 2.0 * margin, height + self.line() + 2.0 * margin];
        let picture = [image.width as f32, image.height as f32];
        let fits = (0..2).all(|axis| size[axis] + 2.0 * margin <= picture[axis]);
        if !fits || size[0] * size[1] > LARGEST * picture[0] * picture[1] {
            return None;
        }
        let ends = picture.map(|end| end - margin);
        let [right, bottom] = [ends[0] - size[0], ends[1] - size[1]];
        let corners = [[right, bottom], [right, margin], [margin, bottom], [margin, margin]];
        let hidden = corners.map(|corner| covered(image, corner, size));
        let least = (1..4).fold(0, |least, i| if hidden[i] < hidden[least] { i } else { least });
        let low = corners[least];
        let (color, alpha) = PANEL;
        fill(image, [low, [low[0] + size[0], low[1] + size[1]]], color, alpha);
        let [x, y] = [low[0] + margin, low[1] + margin];
        title.draw(image, [x, self.base(y + 0.45 * self.line())], INK);
        Some([x, y + self.line()])
    }

    /// The height that there is for what is in a panel.
    fn room(&self, image: &Image) -> f32 {
        image.height as f32 - 4.0 * self.margin() - self.line()
    }
}

fn ramp(
    image: &mut Image,
    text: &Text,
    title: &Line,
    colors: &[[u8; 3]],
    ticks: &[Tick],
    beyond: [bool; 2],
) -> Option<()> {
    let size = text.size;
    let height = (RAMP[1] * size).min(text.room(image) - size).max(2.0 * size).round();
    let least = f64::from(1.2 * size / height);
    let labels: Vec<(f32, Line)> = apart(ticks, least)
        .into_iter()
        .map(|tick| (tick.share as f32, Line::new(&tick.label, size)))
        .collect();
    let widest = labels.iter().map(|(_, label)| label.width).fold(0.0, f32::max);
    let (bar, mark) = ((RAMP[0] * size).round(), (0.35 * size).round());
    // Half a label stands out at either end, or the point of the ramp.
    let half = (0.5 * size).round();
    let corner = [bar + mark + 0.4 * size + widest, height + 2.0 * half];
    let [x, y] = text.panel(image, title, corner)?;
    let y = y + half;
    // A row of pixels for each step of it; the upper end is high. Ticks lie in the middles of rows, too.
    for row in 0..height as usize {
        let share = 1.0 - row as f32 / (height - 1.0);
        let place = (share * colors.len().saturating_sub(1) as f32).round() as usize;
        let color = colors.get(place)?;
        let top = y + row as f32;
        fill(image, [[x, top], [x + bar, top + 1.0]], unit(*color), 1.0);
    }
    if let (Some(lowest), Some(highest)) = (colors.first(), colors.last()) {
        for row in 0..half as usize {
            let row = row as f32;
            let inset = 0.5 * bar * (row + 0.5) / half;
            let ends = [(beyond[0], y + height + row, lowest), (beyond[1], y - 1.0 - row, highest)];
            for (_, top, color) in ends.into_iter().filter(|(is_beyond, ..)| *is_beyond) {
                fill(image, [[x + inset, top], [x + bar - inset, top + 1.0]], unit(*color), 1.0);
            }
        }
    }
    for (share, label) in &labels {
        let at = y + (1.0 - share) * (height - 1.0);
        let thick = (size / 14.0).max(1.0);
        let top = at + 0.5 - 0.5 * thick;
        fill(image, [[x + bar, top], [x + bar + mark, top + thick]], INK, 1.0);
        label.draw(image, [x + bar + mark + 0.4 * size, text.base(at)], INK);
    }
    Some(())
}

fn list(image: &mut Image, text: &Text, title: &Line, entries: &[LegendEntry]) -> Option<()> {
    let (size, line) = (text.size, text.line());
    let most = (text.room(image) / line).max(1.0) as usize;
    let (shown, n_others) = listed(entries, most);
    let mut labels: Vec<(Option<[u8; 3]>, Line)> =
        shown.iter().map(|entry| (Some(entry.color), Line::new(&entry.label, size))).collect();
    if n_others > 0 {
        labels.push((None, Line::new(&format!("{n_others} more"), size)));
    }
    let widest = labels.iter().map(|(_, label)| label.width).fold(0.0, f32::max);
    let (swatch, gap) = (size.round(), (0.6 * size).round());
    let corner = [swatch + gap + widest, labels.len() as f32 * line];
    let [x, mut y] = text.panel(image, title, corner)?;
    for (color, label) in &labels {
        let middle = y + 0.5 * line;
        if let Some(color) = color {
            let top = (middle - 0.5 * swatch).round();
            fill(image, [[x, top], [x + swatch, top + swatch]], unit(*color), 1.0);
        }
        label.draw(image, [x + swatch + gap, text.base(middle)], INK);
        y += line;
    }
    Some(())
}

/// How many pixels of a part of a picture show something at all.
fn covered(image: &Image, [x, y]: [f32; 2], size: [f32; 2]) -> usize {
    let range = |low: f32, length: f32, end: u32| {
        low.max(0.0) as usize..((low + length).max(0.0) as usize).min(end as usize)
    };
    let (across, n) = (range(x, size[0], image.width), image.components as usize);
    let alpha = |x: usize, y: usize| image.data.get((y * image.width as usize + x) * n + n - 1);
    let rows = range(y, size[1], image.height);
    rows.map(|y| across.clone().filter(|x| alpha(*x, y).is_some_and(|a| *a > 0.0)).count()).sum()
}

/// An sRGB-encoded colour as pictures hold it.
fn unit(color: [u8; 3]) -> [f32; 3] {
    color.map(|code| f32::from(code) / 255.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::display::{ColorMap, Scale, ticks};

    fn picture(width: u32, height: u32) -> Image {
        let data = [0.5, 0.5, 0.5, 1.0].repeat((width * height) as usize);
        Image { width, height, components: 4, data }
    }

    fn ramp_legend() -> Legend {
        let colors = ColorMap::Viridis.colors().to_vec();
        let ticks = ticks([0.0, 12.5], Scale::Linear);
        Legend {
            title: "height".into(),
            unit: None,
            body: LegendBody::Ramp { colors, ticks, beyond: [false, true] },
        }
    }

    fn entry(i: u8, n: u64) -> LegendEntry {
        LegendEntry { color: [i, 200, 100], label: format!("{i} class"), n: Some(n) }
    }

    fn is_near(pixel: &[f32], color: [u8; 3]) -> bool {
        pixel[..3].iter().zip(unit(color)).all(|(a, b)| (a - b).abs() < 1e-6)
    }

    fn has(image: &Image, color: [u8; 3]) -> bool {
        image.data.chunks(4).any(|pixel| is_near(pixel, color))
    }

    #[test]
    fn a_legend_is_drawn_in_its_corner_with_the_colours_of_the_map() {
        let mut image = picture(400, 300);
        assert!(draw(&mut image, &ramp_legend()));
        for end in [0, 255] {
            assert!(has(&image, ColorMap::Viridis.colors()[end]), "{end}");
        }
        assert!(image.data.chunks(4).any(|pixel| pixel[0] > 0.9), "there is text");
        // Numbers lie beyond the upper end alone: rows there are narrower than the ramp.
        let widths = |color| {
            let rows = image.data.chunks(4 * 400).map(|row| {
                row.chunks(4)
                    .filter(|pixel| is_near(pixel, ColorMap::Viridis.colors()[color]))
                    .count()
            });
            let rows: Vec<usize> = rows.filter(|n| *n > 0).collect();
            [rows.iter().min().copied(), rows.iter().max().copied()]
        };
        let [least, most] = widths(255);
        assert!(least < most, "{least:?} {most:?}");
        let [least, most] = widths(0);
        assert_eq!(least, most);
        let is_left = |(i, _): &(usize, &[f32])| i % 400 < 200 || i / 400 < 20;
        let outside = image.data.chunks(4).enumerate().filter(is_left);
        assert!(outside.into_iter().all(|(_, pixel)| pixel == [0.5, 0.5, 0.5, 1.0]));
    }

    /// Where the panel of a legend is in a picture of which only these quarters show something: right, and below.
    fn corner(shown: impl Fn(bool, bool) -> bool) -> [bool; 2] {
        let mut image = picture(400, 600);
        for (i, pixel) in image.data.chunks_mut(4).enumerate() {
            pixel[3] = f32::from(u8::from(shown(i % 400 >= 200, i / 400 >= 300)));
        }
        assert!(draw(&mut image, &ramp_legend()));
        let at = image.data.chunks(4).position(|pixel| pixel[0] > 0.9).unwrap();
        [at % 400 >= 200, at / 400 >= 300]
    }

    #[test]
    fn a_legend_hides_nothing_where_a_corner_is_empty() {
        assert_eq!(corner(|_, _| false), [true, true]);
        assert_eq!(corner(|_, _| true), [true, true]);
        assert_eq!(corner(|right, below| right && below), [true, false]);
        assert_eq!(corner(|right, _| right), [false, true]);
        assert_eq!(corner(|right, below| right || below), [false, false]);
    }

    #[test]
    fn lists_have_a_swatch_for_each_entry_and_say_how_many_are_left_out() {
        let entries: Vec<_> = (0..5).map(|i| entry(i, 1)).collect();
        let legend =
            Legend { title: "label".into(), unit: None, body: LegendBody::List(entries.clone()) };
        let mut image = picture(300, 300);
        assert!(draw(&mut image, &legend));
        assert!(entries.iter().all(|entry| has(&image, entry.color)));
        let numbers: Vec<_> = (0..9).map(|i| entry(i, u64::from(i) * 100 % 7)).collect();
        let (shown, n_others) = listed(&numbers, 4);
        let names: Vec<_> = shown.iter().map(|entry| entry.color[0]).collect();
        // 0, 2, 4, 6, 1, 3, 5, 0, 2 surfels.
        assert_eq!((names, n_others), (vec![2, 3, 6], 6));
        assert_eq!(listed(&numbers, 9).1, 0);
    }

    #[test]
    fn pictures_that_are_too_small_stay_as_they_are() {
        for size in [[0, 0], [1, 1], [8, 300], [300, 8], [40, 40]] {
            let mut image = picture(size[0], size[1]);
            let empty = image.clone();
            assert!(!draw(&mut image, &ramp_legend()));
            let entries = (0..200).map(|i| entry(i, 1)).collect();
            let body = LegendBody::List(entries);
            assert!(!draw(&mut image, &Legend { title: "a".into(), unit: Some("s"), body }));
            assert_eq!(image.data, empty.data);
        }
        assert_eq!(heading(&Legend { unit: Some("s"), ..ramp_legend() }), "height [s]");
    }

    #[test]
    fn labels_keep_their_distance() {
        let ticks = ticks([0.0, 1.0], Scale::Linear);
        assert_eq!(apart(&ticks, 0.0).len(), ticks.len());
        let few: Vec<_> = apart(&ticks, 0.35).iter().map(|tick| tick.label.as_str()).collect();
        assert_eq!(few, ["0", "0.4", "0.8"]);
    }
}
