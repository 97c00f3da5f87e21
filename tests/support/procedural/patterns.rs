//! Twins of the plugin's patterns and of the language they are written in, in f64.

use super::filtered::Filtered;
use super::noise::{self, Lattice, Place, Seed};
use glam::{DVec2, DVec3, Vec3};

/// The parameters that patterns see.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Cells of the first octave along the cloud.
    pub frequency: f32,
    /// How many octaves there are.
    pub octaves: u32,
    /// Frequency from octave to octave.
    pub lacunarity: f32,
    /// Contrast from octave to octave.
    pub gain: f32,
    /// How far places are moved, cells.
    pub warp: f32,
    /// Moves the hash.
    pub seed: u32,
    /// Octaves that a pixel leaves less than this of have no mean.
    pub faintest: f64,
}

/// The shader's own.
pub const FAINTEST: f64 = 0.02;

impl Default for Settings {
    /// The plugin's defaults.
    fn default() -> Self {
        Self {
            frequency: 4.0,
            octaves: 6,
            lacunarity: 2.0,
            gain: 0.5,
            warp: 0.0,
            seed: 0,
            faintest: FAINTEST,
        }
    }
}

/// What a surface looks like.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Reflectance, linear Rec. 709.
    pub albedo: DVec3,
    /// Weight of the highlight.
    pub specular: f64,
    /// 0 is a mirror, 1 dull.
    pub roughness: f64,
    /// 1 is a metal.
    pub metallic: f64,
}

/// The patterns that the plugin brings along.
pub const ALL: [&str; 8] = [
    "simple-marble",
    "veined-marble",
    "plaid",
    "wood",
    "granite",
    "brushed-metal",
    "rust",
    "checker",
];

const BETWEEN_OCTAVES: DVec3 = DVec3::new(5.375, 9.703_125, 13.140_625);

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn mix(a: DVec3, b: DVec3, t: f64) -> DVec3 {
    a + (b - a) * t
}

fn fract(x: f64) -> f64 {
    x - x.floor()
}

impl Settings {
    fn seed(&self) -> Seed {
        let key = [0x9e37_79b9u32, 0x85eb_ca6b, 0xc2b2_ae35].map(|odd| odd.wrapping_mul(self.seed));
        Seed { key, mask: (1 << 28) - 1 }
    }

    fn frequency(&self) -> Vec3 {
        Vec3::splat(self.frequency)
    }

    /// One octave.
    #[must_use]
    pub fn octave(&self, at: &Place, cells: Vec3, number: u32) -> Filtered {
        let l = noise::lattice(at, cells).moved(f64::from(number) * BETWEEN_OCTAVES);
        noise::over_pixel(noise::scalar(&l, &self.seed()), noise::widths(at, cells))
    }

    /// As many octaves as asked for, from a frequency on.
    #[must_use]
    pub fn fbm_from(&self, at: &Place, cells: Vec3) -> Filtered {
        let power: f64 = (0..self.octaves).map(|k| f64::from(self.gain).powi(2 * k as i32)).sum();
        let mut contrast = if power > 0.0 { 1.0 / power.sqrt() } else { 0.0 };
        let (mut f, mut octaves) = (cells, Vec::new());
        let mut n_seen = 0;
        for k in 0..self.octaves {
            octaves.push(self.octave(at, f, k).scaled(contrast, 0.0));
            if noise::attenuation(noise::widths(at, f)) > self.faintest {
                n_seen = octaves.len();
            }
            f *= self.lacunarity;
            contrast *= f64::from(self.gain);
        }
        let mean = octaves.iter().take(n_seen).map(|octave| octave.mean).sum();
        let variance: f64 = octaves.iter().map(|octave| octave.deviation.powi(2)).sum();
        Filtered::new(mean, variance.sqrt())
    }

    fn fbm(&self, at: &Place) -> Filtered {
        self.fbm_from(at, self.frequency())
    }

    /// A place moved by noise.
    #[must_use]
    pub fn warped(&self, at: &Place) -> Place {
        if self.warp <= 0.0 || self.frequency <= 0.0 {
            return *at;
        }
        let cells = self.frequency();
        let l = noise::lattice(at, cells).moved(31.0 * BETWEEN_OCTAVES);
        let faded = noise::attenuation(noise::widths(at, cells));
        let warp = f64::from(self.warp);
        let by = warp * faded * noise::vector(&l, &self.seed());
        let grown = (1.0 + 3.0 * (warp * 0.6525).powi(2)).sqrt();
        Place {
            position: at.position + by / cells.as_dvec3(),
            across: at.across * grown,
            along: at.along * grown,
            jitter: at.jitter,
        }
    }

