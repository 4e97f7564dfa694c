//! Section III: the circuit, its gates, and the segments its walls are cut into.

use anyhow::Result;
use chart::{Color, Figure, Mark, Marker, Panel, Shape, Side, Style};
use serde_json::{Map, Value};
use track::Course;

use super::outcome::{Block, Claim, Outcome, Picture, Section};
use super::published::WALLS;
use super::study::{Draw, Simulated, Study};
use crate::commands::world::segments_figure;
use crate::figures::{self, joints, map, single, walls};
use crate::laps::{SampledRun, mean_and_deviation};
use crate::table::Table;

/// The set-up: what was driven, sampled and cut.
pub(crate) fn outcome(study: &Study) -> Result<Outcome> {
    let course = &study.circuit().course;
    let counts = segments(course)?;
    let errors_m: Vec<f64> = WALLS.iter().map(|wall| wall.0).collect();
    let laps = laps_table(study);
    let blocks = vec![
        Block::Text(introduction(study)),
        Block::Table(laps.clone()),
        Picture::block(
            "fig02_walls",
            "Fig. 2",
            "The walls as chains of b-splines; squares mark the joints, where neighbours share the first derivative and \
             the second is zero.",
            walls_figure(course),
        ),
        Picture::block(
            "fig05_gates",
            "Fig. 5",
            format!(
                "The {} sampling gates across the corridor and one measured lap; crosses mark where it is sampled.",
                study.circuit().gates.len()
            ),
            gates_figure(study),
        ),
        Block::Table(segments_table(&counts)),
        Picture::block(
            "segments",
            "Fig. A",
            "Straight segments that both walls need against the maximal error allowed; circles are the paper's 1, 5, 10 \
             and 50 mm. Their number grows as error^(-1/2), as chords of a smooth curve must.",
            segments_figure(course, &errors_m)?,
        ),
        Block::Claims(vec![claim(&counts)]),
    ];
    let csv = counts.iter().fold(
        String::from("max_error_m,segments,paper\n"),
        |csv, (error_m, here, paper)| csv + &format!("{error_m},{here},{paper}\n"),
    );
    let json = counts
        .iter()
        .map(|(error_m, here, _)| (error_m.to_string(), Value::from(*here)));
    Ok(Outcome {
        section: Section {
            heading: "Circuit, laps and sampling".into(),
            blocks,
        },
        csv: vec![("segments.csv", csv), ("laps.csv", laps.to_csv())],
        json: vec![("segments", Value::Object(json.collect::<Map<_, _>>()))],
    })
}

fn introduction(study: &Study) -> String {
    let course = &study.circuit().course;
    let ([width_m, height_m], corridor) = (course.arena_m, course.corridor_m());
    format!(
        "The robot drives {} between two closed walls on an arena of {width_m} m x {height_m} m; the corridor is {:.0} to \
         {:.0} mm wide and {:.2} m long. A lap is kept if it crosses every gate; each run drives on until it has the laps \
         asked for, or times out. Lap times are means with one standard deviation; contact is counted in physics steps of \
         {} ms, which only a simulation knows.",
        course.direction.name(),
        figures::MM * corridor.narrowest_m,
        figures::MM * corridor.widest_m,
        study.circuit().gates.midline_length_m(),
        1000.0 * study.standard.controller.step_s / study.standard.run.physics_steps as f64,
    )
}

/// For each maximal error in m the segments of both walls, ours and the paper's.
fn segments(course: &Course) -> Result<Vec<(f64, usize, usize)>> {
    let count = |&(error_m, _, paper): &(f64, _, usize)| {
        let here =
            course.outer.flatten(error_m)?.vertices.len() + course.inner.flatten(error_m)?.vertices.len();
        Ok((error_m, here, paper))
    };
    WALLS.iter().map(count).collect()
}

fn segments_table(counts: &[(f64, usize, usize)]) -> Table {
    let mut table = Table::new("Segments of both walls", &["maximal error, mm", "paper", "here"]);
    for (error_m, here, paper) in counts {
        table.push([
            format!("{}", figures::MM * error_m),
            paper.to_string(),
            here.to_string(),
        ]);
    }
    table
}

