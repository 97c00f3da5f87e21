//! Reports of tools: errors of the values of a column that they make.

use super::cells::{Cell, ResultsFile};
use super::knobs::knobs;
use super::page::{Swept, Time};
use super::parted::{self, Known, Whole};
use super::subject::Subject;
use super::{Bench, Stamp, stamp, stamps_of, stamps_of_values, sweep, told};
use crate::compare::random;
use crate::report::ReportArguments;
use anyhow::{Context as _, anyhow, bail};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use surfelshop_api::UnitKind;
use surfelshop_api::params::Values;
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_image::metrics::compare_values;
use surfelshop_runtime::plugins::{Registry, UnitRef};
use surfelshop_runtime::tools::{Done, ToolOptions};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::pyramids;
use surfelshop_session::options::values::Setting;
use surfelshop_session::output::part_file::PartStart;
use surfelshop_session::timing::Run;
use surfelshop_session::tool_run::{self, Step};
use surfelshop_session::{parameters, session};

/// Nobody stops these runs but by ending the program: what was measured is on the disk.
static NEVER: AtomicBool = AtomicBool::new(false);

/// Makes the report.
pub(super) fn report(
    arguments: &ReportArguments,
    registry: &Registry,
    unit: &UnitRef,
) -> anyhow::Result<()> {
    let [file] = &arguments.files[..] else {
        bail!("a tool works on one cloud, found {} files", arguments.files.len());
    };
    let tool = Subject::load(unit, &arguments.plugins.patience())?;
    let knobs = knobs(&arguments.knob, unit, tool.declared())?;
    let judge = judge(arguments, registry, &tool)?;
    let source = tool_run::source(file)?;
    let started = PartStart::now();
    parted::folder(arguments)?;
    let mut files = stamps_of(&arguments.files, std::slice::from_ref(&source))?;
    let values = values_of(&tool, &arguments.set)?;
    files.extend(stamps_of_values(tool.declared(), &values)?);
    let mut units = vec![tool.stamp()?];
    let mut note = None;
    match &judge {
        ColumnError::Cloud(path) => files.push(stamp(Path::new(path))?),
        ColumnError::Tool(judge) => {
            let of_judge = values_of(judge, &arguments.reference_set)?;
            files.extend(stamps_of_values(judge.declared(), &of_judge)?);
            units.push(judge.stamp()?);
            if let Some(again) = &arguments.reference_again {
                check_again(judge, &of_judge, again)?;
            }
            note = random_note([(&tool, &values), (judge, &of_judge)]);
        }
    }
    let cloud = read(source, arguments)?;
    let n_threads = match arguments.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let device = format!("{n_threads} threads");
    let known = Known::open(arguments, &device, |device| key(arguments, &units, &files, device))?;
    let mut bench = Tools { arguments, tool: &tool, cloud: &cloud, column: None, truth: None };
    let truth = bench.make_truth(&judge, known.reference())?;
    let name = truth.name.clone();
    bench.truth = Some(truth);
    let plan = Whole::plan(&knobs);
    let mut all = Vec::new();
    for knob in &parted::own(arguments.part, knobs) {
        all.push((knob.id.clone(), sweep(&mut bench, knob, arguments, &known.cells)?));
    }
    let column = bench.column.clone().unwrap_or_default();
    let swept = Swept {
        unit: unit.into(),
        what: format!("{} surfels, column {column}", cloud.len()),
        truth: name,
        device,
        error: format!("RMSE of {column}"),
        time: Time::Tools,
        note,
        all,
    };
    let options = key(arguments, &[], &[], "")?;
    let whole = Whole { arguments, options, files: &files, units: &units, plan, started };
    told(whole, &known, swept)
}

fn values_of(tool: &Subject, typed: &[Setting]) -> anyhow::Result<Values> {
    parameters::values(&tool.reference, tool.declared(), typed)
}

/// Refuses to make a reference twice alike.
fn check_again(judge: &Subject, values: &Values, again: &Setting) -> anyhow::Result<()> {
    let Setting { id, value, .. } = again;
    let changed = values_of(judge, std::slice::from_ref(again))?;
    let declared = judge.declared().iter().find(|declared| declared.id == *id);
    let before = declared.map(|declared| declared.sanitise(values.get(id)));
    match changed.get(id) == before.as_ref() {
        true => bail!(
            "--reference-again {id}={value}: the reference has that value already, and would be made \
             twice alike"
        ),
        false => Ok(()),
    }
}