    /// What a pattern says of a place.
    ///
    /// # Panics
    /// For a name that is none of [`ALL`].
    #[must_use]
    pub fn look(&self, pattern: &str, at: &Place, albedo: DVec3) -> Look {
        let at = &self.warped(at);
        match pattern {
            "simple-marble" => self.simple_marble(at, albedo),
            "veined-marble" => self.veined_marble(at, albedo),
            "plaid" => self.plaid(at, albedo),
            "wood" => self.wood(at, albedo),
            "granite" => self.granite(at, albedo),
            "brushed-metal" => self.brushed_metal(at, albedo),
            "rust" => self.rust(at, albedo),
            "checker" => self.checker(at, albedo),
            _ => panic!("there is no pattern {pattern}"),
        }
    }
}

/// Counts waves along a direction.
fn phase(at: &Place, waves: Vec3) -> Filtered {
    let Lattice { rest, .. } = noise::lattice(at, waves);
    let f = noise::counted(waves);
    let (x, y) = (at.across.dot(f), at.along.dot(f));
    Filtered::new(fract(rest.element_sum()), ((x * x + y * y) / 12.0).sqrt())
}

/// A square wave over a width.
fn square(rest: f64, width: f64) -> f64 {
    let ascent = |x: f64| 0.5 - (fract(x) - 0.5).abs();
    let w = width.max(1e-6);
    ((ascent(rest + 0.5 * w) - ascent(rest - 0.5 * w)) / w).clamp(-1.0, 1.0)
}

/// The patterns themselves, each as in its file of WGSL.
impl Settings {
    fn simple_marble(&self, at: &Place, albedo: DVec3) -> Look {
        let marble = self.fbm(at).scaled(0.5, 0.0).magnitude().scaled(5.0, 0.2);
        let specular = marble.scaled(-1.3, 1.1).ramp(0.0, 1.0);
        let albedo = marble.mean * v(1.0, 0.843, 0.624) * albedo;
        Look { albedo, specular, roughness: 0.41727, metallic: 0.0 }
    }

