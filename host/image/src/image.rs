//! A picture in memory.

/// A picture of 32-bit floats, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Values per pixel.
    pub components: u32,
    /// `width * height * components` values.
    pub data: Vec<f32>,
}

impl Image {
    /// The values of a pixel.
    ///
    /// # Panics
    /// Where the pixel lies outside the picture.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> &[f32] {
        let n = self.components as usize;
        let at = (y as usize * self.width as usize + x as usize) * n;
        &self.data[at..at + n]
    }
}
