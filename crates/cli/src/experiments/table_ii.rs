//! Section IV-B.1, Table II: does the improved sensor model bring the simulation closer?

use anyhow::Result;
use chart::{Axis, Color, Dash, Figure, Fill, Mark, Marker, Panel, Shape, Side, Style};
use sim::Response;

use super::comparison::{Comparison, Space};
use super::distances::{DistanceOf, Distances};
use super::outcome::{Block, Claim, Outcome, Picture, Section};
use super::published::{IMPROVED, ORIGINAL, SENSOR_PAIRS};
use super::study::{Study, Variant};
use crate::figures::{self, Shown, line, map, measured, paths, simulated, single, walls};
use crate::setup;

pub(super) const VARIANTS: [Variant; 2] = [Variant::Standard, Variant::OriginalSensor];
const NAMES: [&str; 2] = ["improved sensor", "original sensor"];

/// The experiment: one PDM of all measured runs and one simulated run with each sensor model.
pub(crate) fn outcome(study: &Study) -> Result<Outcome> {
    let runs = study.real.len();
    let all: Vec<usize> = (0..runs).collect();
    let comparison = Comparison::new(&study.clusters(&all, &VARIANTS))?;
    let distances = table_ii(study, &|run, place| Some(comparison.distance(run, runs + place)));
    let responses = responses(study)?;
    let mut claims = claims(study, &comparison, &distances);
    claims.push(response_claim(&responses));
    let blocks = vec![
        Block::Text(
            "The robot is simulated with the response fitted to measured pairs (improved) and with the line that an \
             early simulated e-puck came with (original). One PDM is built of all measured Braitenberg runs and one \
             simulated run of each."
                .into(),
        ),
        Picture::block(
            "fig08_sensor",
            "Fig. 8",
            "Measured output of an e-puck's proximity sensor and the two models. Without a wall within 0.1 m both read 0.",
            response_figure(&responses),
        ),
        Picture::block(
            "fig09_laps",
            "Fig. 9",
            "Two laps of a measured run and of the simulations with both sensor models.",
            laps_figure(study),
        ),
        Picture::block(
            "fig10_sensor_pdm",
            "Fig. 10",
            "Measured runs and the simulations with both sensor models in the first two modes; at the right the \
             measured runs and the improved sensor alone.",
            plane(study, &comparison),
        ),
        Block::Table(distances.table()),
        Picture::block(
            "table_ii",
            "Fig. B",
            "Table II as a picture: our means with the interval of the middle 95 % of the draws, the paper's values as \
             open diamonds.",
            distances.figure(),
        ),
        Block::Claims(claims),
    ];
    Ok(Outcome {
        section: Section {
            heading: "Sensor model (Table II)".into(),
            blocks,
        },
        csv: vec![("table_ii.csv", distances.csv())],
        json: vec![("table_ii", distances.json())],
    })
}

/// Table II beside the paper's.
pub(super) fn table_ii(study: &Study, distance: &DistanceOf<'_>) -> Distances {
    let [improved, original] = NAMES;
    Distances::beside_paper(
        "Table II: distances of the simulations to the measured runs",
        study.runs(),
        [
            ("improved".into(), improved, IMPROVED),
            ("original".into(), original, ORIGINAL),
        ],
        distance,
    )
}

fn claims(study: &Study, comparison: &Comparison, distances: &Distances) -> Vec<Claim> {
    let runs = study.real.len();
    let (improved, original) = (runs, runs + 1);
    let range = |row: usize| {
        let means = distances.rows[row].here.iter().map(|estimate| estimate.mean);
        let [low, high] = means.fold([f64::INFINITY, 0.0], |[low, high], d| [low.min(d), high.max(d)]);
        format!("{low:.1} to {high:.1}")
    };
    let nearest = |draw: &Space| {
        let by_distance = |a: &usize, b: &usize| {
            draw.distance(*a, improved)
                .total_cmp(&draw.distance(*b, improved))
        };
        (0..runs)
            .min_by(by_distance)
            .expect("there are at least two runs")
    };
    let names = study.runs();
    let first = nearest(&comparison.draws[0]);
    let closest = distances.rows[0].here[first].text(1);
    let smallest_p = comparison.estimate(|draw| {
        let others = (0..runs).filter(|&run| run != nearest(draw));
        others.map(|run| draw.pair(run, improved).p).fold(0.0, f64::max)
    });
    let apart = comparison.estimate(|draw| {
        let pairs = (0..runs).flat_map(|a| (0..a).map(move |b| (a, b)));
        pairs.map(|(a, b)| draw.distance(a, b)).fold(0.0, f64::max)
    });
    let missed =
        comparison.estimate(|draw| (0..runs).filter(|&run| draw.differ(run, improved)).count() as f64);
    vec![
        Claim::counted(
            "With the improved sensor the simulation is closer to every run than with the original one",
            "0.5 to 2.4 against 9.7 to 16.3",
            &format!("{} against {}", range(0), range(1)),
            comparison.tally(|draw| {
                (0..runs).all(|run| draw.distance(run, improved) < draw.distance(run, original))
            }),
        ),
        Claim::counted(
            "The improved simulation is closest to the last run",
            "run d, 0.5",
            &format!("run {}, {closest}", names[first]),
            comparison.tally(|draw| nearest(draw) == runs - 1),
        ),
        Claim::counted(
            "Its cluster remains different from the other runs (Hotelling's test at 5 %)",
            "2.3 to 2.4",
            &format!(
                "largest p of the others {}",
                crate::table::probability(smallest_p.mean)
            ),
            comparison.tally(|draw| {
                (0..runs)
                    .filter(|&run| run != nearest(draw))
                    .all(|run| draw.differ(run, improved))
            }),
        ),
        Claim::counted(
            "The runs differ among themselves, so that one simulation cannot match them all at the same time",
            "runs a to c at 2.3 to 2.4, run d at 0.5",
            &format!(
                "runs up to {} apart; {} of {runs} runs differ from the simulation at 5 %",
                apart.text(1),
                (10.0 * missed.mean).round() / 10.0
            ),
            comparison.tally(|draw| {
                let unequal = (0..runs).any(|a| (0..a).any(|b| draw.differ(a, b)));
                unequal && (0..runs).any(|run| draw.differ(run, improved))
            }),
        ),
    ]
}

