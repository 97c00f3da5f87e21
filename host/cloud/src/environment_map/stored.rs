//! A probe as bytes, so that a program can keep what took a while to compute.

use super::{Mapping, Picture, Probe, Repairs};
use serde::{Deserialize, Serialize};
use surfelshop_api::EnvironmentFacts;

/// Everything but the texels.
#[derive(Serialize, Deserialize)]
struct Head {
    name: String,
    mapping: String,
    mapping_was_detected: bool,
    size: [u32; 2],
    n_not_finite: u64,
    n_negative: u64,
    facts: EnvironmentFacts,
}

impl Probe {
    /// The probe without the texels of its picture.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let head = Head {
            name: self.name.clone(),
            mapping: self.mapping.name().to_owned(),
            mapping_was_detected: self.mapping_was_detected,
            size: [self.picture.width, self.picture.height],
            n_not_finite: self.repairs.n_not_finite,
            n_negative: self.repairs.n_negative,
            facts: self.facts.clone(),
        };
        let head = rmp_serde::to_vec_named(&head).unwrap_or_default();
        let mut bytes = (head.len() as u64).to_le_bytes().to_vec();
        bytes.extend(head);
        bytes.extend_from_slice(bytemuck::cast_slice(&self.texels));
        bytes
    }

    /// A probe of such bytes, made by this version of the program on such a machine; its picture
    /// has a size and no texels. `None` where they are none, or not whole.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (length, rest) = bytes.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let (head, texels) = rest.split_at_checked(length)?;
        let head: Head = rmp_serde::from_slice(head).ok()?;
        let side = head.facts.side as usize;
        let expected = side.checked_mul(side)?.checked_mul(size_of::<[f32; 3]>())?;
        let is_light =
            |texel: &[f32; 3]| texel.iter().all(|value| value.is_finite() && *value >= 0.0);
        if texels.len() != expected || side < 2 {
            return None;
        }
        let texels: Vec<[f32; 3]> = bytemuck::pod_collect_to_vec(texels);
        let [width, height] = head.size;
        texels.iter().all(is_light).then_some(Self {
            name: head.name,
            mapping: Mapping::from_name(&head.mapping)?,
            mapping_was_detected: head.mapping_was_detected,
            picture: Picture { width, height, rgb: Vec::new() },
            repairs: Repairs { n_not_finite: head.n_not_finite, n_negative: head.n_negative },
            facts: head.facts,
            texels,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_probe_comes_back_from_its_bytes() {
        let probe = Probe::constant([1.0, 2.0, 3.0]);
        let bytes = probe.to_bytes();
        let back = Probe::from_bytes(&bytes).unwrap();
        assert_eq!(
            (&back.facts, &back.texels, &back.name),
            (&probe.facts, &probe.texels, &probe.name)
        );
        assert_eq!((back.mapping, back.repairs), (probe.mapping, probe.repairs));
        assert_eq!((back.picture.width, back.picture.rgb.len()), (probe.picture.width, 0));
        for length in [0, 7, 8, 100, bytes.len() - 1] {
            assert!(Probe::from_bytes(&bytes[..length]).is_none(), "{length} bytes");
        }
        let mut bad = bytes.clone();
        let last = bad.len() - 4;
        bad[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(Probe::from_bytes(&bad).is_none());
        assert!(Probe::from_bytes(&[0xff; 64]).is_none());
    }
}
