//! Models of colours: how many bytes a colour has, and how they become red, green, blue and opacity.

/// How the colours of surfels are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ColorModel {
    /// Luminance.
    L,
    /// Luminance and opacity.
    La,
    /// Red, green, blue.
    Rgb,
    /// Red, green, blue, opacity.
    Rgba,
    /// Luminance and two differences.
    Yuv,
    /// Luminance, two differences and opacity.
    Yuva,
}

/// The value of the two differences where they are zero; the format does not say what bytes stand for, and this is
/// how video has them.
const NO_DIFFERENCE: f32 = 128.0;

impl ColorModel {
    /// Bits of the property vector that hold the model.
    pub(crate) const MASK: u32 = 0x1f_0000;

    /// The model of these bits; `None` where they name none.
    pub(crate) fn from_bits(bits: u32) -> Option<Self> {
        Some(match bits & Self::MASK {
            0x01_0000 => Self::L,
            0x09_0000 => Self::La,
            0x07_0000 => Self::Rgb,
            0x0f_0000 => Self::Rgba,
            0x10_0000 => Self::Yuv,
            0x18_0000 => Self::Yuva,
            _ => return None,
        })
    }

    /// The bits of the property vector.
    pub(crate) const fn bits(self) -> u32 {
        match self {
            Self::L => 0x01_0000,
            Self::La => 0x09_0000,
            Self::Rgb => 0x07_0000,
            Self::Rgba => 0x0f_0000,
            Self::Yuv => 0x10_0000,
            Self::Yuva => 0x18_0000,
        }
    }

    /// Bytes of a colour.
    pub(crate) const fn size(self) -> usize {
        match self {
            Self::L => 1,
            Self::La => 2,
            Self::Rgb | Self::Yuv => 3,
            Self::Rgba | Self::Yuva => 4,
        }
    }

    /// Which byte holds opacity.
    pub(crate) const fn alpha(self) -> Option<usize> {
        match self {
            Self::La => Some(1),
            Self::Rgba | Self::Yuva => Some(3),
            _ => None,
        }
    }

    /// The name for people.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::L => "L",
            Self::La => "LA",
            Self::Rgb => "RGB",
            Self::Rgba => "RGBA",
            Self::Yuv => "YUV",
            Self::Yuva => "YUVA",
        }
    }

    /// Red, green, blue and opacity of a colour; what is missing of its bytes counts as 0.
    pub(crate) fn rgba(self, bytes: &[u8]) -> [u8; 4] {
        let at = |place: usize| bytes.get(place).copied().unwrap_or(0);
        let alpha = self.alpha().map_or(255, at);
        let [r, g, b] = match self {
            Self::L | Self::La => [at(0); 3],
            Self::Rgb | Self::Rgba => [at(0), at(1), at(2)],
            Self::Yuv | Self::Yuva => rgb_of_yuv([at(0), at(1), at(2)]),
        };
        [r, g, b, alpha]
    }
}

/// Source: PAL's colour differences, as the format has them.
fn rgb_of_yuv([y, u, v]: [u8; 3]) -> [u8; 3] {
    let y = f32::from(y);
    let [u, v] = [u, v].map(|difference| f32::from(difference) - NO_DIFFERENCE);
    let rgb = [y + 1.14 * v, y - 0.394 * u - 0.581 * v, y + 2.028 * u];
    // Conversion to a byte ends at 0 and 255.
    rgb.map(|channel| channel.round() as u8)
}
