//! The pages: one for each paper, the table of all entries, and how techniques were checked.

mod checked;
mod code;
mod entry;
mod html;
mod pictures;
mod tables;

use crate::PapersArguments;
use crate::entries::Paper;
use crate::outcome::Made;
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
    put("tables.md", tables::markdown(made)?)?;
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
    writeln!(
        body,
        "<p>Commands can be typed in any folder, and write into it. Of those beside an entry, later ones take what \
         earlier ones wrote.</p>"
    )?;
    effects(&mut body, entries)?;
    for made in entries {
        entry::write(&mut body, made, pictures)?;
    }
    Ok(whole(&paper.title, &body))
}

/// The table of what errata do, where there are any.
fn effects(body: &mut String, entries: &[Made<'_>]) -> std::fmt::Result {
    if entries.iter().all(|made| made.effect.is_none()) {
        return Ok(());
    }
    writeln!(
        body,
        "<details open><summary>All effects</summary><p>{}</p><p>On the screen: root of the mean squared difference of \
         the two pictures over what they draw, in percent of white. Errors are against the truth; what they are of is \
         beside them.</p><div class=\"wide\"><table><tr>",
        text(&tables::extremes(entries))
    )?;
    let class = |name: &str| if matches!(name, "what" | "of") { " class=\"words\"" } else { "" };
    for name in tables::EFFECT {
        write!(body, "<th{}>{name}</th>", class(name))?;
    }
    writeln!(body, "</tr>")?;
    for made in entries {
        let row = tables::effect(made);
        let id =
            format!("<a href=\"#{}\">{}</a>", attribute(&entry::anchor(&row[0])), text(&row[0]));
        write!(body, "<tr><td>{id}</td>")?;
        for (name, cell) in tables::EFFECT.iter().zip(&row).skip(1) {
            write!(body, "<td{}>{}</td>", class(name), marked(cell))?;
        }
        writeln!(body, "</tr>")?;
    }
    writeln!(body, "</table></div></details>")
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
        writeln!(
            body,
            "<h2><a href=\"{0}.html\">{1}</a></h2><p>{2}</p><div class=\"wide\"><table><tr><th></th><th class=\"words\">where</th>\
             <th class=\"words\">what</th><th class=\"words\">state</th><th class=\"words\">why</th></tr>",
            attribute(&paper.id),
            text(&paper.title),
            tables::counted(entries)
        )?;
        for made in entries {
            let [word, why] = tables::state(made);
            writeln!(
                body,
                "<tr><td><a href=\"{}.html#{}\">{}</a></td><td class=\"words\">{}</td><td class=\"words\">{}</td>\
                 <td class=\"words short\">{word}</td><td class=\"words\">{}</td></tr>",
                attribute(&paper.id),
                attribute(&entry::anchor(&made.entry.id)),
                text(&made.entry.id),
                text(&made.entry.at),
                marked(&made.entry.shows),
                marked(&why)
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
