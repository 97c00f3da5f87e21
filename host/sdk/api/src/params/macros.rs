//! The macros that declare parameters.

#[cfg(doc)]
use crate::params::FilePath;

/// Declares a unit's parameters as a structure.
///
/// Each field has a documentation comment (the help text), a type (`bool`, `f32`, `f64`, `u32`,
/// `i32`, `String`, [`FilePath`], `[f32; 3]` for a colour, or a type made with
/// [`choices!`](crate::choices!)) and, in braces, `default` followed by any of `range`, `unit`,
/// `quality`, `logarithmic`, `endings`, `label`, `id`. A field with `group` instead has the parameters of
/// another such structure, which several units share, with these defaults.
///
/// ```
/// surfelshop_api::params! {
///     /// Settings of a renderer.
///     pub struct Settings {
///         /// Sharpness of the highlight.
///         shininess: f32 { default: 64.0, range: 1.0..=1024.0, logarithmic: true },
///         /// Samples per pixel.
///         samples: u32 { default: 16, range: 1..=256, quality: true },
///         /// `ao-strength` and `ao-affects`.
///         occlusion: surfelshop_api::Occlusion { group: Default::default() },
///     }
/// }
/// use surfelshop_api::params::ParamSet;
/// assert_eq!(Settings::declare()[1].id, "samples");
/// assert_eq!(Settings::declare()[2].id, "ao-strength");
/// assert_eq!(Settings::default().shininess, 64.0);
/// ```
#[macro_export]
macro_rules! params {
    (
        $(#[$meta:meta])*
        $vis:vis struct $name:ident {
            $(
                $(#[doc = $doc:expr])*
                $field:ident : $type:ty { $key:ident : $default:expr $(, $more:ident : $value:expr)* $(,)? }
            ),* $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug)]
        $vis struct $name {
            $( $(#[doc = $doc])* pub $field: $type, )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $field: $default, )* }
            }
        }

        impl $crate::params::ParamSet for $name {
            fn declare() -> ::std::vec::Vec<$crate::params::ParamDecl> {
                Self::default().declared()
            }

            fn from_values(values: &$crate::params::Values) -> Self {
                Self::default().with_values(values)
            }

            fn declared(&self) -> ::std::vec::Vec<$crate::params::ParamDecl> {
                <[::std::vec::Vec<$crate::params::ParamDecl>]>::concat(&[$(
                    $crate::__param_field!(
                        @declare $key, self.$field, stringify!($field),
                        concat!($($doc, " ",)*), $($more, $value),*
                    )
                ),*])
            }

            fn with_values(mut self, values: &$crate::params::Values) -> Self {
                $($crate::__param_field!(
                    @set $key, values, self.$field, stringify!($field), $($more, $value),*
                );)*
                self
            }

            fn values(&self) -> $crate::params::Values {
                let mut values = $crate::params::Values::new();
                $($crate::__param_field!(
                    @values $key, values, self.$field, stringify!($field), $($more, $value),*
                );)*
                values
            }

            fn unsigned(&self) -> ::std::vec::Vec<::std::string::String> {
                let mut ids = ::std::vec::Vec::new();
                $($crate::__param_field!(
                    @unsigned $key, ids, self.$field, stringify!($field), $($more, $value),*
                );)*
                ids
            }
        }
    };
}

/// One field of [`params!`], a parameter or a group of them.
#[doc(hidden)]
#[macro_export]
macro_rules! __param_field {
    (@declare default, $place:expr, $name:expr, $doc:expr, $($more:ident, $value:expr),*) => {
        ::std::vec![$crate::params::ParamDecl::new($name, &$place, $doc) $( .$more($value) )*]
    };
    (@declare group, $place:expr, $name:expr, $doc:expr,) => {
        $crate::params::ParamSet::declared(&$place)
    };
    (@set default, $values:ident, $place:expr, $name:expr, $($more:ident, $value:expr),*) => {
        let declared = $crate::params::ParamDecl::new($name, &$place, "") $( .$more($value) )*;
        let value = declared.sanitise($values.get(&declared.id));
        if let Some(value) = $crate::params::ParamType::from_value(&value) {
            $place = value;
        }
    };
    (@set group, $values:ident, $place:expr, $name:expr,) => {
        $place = $crate::params::ParamSet::with_values($place, $values);
    };
    (@values default, $values:ident, $place:expr, $name:expr, $($more:ident, $value:expr),*) => {
        let declared = $crate::params::ParamDecl::new($name, &$place, "") $( .$more($value) )*;
        $values.insert(declared.id, $crate::params::ParamType::to_value(&$place));
    };
    (@values group, $values:ident, $place:expr, $name:expr,) => {
        $values.extend($crate::params::ParamSet::values(&$place));
    };
    (@unsigned default, $ids:ident, $place:expr, $name:expr, $($more:ident, $value:expr),*) => {
        if $crate::params::is_unsigned(&$place) {
            let declared = $crate::params::ParamDecl::new($name, &$place, "") $( .$more($value) )*;
            $ids.push(declared.id);
        }
    };
    (@unsigned group, $ids:ident, $place:expr, $name:expr,) => {
        $ids.extend($crate::params::ParamSet::unsigned(&$place));
    };
}

/// Declares a parameter type whose values are a few named choices; the first is the usual
/// default.
///
/// ```
/// surfelshop_api::choices! {
///     /// How the highlight is computed.
///     pub enum Highlight {
///         /// Half vector between light and eye.
///         HalfVector = "half-vector",
///         /// Mirrored eye vector.
///         Reflection = "reflection",
///     }
/// }
/// ```
#[macro_export]
macro_rules! choices {
    (
        $(#[$meta:meta])*
        $vis:vis enum $name:ident {
            $( $(#[$variant_meta:meta])* $variant:ident = $id:literal ),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $vis enum $name {
            $( $(#[$variant_meta])* $variant, )+
        }

        impl $crate::params::ParamType for $name {
            fn kind() -> $crate::params::ParamKind {
                $crate::params::ParamKind::Choice(::std::vec![$( $id.to_owned() ),+])
            }
            fn to_value(&self) -> $crate::params::Value {
                $crate::params::Value::Text(match self { $( Self::$variant => $id ),+ }.to_owned())
            }
            fn from_value(value: &$crate::params::Value) -> Option<Self> {
                match value {
                    $crate::params::Value::Text(text) => match text.as_str() {
                        $( $id => Some(Self::$variant), )+
                        _ => None,
                    },
                    _ => None,
                }
            }
        }
    };
}
