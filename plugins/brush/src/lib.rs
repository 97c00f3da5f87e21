//! # Brushes: tools that are led by hand
//!
//! | tool      | what it does along a stroke                        |
//! |-----------|----------------------------------------------------|
//! | `brush`   | paints a colour                                    |
//! | `value`   | paints a number into a column: `material`, `ao` …  |
//! | `eraser`  | takes surfels away                                 |
//! | `inflate` | moves surfels out along their normals              |
//! | `carve`   | moves surfels in                                   |
//!
//! The host finds the surfels along a stroke and how much each is concerned, its weight; a tool says what becomes of
//! them. In the window they are led over a picture; files of strokes do the same again:
//!
//! ```text
//! surfelshop bake scan.ply -t brush --strokes scan.strokes.json -o painted.ply
//! surfelshop bake scan.ply -t brush --set color=#c03020 --select height=..0.2 -o ground.ply
//! ```
//!
//! Source: Zwicker, Pauly, Knoll and Gross 2002, "Pointshop 3D", section 5, for painting, eroding and carving surfels.

mod eraser;
mod paint;
mod sculpt;
#[cfg(test)]
mod tests;
mod value;

use surfelshop_api::export_plugin;

export_plugin! {
    id: "org.surfelshop.brush",
    tools: [paint::Brush, value::Value, eraser::Eraser, sculpt::Inflate, sculpt::Carve],
}
