//! Sums over windows that are products of a row and a column.

/// Some rows of a picture, one value a pixel.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) values: Vec<f64>,
}

impl Plane {
    /// Sums along rows, weighted by an odd number of taps around every pixel; beyond an end of a
    /// row its last value goes on.
    pub(super) fn across(&self, taps: &[f64]) -> Self {
        let radius = taps.len() / 2;
        let mut values = vec![0.0; self.values.len()];
        let mut padded = vec![0.0; self.width + 2 * radius];
        for (row, sums) in
            self.values.chunks_exact(self.width).zip(values.chunks_exact_mut(self.width))
        {
            padded[..radius].fill(row[0]);
            padded[radius..radius + self.width].copy_from_slice(row);
            padded[radius + self.width..].fill(row[self.width - 1]);
            for (at, tap) in taps.iter().enumerate() {
                accumulate(sums, &padded[at..], *tap);
            }
        }
        Self { width: self.width, values }
    }

    /// Sums down columns, of the rows that have `halo` rows above and below; `halo` is at least the
    /// taps' radius.
    pub(super) fn down(&self, taps: &[f64], halo: usize) -> Self {
        let first = halo - taps.len() / 2;
        let n_rows = (self.values.len() / self.width).saturating_sub(2 * halo);
        let mut values = vec![0.0; n_rows * self.width];
        for (row, sums) in values.chunks_exact_mut(self.width).enumerate() {
            for (at, tap) in taps.iter().enumerate() {
                accumulate(sums, &self.values[(row + first + at) * self.width..], *tap);
            }
        }
        Self { width: self.width, values }
    }
}

fn accumulate(sums: &mut [f64], values: &[f64], weight: f64) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

/// Values of a Gaussian around its middle, 1 there: the value at x pixels is exp(-`falloff` x²).
pub(super) fn gaussian(radius: usize, falloff: f64) -> Vec<f64> {
    offsets(radius).map(|x| (-falloff * x * x).exp()).collect()
}

/// -`radius` to `radius`.
pub(super) fn offsets(radius: usize) -> impl Iterator<Item = f64> {
    (0..=2 * radius).map(move |at| at as f64 - radius as f64)
}

/// The taps scaled so that they add up to 1.
pub(super) fn normalized(mut taps: Vec<f64>) -> Vec<f64> {
    let sum: f64 = taps.iter().sum();
    for tap in &mut taps {
        *tap /= sum;
    }
    taps
}
