//! What was found out of a body of lines: how they are cut, what their columns hold, where they begin.

use super::facts::Numbers;
use super::guess::{Cut, MOST_COLUMNS, best_cut};
use super::names::{have_position, is_left_out, shown, targets};
use super::sample::{Sample, has_words};
use super::{Delimiter, Layout, Typed, ranges};
use crate::text::{is_comment, number, quoted};
use surfelshop_api::columns::{Element, POSITION};
use surfelshop_api::{Error, Result};

/// Comments of a file that are handed on, and the characters of each.
const MOST_COMMENTS: usize = 32;
const MOST_COMMENT: usize = 200;

/// What the user set.
#[derive(Clone, Debug, Default)]
pub(crate) struct Settings {
    pub(crate) delimiter: Option<Delimiter>,
    /// Names of columns and types; `-` for those left out. Empty where they are guessed.
    pub(crate) columns: Vec<(String, Option<Element>)>,
    pub(crate) header_lines: Option<u64>,
}

/// What was found out of a body of lines.
pub(crate) struct Found {
    pub(crate) cut: Cut,
    pub(crate) typed: Vec<Typed>,
    pub(crate) numbers: Numbers,
    /// Where the first line of numbers begins.
    pub(crate) start: u64,
    /// Its number, counted from 1.
    pub(crate) line: u64,
    /// What the columns are and how that was found, for people.
    pub(crate) note: String,
    /// Comments before the numbers.
    pub(crate) comments: Vec<String>,
    /// Lines about columns that are left out without anybody having said so.
    pub(crate) left_out: Vec<String>,
}

impl Found {
    /// How the lines are read, where `wants` says which columns are.
    pub(crate) fn layout(&self, wants: impl Fn(&str) -> bool) -> Layout {
        Layout::new(&self.cut, &self.typed, &self.numbers, wants)
    }

    /// The names of columns by their order in the file, `-` for those that are left out.
    fn names(&self) -> String {
        let n = |column: &str| {
            self.typed.iter().flat_map(|(t, _)| t).filter(|t| t.column == column).count()
        };
        let names = self.typed.iter().map(|(target, _)| match target {
            Some(target) => shown(target, n(&target.column)),
            None => "-".to_owned(),
        });
        names.collect::<Vec<_>>().join(",")
    }
}

/// What is said of a file's columns, cut where there are very many.
pub(crate) fn noted(found: &Found) -> String {
    const SHOWN: usize = 240;
    match found.note.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &found.note[..end]),
        None => found.note.clone(),
    }
}

/// Of a body of lines that has no names: columns by the ranges of their values. The sample's first line is number
/// `line`.
///
/// # Errors
/// Where no lines of three numbers are there.
pub(crate) fn by_ranges(sample: &Sample, line: u64) -> Result<Found> {
    let lines: Vec<&[u8]> =
        sample.head_lines().map(|(_, line)| line).filter(|line| has_words(line)).collect();
    let cut = best_cut(
        &lines,
        &[Delimiter::Space, Delimiter::Tab, Delimiter::Comma, Delimiter::Semicolon],
    );
    let cut = cut.ok_or_else(|| no_numbers(lines.first().copied()))?;
    let numbers = numbers(&cut, lines.into_iter(), sample);
    let targets = ranges::targets(&numbers, &cut.numeric);
    let typed = targets.into_iter().map(|target| (target, None)).collect();
    let mut found = Found {
        typed,
        numbers,
        start: sample.start,
        line,
        note: String::new(),
        comments: Vec::new(),
        left_out: Vec::new(),
        cut,
    };
    found.note = format!("columns {} by their values", found.names());
    Ok(found)
}

fn no_numbers(line: Option<&[u8]>) -> Error {
    let found = line.map_or_else(|| "none".to_owned(), quoted);
    Error::new(format!(
        "expected lines of at least three numbers, found {found}; is it a table of points? The parameter `delimiter` says how its words are separated"
    ))
}

/// The numbers of a sample's lines that fit.
fn numbers<'a>(cut: &Cut, head: impl Iterator<Item = &'a [u8]>, sample: &'a Sample) -> Numbers {
    let mut numbers = Numbers::new(cut.numeric.len());
    for line in head.chain(sample.spread_lines()).filter(|line| cut.fits(line)) {
        if let Some(words) = cut.words(line) {
            numbers.take(&words, cut.decimal, &cut.numeric);
        }
    }
    numbers
}

/// A line of a sample.
struct Numbered<'a> {
    place: usize,
    /// Counted from 1.
    number: u64,
    text: &'a [u8],
}

