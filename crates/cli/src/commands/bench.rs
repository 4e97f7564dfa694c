//! `lapwing bench rays`: what ray casting costs, and what finer walls buy.

use std::path::Path;

use anyhow::Result;
use serde_json::json;

use crate::args::Bench;
use crate::experiments::Measurements;
use crate::output::{OutDir, Work};
use crate::ray_study::{self, Row, Rung};
use crate::session::Session;
use crate::table::Table;

pub(crate) fn run(session: &Session, args: &Bench) -> Result<()> {
    let Bench::Rays {
        segments,
        seeds,
        json,
        out,
    } = args;
    let segments: Vec<usize> = segments.iter().map(|&n| n as usize).collect();
    let measured = Measurements::load(&[])?;
    let config = measured.standard()?;
    let progress = session.progress("casting rays", 3 * segments.len() as u64);
    let rows = ray_study::measure(&config, &measured.circuit, &segments, &|| progress.tick(1))?;
    drop(progress);
    if *json && out.is_none() {
        return session.print_json(&ray_study::document(&rows, &[]));
    }
    let cone = ray_study::cone_cost(&config, &measured.circuit)?;
    let real = measured.braitenberg.clusters()?;
    let rungs = ray_study::ladder(
        &config,
        &measured.circuit,
        &real,
        (session.seed(), *seeds as usize, measured.braitenberg.set.laps),
    )?;
    let document = ray_study::document(&rows, &cone);
    if let Some(out) = out {
        write(session, out, args, &rows, &rungs, &document)?;
    }
    if *json {
        session.print_json(&document)
    } else {
        session.print(&text(&rows, &cone, &rungs, &document))
    }
}

fn write(
    session: &Session,
    out: &Path,
    args: &Bench,
    rows: &[Row],
    rungs: &[Rung],
    document: &serde_json::Value,
) -> Result<()> {
    let Bench::Rays { segments, seeds, .. } = args;
    let configuration = json!({ "segments": segments, "seeds": seeds, "seed": session.seed() });
    let folder = OutDir::create(out, &Work::new("bench rays", &configuration), &[], false)?;
    folder.write("rays_timing.json", format!("{document:#}\n"))?;
    folder.write("rays_timing.svg", ray_study::figure(rows, rungs).to_svg()?)?;
    folder.write("ladder.csv", ray_study::ladder_table(rungs).to_csv())?;
    folder.finish(&session.manifest(configuration, Vec::new()))
}

fn text(rows: &[Row], cone: &[(usize, [f64; 2])], rungs: &[Rung], document: &serde_json::Value) -> String {
    let mut cost = Table::new(
        "Nanoseconds, quickest of several passes",
        &[
            "segments",
            "max error, mm",
            "8 rays: loop",
            "BVH",
            "lapwing",
            "step: loop",
            "BVH",
            "lapwing",
        ],
    );
    for row in rows {
        let cells = ["brute", "bvh", "default"].map(|name| format!("{:.0}", row.ns_per_reading[name]));
        let steps = ["brute", "bvh", "default"].map(|name| format!("{:.0}", row.ns_per_step[name]));
        let error_mm = 1000.0 * row.max_error_m;
        let error = if error_mm < 0.01 {
            format!("{error_mm:.1e}")
        } else {
            format!("{error_mm:.3}")
        };
        let first = [row.segments.to_string(), error];
        cost.push(first.into_iter().chain(cells).chain(steps));
    }
    let mut text = cost.to_text();
    if rows.len() > 1 {
        let slope = |name: &str, key: &str| document["slopes"][name][key].as_f64().unwrap_or(f64::NAN);
        text += &format!(
            "\nThe plain loop is linear, as the paper says: {:.1} ns a segment and {:.0} ns besides (its logarithm grows with exponent {:.2}).\n\
             parry2d's BVH grows with exponent {:.2}, lapwing with exponent {:.2}: {:.0} ns for each tenfold.\n",
            slope("brute", "ns_per_segment"),
            slope("brute", "intercept_ns"),
            slope("brute", "exponent"),
            slope("bvh", "exponent"),
            slope("default", "exponent"),
            slope("default", "ns_per_tenfold"),
        );
    }
    let mut rays = Table::new(
        "\nA control step with a cone of rays at each sensor, ns",
        &["rays", "responses averaged", "distances averaged"],
    );
    for (count, [responses, distances]) in cone {
        rays.push([
            count.to_string(),
            format!("{responses:.0}"),
            format!("{distances:.0}"),
        ]);
    }
    let mut ladder = Table::new(
        "\nFaithfulness against cost",
        &[
            "max error, mm",
            "segments",
            "step, ns",
            "distance to the measured runs",
        ],
    );
    for rung in rungs {
        let distance = rung.distance.map_or("too few laps".into(), |d| d.text(2));
        ladder.push([
            format!("{}", 1000.0 * rung.max_error_m),
            rung.segments.to_string(),
            format!("{:.0}", rung.ns_per_step),
            distance,
        ]);
    }
    text += &rays.to_text();
    text += &ladder.to_text();
    if let Some(rung) = ray_study::coarsest_faithful(rungs) {
        text += &format!(
            "\nThe coarsest walls that cost no faithfulness here: {} mm, {} segments.\n",
            1000.0 * rung.max_error_m,
            rung.segments
        );
    }
    text
}
