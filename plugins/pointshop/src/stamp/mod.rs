//! # `image-brush` and `emboss`: a picture along a stroke
//!
//! | parameter | tool          | type  | default | meaning                                                             |
//! |-----------|---------------|-------|---------|---------------------------------------------------------------------|
//! | `image`   | both          | file  |         | the picture: PNG or JPEG                                            |
//! | `opacity` | `image-brush` | float | 1       | how much of the colour the picture covers, times its own            |
//! | `turn`    | both          | float | 0       | how far the picture of a click is turned, clockwise, degrees        |
//! | `height`  | `emboss`      | float | 0.1     | how far white is moved out along normals, in radii of the stroke; below 0 in |
//!
//! Method. The picture is as wide as the stroke, its top lies ahead, and it repeats along the stroke, also where that
//! begins and ends. A click lays it once, within the stroke's radius, its top towards y, or towards -z on what faces y. A surfel takes the mean of the picture over
//! its own width, in linear light. `image-brush` paints that; `emboss` moves the surfel along its normal n by its weight w
//! times the height h times the luminance L, and turns the normal against the slope of that height: n' = n - h grad(w L),
//! with the slope of the picture over the surfel's width, and the slope of the weight from the nearest place of the stroke.
//!
//! Limits: a surfel has one colour and one height, so that no more of a picture shows than there are surfels. Where a stroke
//! bends sharply the picture is cut. Surfels that are pulled apart stay as large as they are.
//!
//! Source: Zwicker, Pauly, Knoll and Gross 2002, "Pointshop 3D", sections 5.1 and 5.2: brushes that carry images, and
//! displacement maps for carving.
//!
//! ```text
//! surfelshop bake vase.ply -t image-brush --set image=band.png --strokes vase.strokes.json -o painted.ply
//! ```

mod ribbon;

use crate::surfels::floats;
use crate::texture::picture::Picture;
use crate::texture::stage_colors;
use ribbon::{Ribbon, RibbonPlace};
use std::iter;
use std::sync::Arc;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};
use surfelshop_api::glam::{DVec2, DVec3, Vec3, Vec4};
use surfelshop_api::prelude::*;
use surfelshop_api::{Dabs, Falloff, Stroke};

params! {
    /// Settings of `image-brush`.
    pub struct ImageSettings {
        /// The picture: PNG or JPEG.
        image: FilePath { default: FilePath::default(), endings: &["png", "jpg", "jpeg"] },
        /// How much of the colour the picture covers.
        opacity: f32 { default: 1.0, range: 0.0..=1.0 },
        /// How far the picture of a click is turned, clockwise, degrees.
        turn: f64 { default: 0.0, range: -180.0..=180.0 },
    }
}

params! {
    /// Settings of `emboss`.
    pub struct EmbossSettings {
        /// The picture: PNG or JPEG.
        image: FilePath { default: FilePath::default(), endings: &["png", "jpg", "jpeg"] },
        /// How far white is moved out, in radii of the stroke; below 0 in.
        height: f32 { default: 0.1, range: -2.0..=2.0 },
        /// How far the picture of a click is turned, clockwise, degrees.
        turn: f64 { default: 0.0, range: -180.0..=180.0 },
    }
}

/// Why cases of `check` are left out.
const NEEDS_PICTURE: &str = "no case has a picture";

const LIMITS: &[LimitInfo] = &[
    LimitInfo::new("outputs", NEEDS_PICTURE),
    LimitInfo::new("threads", NEEDS_PICTURE),
    LimitInfo::new("again", NEEDS_PICTURE),
    LimitInfo::new("reordered", NEEDS_PICTURE),
];

/// Paints a picture.
pub(crate) struct ImageBrush;
/// Moves surfels by one.
pub(crate) struct Emboss;

impl Tool for ImageBrush {
    const INFO: UnitInfo =
        UnitInfo::new("image-brush", "Image brush", "Paints a picture along a stroke.");
    // The picture is to be seen up to its border.
    const HANDLING: Handling = Handling::Stroke(Dabs { falloff: Falloff::Constant, ..Dabs::USUAL });
    type Params = ImageSettings;
    const LIMITS: &'static [LimitInfo] = LIMITS;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &ImageSettings, job: &Job<'_>) -> Result<()> {
        let laid = Laid::new(cloud, (&params.image, params.turn), job)?;
        let (albedos, weights) = (cloud.albedos(), cloud.weights());
        let painted = cloud.vectors(POSITION).enumerate().filter_map(|(i, place)| {
            let (seen, _) = laid.at(i, place)?;
            let cover = seen.w * weights[i] * params.opacity;
            (cover > 0.0).then(|| (i, albedos[i].lerp(seen.truncate(), cover)))
        });
        let painted: Vec<(usize, Vec3)> = painted.collect();
        job.check()?;
        stage_colors(cloud, &painted, iter::empty(), job)
    }
}

