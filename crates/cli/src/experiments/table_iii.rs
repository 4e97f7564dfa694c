//! Section IV-B.2, Table III: does a coarser wall make the simulation less faithful?

use anyhow::Result;
use chart::{Color, Dash, Figure, Panel, Side, Style};
use serde_json::{Map, Value, json};

use super::comparison::{Comparison, Space};
use super::distances::{DistanceOf, Distances};
use super::estimate::{Estimate, Tally};
use super::mean_lap::Difference;
use super::outcome::{Block, Claim, Outcome, Picture, Section};
use super::published::{self, WALLS};
use super::study::{Study, Variant};
use crate::figures::{self, MM, Shown, across, line, map, measured, simulated, walls};
use crate::table::Table;

/// In the order of [`WALLS`]: 1, 5, 10 and 50 mm.
pub(super) const VARIANTS: [Variant; 4] = [
    Variant::Wall1,
    Variant::Standard,
    Variant::Wall10,
    Variant::Wall50,
];
const NAMES: [&str; 4] = ["error 1 mm", "error 5 mm", "error 10 mm", "error 50 mm"];

/// The experiment: one PDM of all measured runs and one simulated run with each wall error.
pub(crate) fn outcome(study: &Study) -> Result<Outcome> {
    let runs = study.real.len();
    let all: Vec<usize> = (0..runs).collect();
    let comparison = Comparison::new(&study.clusters(&all, &VARIANTS))?;
    let distances = table_iii(study, &|run, place| Some(comparison.distance(run, runs + place)));
    let shapes = Shapes::new(study, &comparison);
    let claims = [claims(study, &comparison), shapes.claims(study)].concat();
    let blocks = vec![
        Block::Text(
            "The walls are cut into straight segments that are nowhere farther than 1, 5, 10 or 50 mm from the \
             b-splines; all else is as in the standard simulation."
                .into(),
        ),
        Picture::block(
            "fig11_walls_pdm",
            "Fig. 11",
            "Measured runs and the simulations with four wall errors in the first two modes; at the right without the \
             coarsest wall.",
            plane(study, &comparison),
        ),
        Block::Table(distances.table()),
        Picture::block(
            "table_iii",
            "Fig. C",
            "Table III as a picture: our means with the interval of the middle 95 % of the draws, the paper's values \
             as open diamonds.",
            distances.figure(),
        ),
        Picture::block("fig12_mean_laps", "Fig. 12", shapes.caption(study), mean_laps_figure(study)),
        Block::Table(shapes.table(study)),
        Block::Claims(claims),
    ];
    Ok(Outcome {
        section: Section {
            heading: "Wall approximation (Table III)".into(),
            blocks,
        },
        csv: vec![
            ("table_iii.csv", distances.csv()),
            ("mean_laps.csv", shapes.table(study).to_csv()),
        ],
        json: vec![("table_iii", distances.json()), ("wall_mean_laps", shapes.json())],
    })
}

/// Table III beside the paper's.
pub(super) fn table_iii(study: &Study, distance: &DistanceOf<'_>) -> Distances {
    let wall = |((error_m, paper, _), name): ((f64, published::Row, usize), &'static str)| {
        (error_m.to_string(), name, paper)
    };
    Distances::beside_paper(
        "Table III: distances of the simulations to the measured runs",
        study.runs(),
        WALLS.into_iter().zip(NAMES).map(wall),
        distance,
    )
}

