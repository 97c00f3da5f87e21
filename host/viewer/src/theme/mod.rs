//! How the window looks: colours and spacing of both themes, and the icons.

mod icons;
mod style;
mod tokens;

pub(crate) use icons::{Icon, dismiss, iconed, iconed_in, text as icon_text};
pub(crate) use style::{apply, tokens};
pub(crate) use tokens::{AXES, ON_OVERLAY, OVERLAY, space};