/// Of a table that may have a header: names from the settings, or from its last line or comment, or else by the
/// ranges of values.
///
/// # Errors
/// Where no lines of three numbers are there, or names and columns do not fit.
pub(crate) fn in_table(sample: &Sample, settings: &Settings) -> Result<Found> {
    let lines: Vec<Numbered<'_>> = (1..)
        .zip(sample.head_lines())
        .map(|(number, (place, text))| Numbered { place, number, text })
        .collect();
    let n_skipped = usize::try_from(settings.header_lines.unwrap_or(0))?.min(lines.len());
    let body: Vec<&Numbered<'_>> =
        lines[n_skipped..].iter().filter(|line| has_words(line.text)).collect();
    let texts: Vec<&[u8]> = body.iter().map(|line| line.text).collect();
    if let Some(grid) = texts.first().filter(|line| is_grid(line)) {
        let found = quoted(grid);
        return Err(Error::new(format!(
            "expected a line for each point, found the header of a grid of heights, {found}; make points of it first, as `gdal_translate -of XYZ` does"
        )));
    }
    let one = settings.delimiter.map(|delimiter| [delimiter]);
    let delimiters = one.as_ref().map_or(&Delimiter::ALL[..], |one| &one[..]);
    let Some(mut cut) = best_cut(&texts, delimiters) else {
        return without_lines(sample, &lines, delimiters)
            .ok_or_else(|| no_numbers(texts.first().copied()));
    };
    let first = match settings.header_lines {
        Some(_) => 0,
        None => texts.iter().position(|line| cut.fits(line)).unwrap_or(0),
    };
    let Some(first) = body.get(first) else { return Err(no_numbers(None)) };
    let header: Vec<&Numbered<'_>> =
        lines.iter().filter(|line| line.number < first.number).collect();
    let (typed, source) = named(&mut cut, settings, &header)?;
    let data =
        texts.into_iter().skip(body.iter().position(|l| l.number == first.number).unwrap_or(0));
    let numbers = numbers(&cut, data.clone(), sample);
    let left_out = match settings.columns.is_empty() {
        true => words_left_out(&cut, &header, data),
        false => Vec::new(),
    };
    let typed = match typed {
        Some(typed) => typed,
        None => ranges::targets(&numbers, &cut.numeric).into_iter().map(|t| (t, None)).collect(),
    };
    let mut found = Found {
        typed,
        numbers,
        start: sample.place(first.place),
        line: first.number,
        note: String::new(),
        comments: comments(&header),
        left_out,
        cut,
    };
    check_position(&found, &header)?;
    let n_header = match settings.header_lines {
        Some(_) => n_skipped,
        None => header.iter().filter(|line| has_words(line.text)).count(),
    };
    found.note = note(&found, source, n_header);
    Ok(found)
}

/// Whether a line begins a grid of heights, as ESRI writes them into files `.asc`.
fn is_grid(line: &[u8]) -> bool {
    let word = line.split(u8::is_ascii_whitespace).find(|word| !word.is_empty());
    word.is_some_and(|word| word.eq_ignore_ascii_case(b"ncols"))
}