/// What is to be known of a tool that is measured against itself with the same random numbers.
fn random_note(both: [(&Subject, &Values); 2]) -> Option<String> {
    let [ours, theirs] = both.map(|(tool, values)| tool.seed(values));
    let is_same = both[0].0.reference == both[1].0.reference;
    (is_same && ours.is_some() && ours == theirs).then(|| {
        format!(
            "Both have the same seed: where random numbers decide, errors are shown too small; \
             --reference-set {}=1 takes others.",
            random::SEED
        )
    })
}

/// What makes the reference.
enum ColumnError {
    Tool(Box<Subject>),
    /// A cloud that has the column.
    Cloud(String),
}

fn judge(
    arguments: &ReportArguments,
    registry: &Registry,
    tool: &Subject,
) -> anyhow::Result<ColumnError> {
    let Some(name) = &arguments.reference else {
        return Ok(ColumnError::Tool(Box::new(tool.clone())));
    };
    if Path::new(name).is_file() {
        return Ok(ColumnError::Cloud(name.clone()));
    }
    let reference = registry.find(UnitKind::Tool, name)?;
    Subject::load(&reference, &arguments.plugins.patience())
        .map(|tool| ColumnError::Tool(Box::new(tool)))
}

fn read(
    source: surfelshop_session::input::scenes::Source,
    arguments: &ReportArguments,
) -> anyhow::Result<Cloud> {
    let clouds = Clouds::read(&[source], &SessionFormats::new(&arguments.plugins))?;
    pyramids::refuse(&clouds, "report -t")?;
    let loaded = clouds.loaded.first().ok_or_else(|| anyhow!("no cloud was read"))?;
    Ok(loaded.cloud.clone())
}

/// Everything that the numbers depend on besides the values of a knob.
fn key(
    arguments: &ReportArguments,
    units: &[(String, Stamp)],
    files: &[Stamp],
    device: &str,
) -> anyhow::Result<String> {
    let written = |settings: &mut dyn Iterator<Item = &Setting>| -> Vec<String> {
        settings.map(|setting| format!("{setting:?}")).collect()
    };
    Ok(serde_json::to_string(&(
        (units, files, &arguments.column, arguments.threads, arguments.part.map(|_| device)),
        written(&mut arguments.set.iter()),
        written(&mut arguments.reference_set.iter()),
        written(&mut arguments.reference_again.iter()),
        env!("CARGO_PKG_VERSION"),
    ))?)
}

/// What values are measured against.
struct Truth {
    name: String,
    values: Vec<f64>,
    /// Its own mean squared error, where it is known.
    noise_mse: f64,
}

/// A tool with a knob at several values.
struct Tools<'a> {
    arguments: &'a ReportArguments,
    tool: &'a Subject,
    cloud: &'a Cloud,
    /// The column, once it is known.
    column: Option<String>,
    truth: Option<Truth>,
}

