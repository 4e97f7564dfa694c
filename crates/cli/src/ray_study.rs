//! What ray casting costs, and what the cost of finer walls buys.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Result;
use chart::{Axis, Figure, Interval, Mark, Panel, Shape, Style};
use pdm::Cluster;
use rayon::prelude::*;
use serde_json::{Value, json};
use sim::{Caster, CasterKind, Circuit, Pose, Rays, Run, Streams, Vec2, Walls, max_error_for, segment_count};
use track::Course;

use crate::config::Config;
use crate::experiments::{Block, Comparison, Estimate, Section};
use crate::interrupt;
use crate::laps;
use crate::setup::Setup;
use crate::table::Table;

/// Control steps whose poses are cast from: two laps.
const POSES: usize = 2200;
/// Longest time that one figure may take to measure.
const PATIENCE: Duration = Duration::from_millis(80);
/// Passes of which the quickest counts: what is slower was disturbed.
const PASSES: usize = 7;

/// The name under which the caster that a run chooses stands.
const CHOSEN: &str = "default";

/// Cost of one number of segments.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(crate) segments: usize,
    pub(crate) max_error_m: f64,
    /// Nanoseconds for eight rays, by caster.
    pub(crate) ns_per_reading: BTreeMap<String, f64>,
    /// Nanoseconds for a control step, by caster.
    pub(crate) ns_per_step: BTreeMap<String, f64>,
}

