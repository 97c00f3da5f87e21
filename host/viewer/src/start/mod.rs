//! The first minute: the page without clouds, its examples, and what is being opened.

mod examples;
mod page;
mod progress;
mod save_thumbnail;
mod splat_scene;
mod thumbnails;

pub(crate) use page::show as show_page;
pub(crate) use progress::show as show_progress;
pub(crate) use thumbnails::Thumbnails;
