//! The mean of several pictures of the same thing, as antialiasing takes it.

use crate::Image;

/// A picture of another shape than those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnlikePictures {
    /// Width, height and components of the pictures before.
    pub before: [u32; 3],
    /// The same of this one.
    pub found: [u32; 3],
}

impl std::error::Error for UnlikePictures {}

impl std::fmt::Display for UnlikePictures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [width, height, components] = self.before;
        let [w, h, c] = self.found;
        write!(
            f,
            "expected another picture of {width} x {height} pixels of {components} numbers, as the first \
             was, found one of {w} x {h} pixels of {c}"
        )
    }
}

/// Sums of linear pictures, four bytes a number. Radiance is weighted by coverage, so that what is behind a pixel
/// that is not covered counts for nothing.
#[derive(Clone, Debug)]
pub struct PictureMean {
    shape: [u32; 3],
    sums: Vec<f32>,
    n: u32,
}

fn shape_of(image: &Image) -> [u32; 3] {
    [image.width, image.height, image.components]
}

/// Radiance times coverage, and coverage.
fn weighted([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    [r * a, g * a, b * a, a]
}

impl PictureMean {
    /// The sum of one picture: linear radiance, of four components with straight alpha.
    #[must_use]
    pub fn of(first: &Image) -> Self {
        let sums = match first.components {
            4 => first.data.as_chunks::<4>().0.iter().flat_map(|pixel| weighted(*pixel)).collect(),
            _ => first.data.clone(),
        };
        Self { shape: shape_of(first), sums, n: 1 }
    }

    /// Pictures added so far, at least 1.
    #[must_use]
    pub fn n_pictures(&self) -> u32 {
        self.n
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// Where it has another size or other components than the first.
    pub fn add(&mut self, image: &Image) -> Result<(), UnlikePictures> {
        if shape_of(image) != self.shape || image.data.len() != self.sums.len() {
            return Err(UnlikePictures { before: self.shape, found: shape_of(image) });
        }
        match self.shape[2] {
            4 => {
                let sums = self.sums.as_chunks_mut::<4>().0.iter_mut();
                for (sum, pixel) in sums.zip(image.data.as_chunks::<4>().0) {
                    for (sum, value) in sum.iter_mut().zip(weighted(*pixel)) {
                        *sum += value;
                    }
                }
            }
            _ => self.sums.iter_mut().zip(&image.data).for_each(|(sum, value)| *sum += value),
        }
        self.n = self.n.saturating_add(1);
        Ok(())
    }

    /// The mean, with straight alpha again; nothing where no picture covers a pixel.
    #[must_use]
    pub fn mean(&self) -> Image {
        let [width, height, components] = self.shape;
        let n = self.n as f32;
        let straight = |&[r, g, b, a]: &[f32; 4]| match a == 0.0 {
            true => [0.0; 4],
            false => [r / a, g / a, b / a, a / n],
        };
        let data = match components {
            4 => self.sums.as_chunks::<4>().0.iter().flat_map(straight).collect(),
            _ => self.sums.iter().map(|sum| sum / n).collect(),
        };
        Image { width, height, components, data }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(data: &[f32], components: u32) -> Image {
        let width = data.len() as u32 / components;
        Image { width, height: 1, components, data: data.to_vec() }
    }

    #[test]
    fn coverage_is_the_mean_and_colours_count_by_it() {
        let mut mean = PictureMean::of(&picture(&[1.0, 0.0, 0.0, 1.0, 9.0, 9.0, 9.0, 0.0], 4));
        mean.add(&picture(&[0.0, 2.0, 0.0, 0.5, 7.0, 7.0, 7.0, 0.0], 4)).unwrap();
        mean.add(&picture(&[5.0, 5.0, 5.0, 0.0, 4.0, 0.0, 8.0, 0.75], 4)).unwrap();
        let third = 1.0 / 1.5;
        assert_eq!(mean.mean().data, [third, third, 0.0, 0.5, 4.0, 0.0, 8.0, 0.25]);
        assert_eq!(mean.n_pictures(), 3);
    }

    #[test]
    fn pixels_that_no_picture_covers_show_nothing() {
        let mut mean = PictureMean::of(&picture(&[3.0, 3.0, 3.0, 0.0], 4));
        mean.add(&picture(&[1.0, 2.0, 3.0, 0.0], 4)).unwrap();
        assert_eq!(mean.mean().data, [0.0; 4]);
    }

    #[test]
    fn without_coverage_all_pictures_count_alike() {
        let mut mean = PictureMean::of(&picture(&[1.0, 2.0, 3.0], 3));
        mean.add(&picture(&[2.0, 4.0, 0.0], 3)).unwrap();
        assert_eq!(mean.mean().data, [1.5, 3.0, 1.5]);
    }

    #[test]
    fn pictures_of_another_shape_are_refused() {
        let mut mean = PictureMean::of(&picture(&[1.0; 4], 4));
        let line = mean.add(&picture(&[1.0; 3], 3)).unwrap_err().to_string();
        assert!(
            line.contains("1 x 1 pixels of 4") && line.ends_with("1 x 1 pixels of 3"),
            "{line}"
        );
        assert_eq!(mean.n_pictures(), 1);
    }
}
