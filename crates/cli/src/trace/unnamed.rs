//! A cause without a name, in words and drawn.

use std::f64::consts::TAU;

use chart::{Axis, Color, Dash, Figure, Mark, Panel, Shape};
use diagnose::{Candidate, Cause};
use sim::{Pattern, Streams, Vec2, WheelSpeeds, unlisted_area, unlisted_at, unlisted_on_floor};

use super::Trace;
use super::recording::Recording;
use crate::experiments::{Block, Picture};
use crate::figures::{colored_path, crossings, line, single};
use crate::setup::Setup;
use crate::table::with_error;

/// What a claimed cause without a name does over what it depends on: a map of the floor, or a curve.
pub(super) fn unnamed(trace: &Trace) -> Option<Block> {
    let effect = trace
        .answer
        .claimed()?
        .effects
        .iter()
        .find(|effect| Cause::of(&effect.setting).is_some())?;
    let cause = Cause::of(&effect.setting)?;
    let Pattern::Constant(values) = &effect.setting.pattern else {
        return None;
    };
    let label = format!("{}, {}", cause.acts_on, unit(&cause));
    let figure = if cause.depends_on == "place" {
        on_floor(trace, values, label)
    } else {
        curve(trace, values, &cause.depends_on, label)
    };
    let caption = format!(
        "What the robot does and the model does not: change of the {} over the {}.",
        cause.acts_on, cause.depends_on
    );
    Some(Picture::block("unlisted", "", caption, figure))
}

/// A cause without a name with what is known of it, for a sentence.
pub(super) fn in_words(trace: &Trace, effect: &Candidate, cause: &Cause) -> String {
    let acts_on = &cause.acts_on;
    let numbers = effect.setting.pattern.numbers();
    let Some(area) = unlisted_area(&numbers) else {
        let depends = match cause.depends_on.as_str() {
            "constant" => "is constant".to_owned(),
            on => format!("depends on the {on}"),
        };
        let size = largest(trace, effect, cause);
        return format!("an effect without a name on the {acts_on} that {depends} ({size})");
    };
    let middle = area.middle_m + trace.shown().0.setup.scene.circuit().middle();
    let errors = &effect.standard_errors[effect.setting.spec.params.len()..];
    format!(
        "an effect without a name on the {acts_on} in an area of the floor ({} {}, at x = {} m, y = {} m, radius {} m, if it is round and fades outwards)",
        with_error(area.amount, errors[0]),
        unit(cause),
        with_error(middle.x, errors[1]),
        with_error(middle.y, errors[2]),
        with_error(area.radius_m, errors[3]),
    )
}

/// The largest amount of a cause, with its unit, and where that is.
fn largest(trace: &Trace, effect: &Candidate, cause: &Cause) -> String {
    let values = effect.setting.pattern.numbers();
    let amount = |at: &dyn Fn(&[f64]) -> f64| {
        // What each coefficient's standard error changes: none is known of two together.
        let change = |(i, error): (usize, &f64)| {
            let mut moved = values.clone();
            moved[i] += error;
            (at(&moved) - at(&values)).powi(2)
        };
        let errors = effect.standard_errors.iter().enumerate();
        let errors = errors.skip(effect.setting.spec.params.len());
        let error = errors.map(change).sum::<f64>().sqrt();
        format!("{} {}", with_error(at(&values), error), unit(cause))
    };
    if cause.depends_on == "place" {
        let middle = trace.shown().0.setup.scene.circuit().middle();
        let lap = mean_lap(trace).into_iter().map(|[x, y]| Vec2::new(x, y));
        let size = |place: &Vec2| unlisted_on_floor(&values, *place - middle).abs();
        let Some(most) = lap.max_by(|a, b| size(a).total_cmp(&size(b))) else {
            return "of no size".to_owned();
        };
        return format!(
            "along the mean lap as large as {}, at x = {:.2} m, y = {:.2} m",
            amount(&|values| unlisted_on_floor(values, most - middle)),
            most.x,
            most.y
        );
    }
    if cause.depends_on == "constant" {
        return amount(&|values| unlisted_at(values, 1.0));
    }
    let variable = Variable::new(trace, &cause.depends_on);
    let size = |u: &f64| unlisted_at(&values, *u).abs();
    // The first of several.
    let most = variable.values().rev().max_by(|a, b| size(a).total_cmp(&size(b)));
    let most = most.unwrap_or(variable.low);
    format!(
        "as large as {}, where the {} is {most:.3} {}",
        amount(&|values| unlisted_at(values, most)),
        variable.name,
        variable.unit
    )
}

