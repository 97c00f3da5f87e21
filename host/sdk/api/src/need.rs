//! What a unit needs of a cloud.

use crate::columns::{Role, role_of};
use serde::{Deserialize, Serialize};

/// A column that a unit reads, as its type states it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NeedInfo {
    pub(crate) column: &'static str,
    pub(crate) components: u32,
    role: Option<Role>,
    pub(crate) required: bool,
}

impl NeedInfo {
    /// A column of numbers that has to be there, with at least so many components.
    #[must_use]
    pub const fn column(name: &'static str, components: u32) -> Self {
        Self { column: name, components, role: None, required: true }
    }

    /// What its values are; else what they are by its name ([`role_of`]).
    #[must_use]
    pub const fn role(mut self, role: Role) -> Self {
        self.role = Some(role);
        self
    }

    /// The unit does without where it is missing.
    #[must_use]
    pub const fn optional(mut self) -> Self {
        self.required = false;
        self
    }
}

impl From<&NeedInfo> for Need {
    fn from(info: &NeedInfo) -> Self {
        Self {
            column: info.column.to_owned(),
            components: info.components,
            role: info.role.unwrap_or_else(|| role_of(info.column)),
            required: info.required,
        }
    }
}

/// A column that a unit reads. Clouds that lack one that is required are not drawn by it. ABI 3.9.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Need {
    /// The column's name.
    pub column: String,
    /// The least number of components.
    pub components: u32,
    /// What its values are.
    #[serde(default)]
    pub role: Role,
    /// Whether it has to be there.
    #[serde(default)]
    pub required: bool,
}

impl std::fmt::Display for Need {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.components {
            1 => write!(f, "`{}`", self.column),
            n => write!(f, "`{}` of {n} components", self.column),
        }
    }
}
