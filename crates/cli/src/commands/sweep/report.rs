//! `sweep.csv`, `sweep.json` and the table on the terminal.

use anyhow::{Context, Result};
use serde_json::{Map, Value, json};

use super::Sweep;
use super::analysis::{MODES, Row, SeedResult};
use super::grid::json_value;
use crate::laps::mean_and_deviation;
use crate::table::Table;

/// One row for each seed, grid point and measured run; empty fields where there is no distance.
pub(super) fn csv(sweep: &Sweep, results: &[SeedResult]) -> Result<Vec<u8>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    let keys = sweep.grid.axes.iter().map(|axis| axis.key.as_str());
    csv.write_record(keys.chain(["seed", "run", "distance", "t2", "p", "laps", "timed_out"]))?;
    for (result, row) in rows(results) {
        let test = |number: fn(&pdm::Hotelling) -> f64| {
            row.test
                .as_ref()
                .map_or(String::new(), |t| json!(number(t)).to_string())
        };
        let fields = [
            result.seed.to_string(),
            sweep.measured.runs[row.run].run.clone(),
            test(|t| t.distance),
            test(|t| t.t2),
            test(|t| t.p),
            row.laps.to_string(),
            row.timed_out.to_string(),
        ];
        csv.write_record(sweep.grid.values(row.point).map(str::to_owned).chain(fields))?;
    }
    csv.into_inner().context("cannot write to memory")
}

fn rows(results: &[SeedResult]) -> impl Iterator<Item = (&SeedResult, &Row)> {
    results
        .iter()
        .flat_map(|result| result.rows.iter().map(move |row| (result, row)))
}

/// `sweep.json`: what was swept, every row, and the mean and spread over the seeds.
pub(super) fn document(sweep: &Sweep, results: &[SeedResult]) -> Value {
    json!({
        "vary": sweep.grid.axes_json(),
        "measured": sweep.measured.set.name,
        "measured_runs": (0..sweep.measured.runs.len()).map(|run| measured_json(sweep, results, run)).collect::<Vec<_>>(),
        "runs": sweep.runs,
        "laps": sweep.laps,
        "gates": sweep.circuit().gates.len(),
        "modes": MODES,
        "seeds": results.iter().map(|result| json!({ "seed": result.seed, "explained": result.explained })).collect::<Vec<_>>(),
        "points": (0..sweep.grid.points.len()).map(|point| point_json(sweep, results, point)).collect::<Vec<_>>(),
        "rows": rows(results).map(|(result, row)| row_json(sweep, result.seed, row)).collect::<Vec<_>>(),
        "remarks": results.iter().flat_map(|result| &result.remarks).collect::<Vec<_>>(),
    })
}

/// The varied keys and their values at a point.
fn values(sweep: &Sweep, point: usize) -> Map<String, Value> {
    sweep
        .grid
        .axes
        .iter()
        .map(|axis| axis.key.clone())
        .zip(sweep.grid.values(point).map(json_value))
        .collect()
}

fn row_json(sweep: &Sweep, seed: u64, row: &Row) -> Value {
    let mut json = json!({
        "seed": seed, "run": sweep.measured.runs[row.run].run, "distance": null, "t2": null, "f": null, "df1": null,
        "df2": null, "p": null, "laps": row.laps, "timed_out": row.timed_out,
    });
    match &row.test {
        Ok(t) => {
            for (key, number) in [("distance", t.distance), ("t2", t.t2), ("f", t.f), ("p", t.p)] {
                json[key] = json!(number);
            }
            (json["df1"], json["df2"]) = (json!(t.df1), json!(t.df2));
        }
        Err(why) => json["why"] = json!(why),
    }
    let mut all = values(sweep, row.point);
    all.extend(json.as_object().cloned().unwrap_or_default());
    Value::Object(all)
}

/// A point's distances over the seeds.
pub(super) struct Spread {
    /// Mean over the seeds that gave one; NaN without any.
    pub(super) mean: f64,
    /// Standard deviation over them; NaN for fewer than two.
    pub(super) deviation: f64,
    pub(super) seeds: usize,
}

/// The distances of a point from a measured run, or from all of them, over the seeds; with several runs the mean over
/// the runs is taken for each seed first.
pub(super) fn spread(results: &[SeedResult], point: usize, run: Option<usize>) -> Spread {
    let of_seed = |result: &SeedResult| {
        let wanted = result
            .rows
            .iter()
            .filter(|row| row.point == point && run.is_none_or(|run| row.run == run));
        let distances: Vec<f64> = wanted
            .filter_map(|row| row.test.as_ref().ok())
            .map(|t| t.distance)
            .collect();
        (!distances.is_empty()).then(|| mean_and_deviation(&distances).0)
    };
    Spread::over(results.iter().filter_map(of_seed).collect())
}