fn plane(study: &Study, comparison: &Comparison) -> Figure {
    let runs = study.runs();
    let label = |place: usize| match runs.get(place) {
        Some(run) => (format!("measured, run {run}"), measured(place)),
        None => (
            NAMES[place - runs.len()].to_owned(),
            simulated(place - runs.len()),
        ),
    };
    let shown = |(place, projection)| {
        let (label, style) = label(place);
        Shown {
            projection,
            label,
            style,
        }
    };
    let clusters: Vec<Shown<'_>> = comparison.projections.iter().enumerate().map(shown).collect();
    let near: Vec<usize> = (0..=runs.len()).collect();
    figures::plane_and_close_up(
        "The two sensor models in the first two modes",
        &comparison.pdm,
        &clusters,
        &near,
    )
}

/// Two laps each.
fn laps_figure(study: &Study) -> Figure {
    let measured = &study.measured.braitenberg;
    let run = study.run_named("d", 0);
    let real: Vec<Vec<[f64; 2]>> = (0..measured.runs[run].laps.len().min(2))
        .map(|lap| measured.path(run, lap))
        .collect();
    let drawn = |variant: Variant| &study.draws[0].run(variant).paths[..];
    let two = |paths: &[Vec<[f64; 2]>]| paths.iter().take(2).cloned().collect::<Vec<_>>();
    let marks = vec![
        walls(&study.circuit().course),
        paths(
            &format!("measured, run {}", study.runs()[run]),
            line(Color::INK, Dash::Solid, 1.2),
            &real,
        ),
        paths(
            NAMES[0],
            line(Color::BLUE, Dash::Solid, 1.2),
            &two(drawn(VARIANTS[0])),
        ),
        paths(
            NAMES[1],
            line(Color::VERMILLION, Dash::Solid, 1.2),
            &two(drawn(VARIANTS[1])),
        ),
    ];
    let panel = Panel {
        size_px: [600.0, 500.0],
        ..map("", marks)
    };
    let figure = single(
        "Laps with both sensor models",
        "Two laps each, over the walls.",
        panel,
    );
    Figure {
        legend: Side::Below,
        ..figure
    }
}

/// Name and response of both models.
fn responses(study: &Study) -> Result<Vec<(&'static str, Response)>> {
    let response = |variant: Variant, name| -> Result<_> {
        let config = match variant {
            Variant::OriginalSensor => study.standard.with("sensor.kind", "original")?,
            _ => study.standard.clone(),
        };
        Ok((
            name,
            setup::model(&config, &study.circuit().course)?.machine.response,
        ))
    };
    Ok(vec![
        response(Variant::Standard, "improved model")?,
        response(Variant::OriginalSensor, "original model")?,
    ])
}

/// By what factor a response is off the measured pairs, typically: the exponential of the root mean square logarithm.
fn misfit(response: &Response) -> f64 {
    let squares =
        SENSOR_PAIRS.map(|[distance_m, reading]| (response.reading(distance_m) / reading).ln().powi(2));
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt().exp()
}

fn response_claim(responses: &[(&str, Response)]) -> Claim {
    let [improved, original] = [0, 1].map(|model: usize| misfit(&responses[model].1));
    Claim::new(
        "The sensor's output is non-linear and diverges from the original model; the improved one follows it",
        "seen in Fig. 8",
        format!(
            "a typical measured reading is off by a factor of {improved:.2} from the improved model and {original:.1} from the original"
        ),
        improved < original && original > 2.0,
    )
}

fn response_figure(responses: &[(&'static str, Response)]) -> Figure {
    let curve = |response: &Response| {
        (0..=200)
            .map(|i| 0.1 * f64::from(i) / 200.0)
            .map(|d| [figures::MM * d, response.reading(d)])
            .collect()
    };
    let styles = [
        line(Color::BLUE, Dash::Solid, 2.0),
        line(Color::VERMILLION, Dash::Dashed, 2.0),
    ];
    let mut marks: Vec<Mark> = responses
        .iter()
        .zip(styles)
        .map(|((name, response), style)| Mark::new(*name, style, Shape::Line(curve(response))))
        .collect();
    let pairs = SENSOR_PAIRS
        .map(|[d, reading]| [figures::MM * d, reading])
        .to_vec();
    let point = Style {
        marker: Marker::Circle,
        fill: Fill::Solid,
        ..Style::color(Color::INK)
    };
    marks.push(Mark::new("measured", point, Shape::Points(pairs)));
    let panel = |y: Axis| Panel {
        x: Axis {
            range: Some([0.0, 100.0]),
            ..Axis::linear("distance to the wall, mm")
        },
        y,
        marks: marks.clone(),
        size_px: [360.0, 280.0],
        ..Panel::default()
    };
    Figure {
        title: "Sensor output and two models".into(),
        description: "Reading against distance, on a linear and on a logarithmic scale.".into(),
        panels: vec![
            panel(Axis::linear("reading, counts")),
            panel(Axis::log("reading, counts")),
        ],
        columns: 2,
        legend: Side::Below,
        ..Figure::default()
    }
}
