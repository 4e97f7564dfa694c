//! `lapwing fit-sensor`: the nonlinear response from measured pairs.

use anyhow::{Context, Result, bail};
use chart::{Axis, Color, Figure, Mark, Panel, Shape, Style};
use diagnose::{Estimate, ResponseFit};
use serde_json::{Value, json};

use crate::args::FitSensor;
use crate::config::nearest;
use crate::dataset::CsvFile;
use crate::figures::single;
use crate::output::{Input, OutDir, Work};
use crate::session::Session;
use crate::table::Table;

/// No infra-red sensor of a robot sees a wall from here: larger distances are in another unit, or are readings.
const FARTHEST_M: f64 = 10.0;
/// Few see one from here.
const FAR_M: f64 = 1.0;

pub(crate) fn run(session: &Session, args: &FitSensor) -> Result<()> {
    let (pairs, names, input) = read(args)?;
    let fit = ResponseFit::new(&pairs).with_context(|| args.pairs.display().to_string())?;
    let farthest_m = fit.pairs.iter().map(|p| p[0]).fold(0.0, f64::max);
    if farthest_m > FAR_M {
        session.remark(&format!(
            "{}: distances up to {farthest_m} m are taken to be in m; few infra-red sensors see so far",
            args.pairs.display()
        ));
    }
    if let Some(out) = &args.out {
        let configuration = json!({ "pairs": args.pairs, "columns": names });
        let out = OutDir::create(
            out,
            &Work::new("fit-sensor", &configuration),
            std::slice::from_ref(&input),
            false,
        )?;
        out.write("fit.json", format!("{:#}\n", document(&fit)))?;
        out.write("response.svg", figure(&fit, &names).to_svg()?)?;
        out.finish(&session.manifest(configuration, vec![input]))?;
    }
    if args.json {
        session.print_json(&document(&fit))
    } else {
        session.print(&text(&fit))
    }
}

/// The pairs, the names of their columns, and the file.
fn read(args: &FitSensor) -> Result<(Vec<[f64; 2]>, [String; 2], Input)> {
    let mut file = CsvFile::open(&args.pairs)?;
    file.check_names()?;
    let columns = match args.columns.as_deref() {
        None if file.header.len() < 2 => {
            return Err(file.header_error("two columns are needed: distance in m, and reading"));
        }
        None => [0, 1],
        Some([distance, reading]) => [distance, reading]
            .map(|name| file.column(name).ok_or(name))
            .map_ok(&file)?,
        Some(other) => bail!(
            "--columns needs two names, distance and reading; {} given",
            other.len()
        ),
    };
    let names = columns.map(|i| file.header[i].clone());
    let mut pairs = Vec::new();
    while let Some(row) = file.next_row()? {
        let pair = [row.required(columns[0])?, row.required(columns[1])?];
        if pair[0] < 0.0 {
            return Err(row.field_error(
                columns[0],
                format!("{} m is no distance; it must not be negative", pair[0]),
            ));
        }
        if pair[0] > FARTHEST_M {
            let mend = "give distances in m, in the first column or in the one that --columns names first";
            return Err(row.field_error(
                columns[0],
                format!("at {} m an infra-red sensor sees no wall; {mend}", pair[0]),
            ));
        }
        pairs.push(pair);
    }
    Ok((pairs, names, file.input))
}

/// Both columns, or the error that names the nearest.
trait MapOk {
    fn map_ok(self, file: &CsvFile) -> Result<[usize; 2]>;
}

impl MapOk for [Result<usize, &String>; 2] {
    fn map_ok(self, file: &CsvFile) -> Result<[usize; 2]> {
        let missing = |name: &String| {
            let near = nearest(name, file.header.iter().map(String::as_str)).join(", ");
            file.header_error(format!("column {name} is missing; nearest: {near}"))
        };
        let [distance, reading] = self;
        Ok([distance.map_err(missing)?, reading.map_err(missing)?])
    }
}

fn estimate(estimate: &Estimate, unit: &str) -> Value {
    json!({
        "value": estimate.value, "standard_error": estimate.standard_error, "unit": unit,
        "low": estimate.value - estimate.half_width_95, "high": estimate.value + estimate.half_width_95,
    })
}

fn document(fit: &ResponseFit) -> Value {
    json!({
        "model": "reading = a / (1 + (d/d0)^p)",
        "a_counts": estimate(&fit.a_counts, "counts"),
        "d0_m": estimate(&fit.d0_m, "m"),
        "exponent": estimate(&fit.exponent, ""),
        "pairs": fit.pairs.len(),
        "set_aside": fit.set_aside,
        "residual_log": fit.residual_log,
        "leave_one_out_relative_error": fit.leave_one_out_relative_error(),
    })
}

fn text(fit: &ResponseFit) -> String {
    let mut table = Table::new(
        "reading = a / (1 + (d/d0)^p), least squares on log reading",
        &["parameter", "value", "standard error", "95 % interval"],
    );
    let rows = [
        ("a, counts", &fit.a_counts, 1.0, 2),
        ("d0, mm", &fit.d0_m, 1000.0, 5),
        ("p", &fit.exponent, 1.0, 5),
    ];
    for (name, e, scale, digits) in rows {
        let (value, error, half) = (scale * e.value, scale * e.standard_error, scale * e.half_width_95);
        table.push([
            name.to_owned(),
            format!("{value:.digits$}"),
            format!("{error:.digits$}"),
            format!("{:.digits$} .. {:.digits$}", value - half, value + half),
        ]);
    }
    let mut text = table.to_text();
    text += &format!(
        "\n{} pairs; a reading departs from the fit by {:.1} % (one standard deviation),\nand from a fit to the other pairs by {:.1} % (root mean square, leaving one out)\n",
        fit.pairs.len(),
        100.0 * fit.residual_log,
        100.0 * fit.leave_one_out_relative_error(),
    );
    if fit.set_aside > 0 {
        text += &format!(
            "{} pairs with readings of 0 or less have no logarithm and are set aside\n",
            fit.set_aside
        );
    }
    text + &format!("\nin a model: {}\n", settings(fit))
}

/// What sets the response in a model, to six significant digits.
fn settings(fit: &ResponseFit) -> String {
    let setting = |(key, estimate): (&str, &Estimate)| {
        let rounded: f64 = format!("{:.5e}", estimate.value)
            .parse()
            .unwrap_or(estimate.value);
        format!("--set sensor.improved.{key}={rounded}")
    };
    [
        ("a_counts", &fit.a_counts),
        ("d0_m", &fit.d0_m),
        ("exponent", &fit.exponent),
    ]
    .map(setting)
    .join(" ")
}

fn figure(fit: &ResponseFit, names: &[String; 2]) -> Figure {
    let response = fit.response();
    let farthest = fit.pairs.iter().map(|p| p[0]).fold(0.0, f64::max);
    let curve = (0..=200)
        .map(|i| farthest * 1.1 * f64::from(i) / 200.0)
        .map(|d| [d, response.reading(d)])
        .collect();
    let panel = Panel {
        x: Axis::linear(format!("{} (m)", names[0])),
        y: Axis::log(format!("{} (counts)", names[1])),
        marks: vec![
            Mark::new("fit", Style::series(0), Shape::Line(curve)),
            Mark::new(
                "measured",
                Style::color(Color::INK),
                Shape::Points(fit.pairs.clone()),
            ),
        ],
        ..Panel::default()
    };
    single(
        "Sensor response",
        "Measured pairs and the fitted response.",
        panel,
    )
}
