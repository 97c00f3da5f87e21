//! Clouds with known answers.

use glam::{DVec3, Vec3};
use surfelshop_api::columns;
use surfelshop_cloud::{Buffer, Cloud, Column};

/// The columns a test cloud is made of, before it becomes one.
#[derive(Clone, Debug, Default)]
pub struct Surfels {
    /// World position that `positions` are relative to.
    pub origin: DVec3,
    /// Centres.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Radii.
    pub radii: Vec<f32>,
    /// Half axes of elliptical splats; no columns where empty.
    pub tangents: Vec<[Vec3; 2]>,
    /// Which are round splats, not 0; no column where empty.
    pub round: Vec<u8>,
    /// Normal fields of elliptical splats; no column where empty.
    pub fields: Vec<[f32; 4]>,
    /// Lines that cut elliptical splats; no column where empty.
    pub clips: Vec<[f32; 7]>,
    /// sRGB-encoded colours; no column where empty.
    pub colors: Vec<[u8; 3]>,
    /// Accessibility; no column where empty.
    pub ao: Vec<f32>,
    /// Indices of materials; no column where empty.
    pub materials: Vec<u32>,
}

impl Surfels {
    /// Adds one surfel without colour.
    pub fn push(&mut self, position: Vec3, normal: Vec3, radius: f32) {
        self.positions.push(position);
        self.normals.push(normal);
        self.radii.push(radius);
    }

    /// Makes every disc an ellipse: its second half axis, `share` as long as the first, lies at
    /// an angle to it that differs from surfel to surfel and is a right one only by chance.
    #[must_use]
    pub fn elliptical(mut self, share: f32) -> Self {
        self.tangents = (self.normals.iter().zip(&self.radii).enumerate())
            .map(|(i, (normal, &radius))| {
                let (u, v) = normal.any_orthonormal_pair();
                let (sin, cos) = (i as f32).sin_cos();
                let (along, across) = (u * cos + v * sin, v * cos - u * sin);
                let skew = 0.3 * (3.0 * i as f32).sin();
                [along * radius, (across + skew * along) * (share * radius)]
            })
            .collect();
        self
    }

    /// Gives every splat a normal field of its own, and cuts two of three: by one line or two, of which
    /// both count or either.
    #[must_use]
    pub fn varying(mut self) -> Self {
        let n = self.normals.len();
        let wave = |i: usize, k: f32| (k * i as f32 + k).sin();
        self.fields = (0..n)
            .map(|i| [0.3 * wave(i, 1.0), 0.3 * wave(i, 2.0), wave(i, 3.0), -wave(i, 5.0)])
            .collect();
        self.clips = (0..n)
            .map(|i| {
                let (a, b) = (7.0 * i as f32).sin_cos();
                let (d, e) = (11.0 * i as f32).sin_cos();
                let kind = [0.0, 1.0, 2.0][i % 3];
                let second = if i % 2 == 0 { [d, e, 0.4] } else { [0.0, 0.0, 2.0 - 1.5 * kind] };
                [a, b, 0.5 * wave(i, 13.0), second[0], second[1], second[2], kind]
            })
            .collect();
        self
    }

    /// The cloud.
    ///
    /// # Panics
    /// Where the lists differ in length.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        let flat = |list: &[Vec3]| Buffer::F32(list.iter().flat_map(Vec3::to_array).collect());
        let mut all = vec![
            Column::new(columns::POSITION, 3, flat(&self.positions)),
            Column::new(columns::NORMAL, 3, flat(&self.normals)),
            Column::new(columns::RADIUS, 1, Buffer::F32(self.radii.clone())),
        ];
        if !self.round.is_empty() {
            all.push(Column::new(columns::ROUND, 1, Buffer::U8(self.round.clone())));
        }
        if !self.tangents.is_empty() {
            for (name, which) in [(columns::TANGENT_U, 0), (columns::TANGENT_V, 1)] {
                let axes: Vec<Vec3> = self.tangents.iter().map(|axes| axes[which]).collect();
                all.push(Column::new(name, 3, flat(&axes)));
            }
        }
        if !self.fields.is_empty() {
            let values = self.fields.iter().flatten().copied().collect();
            all.push(Column::new(columns::NORMAL_FIELD, 4, Buffer::F32(values)));
        }
        if !self.clips.is_empty() {
            let values = self.clips.iter().flatten().copied().collect();
            all.push(Column::new(columns::CLIP, 7, Buffer::F32(values)));
        }
        if !self.colors.is_empty() {
            let values = self.colors.iter().flatten().copied().collect();
            all.push(Column::new(columns::COLOR, 3, Buffer::U8(values)));
        }
        if !self.ao.is_empty() {
            all.push(Column::new(columns::AO, 1, Buffer::F32(self.ao.clone())));
        }
        if !self.materials.is_empty() {
            all.push(Column::new(columns::MATERIAL, 1, Buffer::U32(self.materials.clone())));
        }
        Cloud::new(self.origin, all).expect("generated clouds are consistent")
    }
}

/// `n` surfels spread evenly over a sphere, with radii of 1.5 times the mean spacing.
///
/// Source: the Fibonacci lattice, Swinbank & Purser 2006.
#[must_use]
pub fn sphere(n: usize, radius: f32) -> Surfels {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let spacing = (4.0 * std::f64::consts::PI / n as f64).sqrt() * f64::from(radius);
    let mut surfels = Surfels::default();
    for i in 0..n {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let r = (1.0 - z * z).sqrt();
        let angle = golden * i as f64;
        let normal = DVec3::new(r * angle.cos(), z, r * angle.sin()).as_vec3();
        surfels.push(normal * radius, normal, 1.5 * spacing as f32);
        let shade = |v: f32| (127.5 + 127.4 * v) as u8;
        surfels.colors.push([shade(normal.x), shade(normal.y), shade(normal.z)]);
    }
    surfels
}

/// A ball of radius 1 as a mesh: rings of `across` vertices from pole to pole, and the triangles between
/// them.
#[must_use]
pub fn globe(rings: u32, across: u32) -> (Surfels, Vec<[u32; 3]>) {
    let (mut surfels, mut faces) = (Surfels::default(), Vec::new());
    for ring in 0..rings {
        let (sin, cos) = (std::f32::consts::PI * (ring as f32 + 0.5) / rings as f32).sin_cos();
        for i in 0..across {
            let (y, x) = (std::f32::consts::TAU * i as f32 / across as f32).sin_cos();
            let normal = Vec3::new(sin * x, cos, sin * y);
            surfels.push(normal, normal, 5.0 / (rings.min(across) as f32));
            surfels.colors.push([200, 150, 100]);
            if ring > 0 {
                let next = (i + 1) % across;
                let [a, b] = [(ring - 1) * across, ring * across];
                faces.push([a + i, a + next, b + i]);
                faces.push([a + next, b + next, b + i]);
            }
        }
    }
    (surfels, faces)
}

/// A square in the plane y = 0 with side `2 * half`, `n * n` surfels of equal colour.
#[must_use]
pub fn plane(n: usize, half: f32) -> Surfels {
    let spacing = 2.0 * half / n as f32;
    let mut surfels = Surfels::default();
    for i in 0..n * n {
        let at = |k: usize| (k as f32 + 0.5) * spacing - half;
        surfels.push(Vec3::new(at(i % n), 0.0, at(i / n)), Vec3::Y, spacing);
    }
    surfels
}
