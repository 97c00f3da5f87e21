//! Normal fields and clip lines of a cloud, the attributes that vary over a surfel.

/// Normal fields, and the lines that cut surfels, of a cloud's surfels in drawing order.
#[derive(Default)]
pub struct Splats {
    /// x, y, α and β of each surfel's normal field, where there are any.
    pub fields: Option<Vec<[f32; 4]>>,
    /// Surfels before the first that is cut.
    pub n_whole: usize,
    /// Two lines and how many of them count, of each surfel from there on.
    pub clips: Vec<[f32; 7]>,
}

impl Splats {
    /// Bytes of all of it.
    pub(crate) fn bytes(&self) -> usize {
        let fields = self.fields.as_ref().map_or(0, |fields| 16 * fields.len());
        fields + 28 * self.clips.len()
    }

    pub(crate) fn clip(&self, place: usize) -> Option<&[f32; 7]> {
        self.clips.get(place.checked_sub(self.n_whole)?)
    }
}
