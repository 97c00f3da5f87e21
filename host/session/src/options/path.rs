//! Paths of cameras as they are typed.

/// Most frames of a path.
const MOST_FRAMES: u32 = 3600;

/// Where the camera goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathSpec {
    /// Once around what it looks at, in so many frames.
    Orbit(u32),
    /// To the cameras of the scene's views, in their order.
    Views,
    /// Along a smooth curve through these cameras, in so many frames.
    Along(u32),
}

impl PathSpec {
    /// Reads `orbit:N`, `along:N` or `views`.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let number = |word: &str| text.strip_prefix(word).and_then(|n| n.trim().parse().ok());
        match (text, number("orbit:"), number("along:")) {
            ("views", ..) => Ok(Self::Views),
            (_, Some(n), _) if (1..=MOST_FRAMES).contains(&n) => Ok(Self::Orbit(n)),
            (_, _, Some(n)) if (2..=MOST_FRAMES).contains(&n) => Ok(Self::Along(n)),
            _ => Err(format!(
                "expected orbit:N with N from 1 to {MOST_FRAMES}, along:N with N from 2, or views"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_or_refused() {
        assert_eq!(PathSpec::parse("orbit:24"), Ok(PathSpec::Orbit(24)));
        assert_eq!(PathSpec::parse("views"), Ok(PathSpec::Views));
        assert_eq!(PathSpec::parse("along:2"), Ok(PathSpec::Along(2)));
        for text in ["along:1", "orbit", "orbit:0", "orbit:3601", "orbit:-1", "views:2", ""] {
            assert!(PathSpec::parse(text).is_err(), "{text}");
        }
    }
}