impl Tools<'_> {
    fn run(&self, tool: &Subject, typed: &[Setting]) -> anyhow::Result<(Done, Option<Duration>)> {
        let values = values_of(tool, typed)?;
        let Subject { reference, unit } = tool.clone();
        let step = Step { reference, unit, values };
        let options = ToolOptions {
            patience: self.arguments.plugins.patience(),
            threads: self.arguments.threads,
            device: session::gpu_options(&self.arguments.device).into(),
        };
        step.run(self.cloud, &options, &NEVER)
    }

    /// The values of the column in a cloud, as many as the cloud that was read has.
    fn values(&mut self, whose: &str, cloud: &Cloud, made: &[String]) -> anyhow::Result<Vec<f64>> {
        let is_measured = |name: &&String| cloud.column(name).is_some_and(|c| numbers(c).is_some());
        let wanted = self.arguments.column.clone().or_else(|| self.column.clone());
        let name = match wanted {
            Some(name) => name,
            None => made.iter().find(is_measured).cloned().ok_or_else(|| {
                anyhow!("{whose} made no column of numbers to measure; name one with --column")
            })?,
        };
        if cloud.len() != self.cloud.len() {
            bail!(
                "{whose} has {} surfels of {}: errors are measured surfel by surfel",
                cloud.len(),
                self.cloud.len()
            );
        }
        let columns = || cloud.columns().iter().map(Column::name).collect::<Vec<_>>().join(", ");
        let column = cloud
            .column(&name)
            .ok_or_else(|| anyhow!("{whose} has no column `{name}`; it has: {}", columns()))?;
        let values = numbers(column)
            .ok_or_else(|| anyhow!("the values of column `{name}` are no numbers to measure"))?;
        self.column = Some(name);
        Ok(values)
    }

    fn values_of_run(&mut self, tool: &Subject, done: &Done) -> anyhow::Result<Vec<f64>> {
        let unit = &tool.reference;
        let Some(edited) = &done.edited else { bail!("{unit} changed nothing") };
        self.values(&unit.to_string(), &edited.cloud, &edited.columns)
    }

    fn make_truth(&mut self, judge: &ColumnError, kept: &ResultsFile) -> anyhow::Result<Truth> {
        let tool = match judge {
            ColumnError::Tool(tool) => tool,
            ColumnError::Cloud(path) => {
                // Which column it is may only be known from what the tool makes.
                if self.arguments.column.is_none() {
                    let (done, _) = self.run(self.tool, &self.arguments.set)?;
                    self.values_of_run(self.tool, &done)?;
                }
                let cloud = read(tool_run::source(Path::new(path))?, self.arguments)?;
                let values = self.values(path, &cloud, &[])?;
                return Ok(Truth { name: path.clone(), values, noise_mse: 0.0 });
            }
        };
        let settings = &self.arguments.reference_set;
        let again = self.arguments.reference_again.as_ref();
        let told = settings.iter().map(|s| format!("{}={}", s.id, s.value)).collect::<Vec<_>>();
        let more = again.map(|s| format!("and {}={}", s.id, s.value)).unwrap_or_default();
        let name = format!("{} {} {more}", tool.reference.id, told.join(" ")).trim().to_owned();
        if let (Some(column), Some((noise_mse, values))) =
            (kept.column(), kept.true_values(self.cloud.len())?)
        {
            self.column = Some(column);
            return Ok(Truth { name, values, noise_mse });
        }
        let (done, _) = self.run(tool, settings)?;
        let mut values = self.values_of_run(tool, &done)?;
        let mut noise_mse = 0.0;
        if let Some(again) = again {
            let others = settings.iter().filter(|setting| setting.id != again.id).cloned();
            let (done, _) = self.run(tool, &others.chain([again.clone()]).collect::<Vec<_>>())?;
            let other = self.values_of_run(tool, &done)?;
            // Of two that err independently the mean has half the variance, and their difference
            // twice the variance.
            let apart = values.iter().zip(&other).map(|(a, b)| (a - b) * (a - b));
            noise_mse = apart.sum::<f64>() / (4 * values.len().max(1)) as f64;
            values.iter_mut().zip(&other).for_each(|(a, b)| *a = (*a + *b) / 2.0);
        }
        kept.put_true_values(self.column.as_deref().unwrap_or_default(), noise_mse, &values)?;
        Ok(Truth { name, values, noise_mse })
    }

    fn turned(&self, knob: &str, value: &str) -> Vec<Setting> {
        let turned = Setting { unit: None, id: knob.to_owned(), value: value.to_owned() };
        let settings = self.arguments.set.iter().filter(|setting| setting.id != knob);
        settings.cloned().chain([turned]).collect()
    }

    fn measured(&mut self, knob: &str, value: &str) -> anyhow::Result<Cell> {
        let (done, _) = self.run(self.tool, &self.turned(knob, value))?;
        let values = self.values_of_run(self.tool, &done)?;
        let truth = self.truth.as_ref().context("there is no reference")?;
        let errors = compare_values(&values, &truth.values, truth.noise_mse)
            .map_err(|error| anyhow!("{knob}={value}: {error}"))?;
        let first_ms = done.took.as_secs_f64() * 1e3;
        Ok(Cell { noise: errors.noise, ..Cell::new(knob, value, &errors.named(), first_ms) })
    }
}

impl Bench for Tools<'_> {
    fn first(&mut self, knob: &str, value: &str) -> Result<Cell, String> {
        self.measured(knob, value).map_err(|error| format!("{error:#}"))
    }

    fn again(&mut self, knob: &str, value: &str) -> Result<Run, String> {
        let ran = self.run(self.tool, &self.turned(knob, value));
        let (done, cpu) = ran.map_err(|error| format!("{error:#}"))?;
        Ok(Run {
            wall_ms: done.took.as_secs_f64() * 1e3,
            own_passes_ms: None,
            cpu_ms: cpu.map(|cpu| cpu.as_secs_f64() * 1e3),
        })
    }
}

/// A column's values, all components one after the other.
fn numbers(column: &Column) -> Option<Vec<f64>> {
    match column.values() {
        Buffer::F32(values) => Some(values.iter().map(|&value| f64::from(value)).collect()),
        Buffer::F64(values) => Some(values.to_vec()),
        Buffer::U8(values) => Some(values.iter().map(|&value| f64::from(value)).collect()),
        Buffer::U32(values) => Some(values.iter().map(|&value| f64::from(value)).collect()),
        _ => None,
    }
}
