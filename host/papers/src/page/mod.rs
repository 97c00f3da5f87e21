//! The pages: one for each paper, the table of all entries, and how techniques were checked.

mod checked;
mod entry;
mod html;
mod pictures;

use crate::PapersArguments;
use crate::entries::Paper;
use crate::outcome::{Made, State};
use html::{attribute, marked, text};
use pictures::Pictures;
use std::fmt::Write as _;
use surfelshop_session::output::{command_line, files};

const TEMPLATE: &str = include_str!("page.html");

/// Writes all pages and says where they are.
pub(crate) fn write(
    arguments: &PapersArguments,
    made: &[(&Paper, Vec<Made<'_>>)],
) -> anyhow::Result<Vec<String>> {
    let mut written = Vec::new();
    let mut put = |name: &str, page: String| -> anyhow::Result<()> {
        let path = arguments.folder().join(name);
        files::write_whole(&path, page.as_bytes())?;
        written.push(path.display().to_string());
        Ok(())
    };
    for (paper, entries) in made {
        let pictures = Pictures::read(entries)?;
        put(&format!("{}.html", paper.id), of_paper(paper, entries, &pictures)?)?;
    }
    put("checked.html", whole("How this was checked", &checked::body()?))?;
    put("index.html", whole("The papers, made again", &contents(arguments, made)?))?;
    Ok(written)
}

/// A page with a title around its body.
fn whole(title: &str, body: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    TEMPLATE
        .replace("TITLE", &text(title))
        .replace("VERSION", version)
        // Last, so that nothing in it is replaced.
        .replacen("BODY", body, 1)
}

fn of_paper(
    paper: &Paper,
    entries: &[Made<'_>],
    pictures: &Pictures,
) -> Result<String, std::fmt::Error> {
    let mut body = String::new();
    writeln!(body, "<p>{}</p>", text(&paper.source))?;
    for note in &paper.notes {
        writeln!(body, "<p>{}</p>", marked(note))?;
    }
    if pictures.are_smaller() {
        writeln!(body, "<p>Pictures on this page are smaller than they were drawn.</p>")?;
    }
    let links = [
        "index.html",
        "thesis.html",
        "phong-splatting.html",
        "point-gi.html",
        "errata.html",
        "checked.html",
    ];
    let link = |name: &&str| format!("<a href=\"{name}\">{}</a>", name.trim_end_matches(".html"));
    writeln!(body, "<p>{}</p>", links.iter().map(link).collect::<Vec<_>>().join(" · "))?;
    for made in entries {
        entry::write(&mut body, made, pictures)?;
    }
    Ok(whole(&paper.title, &body))
}

/// The table of all entries.
fn contents(
    arguments: &PapersArguments,
    made: &[(&Paper, Vec<Made<'_>>)],
) -> Result<String, std::fmt::Error> {
    let mut body = String::new();
    let size = arguments.size;
    writeln!(
        body,
        "<p>The figures, tables and errata of three papers, made by <code>{}</code>: pictures of {size} x {size} \
         pixels, {} paths a pixel in those that others are measured against. <a href=\"checked.html\">How the \
         techniques were checked.</a></p>",
        text(&command_line::typed()),
        arguments.samples
    )?;
    for (paper, entries) in made {
        let state = |made: &Made<'_>| made.outcome.as_ref().map(|outcome| outcome.state).ok();
        let count = |wanted| entries.iter().filter(|made| state(made) == Some(wanted)).count();
        let [n_made, n_stood_in, n_not] =
            [State::Made, State::StoodIn, State::Impossible].map(count);
        let n_failed = entries.len() - n_made - n_stood_in - n_not;
        writeln!(
            body,
            "<h2><a href=\"{0}.html\">{1}</a></h2><p>{2} entries: {n_made} made, {n_stood_in} with something that \
             stands in, {n_not} not made{3}.</p><div class=\"wide\"><table><tr><th></th><th>where</th><th>what</th>\
             <th>state</th><th>why</th></tr>",
            attribute(&paper.id),
            text(&paper.title),
            entries.len(),
            if n_failed > 0 { format!(", {n_failed} failed") } else { String::new() }
        )?;
        for made in entries {
            let (word, why) = match &made.outcome {
                Ok(outcome) => (outcome.state.word(), entry::why(made.entry, outcome)),
                Err(line) => ("failed", line.clone()),
            };
            writeln!(
                body,
                "<tr><td><a href=\"{}.html#{}\">{}</a></td><td>{}</td><td>{}</td><td>{word}</td><td>{}</td></tr>",
                attribute(&paper.id),
                attribute(&entry::anchor(&made.entry.id)),
                text(&made.entry.id),
                text(&made.entry.at),
                text(&made.entry.shows),
                text(&why)
            )?;
        }
        writeln!(body, "</table></div>")?;
    }
    Ok(body)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_in_a_page_steers_nothing_and_asks_for_nothing() {
        let page = whole("<b>", &text("</p><script>alert(1)</script> TITLE VERSION BODY"));
        assert!(!page.contains("<script>alert"));
        assert!(page.contains("TITLE VERSION BODY"), "a body stays as it is");
        for remote in ["http://", "https://", "@import", "url("] {
            assert!(!page.contains(remote), "{remote}");
        }
    }
}
