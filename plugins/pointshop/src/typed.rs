//! Rows of numbers that are typed.

use surfelshop_api::prelude::*;

/// Reads rows of `N` numbers, with semicolons between; numbers stand apart by spaces or commas. `form` says what is expected,
/// in an error about the parameter `id`.
///
/// # Errors
/// Where a row has another number of them, or one is none or not finite.
pub(crate) fn rows<const N: usize>(id: &str, text: &str, form: &str) -> Result<Vec<[f64; N]>> {
    let rows = text.split(';').map(str::trim).filter(|row| !row.is_empty());
    let read = |row: &str| {
        let words =
            row.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
        let number = |word: &str| word.parse().ok().filter(|number: &f64| number.is_finite());
        let numbers: Option<Vec<f64>> = words.map(number).collect();
        let row_of = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        row_of.ok_or_else(|| {
            Error::new(format!("`{id}`: expected {form}, {N} numbers each, found `{row}`"))
        })
    };
    rows.map(read).collect()
}
