//! Parameters of the format.

use surfelshop_api::{choices, params};

choices! {
    /// How normals are written.
    pub enum NormalChoice {
        /// Codes of 32 bits.
        Cub32 = "cub32",
        /// Three 32-bit floats.
        Float = "float",
    }
}

params! {
    /// Settings of `sfl`.
    pub struct Settings {
        /// How normals are written: codes of 32 bits, up to 0.005 degrees wrong, or three floats.
        normals: NormalChoice { default: NormalChoice::Cub32 },
    }
}