fn claims(study: &Study, comparison: &Comparison) -> Vec<Claim> {
    let runs = study.real.len();
    let mean = |draw: &Space, wall: usize| {
        (0..runs).map(|run| draw.distance(run, runs + wall)).sum::<f64>() / runs as f64
    };
    let means = [0, 1, 2, 3].map(|wall| comparison.estimate(|draw| mean(draw, wall)).mean);
    let paper = WALLS.map(|(_, row, _)| row.mean());
    let list = |d: [f64; 4]| format!("{:.1}, {:.1}, {:.1} and {:.1}", d[0], d[1], d[2], d[3]);
    let (finest, fine) = (runs, runs + 1);
    let different = comparison.tally(|draw| draw.differ(finest, fine));
    vec![
        Claim::counted(
            "A wall error of 50 mm makes the simulation clearly less faithful than any smaller one (mean distance over \
             the runs for 1, 5, 10 and 50 mm)",
            list(paper),
            &list(means),
            comparison.tally(|draw| (0..3).all(|wall| mean(draw, 3) > mean(draw, wall))),
        ),
        Claim::new(
            "Wall errors of 1 and 5 mm are nearly impossible to tell apart (they are if Hotelling's test at 5 % seldom \
             finds a difference)",
            "clusters overlap in Fig. 11",
            format!(
                "distance of the two clusters {}; different in {different}",
                comparison.distance(finest, fine).text(1)
            ),
            (different.times as f64) < 0.5 * different.draws as f64,
        ),
        Claim::counted(
            "With 1 and 5 mm there is a clear offset between simulated and measured clusters (every run, Hotelling's \
             test at 5 %)",
            "distances 4.6 to 16.5",
            &format!("mean distances over the runs {:.1} and {:.1}", means[0], means[1]),
            comparison.tally(|draw| (0..runs).all(|run| draw.differ(run, finest) && draw.differ(run, fine))),
        ),
        Claim::counted(
            "Curiously, the middle error of 10 mm is closer to the measured runs than 1 and 5 mm (mean distance over \
             the runs)",
            format!("{:.1} against {:.1} and {:.1}", paper[2], paper[0], paper[1]),
            &format!("{:.1} against {:.1} and {:.1}", means[2], means[0], means[1]),
            comparison.tally(|draw| mean(draw, 2) < mean(draw, 0).min(mean(draw, 1))),
        ),
    ]
}

fn plane(study: &Study, comparison: &Comparison) -> Figure {
    let runs = study.runs();
    let shown = |(place, projection)| match runs.get(place) {
        Some(run) => Shown {
            projection,
            label: format!("measured, run {run}"),
            style: measured(place),
        },
        None => {
            let wall = place - runs.len();
            Shown {
                projection,
                label: NAMES[wall].into(),
                style: simulated(wall),
            }
        }
    };
    let clusters: Vec<Shown<'_>> = comparison.projections.iter().enumerate().map(shown).collect();
    let near: Vec<usize> = (0..clusters.len() - 1).collect();
    figures::plane_and_close_up(
        "Four wall errors in the first two modes",
        &comparison.pdm,
        &clusters,
        &near,
    )
}

/// Mean laps and cluster shapes against run d, draw by draw.
struct Shapes {
    /// By wall, then by draw.
    differences: Vec<Vec<Difference>>,
    /// How much the covariance of the cluster differs from that of the run, by wall, then by draw.
    contrasts: Vec<Vec<f64>>,
}

impl Shapes {
    fn new(study: &Study, comparison: &Comparison) -> Self {
        let (run, runs) = (study.run_named("d", 0), study.real.len());
        let difference = |variant: Variant| {
            let of =
                |draw: &super::study::Draw| Difference::new(&draw.run(variant).cluster, &study.real[run]);
            study.draws.iter().map(of).collect()
        };
        let contrast = |wall: usize| {
            comparison
                .draws
                .iter()
                .map(|draw| draw.pair(run, runs + wall).contrast)
                .collect()
        };
        Self {
            differences: VARIANTS.into_iter().map(difference).collect(),
            contrasts: (0..VARIANTS.len()).map(contrast).collect(),
        }
    }

    fn estimate(&self, wall: usize, number: impl Fn(&Difference) -> f64) -> Estimate {
        Estimate::of(&self.differences[wall].iter().map(number).collect::<Vec<_>>())
    }

    fn tally(&self, so: impl Fn(usize) -> bool) -> Tally {
        Tally::of((0..self.contrasts[0].len()).map(so))
    }

    fn table(&self, study: &Study) -> Table {
        let run = &study.runs()[study.run_named("d", 0)];
        let title = format!("Mean laps against that of run {run}, and cluster shapes against its shape");
        let mut table = Table::new(
            title,
            &[
                "simulation",
                "rms, mm",
                "offset, mm",
                "without offset, mm",
                "correlation",
                "shape contrast",
            ],
        );
        for (wall, name) in NAMES.iter().enumerate() {
            table.push([
                (*name).to_owned(),
                self.estimate(wall, |d| MM * d.rms_m).text(1),
                self.estimate(wall, |d| MM * d.offset_m).text(1),
                self.estimate(wall, |d| MM * d.shape_m).text(1),
                self.estimate(wall, |d| d.correlation).text(3),
                Estimate::of(&self.contrasts[wall]).text(2),
            ]);
        }
        table
    }

    fn caption(&self, study: &Study) -> String {
        let run = &study.runs()[study.run_named("d", 0)];
        format!(
            "Mean laps of measured run {run} and of the simulations with wall errors of 1, 10 and 50 mm: on the course \
             (left), and as positions across the track (right), where differences of millimetres show."
        )
    }