    fn plaid(&self, at: &Place, albedo: DVec3) -> Look {
        let threads = |x: Filtered| {
            let green = x.pulse(0.36);
            let navy = x.scaled(1.0, -0.10).pulse(0.16);
            let yellow = x.scaled(1.0, -0.66).pulse(0.045);
            let red = v(0.42, 0.02, 0.03);
            let color = mix(mix(red, v(0.02, 0.10, 0.04), green), v(0.015, 0.025, 0.12), navy);
            mix(color, v(0.75, 0.55, 0.06), yellow)
        };
        let sets = self.frequency();
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| threads(phase(at, sets * axis)));
        let twill = phase(at, 16.0 * sets * Vec3::ONE).wave();
        let weave = phase(at, 16.0 * sets * Vec3::new(1.0, -1.0, 0.5)).wave();
        let third = 1.0 / 3.0;
        let cloth = (third + 0.2 * twill) * x + (third - 0.2 * twill) * y + third * z;
        let fibre = 1.0 + 0.12 * weave + 0.5 * self.octave(at, 24.0 * sets, 3).mean;
        let albedo = albedo * cloth * fibre.max(0.0);
        Look { albedo, specular: 0.08, roughness: 0.75, metallic: 0.0 }
    }

    fn wood(&self, at: &Place, albedo: DVec3) -> Look {
        let grain = self.frequency() * Vec3::new(0.5, 0.12, 0.5);
        let wavering = self.fbm_from(at, grain);
        let from_axis = DVec2::new(at.position.x, at.position.z) - 0.5;
        let away = from_axis.length().max(1e-6);
        let rings = 3.0 * f64::from(self.frequency);
        let out = from_axis / away;
        let reach = [at.across, at.along].map(|a| DVec2::new(a.x, a.z).dot(out) * rings);
        let reach = DVec2::from(reach);
        let ring = Filtered::new(away * rings, (reach.length_squared() / 12.0).sqrt())
            .sum(wavering.scaled(2.0, 0.0));
        let year = 0.5 + 0.5 * ring.wave() + 0.2 * ring.scaled(2.0, 0.1).wave();
        let pores =
            self.octave(at, self.frequency() * Vec3::new(48.0, 2.0, 48.0), 5).ramp(0.1, 0.6);
        let fibre = self.octave(at, self.frequency() * Vec3::new(20.0, 0.8, 20.0), 7).mean;
        let color = mix(v(0.58, 0.34, 0.16), v(0.27, 0.11, 0.04), year.clamp(0.0, 1.0));
        let albedo = albedo * color * (1.0 + 0.35 * fibre) * (1.0 - 0.45 * pores);
        Look { albedo, specular: 0.25, roughness: 0.45, metallic: 0.0 }
    }

    fn granite(&self, at: &Place, albedo: DVec3) -> Look {
        let grains = 5.0 * self.frequency();
        let feldspar = self.octave(at, grains, 1).ramp(0.02, 0.10);
        let mica = self.octave(at, 1.7 * grains, 2).ramp(0.24, 0.30);
        let dust = self.fbm_from(at, 2.0 * grains).mean;
        let color = mix(v(0.52, 0.51, 0.50), v(0.62, 0.42, 0.34), feldspar) * (1.0 + 0.5 * dust);
        let color = mix(color, v(0.035, 0.033, 0.03), mica).max(DVec3::ZERO);
        let roughness = 0.35 + (0.2 - 0.35) * mica;
        Look { albedo: albedo * color, specular: 0.3 + 0.5 * mica, roughness, metallic: 0.0 }
    }

    fn brushed_metal(&self, at: &Place, albedo: DVec3) -> Look {
        let f = self.frequency();
        let scratches = self.octave(at, f * Vec3::new(0.7, 90.0, 0.7), 1);
        let deep = self.octave(at, f * Vec3::new(1.3, 37.0, 1.3), 2).ramp(0.15, 0.6);
        let smudges = self.fbm_from(at, f);
        let color = v(0.56, 0.57, 0.58) * (1.0 + 0.5 * scratches.mean) * (1.0 - 0.35 * deep);
        let roughness =
            0.28 + 0.25 * scratches.mean + 0.4 * scratches.deviation + 0.12 * smudges.mean;
        let albedo = albedo.min(DVec3::ONE) * color.max(DVec3::ZERO);
        Look { albedo, specular: 0.9, roughness: roughness.clamp(0.05, 1.0), metallic: 1.0 }
    }

    fn rust(&self, at: &Place, albedo: DVec3) -> Look {
        let decay = self.fbm(at);
        let rusty = decay.ramp(0.02, 0.10);
        let bare = decay.ramp(-0.03, 0.0);
        let age = self.fbm_from(at, 4.0 * self.frequency()).ramp(-0.3, 0.3);
        let pits = self.octave(at, 9.0 * self.frequency(), 11).ramp(0.2, 0.5);
        let rust = mix(v(0.42, 0.13, 0.03), v(0.09, 0.03, 0.018), age) * (1.0 - 0.5 * pits);
        let color = mix(mix(v(0.10, 0.22, 0.25), v(0.30, 0.29, 0.28), bare), rust, rusty);
        let blend = |a: f64, b: f64, t: f64| a + (b - a) * t;
        Look {
            albedo: albedo * color,
            specular: blend(0.5, 0.04, rusty),
            roughness: blend(blend(0.3, 0.45, bare), 0.9, rusty),
            metallic: 0.6 * bare * (1.0 - rusty),
        }
    }

    fn checker(&self, at: &Place, albedo: DVec3) -> Look {
        let waves = 0.5 * self.frequency();
        let l = noise::lattice(at, waves);
        let wide = (at.across.abs() + at.along.abs()) * noise::counted(waves);
        let turn: f64 = (0..3).map(|k| square(l.rest[k], wide[k])).product();
        let albedo = albedo * (0.05 + 0.75 * (0.5 + 0.5 * turn));
        Look { albedo, specular: 0.0, roughness: 0.5, metallic: 0.0 }
    }
}

impl Settings {
    fn veined_marble(&self, at: &Place, albedo: DVec3) -> Look {
        let folds = self.fbm(at);
        let layers = phase(at, self.frequency() * Vec3::new(0.44, 0.60, 0.24));
        let folded = layers.sum(folds.scaled(1.8, 0.0));
        let strength = self.octave(at, 0.6 * self.frequency(), 19).ramp(-0.25, 0.30);
        let vein = strength * folded.lines(0.022);
        let shade = (0.3 + 0.7 * strength) * folded.lines(0.14);
        let thread = (1.0 - strength) * self.octave(at, 1.1 * self.frequency(), 17).line(0.012);
        let grey = v(0.16, 0.17, 0.20);
        let color = mix(v(0.84, 0.82, 0.78), grey, 0.30 * shade);
        let color = mix(mix(color, v(0.55, 0.38, 0.18), 0.5 * thread), grey, 0.85 * vein);
        let albedo = albedo * color * (1.0 + 0.15 * folds.mean);
        Look { albedo, specular: 0.5, roughness: 0.3, metallic: 0.0 }
    }
}
