//! The command that measures one row of a table again.

use super::cells::Cell;
use surfelshop_session::output::command_line;

/// Options whose values are another's in the command of one row.
const REPLACED: [&str; 4] = ["--knob", "--out", "-o", "--part"];

/// The typed command with one value of one knob, into a folder of its own.
pub(super) fn command(words: &[String], cell: &Cell) -> String {
    // In front of what was typed, behind which a `--` may stand.
    let (first, typed) = words.split_at(words.len().min(1));
    let mut own = first.to_vec();
    own.extend(["--knob".to_owned(), format!("{}={}", cell.knob, cell.value)]);
    own.extend(["-o".to_owned(), "alone".to_owned()]);
    let typed = command_line::without(typed, &REPLACED);
    own.extend(typed.into_iter().filter(|word| word != "--json"));
    command_line::words("surfelshop", own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_s_command_is_the_typed_one_with_its_value() {
        let cell = Cell::faulty("rays", "16", String::new());
        let line = "report -- a.ply -t ao --knob rays=1,16 --knob=tolerance=0,1 -o out -oout --json \
                    --set method=rays";
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        let expected = "surfelshop report --knob rays=16 -o alone -- a.ply -t ao --set method=rays";
        assert_eq!(command(&words, &cell), expected);
    }
}