/// The unit of what a cause does to what it acts on.
fn unit(cause: &Cause) -> &'static str {
    match cause.acts_on.as_str() {
        "yaw rate" => "rad/s",
        "side slip" => "m/s",
        "left-right difference" => "counts",
        "camera x" | "camera y" => "m",
        _ => "share",
    }
}

/// The mean lap of the declared model, gate by gate, m.
fn mean_lap(trace: &Trace) -> Vec<[f64; 2]> {
    let (recording, errors) = trace.shown();
    crossings(recording.setup.scene.circuit(), errors.before.mean_m())
}

fn on_floor(trace: &Trace, coefficients: &[f64], label: String) -> Figure {
    let circuit = trace.shown().0.setup.scene.circuit();
    let middle = circuit.middle();
    let mut points = mean_lap(trace);
    points.push(points[0]);
    let values: Vec<f64> = (points.iter())
        .map(|[x, y]| unlisted_on_floor(coefficients, Vec2::new(*x, *y) - middle))
        .collect();
    let panel = colored_path(circuit, points, values, label, 1e-9);
    single("A cause without a name", "Its size along the mean lap.", panel)
}

/// What a cause without a name may depend on, and from where to where the robot takes it.
struct Variable {
    name: &'static str,
    unit: &'static str,
    low: f64,
    high: f64,
}

impl Variable {
    fn new(trace: &Trace, depends_on: &str) -> Self {
        let (recording, errors) = trace.shown();
        let commands = || commanded(recording);
        let (name, unit, [low, high]) = match depends_on {
            "heading" => ("heading", "rad", [-TAU / 2.0, TAU / 2.0]),
            "gate" => ("place along the lap", "rad", [0.0, TAU]),
            "wheel angle" => ("angle of the wheel", "rad", [0.0, TAU]),
            "time" => {
                let laps = recording.shape().into_iter().max().unwrap_or(1);
                let run_s = errors.before.lap_s() * laps as f64;
                ("time since the run began", "s", [0.0, run_s])
            }
            "speed" => {
                let means = commands().into_iter().map(|c| 0.5 * (c.left_m_s + c.right_m_s));
                ("mean of the commanded speeds", "m/s", ends(means))
            }
            _ => {
                let differences = commands().into_iter().map(|c| c.right_m_s - c.left_m_s);
                ("difference of the commanded speeds", "m/s", ends(differences))
            }
        };
        Self {
            name,
            unit,
            low,
            high,
        }
    }

    /// So many of its values that a curve is smooth.
    fn values(&self) -> impl DoubleEndedIterator<Item = f64> {
        let (low, high) = (self.low, self.high);
        (0..=200).map(move |i| low + (high - low) * f64::from(i) / 200.0)
    }
}

/// The commands of two laps of the declared model.
fn commanded(recording: &Recording) -> Vec<WheelSpeeds> {
    let mut commands = Vec::new();
    let Setup { scene, model } = &recording.setup;
    if let Ok(world) = scene.world(model, recording.first_run) {
        // That the model drives was seen when it was judged.
        let _ = sim::drive(&world, Streams { seed: 0, run: 0 }, 1, |step| {
            commands.push(step.command);
        });
    }
    commands
}

/// The least and the largest of some values.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}

fn curve(trace: &Trace, coefficients: &[f64], depends_on: &str, label: String) -> Figure {
    let variable = Variable::new(trace, depends_on);
    let points = variable.values().map(|u| [u, unlisted_at(coefficients, u)]);
    let marks = vec![Mark::new(
        "",
        line(Color::BLUE, Dash::Solid, 2.0),
        Shape::Line(points.collect()),
    )];
    let panel = Panel {
        x: Axis::linear(format!("{}, {}", variable.name, variable.unit)),
        y: Axis::linear(label),
        marks,
        ..Panel::default()
    };
    single(
        "A cause without a name",
        "Its size over what it depends on.",
        panel,
    )
}