    fn json(&self) -> Value {
        let entry = |(wall, (error_m, _, _)): (usize, &(f64, published::Row, usize))| {
            let value = json!({
                "rms_m": self.estimate(wall, |d| d.rms_m).json("value"),
                "offset_m": self.estimate(wall, |d| d.offset_m).json("value"),
                "without_offset_m": self.estimate(wall, |d| d.shape_m).json("value"),
                "correlation": self.estimate(wall, |d| d.correlation).json("value"),
                "shape_contrast": Estimate::of(&self.contrasts[wall]).json("value"),
            });
            (error_m.to_string(), value)
        };
        Value::Object(WALLS.iter().enumerate().map(entry).collect::<Map<_, _>>())
    }

    fn claims(&self, study: &Study) -> Vec<Claim> {
        let run = &study.runs()[study.run_named("d", 0)];
        let rms = |wall: usize| self.estimate(wall, |d| MM * d.rms_m).text(1);
        let correlation = |wall: usize| self.estimate(wall, |d| d.correlation).text(3);
        let contrast = |wall: usize| Estimate::of(&self.contrasts[wall]).text(2);
        let (finest, fine, middle, coarse) = (0, 1, 2, 3);
        let is = |wall: usize, draw: usize| self.differences[wall][draw];
        vec![
            Claim::counted(
                format!(
                    "The cluster shapes of 1 and 5 mm are closer to that of run {run} than the shape of 10 mm (contrast of \
                     the covariances, 0 where they are equal)"
                ),
                "seen in Fig. 11",
                &format!(
                    "{} and {} against {}",
                    contrast(finest),
                    contrast(fine),
                    contrast(middle)
                ),
                self.tally(|draw| {
                    let [a, b, c] = [finest, fine, middle].map(|wall| self.contrasts[wall][draw]);
                    a.max(b) < c
                }),
            ),
            Claim::counted(
                format!("With 50 mm the mean lap differs most from that of run {run}"),
                "seen in Fig. 12",
                &format!(
                    "{} mm rms against {} with 1 mm and {} with 10 mm",
                    rms(coarse),
                    rms(finest),
                    rms(middle)
                ),
                self.tally(|draw| {
                    is(coarse, draw).rms_m > is(finest, draw).rms_m.max(is(middle, draw).rms_m)
                }),
            ),
            Claim::counted(
                format!("The mean lap of 10 mm is closer to that of run {run} than the one of 1 mm"),
                "seen in Fig. 12",
                &format!("{} mm rms against {}", rms(middle), rms(finest)),
                self.tally(|draw| is(middle, draw).rms_m < is(finest, draw).rms_m),
            ),
            Claim::counted(
                format!(
                    "The oscillations of the mean lap of 1 mm are more like those of run {run} than the ones of 10 mm \
                     (correlation over the gates)"
                ),
                "seen in Fig. 12",
                &format!("{} against {}", correlation(finest), correlation(middle)),
                self.tally(|draw| is(finest, draw).correlation > is(middle, draw).correlation),
            ),
        ]
    }
}

fn mean_laps_figure(study: &Study) -> Figure {
    let run = study.run_named("d", 0);
    let draw = &study.draws[0];
    let simulated = |wall: usize, color: Color, dash: Dash| {
        let style = line(color, dash, 1.4);
        (
            NAMES[wall].to_owned(),
            draw.run(VARIANTS[wall]).cluster.mean(),
            style,
        )
    };
    let curves = vec![
        (
            format!("measured, run {}", study.runs()[run]),
            study.real[run].mean(),
            line(Color::INK, Dash::Solid, 2.0),
        ),
        simulated(0, Color::BLUE, Dash::Solid),
        simulated(2, Color::GREEN, Dash::Dashed),
        simulated(3, Color::VERMILLION, Dash::DashDot),
    ];
    let lap = |(label, offsets_m, style): &(String, Vec<f64>, Style)| {
        let mut points = figures::crossings(study.circuit(), offsets_m);
        points.push(points[0]);
        figures::paths(label, *style, &[points])
    };
    let marks = std::iter::once(walls(&study.circuit().course))
        .chain(curves.iter().map(lap))
        .collect();
    Figure {
        title: "Mean laps".into(),
        description: "Mean laps on the course, and their positions across the track gate by gate.".into(),
        panels: vec![
            Panel {
                size_px: [420.0, 360.0],
                ..map("on the course", marks)
            },
            Panel {
                size_px: [420.0, 360.0],
                title: "across the track".into(),
                ..across(&curves)
            },
        ],
        columns: 2,
        legend: Side::Below,
        ..Figure::default()
    }
}
