//! Pictures: what renderers give, how a screen shows it, what files hold, and how far two are apart.
//!
//! Invariants: this crate opens no device and knows no renderer; radiance stays linear until
//! [`display_transform`] exposes and tone-maps it.

pub mod display_transform;
mod error;
pub mod exr;
mod eye_dome;
mod image;
pub mod lines;
pub mod metrics;
pub mod outputs;
mod picture_mean;
pub mod png;
mod sample_sums;
pub mod text;

pub use error::FileError;
pub use eye_dome::EyeDome;
pub use image::Image;
pub use picture_mean::{PictureMean, UnlikePictures};
pub use sample_sums::{SampleSums, TracedPicture};
