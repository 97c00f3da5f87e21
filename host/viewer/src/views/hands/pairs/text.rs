//! Pairs as a parameter holds them: rows of numbers with semicolons between.

/// The rows of a text, of so many numbers each; `None` where one is none.
pub(super) fn rows(text: &str, n: usize) -> Option<Vec<Vec<f64>>> {
    let rows = text.split(';').map(str::trim).filter(|row| !row.is_empty());
    let read = |row: &str| {
        let words = row.split(|c: char| c.is_whitespace() || c == ',');
        let words = words.filter(|word| !word.is_empty());
        let number = |word: &str| word.parse().ok().filter(|number: &f64| number.is_finite());
        let numbers: Option<Vec<f64>> = words.map(number).collect();
        numbers.filter(|numbers| numbers.len() == n)
    };
    rows.map(read).collect()
}

/// The text of rows.
pub(super) fn text_of(rows: &[Vec<f64>]) -> String {
    let row = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    rows.iter().map(row).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_as_they_were_written() {
        let pairs =
            vec![vec![0.1, -2.0, 481_000.123_456, 0.25, 1.0], vec![1e-9, 0.0, 3.0, 0.0, 0.5]];
        assert_eq!(rows(&text_of(&pairs), 5), Some(pairs));
        assert_eq!(
            rows(" 1,2 3 ;; 4 5,6; ", 3),
            Some(vec![vec![1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0]])
        );
        assert_eq!(rows("", 6), Some(Vec::new()));
        for text in ["1 2", "1 2 x", "1 2 inf", "1 2 3 4"] {
            assert_eq!(rows(text, 3), None, "{text}");
        }
    }
}
