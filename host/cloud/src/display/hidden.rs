//! Surfels that are hidden one by one, which no filter tells from others.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::selection::{Selection, SelectionError};
use crate::memory::with_room;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD;

/// The column that says which surfels are hidden, one byte each. It belongs to a scene, and no file of a cloud has it.
pub const HIDDEN: &str = "hidden_surfels";

/// The cloud with other surfels hidden; with none where the selection is empty. Nothing else of it changes, and its
/// columns are shared.
///
/// # Errors
/// Where the selection is of another number of surfels, all would be hidden, or there is no memory.
pub fn hiding(cloud: &Cloud, hidden: &Selection) -> Result<Cloud, SelectionError> {
    let (expected, found) = (cloud.len(), hidden.len());
    if expected != found {
        return Err(SelectionError::Length { expected, found });
    }
    if hidden.is_empty() {
        return Ok(cloud.displayed_without(HIDDEN));
    }
    if hidden.count() == cloud.len() {
        return Err(SelectionError::Everything { len: cloud.len() });
    }
    let mut values = with_room(cloud.len())?;
    values.extend((0..cloud.len()).map(|index| u8::from(hidden.contains(index))));
    Ok(cloud.displayed_with(Column::new(HIDDEN, 1, Buffer::U8(values))))
}

/// The cloud as its file has it: all surfels are shown.
#[must_use]
pub fn unhidden(cloud: &Cloud) -> Cloud {
    cloud.displayed_without(HIDDEN)
}

/// Which surfels of a cloud are hidden; `None` where none is.
///
/// # Errors
/// Where there is no memory.
pub fn hidden(cloud: &Cloud) -> Result<Option<Selection>, SelectionError> {
    let Some(values) = values(cloud) else { return Ok(None) };
    Selection::of(cloud.len(), |index| values[index] != 0).map(Some)
}

/// The bytes of the column, where it is what it should be.
pub(super) fn values(cloud: &Cloud) -> Option<&[u8]> {
    let column = cloud.column(HIDDEN)?;
    match column.values() {
        Buffer::U8(values) if values.len() == cloud.len() => Some(values),
        _ => None,
    }
}

/// Hidden surfels as a scene notes them: how many there are in all, and how many follow each other that are shown,
/// hidden, shown and so on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HiddenSurfels {
    len: u64,
    runs: Vec<u64>,
}

impl HiddenSurfels {
    /// What a selection hides.
    #[must_use]
    pub fn of(hidden: &Selection) -> Self {
        let mut runs = Vec::new();
        let (mut is_hidden, mut began) = (false, 0);
        for index in 0..hidden.len() {
            if hidden.contains(index) != is_hidden {
                runs.push((index - began) as u64);
                (is_hidden, began) = (!is_hidden, index);
            }
        }
        if is_hidden {
            runs.push((hidden.len() - began) as u64);
        }
        Self { len: hidden.len() as u64, runs }
    }

    /// The surfels, of a cloud of `len`.
    ///
    /// # Errors
    /// Where it is of another number of surfels, or there is no memory.
    pub fn selection(&self, len: usize) -> Result<Selection, SelectionError> {
        if self.len != len as u64 {
            let found = usize::try_from(self.len).unwrap_or(usize::MAX);
            return Err(SelectionError::Length { expected: len, found });
        }
        let mut selection = Selection::none(len)?;
        let mut at = 0;
        for (i, run) in self.runs.iter().enumerate() {
            let end = at + *run as usize;
            if i % 2 == 1 {
                (at..end).for_each(|index| selection.insert(index));
            }
            at = end;
        }
        Ok(selection)
    }

    /// As text: its numbers, of seven bits a byte, in base 64.
    #[must_use]
    pub fn text(&self) -> String {
        let mut bytes = Vec::new();
        for number in std::iter::once(&self.len).chain(&self.runs) {
            let mut left = *number;
            while left >= 0x80 {
                bytes.push(left as u8 | 0x80);
                left >>= 7;
            }
            bytes.push(left as u8);
        }
        STANDARD_NO_PAD.encode(bytes)
    }

    /// Reads such a text; `None` where it is none.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let bytes = STANDARD_NO_PAD.decode(text).ok()?;
        let (mut numbers, mut number, mut shift) = (Vec::new(), 0u64, 0);
        for byte in bytes {
            // A cloud has at most 2^32 surfels.
            if shift > 28 {
                return None;
            }
            number |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte < 0x80 {
                numbers.push(number);
                (number, shift) = (0, 0);
            }
        }
        let (len, runs) = numbers.split_first()?;
        let is_whole = shift == 0 && runs.iter().sum::<u64>() <= *len;
        // Only the first may be empty: the first surfel is hidden then.
        let is_short = runs.iter().skip(1).all(|run| *run > 0);
        (is_whole && is_short).then(|| Self { len: *len, runs: runs.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn hidden_surfels_are_read_as_they_were_written(bits in proptest::collection::vec(any::<bool>(), 0..700)) {
            let selection = Selection::of(bits.len(), |index| bits[index]).unwrap();
            let noted = HiddenSurfels::of(&selection);
            let again = HiddenSurfels::parse(&noted.text()).unwrap();
            prop_assert_eq!(&again, &noted);
            prop_assert_eq!(again.selection(bits.len()).unwrap(), selection);
            prop_assert!(again.selection(bits.len() + 1).is_err());
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[A-Za-z0-9+/=]{0,40}") {
            if let Some(read) = HiddenSurfels::parse(&text) {
                prop_assert_eq!(HiddenSurfels::parse(&read.text()), Some(read));
            }
        }
    }
}
