//! An entry on its page.

use super::code;
use super::html::{attribute, marked, text};
use super::pictures::Pictures;
use crate::entries::Entry;
use crate::outcome::{Grid, Made, Outcome, Shown, State};
use std::fmt::{Result, Write};

/// The name of an entry's place on the page.
pub(super) fn anchor(id: &str) -> String {
    id.to_ascii_lowercase().replace(' ', "-")
}

/// What is to be said of an entry's state.
pub(super) fn why(entry: &Entry, outcome: &Outcome) -> String {
    if outcome.state == State::Impossible {
        return entry.impossible.clone();
    }
    // Of what was made of one cloud in several ways, the cloud.
    let mut stands_in: Vec<&Shown> = Vec::new();
    for shown in outcome.data.iter().filter(|shown| !shown.stands_in_for.is_empty()) {
        match stands_in.iter_mut().find(|known| known.stands_in_for == shown.stands_in_for) {
            Some(known) if shown.of.len() < known.of.len() => *known = shown,
            Some(_) => {}
            None => stands_in.push(shown),
        }
    }
    let line = |shown: &&Shown| format!("{} for {}", shown.of, shown.stands_in_for);
    let mut all: Vec<String> = stands_in.iter().map(line).collect();
    all.extend(Some(entry.stand_in.clone()).filter(|line| !line.is_empty()));
    all.dedup();
    all.join("; ")
}

/// Writes an entry.
pub(super) fn write(body: &mut String, made: &Made<'_>, pictures: &Pictures) -> Result {
    let entry = made.entry;
    writeln!(body, "<section id=\"{}\"><h2>{}", attribute(&anchor(&entry.id)), text(&entry.id))?;
    let state = made.outcome.as_ref().map_or("failed", |outcome| outcome.state.word());
    writeln!(body, "<small>{} · {state}</small></h2>", text(&entry.at))?;
    writeln!(body, "<p>{}</p>", marked(&entry.shows))?;
    for (name, line) in
        [("Printed", &entry.printed), ("Corrected", &entry.corrected), ("Why", &entry.reason)]
    {
        if !line.is_empty() {
            writeln!(body, "<p><b>{name}:</b> {}</p>", marked(line))?;
        }
    }
    if !entry.severity.is_empty() {
        let word = match entry.severity.as_str() {
            "B" => "wrong output",
            "Q" => "bias",
            "A" => "ambiguous",
            _ => "cosmetic",
        };
        writeln!(body, "<p><b>Severity:</b> {word}.</p>")?;
    }
    if let Ok(outcome) = &made.outcome
        && outcome.state == State::StoodIn
    {
        writeln!(body, "<p><b>Stood in:</b> {}</p>", marked(&why(entry, outcome)))?;
    }
    match &made.outcome {
        Err(line) => writeln!(body, "<p class=\"bad\">It failed: {}</p>", text(line))?,
        Ok(outcome) if outcome.state == State::Impossible => {
            writeln!(body, "<p><b>Not made:</b> {}</p>", marked(&entry.impossible))?;
        }
        Ok(outcome) => results(body, entry, outcome, pictures)?,
    }
    writeln!(body, "</section>")
}

fn results(body: &mut String, entry: &Entry, outcome: &Outcome, pictures: &Pictures) -> Result {
    let has = |name: &str| outcome.pictures.iter().any(|picture| picture.name == name);
    if has("printed") && has("corrected") {
        // Its pictures are those below, which the page's script fills in: each is on the page once.
        writeln!(
            body,
            "<figure class=\"wipe\"><div><img alt=\"as corrected\"><img alt=\"as printed\"><i></i></div><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"where the \
             printed form ends\"><figcaption>left as printed, right as corrected</figcaption></figure>"
        )?;
    }
    if !entry.pictures.is_empty() {
        writeln!(body, "<p>{}</p>", marked(&entry.pictures))?;
    }
    writeln!(body, "<div class=\"sheet\">")?;
    for picture in &outcome.pictures {
        let address = pictures.address(&outcome.folder.join(&picture.file));
        let name = text(&picture.name);
        writeln!(
            body,
            "<figure><img src=\"{address}\" alt=\"{name}\"><figcaption>{name}</figcaption></figure>"
        )?;
    }
    writeln!(body, "</div>")?;
    for said in outcome.said.iter().filter(|said| !said.is_empty()) {
        writeln!(body, "<pre>{}</pre>", text(said))?;
    }
    numbers(body, outcome)?;
    for grid in &outcome.tables {
        table(body, grid)?;
    }
    for drawing in &outcome.drawings {
        writeln!(
            body,
            "<figure>{}<figcaption>{}</figcaption></figure>",
            drawing.svg,
            text(&drawing.caption)
        )?;
    }
    footer(body, entry, outcome)
}

