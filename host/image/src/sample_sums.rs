//! Sums of the samples of a picture, and the picture that follows from them.

use crate::Image;
use std::time::Duration;
use surfelshop_api::Tile;

/// A traced picture.
#[derive(Clone, Debug)]
pub struct TracedPicture {
    /// Linear radiance and coverage, straight alpha.
    pub color: Image,
    /// Variance of each pixel's mean, of its radiance weighted by coverage and of its coverage; zero
    /// where there is one sample.
    pub variance: Image,
    /// The means of the even and of the odd samples, weighted by coverage.
    pub halves: [Image; 2],
    /// Samples of each pixel.
    pub samples: u32,
    /// Elapsed time.
    pub took: Duration,
}

impl TracedPicture {
    /// The root of the mean variance over pixels and colours: how far the picture is from its limit,
    /// on the average.
    #[must_use]
    pub fn standard_error(&self) -> f64 {
        let variances = self.variance.data.as_chunks::<4>().0.iter().flat_map(|pixel| &pixel[..3]);
        let n = 3 * self.variance.data.len() / 4;
        (variances.map(|v| f64::from(*v)).sum::<f64>() / n.max(1) as f64).sqrt()
    }
}

/// A picture as far as its samples have been added up.
#[derive(Clone, Debug)]
pub struct SampleSums {
    size: [u32; 2],
    /// Sums of the even and of the odd samples.
    halves: [Vec<[f64; 4]>; 2],
    /// Sums of the squares of all.
    squares: Vec<[f64; 4]>,
}

impl SampleSums {
    /// No samples of so many pixels.
    #[must_use]
    pub fn new(size: [u32; 2]) -> Self {
        let zeros = || vec![[0.0; 4]; size[0] as usize * size[1] as usize];
        Self { size, halves: [zeros(), zeros()], squares: zeros() }
    }

    /// Adds a sample of all pixels, four floats each.
    pub fn add(&mut self, sample: u32, pixels: &[f32]) {
        let half = &mut self.halves[(sample % 2) as usize];
        let sums = half.iter_mut().zip(&mut self.squares);
        for ((sum, squares), pixel) in sums.zip(pixels.as_chunks::<4>().0) {
            for ((sum, square), value) in sum.iter_mut().zip(squares).zip(pixel) {
                let value = f64::from(*value);
                *sum += value;
                *square += value * value;
            }
        }
    }

    /// Puts the sums of a tile into those of the whole.
    pub fn put(&mut self, tile: Tile, part: &Self) {
        let from = [&part.halves[0], &part.halves[1], &part.squares];
        let [even, odd] = &mut self.halves;
        for (to, from) in [even, odd, &mut self.squares].into_iter().zip(from) {
            for (row, values) in from.chunks_exact(tile.width.max(1) as usize).enumerate() {
                let start = (tile.y as usize + row) * self.size[0] as usize + tile.x as usize;
                if let Some(place) = to.get_mut(start..start + values.len()) {
                    place.copy_from_slice(values);
                }
            }
        }
    }

    /// Radiance and straight coverage of so many samples, four values a pixel.
    #[must_use]
    pub fn color(&self, samples: u32) -> Image {
        let n = f64::from(samples.max(1));
        let [even, odd] = &self.halves;
        let color = |i: usize| {
            let [r, g, b, a] = [0, 1, 2, 3].map(|c| (even[i][c] + odd[i][c]) / n);
            if a > 0.0 { [r / a, g / a, b / a, a] } else { [0.0; 4] }
        };
        let data = (0..self.squares.len()).flat_map(|i| color(i).map(|v| v as f32)).collect();
        let [width, height] = self.size;
        Image { width, height, components: 4, data }
    }

    /// The picture of so many samples.
    pub fn picture(&self, samples: u32, took: Duration) -> TracedPicture {
        let n = f64::from(samples.max(1));
        let [width, height] = self.size;
        let image = |pixel: &dyn Fn(usize) -> [f64; 4]| {
            let data = (0..self.squares.len()).flat_map(|i| pixel(i).map(|v| v as f32)).collect();
            Image { width, height, components: 4, data }
        };
        let [even, odd] = &self.halves;
        let mean = |i: usize| [0, 1, 2, 3].map(|c| (even[i][c] + odd[i][c]) / n);
        let variance = |i: usize| {
            let mean = mean(i);
            // That of one sample, unbiased, over the number of them.
            let of = |c: usize| (self.squares[i][c] / n - mean[c] * mean[c]).max(0.0) / (n - 1.0);
            if samples < 2 { [0.0; 4] } else { [0, 1, 2, 3].map(of) }
        };
        let counts = [samples.div_ceil(2), samples / 2].map(|n| f64::from(n.max(1)));
        TracedPicture {
            color: self.color(samples),
            variance: image(&variance),
            halves: [
                image(&|i| even[i].map(|sum| sum / counts[0])),
                image(&|i| odd[i].map(|sum| sum / counts[1])),
            ],
            samples,
            took,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_halves_and_variances_are_those_of_the_samples() {
        let mut part = SampleSums::new([1, 1]);
        let samples = [1.0f32, 3.0, 2.0, 6.0];
        for (i, value) in samples.iter().enumerate() {
            part.add(i as u32, &[*value, 0.0, 0.0, 0.5]);
        }
        let mut whole = SampleSums::new([2, 1]);
        whole.put(Tile { x: 1, y: 0, width: 1, height: 1, sample: 0 }, &part);
        let picture = whole.picture(4, Duration::ZERO);
        assert_eq!(picture.color.data[..4], [0.0; 4]);
        assert_eq!(picture.color.data[4..], [6.0, 0.0, 0.0, 0.5], "straight alpha");
        assert_eq!(picture.halves[0].data[4], 1.5);
        assert_eq!(picture.halves[1].data[4], 4.5);
        // Squared deviations from 3: 4, 0, 1, 9; over 3 is the variance of one, over 4 that of the mean.
        assert!((picture.variance.data[4] - 14.0 / 12.0).abs() < 1e-6);
        assert!((picture.standard_error() - (14.0f64 / 12.0 / 6.0).sqrt()).abs() < 1e-6);
    }
}
