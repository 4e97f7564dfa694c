//! Section IV-B.4, Fig. 14: which feature of the simulation matters most?

use anyhow::Result;
use chart::Figure;
use serde_json::{Map, Value};

use super::comparison::{Comparison, Space};
use super::estimate::Estimate;
use super::outcome::{Block, Claim, Outcome, Picture, Section};
use super::study::{Study, Variant};
use crate::figures::{self, Shown, measured, simulated};
use crate::table::Table;

/// The clusters after run d, which is the first.
const VARIANTS: [Variant; 4] = [
    Variant::Standard,
    Variant::OriginalSensor,
    Variant::Slip100,
    Variant::Wall50,
];
const KEYS: [&str; 4] = ["standard", "original_sensor", "slip_100", "wall_50_mm"];
const RUN: usize = 0;
const STANDARD: usize = 1;
const SENSOR: usize = 2;
const SLIP: usize = 3;
const WALL: usize = 4;

/// The experiment: run d, the standard simulation, and three with one feature changed, in one PDM.
pub(crate) fn outcome(study: &Study) -> Result<Outcome> {
    let place = study.run_named("d", 0);
    let run = study.runs()[place].clone();
    let comparison = Comparison::new(&study.clusters(&[place], &VARIANTS))?;
    let blocks = vec![
        Block::Text(format!(
            "The standard simulation (improved sensor, 5 mm, 10 % slip) and three with one feature changed each, with \
             measured run {run} in one PDM. The paper prints the picture only, so there are no distances of it to set \
             ours beside."
        )),
        Picture::block(
            "fig14_combined_pdm",
            "Fig. 14",
            format!(
                "Measured run {run}, the standard simulation and one change at a time in the first two modes; at the \
                 right the clusters nearest to the run."
            ),
            figure(&comparison, place, &run),
        ),
        Block::Table(table(&comparison, &run)),
        Block::Claims(claims(&comparison, &run)),
    ];
    Ok(Outcome {
        section: Section {
            heading: "All three features together".into(),
            blocks,
        },
        csv: vec![("combined.csv", csv(&comparison))],
        json: vec![("combined", json(&comparison))],
    })
}

fn name(variant: Variant) -> String {
    match variant {
        Variant::Standard => "standard".into(),
        other => format!("{} instead", other.name()),
    }
}

fn table(comparison: &Comparison, run: &str) -> Table {
    let head = format!("distance to run {run}");
    let mut table = Table::new(
        "One feature changed at a time (Fig. 14)",
        &["simulation", &head, "distance to the standard simulation"],
    );
    for (place, variant) in VARIANTS.into_iter().enumerate() {
        let cluster = place + 1;
        let moved = if cluster == STANDARD {
            "-".into()
        } else {
            comparison.distance(cluster, STANDARD).text(1)
        };
        table.push([name(variant), comparison.distance(cluster, RUN).text(1), moved]);
    }
    table
}

fn claims(comparison: &Comparison, run: &str) -> Vec<Claim> {
    let to_run = |cluster: usize| comparison.distance(cluster, RUN).text(1);
    let moved = |cluster: usize| comparison.distance(cluster, STANDARD).text(1);
    let change =
        |draw: &Space, cluster: usize| (draw.distance(cluster, RUN) - draw.distance(STANDARD, RUN)).abs();
    vec![
        Claim::counted(
            format!(
                "Changing the sensor model or the wall error makes the simulation much less like run {run}"
            ),
            "seen in Fig. 14",
            &format!(
                "{} and {} against {}",
                to_run(SENSOR),
                to_run(WALL),
                to_run(STANDARD)
            ),
            comparison.tally(|draw| {
                draw.distance(SENSOR, RUN).min(draw.distance(WALL, RUN)) > 2.0 * draw.distance(STANDARD, RUN)
            }),
        ),
        Claim::counted(
            "Changing the slip noise has a much smaller impact than either (distance to the standard simulation)",
            "seen in Fig. 14",
            &format!("{} against {} and {}", moved(SLIP), moved(SENSOR), moved(WALL)),
            comparison.tally(|draw| {
                draw.distance(SLIP, STANDARD)
                    < 0.5 * draw.distance(SENSOR, STANDARD).min(draw.distance(WALL, STANDARD))
            }),
        ),
        Claim::counted(
            format!(
                "So it is better to improve sensor and walls than to match the slip (change of the distance to run {run})"
            ),
            "concluded from Fig. 14",
            &format!(
                "{} by the slip, {} and {} by sensor and walls",
                comparison.estimate(|draw| change(draw, SLIP)).text(1),
                comparison.estimate(|draw| change(draw, SENSOR)).text(1),
                comparison.estimate(|draw| change(draw, WALL)).text(1),
            ),
            comparison.tally(|draw| change(draw, SLIP) < change(draw, SENSOR).min(change(draw, WALL))),
        ),
    ]
}

fn figure(comparison: &Comparison, place: usize, run: &str) -> Figure {
    let shown = |(cluster, projection)| match cluster {
        RUN => Shown {
            projection,
            label: format!("measured, run {run}"),
            style: measured(place),
        },
        _ => Shown {
            projection,
            label: name(VARIANTS[cluster - 1]),
            style: simulated(cluster - 1),
        },
    };
    let clusters: Vec<Shown<'_>> = comparison.projections.iter().enumerate().map(shown).collect();
    let near = [RUN, STANDARD, SLIP];
    figures::plane_and_close_up("One feature changed at a time", &comparison.pdm, &clusters, &near)
}

fn csv(comparison: &Comparison) -> String {
    let mut csv =
        String::from("simulation,distance_to_run,low,high,distance_to_standard,standard_low,standard_high\n");
    for (place, key) in KEYS.iter().enumerate() {
        let cells = [RUN, STANDARD].map(|to| {
            let Estimate { mean, low, high, .. } = comparison.distance(place + 1, to);
            format!("{mean},{low},{high}")
        });
        csv += &format!("{key},{}\n", cells.join(","));
    }
    csv
}

fn json(comparison: &Comparison) -> Value {
    let entry = |(place, key): (usize, &&str)| {
        let mut entry = comparison.distance(place + 1, RUN).json("distance");
        if place + 1 != STANDARD {
            entry["to_standard"] = comparison.distance(place + 1, STANDARD).json("distance");
        }
        ((*key).to_owned(), entry)
    };
    Value::Object(KEYS.iter().enumerate().map(entry).collect::<Map<_, _>>())
}
