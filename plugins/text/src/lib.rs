//! # Text: clouds as lines of numbers
//!
//! | format | files                              | what it reads and writes                                      |
//! |--------|------------------------------------|---------------------------------------------------------------|
//! | `xyz`  | `.xyz` `.txt` `.asc` `.csv` `.tsv` | a line for each point; its columns are named, set or guessed  |
//! | `pts`  | `.pts`                             | the number of points, then x y z, intensity, colour           |
//! | `ptx`  | `.ptx`                             | scans with a grid and a pose, then x y z, intensity, colour   |
//!
//! Each format's file opens with its rules. All of them: `z` points up; line ends are LF, CR or both; lines that
//! cannot be read are left out and counted in one warning, and from 1 % on the file is refused; words such as
//! `nan` and `inf` are numbers. Files are read in blocks on all threads, a few megabytes at a time, so that
//! memory does not grow with the file.
//!
//! ```text
//! surfelshop info scan.csv
//! surfelshop render scan.xyz --set columns=x,y,z,intensity,- -o scan.png
//! ```

mod announced;
mod layout;
mod output;
mod pts;
mod ptx;
mod rows;
mod text;
mod xyz;

#[cfg(test)]
mod tests;

use surfelshop_api::export_plugin;

export_plugin! { id: "org.surfelshop.text", formats: [xyz::Xyz, pts::Pts, ptx::Ptx] }
