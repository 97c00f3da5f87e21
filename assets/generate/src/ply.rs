//! Writes surfels as binary little-endian PLY.

use glam::Vec3;

/// A surfel as it is stored.
pub(crate) struct Surfel {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) radius: f32,
    /// sRGB-encoded albedo.
    pub(crate) color: [u8; 3],
}

/// The bytes of a PLY file.
pub(crate) fn encode(surfels: &[Surfel]) -> Vec<u8> {
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    header += &format!("element vertex {}\n", surfels.len());
    for name in ["x", "y", "z", "nx", "ny", "nz", "radius"] {
        header += &format!("property float {name}\n");
    }
    for name in ["red", "green", "blue"] {
        header += &format!("property uchar {name}\n");
    }
    header += "end_header\n";
    let mut bytes = header.into_bytes();
    for surfel in surfels {
        for vector in [surfel.position, surfel.normal] {
            bytes.extend(vector.to_array().map(f32::to_le_bytes).as_flattened());
        }
        bytes.extend(surfel.radius.to_le_bytes());
        bytes.extend(surfel.color);
    }
    bytes
}
