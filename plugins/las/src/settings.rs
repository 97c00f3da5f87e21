//! Parameters of the format.

use surfelshop_api::{choices, params};

choices! {
    /// The version of LAS that is written.
    pub enum Version {
        /// 1.2 where that holds all that the cloud has as it is; else 1.4.
        Auto = "auto",
        /// 1.4: up to 15 returns, 256 classes, scan angles of 0.006 degrees, near infrared.
        Newer = "1.4",
        /// 1.2, for old programs: up to 7 returns, 32 classes, whole degrees.
        Older = "1.2",
    }
}

params! {
    /// Settings of `las`, for files that are written.
    pub struct Settings {
        /// Version of LAS: 1.4, 1.2 for old programs, or the lowest that holds the cloud (auto): 1.2 where it comes
        /// from LAS 1.0 to 1.3, or has classes up to 31, up to 7 returns, scan angles of whole degrees and no system
        /// in WKT; else 1.4, also for more than 128 MiB of points with these.
        version: Version { default: Version::Auto },
        /// Step of coordinates, in units of the cloud. 0: the step that the cloud has in its own file; where it
        /// has none, a power of ten about as fine as single precision over the cloud's extent (a ten millionth
        /// of it), at most 0.00001, and coarser only where 32 bits do not reach.
        scale: f64 { default: 0.0, range: 0.0..=1e6, unit: "scene units" },
    }
}
