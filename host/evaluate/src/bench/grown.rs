//! What was measured of growth, and what it says.

use super::cells::{Cell, Table};
use super::fit::exponent;
use super::plot::{self, Line};
use super::report::{self, Measured, Object};
use super::series::{Point, Series};
use super::variant::Variant;
use crate::bench::BenchArguments;
use crate::compare::put;
use serde_json::json;
use surfelshop_session::output::terminal;

/// Everything measured so far.
#[derive(Default)]
pub(super) struct Grown {
    pub(super) measured: Measured,
    /// Where each cell was measured.
    points: Vec<Point>,
}

/// Growth of a variant in a series.
struct Curve<'a> {
    series: Series,
    what: &'a str,
    variant: &'a str,
    is_frame: bool,
    cells: Vec<(f64, &'a Cell)>,
}

impl Curve<'_> {
    fn points(&self, of: fn(&Cell) -> Option<f64>) -> Vec<(f64, f64)> {
        self.cells.iter().filter_map(|(x, cell)| Some((*x, of(cell)?))).collect()
    }
}

impl Grown {
    /// Whether nothing was measured.
    pub(super) fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Adds what was measured in a place.
    pub(super) fn add(&mut self, point: &Point, cells: Vec<Cell>) {
        self.measured.cells.extend(cells);
        self.points.resize(self.measured.cells.len(), *point);
    }

    /// Each variant's growth, frames and surfels apart, in the order of the series.
    fn curves(&self) -> Vec<Curve<'_>> {
        let mut all = Vec::<Curve<'_>>::new();
        for (point, cell) in self.points.iter().zip(&self.measured.cells) {
            let (series, what, variant) = (point.series, &*cell.what, &*cell.timed.variant);
            let is_it = |c: &Curve<'_>| (c.series, c.what, c.variant) == (series, what, variant);
            match all.iter_mut().find(|curve| is_it(curve)) {
                Some(curve) => curve.cells.push((point.x(), cell)),
                None => {
                    let cells = vec![(point.x(), cell)];
                    let is_frame = cell.is_frame;
                    all.push(Curve { series, what, variant, is_frame, cells });
                }
            }
        }
        all
    }

    /// The powers that times grow with.
    fn fits(&self) -> Table {
        let head = ["series", "drawn", "variant", "wall exponent", "CPU exponent"];
        let row = |curve: &Curve<'_>| {
            let [wall, cpu] = [Cell::wall_ms, Cell::cpu_ms].map(|of| exponent(&curve.points(of)));
            let Curve { series, what, variant, .. } = curve;
            vec![json!(series.name()), json!(what), json!(variant), json!(wall), json!(cpu)]
        };
        let head = head.map(str::to_owned).to_vec();
        Table { head, rows: self.curves().iter().map(row).collect() }
    }

    /// The plot of a series.
    fn plot(&self, series: Series, variants: &[Variant]) -> anyhow::Result<Option<String>> {
        let curves = self.curves();
        let line = |curve: &Curve<'_>| Line {
            name: format!("{}, {}", curve.what, curve.variant),
            variant: variants.iter().position(|one| one.name == curve.variant).unwrap_or(0),
            is_frame: curve.is_frame,
            points: curve.points(Cell::wall_ms),
        };
        let lines = curves.iter().filter(|curve| curve.series == series).map(line);
        let title = format!("How time grows with {}", series.name());
        plot::svg(&title, series.across(), &lines.collect::<Vec<_>>())
    }

    /// Writes all files and prints.
    pub(super) fn tell(
        &self,
        arguments: &BenchArguments,
        variants: &[Variant],
        mut object: Object,
    ) -> anyhow::Result<()> {
        self.measured.add_to(&mut object);
        let fits = self.fits();
        object
            .insert("fits".to_owned(), fits.objects(&["series", "what", "variant", "wall", "cpu"]));
        self.measured.write(arguments, "growth", &object)?;
        if let Some(folder) = &arguments.out {
            put(folder, "fits.csv", fits.csv().as_bytes())?;
            for series in Series::ALL {
                if let Some(svg) = self.plot(series, variants)? {
                    put(folder, &format!("{}.svg", series.name()), svg.as_bytes())?;
                }
            }
        }
        if arguments.report.json {
            return terminal::json(&object);
        }
        terminal::line(report::place(&object))?;
        self.measured.print()?;
        let caption = "Time grows as what grows to the power of (last points of each series):";
        terminal::line(format!("\n{caption}\n{}", fits.text()))
    }
}
