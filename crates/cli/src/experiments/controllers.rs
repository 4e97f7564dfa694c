//! Section IV-A: are the two controllers told apart by their laps?

use anyhow::Result;
use chart::{Color, Figure, Fill, Marker, Panel, Side, Style};
use pdm::Cluster;
use serde_json::{Value, json};

use super::comparison::{Comparison, Space};
use super::estimate::{Estimate, Tally};
use super::outcome::{Block, Claim, Outcome, Picture, Section};
use super::published::{NEAREST_BRAITENBERG, NEAREST_OTHER, NEAREST_RULE_BASED};
use super::study::{Draw, Study};
use crate::figures::{self, Shown, map, paths, walls};
use crate::laps::Measured;
use crate::table::Table;

/// Runs of two controllers in one PDM: first those of the rule-based one, then the Braitenberg one's.
struct Controllers {
    comparison: Comparison,
    /// `rule-based/a`, ...
    names: Vec<String>,
    /// How many of them are rule-based.
    rule_based: usize,
}

/// The experiment, on measured laps as in the paper and on simulated ones beside it.
pub(crate) fn outcome(study: &Study) -> Result<Outcome> {
    let (one, other) = (&study.measured.rule_based, &study.measured.braitenberg);
    let measured: Vec<Cluster> = [one.clusters()?, other.clusters()?].concat();
    let names = |measured: &Measured, kind: &str| {
        measured
            .runs
            .iter()
            .map(|run| format!("{kind}/{}", run.run))
            .collect::<Vec<_>>()
    };
    let real = Controllers {
        comparison: Comparison::new(&[measured.iter().collect()])?,
        names: [names(one, "rule-based"), names(other, "Braitenberg")].concat(),
        rule_based: one.runs.len(),
    };
    let of_draw = |draw: &'_ Draw| -> Vec<Cluster> {
        draw.rule_based
            .iter()
            .chain(&draw.braitenberg)
            .map(|run| run.cluster.clone())
            .collect()
    };
    let drawn: Vec<Vec<Cluster>> = study.draws.iter().map(of_draw).collect();
    let runs = study.draws[0].rule_based.len();
    let name = |kind: &str| {
        (0..runs)
            .map(|run| format!("{kind}/{}", crate::dataset::run_name(run)))
            .collect::<Vec<_>>()
    };
    let simulated = Controllers {
        comparison: Comparison::new(&drawn.iter().map(|draw| draw.iter().collect()).collect::<Vec<_>>())?,
        names: [name("rule-based"), name("Braitenberg")].concat(),
        rule_based: runs,
    };
    let lower = lower_half(study, &measured, real.rule_based);
    Ok(Outcome {
        section: section(study, &real, &simulated, lower),
        csv: vec![("controllers.csv", csv(&real, &simulated))],
        json: vec![
            ("controllers", real.json()),
            ("controllers_simulated", simulated.json()),
        ],
    })
}

impl Controllers {
    /// The nearest other run of a run's own controller in one draw: its place and the distance.
    fn nearest(&self, draw: &Space, run: usize, own: bool) -> (usize, f64) {
        let eligible =
            |&other: &usize| other != run && own == ((other < self.rule_based) == (run < self.rule_based));
        let distance = |other: usize| (other, draw.distance(run, other));
        let nearest = (0..self.names.len())
            .filter(eligible)
            .map(distance)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.expect("each controller has at least two runs")
    }

    fn distance(&self, run: usize, own: bool) -> Estimate {
        self.comparison.estimate(|draw| self.nearest(draw, run, own).1)
    }

    /// How many runs are nearer to one of their own controller than to any of the other.
    fn classified(&self, draw: &Space) -> usize {
        let right = |&run: &usize| self.nearest(draw, run, true).1 < self.nearest(draw, run, false).1;
        (0..self.names.len()).filter(right).count()
    }

    /// Least and greatest nearest distance of these runs in the first draw.
    fn range(&self, runs: std::ops::Range<usize>, own: bool) -> [f64; 2] {
        let distances = runs.map(|run| self.distance(run, own).first);
        distances.fold([f64::INFINITY, 0.0], |[low, high], d| [low.min(d), high.max(d)])
    }

    fn json(&self) -> Value {
        let nearest = |own: bool| -> Vec<Value> {
            let entry = |run: usize| {
                let mut entry = json!({ "run": self.names[run] });
                if let (Some(entry), Value::Object(estimate)) =
                    (entry.as_object_mut(), self.distance(run, own).json("distance"))
                {
                    entry.extend(estimate);
                    entry.insert(
                        "nearest".into(),
                        self.names[self.nearest(&self.comparison.draws[0], run, own).0]
                            .clone()
                            .into(),
                    );
                }
                entry
            };
            (0..self.names.len()).map(entry).collect()
        };
        let classified = self.classified(&self.comparison.draws[0]);
        json!({
            "nearest_same": nearest(true),
            "nearest_other": nearest(false),
            "classified": format!("{classified}/{}", self.names.len()),
        })
    }

