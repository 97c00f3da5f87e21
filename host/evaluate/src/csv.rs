//! Tables of values with commas between them.

use serde_json::Value;

/// A head and rows, each a line; texts stand between quotes, and nothing where there is no value.
pub(crate) fn table(head: &[&str], rows: &[Vec<Value>]) -> String {
    let text = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let cell = |value: &Value| match value {
        Value::Null => String::new(),
        Value::String(words) => text(words),
        other => other.to_string(),
    };
    let line = |cells: Vec<String>| cells.join(",") + "\n";
    let head = line(head.iter().copied().map(text).collect());
    rows.iter().fold(head, |all, row| all + &line(row.iter().map(cell).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn texts_are_quoted_and_nothing_is_empty() {
        let rows = [vec![json!("a \"b\", c"), json!(0.5), json!(null)]];
        assert_eq!(
            table(&["x", "y, z", ""], &rows),
            "\"x\",\"y, z\",\"\"\n\"a \"\"b\"\", c\",0.5,\n"
        );
    }
}