/// Printed numbers and ours, and those that formulas gave.
fn numbers(body: &mut String, outcome: &Outcome) -> Result {
    let named = |pointer: &str| pointer.is_empty();
    let rows: Vec<Vec<String>> = outcome
        .numbers
        .iter()
        .filter(|number| !number.printed.is_empty() || named(&number.pointer))
        .map(|number| {
            let ours = format!("{} {}", shown(number.value), number.unit);
            vec![number.what.clone(), number.printed.clone(), ours]
        })
        .collect();
    if rows.is_empty() {
        return Ok(());
    }
    let head = ["", "printed", "ours"].map(str::to_owned).to_vec();
    if rows.iter().all(|row| row[1].is_empty()) {
        let head = vec![head[0].clone(), head[2].clone()];
        let rows = rows.into_iter().map(|row| vec![row[0].clone(), row[2].clone()]).collect();
        return table(body, &Grid { caption: String::new(), head, rows });
    }
    table(body, &Grid { caption: String::new(), head, rows })
}

/// A number with four digits.
fn shown(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if value.fract() == 0.0 && size < 1e5 => format!("{}", value + 0.0),
        _ if (1e-3..1e5).contains(&size) => {
            let digits = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.3e}"),
    }
}

/// Columns of words.
const WORDS: [&str; 2] = ["printed", "section"];

fn table(body: &mut String, grid: &Grid) -> Result {
    if !grid.caption.is_empty() {
        writeln!(body, "<p>{}</p>", text(&grid.caption))?;
    }
    write!(body, "<div class=\"wide\"><table><tr>")?;
    let class = |name: &str| if WORDS.contains(&name) { " class=\"words\"" } else { "" };
    for name in &grid.head {
        write!(body, "<th{}>{}</th>", class(name), text(name))?;
    }
    writeln!(body, "</tr>")?;
    for row in &grid.rows {
        write!(body, "<tr>")?;
        for (name, cell) in grid.head.iter().zip(row) {
            write!(body, "<td{}>{}</td>", class(name), text(cell))?;
        }
        writeln!(body, "</tr>")?;
    }
    writeln!(body, "</table></div>")
}

fn footer(body: &mut String, entry: &Entry, outcome: &Outcome) -> Result {
    writeln!(body, "<details><summary>How it is made</summary>")?;
    for shown in &outcome.data {
        let stands_in = match shown.stands_in_for.as_str() {
            "" => String::new(),
            of => format!(", which stands in for {}", text(of)),
        };
        writeln!(body, "<p>Shown: {}{stands_in}.</p>", text(&shown.of))?;
    }
    if !outcome.commands.is_empty() {
        writeln!(body, "<pre>{}</pre>", text(&outcome.commands.join("\n")))?;
    }
    for place in &entry.formula {
        let lines = code::excerpt(place).unwrap_or_default();
        writeln!(
            body,
            "<details><summary>In the code: <code>{}</code></summary><pre>{}</pre></details>",
            text(place),
            text(&lines)
        )?;
    }
    if !entry.technique.is_empty() {
        let technique = attribute(&entry.technique);
        writeln!(body, "<p><a href=\"checked.html#{technique}\">How it was checked.</a></p>")?;
    }
    writeln!(
        body,
        "<p>{}, {}; {:.1} s.</p></details>",
        text(&outcome.date),
        text(&outcome.machine),
        outcome.seconds
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_in_is_said_once() {
        let shown = |of: &str, stands_in_for: &str| Shown {
            of: of.to_owned(),
            stands_in_for: stands_in_for.to_owned(),
        };
        let mut outcome = Outcome::empty(State::StoodIn);
        outcome.data =
            vec![shown("a, rays", "x"), shown("a", "x"), shown("b", ""), shown("c", "y")];
        let entry = Entry { stand_in: "So it is.".to_owned(), ..Entry::default() };
        assert_eq!(why(&entry, &outcome), "a for x; c for y; So it is.");
    }

    #[test]
    fn whole_numbers_are_whole_and_others_have_four_digits() {
        let all = [0.0, 0.12345, 1477.14, -2.0, 3.5e6].map(shown);
        assert_eq!(all, ["0", "0.1235", "1477", "-2", "3.500e6"]);
    }
}