impl Tool for Emboss {
    const INFO: UnitInfo =
        UnitInfo::new("emboss", "Emboss", "Moves surfels out by a picture along a stroke.");
    const HANDLING: Handling = Handling::STROKE;
    type Params = EmbossSettings;
    const LIMITS: &'static [LimitInfo] = LIMITS;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &EmbossSettings, job: &Job<'_>) -> Result<()> {
        let Some(normals) = cloud.floats(NORMAL, 3) else {
            return Err(Error::new("expected normals, found none; run the tool `normals` first"));
        };
        let laid = Laid::new(cloud, (&params.image, params.turn), job)?;
        let weights = cloud.weights();
        let height = f64::from(params.height) * laid.stroke.radius;
        let (mut positions, mut turned) = (Vec::<f32>::new(), Vec::<f32>::new());
        for (i, place) in cloud.vectors(POSITION).enumerate() {
            let normal = Vec3::from_slice(&normals[3 * i..3 * i + 3]);
            let weight = f64::from(weights[i]);
            let (light, slope) = laid.relief(i, place, (normal, weight));
            let moved = place.as_dvec3() + normal.as_dvec3() * (weight * height * light);
            positions.extend(moved.as_vec3().to_array());
            let steeper = (normal.as_dvec3() - slope * height).as_vec3();
            turned.extend(steeper.normalize_or(normal).to_array());
        }
        job.check()?;
        let columns = [floats(POSITION, 3, &positions), floats(NORMAL, 3, &turned)];
        job.edit(&Edit::Columns(columns.into()))
    }
}

/// A picture along a stroke over a cloud.
struct Laid<'a> {
    picture: Arc<Picture>,
    ribbon: Ribbon<'a>,
    stroke: &'a Stroke,
    origin: DVec3,
    radii: Option<&'a [f32]>,
}

impl<'a> Laid<'a> {
    fn new(
        cloud: &'a CloudView<'_>,
        (image, turn): (&FilePath, f64),
        job: &Job<'a>,
    ) -> Result<Self> {
        if image.is_empty() {
            return Err(Error::new("expected a picture in `image`, found no file"));
        }
        let Some(stroke) = job.stroke() else {
            return Err(Error::new(
                "expected a stroke, found none; lead it by hand, or by `--strokes`",
            ));
        };
        let picture = Picture::read_once(image.as_path(), job)?;
        let Some(ribbon) = Ribbon::of(stroke, picture.aspect(), turn.to_radians()) else {
            return Err(Error::new("expected samples of a stroke, found none"));
        };
        let radii = cloud.floats(RADIUS, 1);
        Ok(Self { picture, ribbon, stroke, origin: cloud.origin, radii })
    }

    /// Width of a surfel in heights of the picture.
    fn width(&self, i: usize) -> f64 {
        let radius = self.radii.and_then(|radii| radii.get(i)).copied().unwrap_or_default();
        2.0 * f64::from(radius) / self.ribbon.height()
    }

    /// The picture at a surfel: linear light and how much it covers.
    fn at(&self, i: usize, place: Vec3) -> Option<(Vec4, RibbonPlace)> {
        let at = self.ribbon.at(self.origin + place.as_dvec3())?;
        Some((self.picture.at(at.picture, self.width(i))?, at))
    }

    /// The luminance at a surfel, and the slope of luminance times weight along the surface, per scene unit.
    fn relief(&self, i: usize, place: Vec3, (normal, weight): (Vec3, f64)) -> (f64, DVec3) {
        let Some((seen, at)) = self.at(i, place) else { return (0.0, DVec3::ZERO) };
        let light = luminance(seen);
        // Over the surfel's width; a hundredth of the picture where it has none.
        let width = self.width(i);
        let step = if width > 0.0 { 0.5 * width } else { 0.01 };
        let difference = |by: DVec2| {
            let beside = |by: DVec2| {
                // The picture ends at the sides, and repeats along a line.
                let moved = at.picture + by;
                let repeats = self.ribbon.repeats();
                let y = if repeats { moved.y.rem_euclid(1.0) } else { moved.y };
                let moved = DVec2::new(moved.x, y);
                self.picture.at(moved, width).map_or(0.0, luminance)
            };
            (beside(by) - beside(-by)) / (2.0 * step * self.ribbon.height())
        };
        let of_picture = at.axes[0] * difference(DVec2::new(step, 0.0))
            + at.axes[1] * difference(DVec2::new(0.0, step));
        let slope = weight * of_picture + light * self.fall(at.away, weight);
        (light, slope.reject_from(normal.as_dvec3().try_normalize().unwrap_or(DVec3::Y)))
    }

    /// The slope of the weight beside a line, from the nearest place on it, where the weight is `found`: by pressure, and
    /// where a surfel faces another way, it is less than what the falloff gives.
    fn fall(&self, away: DVec3, found: f64) -> DVec3 {
        let (share, radius) = (away.length() / self.stroke.radius, self.stroke.radius);
        /// Of a radius: where the slope is measured.
        const STEP: f64 = 1e-3;
        let weight = |share: f64| self.stroke.dabs.falloff.weight(share.max(0.0));
        let fall = (weight(share + STEP) - weight(share - STEP)) / (2.0 * STEP);
        let full = weight(share);
        let part = if full > 0.0 { (found / full).min(1.0) } else { 0.0 };
        // A hard edge has no slope.
        away.normalize_or_zero() * part * fall.clamp(-4.0, 4.0) / radius
    }
}

/// Luminance of light that covers as much as its last number says; what is not covered is black.
///
/// Source: ITU-R BT.709.
fn luminance(seen: Vec4) -> f64 {
    f64::from(seen.truncate().dot(Vec3::new(0.2126, 0.7152, 0.0722)) * seen.w)
}