    fn table(&self, title: &str, paper: bool) -> Table {
        let mut table = Table::new(
            title,
            &["run", "nearest of its controller", "nearest of the other"],
        );
        for (run, name) in self.names.iter().enumerate() {
            table.push([
                name.clone(),
                self.distance(run, true).text(1),
                self.distance(run, false).text(1),
            ]);
        }
        if paper {
            for (kind, [low, high]) in [
                ("rule-based", NEAREST_RULE_BASED),
                ("Braitenberg", NEAREST_BRAITENBERG),
            ] {
                let other = format!("{NEAREST_OTHER:.1} or more");
                table.push([format!("{kind}, paper"), format!("{low:.1} to {high:.1}"), other]);
            }
        }
        table
    }

    fn panel(&self, title: &str) -> Panel {
        let shown = |(run, projection)| {
            let rule_based = run < self.rule_based;
            let (color, kind) = if rule_based {
                (Color::VERMILLION, "rule-based")
            } else {
                (Color::BLUE, "Braitenberg")
            };
            let number = if rule_based { run } else { run - self.rule_based };
            let style = Style {
                marker: Marker::series(number),
                fill: if rule_based { Fill::Open } else { Fill::Solid },
                size_px: 6.0,
                width_px: 1.1,
                ..Style::color(color)
            };
            let label = format!("{kind} {}", crate::dataset::run_name(number));
            Shown {
                projection,
                label,
                style,
            }
        };
        let clusters: Vec<Shown<'_>> = self
            .comparison
            .projections
            .iter()
            .enumerate()
            .map(shown)
            .collect();
        figures::plane(title, &self.comparison.pdm, &clusters)
    }
}

/// What of the track lies in the lower half of the arena.
#[derive(Debug, Clone, Copy)]
struct LowerHalf {
    /// The share of the difference of the controllers' mean laps, in squares.
    difference: f64,
    /// The share of the gates.
    gates: f64,
}

fn lower_half(study: &Study, clusters: &[Cluster], rule_based: usize) -> LowerHalf {
    let gates = &study.circuit().gates;
    let mean = |clusters: &[Cluster], gate: usize| {
        clusters
            .iter()
            .map(|cluster| cluster.laps().column(gate).mean())
            .sum::<f64>()
            / clusters.len() as f64
    };
    let (one, other) = clusters.split_at(rule_based);
    let middle_m = study.circuit().course.arena_m[1] / 2.0;
    let squares = (0..gates.len()).map(|gate| (mean(one, gate) - mean(other, gate)).powi(2));
    let squares: Vec<(f64, bool)> = squares
        .zip(gates)
        .map(|(square, gate)| (square, gate.center.y < middle_m))
        .collect();
    let all: f64 = squares.iter().map(|(square, _)| square).sum();
    let lower = || squares.iter().filter(|(_, lower)| *lower);
    LowerHalf {
        difference: lower().map(|(square, _)| square).sum::<f64>() / all,
        gates: lower().count() as f64 / squares.len() as f64,
    }
}

fn claims(real: &Controllers, simulated: &Controllers, lower: LowerHalf) -> Vec<Claim> {
    let count = real.names.len();
    let classified = real.classified(&real.comparison.draws[0]);
    let within = |range: [f64; 2], paper: [f64; 2]| range[0] >= paper[0] && range[1] <= paper[1];
    let words = |[low, high]: [f64; 2]| format!("{low:.1} to {high:.1}");
    let (first, second) = (
        real.range(0..real.rule_based, true),
        real.range(real.rule_based..count, true),
    );
    let [other, _] = real.range(0..count, false);
    let all = simulated.names.len();
    let in_simulation = Tally::of(
        simulated
            .comparison
            .draws
            .iter()
            .map(|draw| simulated.classified(draw) == all),
    );
    vec![
        Claim::new(
            "Each run is nearer to a run of its own controller than to any of the other, so that all are classified rightly",
            "8 of 8 (100 %)",
            format!("{classified} of {count}"),
            classified == count,
        ),
        Claim::new(
            format!(
                "The nearest other run of the rule-based controller is {} away",
                words(NEAREST_RULE_BASED)
            ),
            words(NEAREST_RULE_BASED),
            words(first),
            within(first, NEAREST_RULE_BASED),
        ),
        Claim::new(
            format!(
                "The nearest other run of the Braitenberg controller is {} away",
                words(NEAREST_BRAITENBERG)
            ),
            words(NEAREST_BRAITENBERG),
            words(second),
            within(second, NEAREST_BRAITENBERG),
        ),
        Claim::new(
            format!("Runs of different controllers are at least {NEAREST_OTHER} apart"),
            format!("{NEAREST_OTHER}"),
            format!("{other:.1}"),
            other >= NEAREST_OTHER,
        ),
        Claim::new(
            "The main difference between the two controllers lies in the lower part of the circuit (at \
             least two thirds of the squared difference of the mean laps)",
            "seen in Fig. 6",
            format!(
                "{:.0} % of it is in the lower half of the arena, on {:.0} % of the gates",
                100.0 * lower.difference,
                100.0 * lower.gates
            ),
            lower.difference >= 2.0 / 3.0,
        ),
        Claim::counted(
            "The classification that simulation reaches is reached on the measured laps too",
            "100 % in both",
            &format!("measured {classified} of {count}, simulated {all} of {all}"),
            Tally {
                times: if classified == count {
                    in_simulation.times
                } else {
                    0
                },
                ..in_simulation
            },
        ),
    ]
}