fn claim(counts: &[(f64, usize, usize)]) -> Claim {
    let list = |numbers: Vec<usize>| {
        numbers
            .iter()
            .map(usize::to_string)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let (here, paper) = (
        counts.iter().map(|c| c.1).collect::<Vec<_>>(),
        counts.iter().map(|c| c.2).collect::<Vec<_>>(),
    );
    let holds = here == paper;
    Claim::new(
        "A smaller wall error needs more segments: for 1, 5, 10 and 50 mm respectively",
        list(paper),
        list(here),
        holds,
    )
}

fn walls_figure(course: &Course) -> Figure {
    let panel = map("", vec![walls(course), joints(course)]);
    let figure = single(
        "The walls",
        "Two closed walls and the joints of their b-splines.",
        panel,
    );
    Figure {
        legend: Side::Below,
        ..figure
    }
}

fn gates_figure(study: &Study) -> Figure {
    let (circuit, measured) = (study.circuit(), &study.measured.braitenberg);
    let path = [measured.path(0, 0)];
    let crosses = figures::crossings(circuit, &measured.runs[0].laps[0].offsets_m);
    let cross = Style {
        marker: Marker::Cross,
        size_px: 6.0,
        ..Style::color(Color::VERMILLION)
    };
    let lap = Style {
        width_px: 1.2,
        ..Style::color(Color::BLUE)
    };
    let marks = vec![
        figures::gates(circuit),
        walls(&circuit.course),
        figures::paths("lap", lap, &path),
        Mark::new("samples", cross, Shape::Points(crosses)),
    ];
    let panel = Panel {
        size_px: [640.0, 540.0],
        ..map("", marks)
    };
    let figure = single(
        "Gates and a sampled lap",
        "The gates, the walls, one lap and its crossings.",
        panel,
    );
    Figure {
        legend: Side::Below,
        ..figure
    }
}

/// How many laps there are of each kind, and how long they take: none is dropped silently.
fn laps_table(study: &Study) -> Table {
    let mut table = Table::new(
        "Laps",
        &[
            "laps of",
            "runs",
            "closed",
            "lap time, s",
            "steps in contact",
            "timed out",
        ],
    );
    for (name, measured) in [
        ("rule-based, measured", &study.measured.rule_based),
        ("Braitenberg, measured", &study.measured.braitenberg),
    ] {
        let runs: Vec<&SampledRun> = measured.runs.iter().collect();
        push(&mut table, name, &runs, None);
    }
    let mut simulated = |name: &str, of: &dyn Fn(&Draw) -> &[Simulated]| {
        let all: Vec<&Simulated> = study.draws.iter().flat_map(of).collect();
        let contacts = all.iter().map(|run| run.contacts).sum();
        push(
            &mut table,
            name,
            &all.iter().map(|run| &run.run).collect::<Vec<_>>(),
            Some(contacts),
        );
    };
    simulated("rule-based, simulated", &|draw| &draw.rule_based);
    simulated("standard, simulated", &|draw| &draw.braitenberg);
    for (place, variant) in Study::VARIANTS.iter().enumerate() {
        simulated(&format!("{}, simulated", variant.name()), &|draw| {
            draw.other(place)
        });
    }
    table
}

fn push(table: &mut Table, name: &str, runs: &[&SampledRun], contacts: Option<u64>) {
    let (closed, wanted) = runs
        .iter()
        .fold((0, 0), |(c, w), run| (c + run.laps.len(), w + run.wanted));
    let times: Vec<f64> = runs.iter().flat_map(|run| run.lap_times_s()).collect();
    let (mean, deviation) = mean_and_deviation(&times);
    table.push([
        name.to_owned(),
        runs.len().to_string(),
        format!("{closed} of {wanted}"),
        format!("{mean:.1} ± {deviation:.1}"),
        contacts.map_or("-".into(), |steps| steps.to_string()),
        runs.iter().filter(|run| run.timed_out).count().to_string(),
    ]);
}
