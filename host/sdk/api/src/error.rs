use std::fmt;
use std::path::Path;

/// Why a plugin could not do what it was asked for: one readable line.
///
/// Any standard error converts into it with `?`. The host shows the line beside the plugin's
/// name, so a message names what was expected and what was found, not the plugin.
pub struct Error {
    message: String,
}

/// A result whose error is a readable line.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// An error that says `message`.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into() }
    }

    /// The same with the file in front that it is about: `snail.xyz: permission denied`. ABI 3.10.
    #[must_use]
    pub fn at(self, path: impl AsRef<Path>) -> Self {
        Self { message: format!("{}: {}", path.as_ref().display(), self.message) }
    }

    /// The line shown to the user.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
    }
}

/// Says which file an error is about, where the error itself does not: those of the standard library do not.
///
/// ```
/// use surfelshop_api::prelude::*;
///
/// fn first_line(path: &FilePath) -> Result<String> {
///     let text = std::fs::read_to_string(path).at(path)?;
///     Ok(text.lines().next().unwrap_or_default().to_owned())
/// }
///
/// let line = first_line(&FilePath("gone.txt".to_owned())).unwrap_err().to_string();
/// assert!(line.starts_with("gone.txt: "));
/// ```
///
/// ABI 3.10.
pub trait ResultExt<T> {
    /// The same, with the file in front of an error.
    ///
    /// # Errors
    /// Where it was one.
    fn at(self, path: impl AsRef<Path>) -> Result<T>;
}

impl<T, E: Into<Error>> ResultExt<T> for std::result::Result<T, E> {
    fn at(self, path: impl AsRef<Path>) -> Result<T> {
        self.map_err(|error| error.into().at(path))
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

// `Error` itself does not implement `std::error::Error`, which is what lets every error that does
// convert into it.
impl<E: std::error::Error> From<E> for Error {
    fn from(source: E) -> Self {
        let mut message = source.to_string();
        let mut cause = source.source();
        while let Some(inner) = cause {
            message.push_str(": ");
            message.push_str(&inner.to_string());
            cause = inner.source();
        }
        Self { message }
    }
}
