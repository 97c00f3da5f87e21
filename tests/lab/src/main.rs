//! Measuring programs: the figures of the manual's pages of evidence.

#![allow(clippy::unwrap_used, reason = "a measurement that cannot go on ends")]
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "figures are what these programs are for"
)]

mod agreement;
mod ambient_occlusion;
mod boundary;
mod contact_sheet;
mod farm;
mod fuzz;
mod gi;
mod leaving_out;
mod many;
mod natural_light;
mod precision;
mod procedural;
mod reading;
mod shading_speed;
mod splat_edges;
mod splat_pictures;
mod splats;
mod surface;
mod window;

type Run = fn() -> anyhow::Result<()>;

const PROGRAMS: [(&str, Run); 22] = [
    ("agreement", agreement::run),
    ("ambient_occlusion", ambient_occlusion::run),
    ("boundary", boundary::run),
    ("contact_sheet", contact_sheet::run),
    ("farm", farm::run),
    ("fuzz", fuzz::run),
    ("gi_error", gi::error::run),
    ("gi_maps", gi::maps::run),
    ("gi_times", gi::times::run),
    ("leaving_out", leaving_out::run),
    ("many", many::run),
    ("natural_light", natural_light::run),
    ("precision", precision::run),
    ("procedural", procedural::run),
    ("reading", reading::run),
    ("shading_speed", shading_speed::run),
    ("splat_edges", splat_edges::run),
    ("splat_pictures", splat_pictures::run),
    ("splats", splats::run),
    ("surface", surface::run),
    ("ways", boundary::ways::run),
    ("window", window::run),
];

fn main() -> anyhow::Result<()> {
    let name = std::env::args().nth(1).unwrap_or_default();
    match PROGRAMS.iter().find(|(known, _)| *known == name) {
        Some((_, run)) => run(),
        None => {
            let names: Vec<&str> = PROGRAMS.iter().map(|(known, _)| *known).collect();
            anyhow::bail!("expected one of {}, found `{name}`", names.join(", "))
        }
    }
}