/// The casters that are compared.
fn casters() -> [(&'static str, Option<CasterKind>); 3] {
    [
        ("brute", Some(CasterKind::Brute)),
        ("bvh", Some(CasterKind::Bvh)),
        (CHOSEN, None),
    ]
}

/// Measures casters against numbers of segments on a circuit, numbers that come out equal once; each tick is one of three casters at one number.
///
/// # Errors
/// A number of segments that the circuit cannot be cut into.
pub(crate) fn measure(
    config: &Config,
    circuit: &Arc<Circuit>,
    segments: &[usize],
    tick: &dyn Fn(),
) -> Result<Vec<Row>> {
    let poses = driven_poses(config, circuit)?;
    let row = |max_error_m: f64| {
        let mut config = config.clone();
        config.wall.max_error_m = max_error_m;
        let mut row = Row {
            segments: 0,
            max_error_m,
            ns_per_reading: BTreeMap::new(),
            ns_per_step: BTreeMap::new(),
        };
        for (name, kind) in casters() {
            interrupt::check()?;
            let setup = Setup::new(&config, Arc::clone(circuit), kind)?;
            row.segments = setup.scene.walls().len();
            row.ns_per_reading.insert(name.into(), reading_ns(&setup, &poses));
            row.ns_per_step.insert(name.into(), step_ns(&setup)?);
            tick();
        }
        Ok(row)
    };
    cuts(&circuit.course, segments)?.into_iter().map(row).collect()
}

/// The maximal errors that give the numbers of segments nearest to these, each number once.
fn cuts(course: &Course, segments: &[usize]) -> Result<Vec<f64>> {
    let mut cuts: Vec<(usize, f64)> = Vec::new();
    for &wanted in segments {
        let max_error_m = max_error_for(course, wanted)?;
        let found = segment_count(course, max_error_m)?;
        if cuts.iter().all(|&(count, _)| count != found) {
            cuts.push((found, max_error_m));
        }
    }
    Ok(cuts.into_iter().map(|(_, max_error_m)| max_error_m).collect())
}

/// Poses of a robot that drives laps.
fn driven_poses(config: &Config, circuit: &Arc<Circuit>) -> Result<Vec<Pose>> {
    let setup = Setup::new(config, Arc::clone(circuit), None)?;
    let world = setup.scene.world(&setup.model, 0)?;
    let mut run = Run::new(&world, Streams { seed: 1, run: 0 })?;
    let mut poses = Vec::with_capacity(POSES);
    for _ in 0..POSES {
        run.step();
        poses.push(run.pose());
    }
    Ok(poses)
}

/// The quickest of several passes, ns for each of as many units as fit into the time; `work` does the units from `0` on.
fn quickest_ns(most: usize, mut work: impl FnMut(usize)) -> f64 {
    let first = Instant::now();
    work(1);
    let once = first.elapsed().max(Duration::from_nanos(20));
    let units = ((PATIENCE.as_secs_f64() / PASSES as f64 / once.as_secs_f64()) as usize).clamp(1, most);
    (0..PASSES)
        .map(|_| {
            let begun = Instant::now();
            work(units);
            begun.elapsed().as_secs_f64() * 1e9 / units as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn reading_ns(setup: &Setup, poses: &[Pose]) -> f64 {
    let mounts = &setup.model.machine.mounts;
    let body = Rays::new(mounts.map(|m| (m.position, Vec2::new(m.angle_rad.cos(), m.angle_rad.sin()))));
    let looks: Vec<(Vec2, Rays)> = poses
        .iter()
        .map(|pose| (pose.position, body.placed(*pose)))
        .collect();
    let (caster, walls): (&Caster, &Walls) = (setup.scene.caster(), setup.scene.walls());
    quickest_ns(20 * looks.len(), |units| {
        for (center, rays) in looks.iter().cycle().take(units) {
            black_box(caster.cast(walls, *center, black_box(rays)));
        }
    })
}

fn step_ns(setup: &Setup) -> Result<f64> {
    let world = setup.scene.world(&setup.model, 0)?;
    let mut run = Run::new(&world, Streams { seed: 1, run: 0 })?;
    Ok(quickest_ns(20 * POSES, |units| {
        for _ in 0..units {
            black_box(run.step());
        }
    }))
}

/// Cost against rays per sensor at the declared walls: rays, and ns per control step if responses and if distances are averaged.
///
/// # Errors
/// A model that cannot be simulated.
pub(crate) fn cone_cost(config: &Config, circuit: &Arc<Circuit>) -> Result<Vec<(usize, [f64; 2])>> {
    let step = |rays: usize, combine: &str| -> Result<f64> {
        interrupt::check()?;
        let config = config
            .with("sensor.rays", &rays.to_string())?
            .with("sensor.half_angle_rad", "0.3")?
            .with("sensor.combine", combine)?;
        step_ns(&Setup::new(&config, Arc::clone(circuit), None)?)
    };
    [1, 3, 10, 30, 100]
        .into_iter()
        .map(|rays| Ok((rays, [step(rays, "responses")?, step(rays, "distances")?])))
        .collect()
}

/// Slope and intercept of cost against segments, ns; the slope of its logarithm against that of the segments.
fn slopes(rows: &[Row], name: &str) -> Value {
    let points: Vec<(f64, f64)> = rows
        .iter()
        .map(|row| (row.segments as f64, row.ns_per_reading[name]))
        .collect();
    let (slope, intercept) = weighted_line(&points);
    let logs: Vec<(f64, f64)> = points.iter().map(|(n, t)| (n.ln(), t.ln())).collect();
    let tenfold: Vec<(f64, f64)> = points.iter().map(|(n, t)| (n.log10(), *t)).collect();
    json!({
        "ns_per_segment": slope, "intercept_ns": intercept,
        "exponent": line(&logs).0, "ns_per_tenfold": line(&tenfold).0,
    })
}

/// Least squares on relative errors: costs span orders of magnitude.
fn weighted_line(points: &[(f64, f64)]) -> (f64, f64) {
    let sum = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>();
    let w = |t: f64| 1.0 / (t * t);
    let (s, sx, sy) = (sum(&|p| w(p.1)), sum(&|p| w(p.1) * p.0), sum(&|p| w(p.1) * p.1));
    let (sxx, sxy) = (sum(&|p| w(p.1) * p.0 * p.0), sum(&|p| w(p.1) * p.0 * p.1));
    let slope = (s * sxy - sx * sy) / (s * sxx - sx * sx);
    (slope, (sy - slope * sx) / s)
}

fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = (
        points.iter().map(|p| p.0).sum::<f64>() / n,
        points.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let sxy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let sxx: f64 = points.iter().map(|p| (p.0 - mx) * (p.0 - mx)).sum();
    (sxy / sxx, my - sxy / sxx * mx)
}

/// The rows and their slopes (where there are at least two numbers of segments).
pub(crate) fn document(rows: &[Row], cone: &[(usize, [f64; 2])]) -> Value {
    let row = |row: &Row| {
        json!({
            "segments": row.segments, "max_error_m": row.max_error_m,
            "ns_per_reading": row.ns_per_reading, "ns_per_step": row.ns_per_step,
        })
    };
    let fitted = casters().map(|(name, _)| (name.to_owned(), slopes(rows, name)));
    let slopes = if rows.len() > 1 {
        Value::Object(fitted.into_iter().collect())
    } else {
        json!({})
    };
    let ray = |(rays, [responses, distances]): &(usize, [f64; 2])| json!({ "rays_per_sensor": rays, "ns_per_step": { "responses": responses, "distances": distances } });
    json!({
        "rows": rows.iter().map(row).collect::<Vec<_>>(),
        "slopes": slopes,
        "cone": cone.iter().map(ray).collect::<Vec<_>>(),
    })
}

/// Cost against segments, one line for each caster, on logarithmic axes.
pub(crate) fn cost_panel(rows: &[Row]) -> Panel {
    let mark = |(i, (name, _)): (usize, (&str, Option<CasterKind>))| {
        let label = match name {
            "brute" => "plain loop",
            "bvh" => "BVH of parry2d",
            _ => "lapwing",
        };
        let points: Vec<[f64; 2]> = rows
            .iter()
            .map(|row| [row.segments as f64, row.ns_per_reading[name]])
            .collect();
        [
            Mark::new(label, Style::series(i), Shape::Line(points.clone())),
            Mark::new(label, Style::series(i), Shape::Points(points)),
        ]
    };
    Panel {
        x: Axis::log("straight segments"),
        y: Axis::log("eight rays, ns"),
        marks: casters().into_iter().enumerate().flat_map(mark).collect(),
        ..Panel::default()
    }
}

/// What one maximal error of the walls costs and buys.
#[derive(Debug, Clone)]
pub(crate) struct Rung {
    pub(crate) max_error_m: f64,
    pub(crate) segments: usize,
    /// Distance to the measured runs (eq. 8), mean over them; none where the robot completes too few laps.
    pub(crate) distance: Option<Estimate>,
    /// Cost of a control step, ns.
    pub(crate) ns_per_step: f64,
}

/// The maximal errors of the ladder, m.
pub(crate) const LADDER_M: [f64; 10] = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 1e-1];

/// Faithfulness against cost: for every maximal error the distance of simulated laps to measured runs, in a PDM for each of
/// several draws of all of them together.
///
/// # Errors
/// A model that cannot be simulated.
pub(crate) fn ladder(
    config: &Config,
    circuit: &Arc<Circuit>,
    real: &[Cluster],
    (seed, draws, wanted): (u64, usize, usize),
) -> Result<Vec<Rung>> {
    let mut setups = Vec::new();
    for max_error_m in LADDER_M {
        let mut config = config.clone();
        config.wall.max_error_m = max_error_m;
        // Too coarse a cut has no closed wall left, or one that shuts the robot out: there the ladder ends.
        let Ok(setup) = Setup::new(&config, Arc::clone(circuit), None) else {
            break;
        };
        setups.push(setup);
    }
    let jobs: Vec<(usize, u64)> = (0..setups.len())
        .flat_map(|i| (0..draws as u64).map(move |d| (i, d)))
        .collect();
    let driven = jobs.par_iter().map(|&(i, draw)| {
        interrupt::check()?;
        let drive = setups[i].drive(
            Streams {
                seed,
                run: 1000 + draw * LADDER_M.len() as u64 + i as u64,
            },
            wanted,
            |_| {},
        )?;
        Ok(laps::simulated(&format!("{i}"), 0, &drive, wanted))
    });
    let driven: Vec<laps::SampledRun> = driven.collect::<Result<_>>()?;
    let whole = |i: usize| (0..draws).all(|d| driven[i * draws + d].laps.len() == wanted);
    let usable: Vec<usize> = (0..setups.len()).filter(|&i| whole(i)).collect();
    let clusters: Vec<Vec<Cluster>> = (0..draws)
        .map(|d| {
            usable
                .iter()
                .map(|&i| driven[i * draws + d].cluster())
                .collect::<Result<_>>()
        })
        .collect::<Result<_>>()?;
    let together: Vec<Vec<&Cluster>> = clusters
        .iter()
        .map(|simulated| real.iter().chain(simulated).collect())
        .collect();
    let comparison = Comparison::new(&together)?;
    let mut rungs = Vec::with_capacity(setups.len());
    for (i, setup) in setups.iter().enumerate() {
        let place = usable.iter().position(|&u| u == i);
        let distance = place.map(|place| {
            comparison.estimate(|draw| {
                (0..real.len())
                    .map(|r| draw.distance(r, real.len() + place))
                    .sum::<f64>()
                    / real.len() as f64
            })
        });
        let (max_error_m, segments) = (LADDER_M[i], setup.scene.walls().len());
        rungs.push(Rung {
            max_error_m,
            segments,
            distance,
            ns_per_step: step_ns(setup)?,
        });
    }
    Ok(rungs)
}

/// Distance to the measured laps against the cost of a control step, each point with the interval of the draws.
pub(crate) fn ladder_panel(rungs: &[Rung]) -> Panel {
    let known: Vec<(&Rung, Estimate)> = rungs
        .iter()
        .filter_map(|rung| rung.distance.map(|d| (rung, d)))
        .collect();
    let at = |rung: &Rung| rung.ns_per_step / 1000.0;
    let style = Style::series(2);
    let points = known.iter().map(|(rung, d)| [at(rung), d.mean]).collect();
    let intervals = known
        .iter()
        .map(|(rung, d)| Interval {
            at: at(rung),
            low: d.low,
            high: d.high,
        })
        .collect();
    let notes = known.iter().map(|(rung, d)| chart::Note {
        at: [at(rung), d.high],
        text: format!("{} mm", 1000.0 * rung.max_error_m),
        anchor: chart::Anchor::Above,
    });
    Panel {
        x: Axis::linear("a control step, µs"),
        y: Axis::log("distance to the measured runs (eq. 8)"),
        marks: vec![
            Mark::new(
                "walls within so many mm",
                style,
                Shape::ErrorBars {
                    intervals,
                    direction: chart::Direction::Vertical,
                },
            ),
            Mark::new("walls within so many mm", style, Shape::Points(points)),
            Mark::new(
                "",
                Style {
                    text_px: 10.0,
                    ..Style::color(chart::Color::GREY)
                },
                Shape::Notes(notes.collect()),
            ),
        ],
        ..Panel::default()
    }
}

/// The coarsest walls that are no less faithful than the finest: their mean distance lies within the finest's interval or below.
pub(crate) fn coarsest_faithful(rungs: &[Rung]) -> Option<&Rung> {
    let finest = rungs.iter().find_map(|rung| rung.distance)?;
    rungs
        .iter()
        .rev()
        .find(|rung| rung.distance.is_some_and(|d| d.mean <= finest.high))
}

/// The ladder without what a clock measured.
pub(crate) fn ladder_table(rungs: &[Rung]) -> Table {
    let mut table = Table::new(
        "Faithfulness of a ladder of wall errors",
        &["maximal error, mm", "segments", "distance to the measured runs"],
    );
    for rung in rungs {
        let distance = rung.distance.map_or("too few laps".into(), |d| d.text(2));
        table.push([
            format!("{}", 1000.0 * rung.max_error_m),
            rung.segments.to_string(),
            distance,
        ]);
    }
    table
}

/// Both panels.
pub(crate) fn figure(rows: &[Row], rungs: &[Rung]) -> Figure {
    Figure {
        title: "Cost of ray casting".into(),
        description:
            "Left: nanoseconds for eight rays against the number of segments, for a plain loop, parry2d's BVH and lapwing. Right: \
             distance to the measured laps against the cost of a control step."
                .into(),
        panels: vec![cost_panel(rows), ladder_panel(rungs)],
        columns: 2,
        legend: chart::Side::Below,
        ..Figure::default()
    }
}

/// The path of the picture that a clock measured, from the report.
pub(crate) const PICTURE: &str = "figures/rays_timing.svg";

/// The section of the report.
pub(crate) fn section(rungs: &[Rung], draws: usize) -> Section {
    let coarsest = coarsest_faithful(rungs).map_or_else(String::new, |rung| {
        format!(
            " The coarsest walls that are no less faithful than the finest: {} mm, {} segments.",
            1000.0 * rung.max_error_m,
            rung.segments
        )
    });
    let text = format!(
        "The paper trades the number of segments for computing time, because tracing rays costs a time linear in it. Below are \
         the cost of eight rays against the number of segments, for a plain loop, for a bounding volume hierarchy and for the \
         caster that lapwing chooses, and what finer walls buy: the distance of the simulated laps to the measured runs \
         (mean of eq. 8 over the runs; mean and middle 95 % of {draws} draws, each with a PDM of its own).{coarsest}"
    );
    let caption = format!(
        "Fig. R. Left: cost of eight rays against the number of segments. Right: distance to the measured runs against the cost \
         of a control step, for walls within the errors named. Measured on this machine when the report was made; the picture \
         lies beside this page as {PICTURE}, since all that stands in the page itself is the same whenever it is made."
    );
    Section {
        heading: "What ray casting costs".into(),
        blocks: vec![
            Block::Text(text),
            Block::Linked {
                path: PICTURE.into(),
                caption,
            },
            Block::Table(ladder_table(rungs)),
        ],
    }
}
