//! Which surfels are shown, as a scene says it.

use super::settings::{Attribute, whole};
use serde::{Deserialize, Serialize};

/// Which surfels are shown, by an attribute. Clouds without it are shown whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    /// The attribute.
    pub attribute: Attribute,
    /// What happens to surfels whose number passes the test.
    pub action: FilterAction,
    /// The test.
    pub test: FilterTest,
}

/// What happens to surfels that pass a test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterAction {
    /// They are shown, and no others.
    Keep,
    /// They are hidden.
    Hide,
}

impl FilterAction {
    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Keep => "keep",
            Self::Hide => "hide",
        }
    }

    /// The action of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Keep, Self::Hide].into_iter().find(|action| action.name() == name)
    }
}

/// A test of a number. NaN passes none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "StoredTest", from = "StoredTest")]
pub enum FilterTest {
    /// It lies between these, ends included; an end may be infinite.
    Range([f64; 2]),
    /// It is one of these.
    Values(Vec<i64>),
}

impl FilterTest {
    /// Whether a number passes.
    #[must_use]
    pub fn passes(&self, number: f64) -> bool {
        match self {
            Self::Range([low, high]) => (*low..=*high).contains(&number),
            Self::Values(values) => whole(number).is_some_and(|whole| values.contains(&whole)),
        }
    }
}

/// A test as files have it: an end that is infinite is left open.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum StoredTest {
    Range([Option<f64>; 2]),
    Values(Vec<i64>),
}

impl From<FilterTest> for StoredTest {
    fn from(test: FilterTest) -> Self {
        match test {
            FilterTest::Range(ends) => {
                Self::Range(ends.map(|end| Some(end).filter(|end| end.is_finite())))
            }
            FilterTest::Values(values) => Self::Values(values),
        }
    }
}

impl From<StoredTest> for FilterTest {
    fn from(stored: StoredTest) -> Self {
        match stored {
            StoredTest::Range([low, high]) => {
                Self::Range([low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY)])
            }
            StoredTest::Values(values) => Self::Values(values),
        }
    }
}

impl Filter {
    /// Whether a surfel of this number is shown.
    #[must_use]
    pub fn shows(&self, number: f64) -> bool {
        self.test.passes(number) == (self.action == FilterAction::Keep)
    }
}

impl std::fmt::Display for Filter {
    /// As it is typed, behind the word for its action: `hide classification=7,18`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}=", self.action.name(), self.attribute.title())?;
        match &self.test {
            FilterTest::Range([low, high]) => {
                let end = |end: &f64| if end.is_finite() { end.to_string() } else { String::new() };
                write!(f, "{}..{}", end(low), end(high))
            }
            FilterTest::Values(values) => {
                let values: Vec<String> = values.iter().map(i64::to_string).collect();
                f.write_str(&values.join(","))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_passes_no_test() {
        let range = FilterTest::Range([f64::NEG_INFINITY, f64::INFINITY]);
        let values = FilterTest::Values(vec![0, 2]);
        assert!(range.passes(1e300) && range.passes(f64::INFINITY) && !range.passes(f64::NAN));
        assert!(values.passes(2.0) && values.passes(-0.0) && !values.passes(2.5));
        assert!(!values.passes(f64::NAN) && !values.passes(f64::INFINITY));
        let filter = |action| Filter { attribute: Attribute::Height, action, test: values.clone() };
        assert!(
            filter(FilterAction::Keep).shows(2.0) && !filter(FilterAction::Keep).shows(f64::NAN)
        );
        assert!(
            !filter(FilterAction::Hide).shows(2.0) && filter(FilterAction::Hide).shows(f64::NAN)
        );
    }

    #[test]
    fn filters_read_as_they_are_typed() {
        let filter = |action, test| Filter { attribute: Attribute::column("class"), action, test };
        let hide = filter(FilterAction::Hide, FilterTest::Values(vec![7, -1]));
        assert_eq!(hide.to_string(), "hide class=7,-1");
        let keep = filter(FilterAction::Keep, FilterTest::Range([0.5, f64::INFINITY]));
        assert_eq!(keep.to_string(), "keep class=0.5..");
    }
}