fn section(study: &Study, real: &Controllers, simulated: &Controllers, lower: LowerHalf) -> Section {
    let panels = vec![
        real.panel("measured"),
        simulated.panel("simulated (declared model)"),
    ];
    let planes = Figure {
        title: "The runs of two controllers in the first two modes".into(),
        description: "Every lap, with an ellipse of two standard deviations round each run.".into(),
        panels,
        columns: 2,
        legend: Side::Below,
        ..Figure::default()
    };
    Section {
        heading: "Two controllers".into(),
        blocks: vec![
            Block::Text(
                "All runs of both controllers go into one PDM. A run is classified rightly if the run nearest to it, \
                 by eq. 8 in the first two modes, is of the same controller. The paper did this on camera laps; the \
                 declared model does the same beside it, with intervals over the draws."
                    .into(),
            ),
            Picture::block(
                "fig06_controllers",
                "Fig. 6",
                "Four laps of each controller, measured (left) and simulated (right).",
                laps_figure(study),
            ),
            Picture::block(
                "fig07_controllers_pdm",
                "Fig. 7",
                "The laps of all runs in the first two modes of the PDM of both controllers, measured (left) and \
                 simulated (right). Each panel is a PDM of its own, so its axes are its own.",
                planes,
            ),
            Block::Table(real.table("Nearest runs, measured laps", true)),
            Block::Table(simulated.table("Nearest runs, simulated laps", false)),
            Block::Claims(claims(real, simulated, lower)),
        ],
    }
}

/// Four laps of each controller.
fn laps_figure(study: &Study) -> Figure {
    let course = &study.circuit().course;
    let lines = [Color::VERMILLION, Color::BLUE].map(|color| Style {
        width_px: 1.0,
        opacity: 0.8,
        ..Style::color(color)
    });
    let panel = |title: &str, [one, other]: [&[Vec<[f64; 2]>]; 2]| {
        let marks = vec![
            walls(course),
            paths("rule-based", lines[0], one),
            paths("Braitenberg", lines[1], other),
        ];
        Panel {
            size_px: [420.0, 360.0],
            ..map(title, marks)
        }
    };
    let of = |measured: &Measured| -> Vec<Vec<[f64; 2]>> {
        (0..measured.runs[0].laps.len().min(4))
            .map(|lap| measured.path(0, lap))
            .collect()
    };
    let (one, other) = (of(&study.measured.rule_based), of(&study.measured.braitenberg));
    let draw = &study.draws[0];
    Figure {
        title: "Laps of two controllers".into(),
        description: "Four laps of each controller over the walls.".into(),
        panels: vec![
            panel("measured", [&one, &other]),
            panel(
                "simulated",
                [&draw.rule_based[0].paths, &draw.braitenberg[0].paths],
            ),
        ],
        columns: 2,
        legend: Side::Below,
        ..Figure::default()
    }
}

fn csv(real: &Controllers, simulated: &Controllers) -> String {
    let mut csv =
        String::from("laps,run,nearest_same,same_low,same_high,nearest_other,other_low,other_high\n");
    for (kind, controllers) in [("measured", real), ("simulated", simulated)] {
        for (run, name) in controllers.names.iter().enumerate() {
            let cells = [true, false].map(|own| {
                let Estimate { mean, low, high, .. } = controllers.distance(run, own);
                format!("{mean},{low},{high}")
            });
            csv += &format!("{kind},{name},{}\n", cells.join(","));
        }
    }
    csv
}