/// Names of columns as they are set or as the header has them, and where they come from.
fn named(
    cut: &mut Cut,
    settings: &Settings,
    header: &[&Numbered<'_>],
) -> Result<(Option<Vec<Typed>>, &'static str)> {
    let n = cut.numeric.len();
    if !settings.columns.is_empty() {
        let n_set = settings.columns.len();
        if n_set > n {
            return Err(Error::new(format!(
                "--text-columns: expected at most {n} names, one for each column of the file, found {n_set}; leave some out"
            )));
        }
        let mut names: Vec<&str> = settings.columns.iter().map(|(name, _)| name.as_str()).collect();
        names.resize(n, "-");
        // What the user names is read, whatever the first lines hold.
        for (is_numeric, name) in cut.numeric.iter_mut().zip(&names) {
            *is_numeric |= !is_left_out(name);
        }
        let types = settings.columns.iter().map(|(_, element)| *element);
        let typed = targets(&names).into_iter().zip(types.chain(std::iter::repeat(None)));
        return Ok((Some(typed.collect()), "as set"));
    }
    let names = names_of(cut, header);
    let Some(names) = &names else { return Ok((None, "guessed")) };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    // Lines that the user passes over need not be names.
    if settings.header_lines.is_some() && !have_position(&names) {
        return Ok((None, "guessed"));
    }
    // Columns of text are left out before names are put together: what lacks a component is no whole column.
    let numbers = names.iter().zip(&cut.numeric);
    let names: Vec<&str> =
        numbers.map(|(name, &is_numeric)| if is_numeric { *name } else { "-" }).collect();
    let typed = targets(&names).into_iter().map(|target| (target, None)).collect();
    Ok((Some(typed), "by their names"))
}

/// The names in a header: the last that name the coordinates, or else the last.
fn names_of(cut: &Cut, header: &[&Numbered<'_>]) -> Option<Vec<String>> {
    let all: Vec<Vec<String>> =
        header.iter().rev().filter_map(|line| header_names(cut, line.text)).collect();
    let clear = all.iter().find(|names| {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        have_position(&names)
    });
    clear.or(all.first()).cloned()
}

/// The names in a line of a header, where there are as many as columns. Comments, and lines that are cut in
/// another way than the numbers, must name the coordinates.
fn header_names(cut: &Cut, line: &[u8]) -> Option<Vec<String>> {
    let comment = is_comment(line);
    let line = String::from_utf8_lossy(line);
    let line = line.trim_matches(|c: char| c.is_whitespace() || "#%/".contains(c));
    let all = std::iter::once(cut.delimiter).chain(Delimiter::ALL);
    all.enumerate().find_map(|(i, delimiter)| {
        let mut words = delimiter.split(line.as_bytes());
        if words.len() == cut.numeric.len() + 1 && words.last().is_some_and(|w| w.is_empty()) {
            words.pop();
        }
        // One word that is no number may be damage.
        let n_names = words.iter().filter(|word| number(word, cut.decimal).is_none()).count();
        let are_names = n_names * 2 >= words.len();
        let names: Vec<String> =
            words.iter().map(|word| String::from_utf8_lossy(word).into_owned()).collect();
        let all: Vec<&str> = names.iter().map(String::as_str).collect();
        let clear = (!comment && i == 0) || have_position(&all);
        (names.len() == cut.numeric.len() && are_names && clear).then_some(names)
    })
}

fn check_position(found: &Found, header: &[&Numbered<'_>]) -> Result<()> {
    let position = found.typed.iter().flat_map(|(target, _)| target);
    if position.filter(|target| target.column == POSITION).count() == 3 {
        return Ok(());
    }
    let names = names_of(&found.cut, header);
    let names = names.map_or_else(|| found.names(), |names| names.join(","));
    Err(Error::new(format!(
        "expected columns of numbers named x, y and z, found {}; name them with --text-columns",
        quoted(names.as_bytes())
    )))
}

/// A table that has names but no lines yet.
fn without_lines(
    sample: &Sample,
    lines: &[Numbered<'_>],
    delimiters: &[Delimiter],
) -> Option<Found> {
    if !sample.is_all {
        return None;
    }
    let last = lines.iter().rfind(|line| !line.text.trim_ascii().is_empty())?;
    let text = String::from_utf8_lossy(last.text);
    let text = text.trim_matches(|c: char| c.is_whitespace() || "#%/".contains(c));
    let (delimiter, names) = delimiters.iter().find_map(|&delimiter| {
        let words = delimiter.split(text.as_bytes());
        let names = words.iter().map(|word| std::str::from_utf8(word).ok());
        let names: Vec<&str> = names.collect::<Option<_>>()?;
        (have_position(&names) && names.len() <= MOST_COLUMNS).then_some((delimiter, names))
    })?;
    let cut = Cut { delimiter, decimal: b'.', numeric: vec![true; names.len()] };
    let typed: Vec<Typed> = targets(&names).into_iter().map(|target| (target, None)).collect();
    let numbers = Numbers::new(names.len());
    let (start, line) = (sample.place(sample.head.len()), last.number + 1);
    let (comments, left_out) = Default::default();
    let mut found =
        Found { cut, typed, numbers, start, line, note: String::new(), comments, left_out };
    found.note = note(&found, "by their names", 1);
    Some(found)
}

/// What is found, for people.
fn note(found: &Found, source: &str, n_header: usize) -> String {
    let mut note =
        format!("columns {} {source}; separated by {}", found.names(), found.cut.delimiter.words());
    if found.cut.decimal == b',' {
        note += "; decimal commas";
    }
    match n_header {
        0 => {}
        1 => note += "; one header line",
        n => note += &format!("; {n} header lines"),
    }
    note
}

/// Says of each column of words that it is left out.
fn words_left_out<'a>(
    cut: &Cut,
    header: &[&Numbered<'_>],
    mut data: impl Iterator<Item = &'a [u8]>,
) -> Vec<String> {
    /// Most columns that are named.
    const MOST: usize = 8;
    let words = data.find(|line| cut.fits(line)).and_then(|line| cut.words(line));
    let names = names_of(cut, header).unwrap_or_default();
    let of_words = (0..cut.numeric.len()).filter(|&i| !cut.numeric[i]);
    let line = |i: usize| {
        let name = names.get(i).map_or_else(String::new, |name| quoted(name.as_bytes()) + " ");
        let word = words.as_ref().and_then(|words| words.get(i));
        let word = word
            .map_or_else(|| "words".to_owned(), |word| format!("words such as {}", quoted(word)));
        format!(
            "column {} {name}is left out: expected numbers, found {word}; write a number for each word to have it as classes",
            i + 1
        )
    };
    of_words.map(line).take(MOST).collect()
}

/// The comments among the lines of a header.
fn comments(header: &[&Numbered<'_>]) -> Vec<String> {
    let comments = header.iter().filter(|line| is_comment(line.text)).map(|line| {
        let text = String::from_utf8_lossy(line.text);
        let text = text.trim_matches(|c: char| c.is_whitespace() || "#%/".contains(c));
        let printable = text.chars().map(|c| if c.is_control() { ' ' } else { c });
        printable.take(MOST_COMMENT).collect::<String>()
    });
    comments.filter(|comment| !comment.is_empty()).take(MOST_COMMENTS).collect()
}
