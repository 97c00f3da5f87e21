//! Frames of files, once around what the camera looks at.

use super::cells::{Cell, Of, cells};
use super::memory::memory;
use super::report::{self, Measured, Object};
use super::split::split;
use super::timing::{What, timed};
use super::variant::{LeftOut, Variant, base, open};
use super::{files, renderers};
use crate::bench::BenchArguments;
use crate::compare::{Stage, requests};
use serde_json::json;
use std::path::Path;
use std::time::Duration;
use surfelshop_api::View;
use surfelshop_runtime::plugins::Registry;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::options::values::Size;
use surfelshop_session::output::json;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::render::camera_path::orbit;
use surfelshop_session::setup::{self, RenderSetup};
use surfelshop_session::{render, session};

/// Frames of a turn where none are typed.
const FRAMES: u32 = 12;

/// Everything measured so far.
struct Session<'a> {
    arguments: &'a BenchArguments,
    given: &'a ExplicitOptions,
    registry: &'a Registry,
    variants: &'a [Variant],
    measured: Measured,
    left_out: LeftOut,
    /// What every benchmark says, with the device of the last file.
    object: Object,
}

/// Measures frames and surfels alone.
pub(super) fn run(arguments: &BenchArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    let registry = session::registry(&arguments.plugins)?;
    let variants = Variant::all(&arguments.strategies(given), &arguments.details());
    let mut session = Session {
        arguments,
        given,
        registry: &registry,
        variants: &variants,
        measured: Measured::default(),
        left_out: LeftOut::default(),
        object: Object::new(),
    };
    for (name, file) in files(arguments)? {
        match session.file(&name, &file) {
            // What was measured of others is worth telling.
            Err(error) if !session.measured.cells.is_empty() => {
                terminal::note(format!("{name} is left out: {error:#}"));
            }
            measured => measured?,
        }
    }
    let Session { measured, mut object, .. } = session;
    measured.add_to(&mut object);
    measured.write(arguments, "bench", &object)?;
    if arguments.report.json {
        return terminal::json(&object);
    }
    terminal::line(report::place(&object))?;
    measured.print()
}

impl Session<'_> {
    fn file(&mut self, name: &str, file: &Path) -> anyhow::Result<()> {
        let arguments = self.arguments;
        let inputs = Inputs::open(&[file.to_owned()])?;
        let opened = inputs.opened.as_ref();
        let seen = setup::first_view(opened);
        let picture = |size| arguments.picture(size);
        // Nothing of it depends on the size.
        let staging = RenderSetup::new(&picture(Size([1, 1]))?, self.given, opened, seen.as_ref())?;
        let mut staging = without_antialiasing(name, staging);
        let named = renderers(arguments, self.registry)?;
        let patience = arguments.plugins.patience();
        let mut all = requests::with_settings(named, &arguments.set, opened, &patience)?;
        let formats = SessionFormats::new(&arguments.plugins);
        let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
        let clouds = &displayed.clouds;
        let infos = &clouds.facts.clouds;
        requests::draw_beside(&mut all, self.registry, &inputs.sources, infos)?;
        let mut contestants = open(arguments, self.variants, &mut self.left_out)?;
        let extent = clouds.extent(staging.scene.surface.radius_scale);
        let n = arguments.frames.unwrap_or(FRAMES);
        let progress = Progress::new(format!("measuring {name}"));
        // What surfels alone take comes last: the first frame of a renderer has everything to make.
        let whats = || all.iter().map(What::Frame).chain([What::Surfels]);
        let n_steps = (arguments.sizes.len() * whats().count()) as f64;
        for (i, &size) in arguments.sizes.iter().enumerate() {
            let view = render::view(&picture(size)?, &staging, clouds);
            let views: Vec<View> = match arguments.still {
                true => vec![view; n as usize],
                false => orbit(&view, &extent, n).collect(),
            };
            for (j, what) in whats().enumerate() {
                let plugins = &arguments.plugins;
                let staging = &staging;
                let surroundings = surroundings.as_ref();
                let stage = Stage { plugins, staging, clouds, surroundings, view };
                let all = timed(
                    &mut contestants,
                    what,
                    &stage,
                    &views,
                    Duration::MAX,
                    &mut self.left_out,
                )?;
                let of = of(name, clouds, size);
                let cells = cells(&of, what, all, &base(self.variants));
                if arguments.split {
                    let left_out = &mut self.left_out;
                    let mut splits = split(&mut contestants, what, &stage, &views, &of, left_out);
                    for split in &mut splits {
                        let whole = cells.iter().find(|one| one.timed.variant == split.variant());
                        split.whole_ms = whole.and_then(Cell::cpu_ms);
                    }
                    self.measured.splits.extend(splits);
                }
                self.measured.cells.extend(cells);
                let done = (i * whats().count() + j + 1) as f64 / n_steps;
                // Ctrl-C ends the program.
                let _goes_on = progress.tell(done);
            }
        }
        self.measured.memory.extend(memory(name, clouds, &contestants));
        let adapter = contestants.first().map(|one| json::adapter(&one.studio));
        self.object = report::object("frames", adapter, &base(self.variants), &self.left_out);
        Ok(())
    }
}

/// What is timed is a frame; says of how many the scene has each picture made.
fn without_antialiasing(name: &str, staging: RenderSetup) -> RenderSetup {
    let n = staging.antialias;
    if n > 1 {
        terminal::note(format!(
            "{name}: its pictures are antialiased and take {n} times a frame's time, which is what is measured"
        ));
    }
    RenderSetup { antialias: 1, ..staging }
}

fn of(name: &str, clouds: &Clouds, Size([width, height]): Size) -> Of {
    vec![
        ("file", json!(name)),
        ("surfels", json!(clouds.facts.n_surfels)),
        ("size", json!(format!("{width}x{height}"))),
    ]
}