/// The mean distances of a measured run from the others over the seeds.
fn among_measured(results: &[SeedResult], run: usize) -> Spread {
    let of_seed = |result: &SeedResult| result.among_measured[run].clone().ok();
    Spread::over(results.iter().filter_map(of_seed).collect())
}

impl Spread {
    fn over(distances: Vec<f64>) -> Self {
        let (mean, deviation) = mean_and_deviation(&distances);
        Self {
            mean,
            deviation,
            seeds: distances.len(),
        }
    }
}

/// The sum of a count over the seeds; it is the same in all rows of a point.
fn total(results: &[SeedResult], point: usize, count: fn(&Row) -> usize) -> usize {
    results
        .iter()
        .filter_map(|result| result.rows.iter().find(|row| row.point == point))
        .map(count)
        .sum()
}

fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { Value::Null }
}

/// A measured run, with its distance from the others.
fn measured_json(sweep: &Sweep, results: &[SeedResult], run: usize) -> Value {
    let measured = &sweep.measured.runs[run];
    let others = among_measured(results, run).mean;
    json!({ "run": measured.run, "laps": measured.laps.len(), "distance_from_others": finite(others) })
}

fn point_json(sweep: &Sweep, results: &[SeedResult], point: usize) -> Value {
    let run = |run: usize| {
        let s = spread(results, point, Some(run));
        json!({
            "run": sweep.measured.runs[run].run, "distance": finite(s.mean), "deviation": finite(s.deviation),
            "seeds": s.seeds,
        })
    };
    let mut json = values(sweep, point);
    json.insert("laps".into(), json!(total(results, point, |row| row.laps)));
    json.insert(
        "timed_out".into(),
        json!(total(results, point, |row| row.timed_out)),
    );
    json.insert(
        "against".into(),
        json!((0..sweep.measured.runs.len()).map(run).collect::<Vec<_>>()),
    );
    Value::Object(json)
}

/// The table: a row for each grid point, a column for each measured run.
pub(super) fn text(sweep: &Sweep, results: &[SeedResult]) -> String {
    let (runs, seeds) = (&sweep.measured.runs, sweep.seeds.len());
    let over = match seeds {
        1 => String::new(),
        _ => format!("; mean and standard deviation over {seeds} seeds, or over (so many) of them"),
    };
    let title = format!(
        "Distance of each grid point from the runs of {} (eq. 8 in {MODES} modes of one model of all these points and runs{over})",
        sweep.measured.set.name
    );
    let mut columns: Vec<&str> = sweep.grid.axes.iter().map(|axis| axis.key.as_str()).collect();
    columns.extend(runs.iter().map(|run| run.run.as_str()));
    columns.extend(["laps closed", "timed out"]);
    let mut table = Table::new(title, &columns);
    for point in 0..sweep.grid.points.len() {
        let mut row: Vec<String> = sweep.grid.values(point).map(str::to_owned).collect();
        row.extend((0..runs.len()).map(|run| cell(&spread(results, point, Some(run)), seeds)));
        row.push(format!(
            "{} of {}",
            total(results, point, |row| row.laps),
            seeds * sweep.runs * sweep.laps
        ));
        row.push(format!(
            "{} of {}",
            total(results, point, |row| row.timed_out),
            seeds * sweep.runs
        ));
        table.push(row);
    }
    if runs.len() > 1 {
        let axes = sweep.grid.axes.len();
        let mut row = vec![String::new(); axes];
        row[0] = "the other runs".to_owned();
        row.extend((0..runs.len()).map(|run| cell(&among_measured(results, run), seeds)));
        row.extend([String::new(), String::new()]);
        table.push(row);
    }
    format!(
        "{}Last row: the mean distance of a measured run from the others. In a grid of other points the modes, and with them all \
         distances, are others.\n",
        table.to_text()
    )
}

/// Where only some of the seeds gave a distance, their number follows in brackets.
fn cell(spread: &Spread, seeds: usize) -> String {
    let number = match spread.seeds {
        0 => return "-".to_owned(),
        1 => format!("{:.2}", spread.mean),
        _ => format!("{:.2} ± {:.2}", spread.mean, spread.deviation),
    };
    if spread.seeds == seeds {
        number
    } else {
        format!("{number} ({})", spread.seeds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_says_how_many_seeds_it_stands_for() {
        let cell = |mean, deviation, seeds| {
            cell(
                &Spread {
                    mean,
                    deviation,
                    seeds,
                },
                4,
            )
        };
        assert_eq!(cell(1.0, 0.25, 4), "1.00 ± 0.25");
        assert_eq!(cell(1.0, 0.25, 2), "1.00 ± 0.25 (2)");
        assert_eq!(cell(1.0, f64::NAN, 1), "1.00 (1)");
        assert_eq!(cell(f64::NAN, f64::NAN, 0), "-");
    }
}
