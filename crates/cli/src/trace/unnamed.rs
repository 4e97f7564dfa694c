//! A cause without a name, in words and drawn.

use std::f64::consts::TAU;

use chart::{Axis, Color, Dash, Figure, Mark, Panel, Shape};
use diagnose::{Candidate, Cause};
use sim::{Pattern, Vec2, unlisted_area, unlisted_at, unlisted_on_floor};

use super::Trace;
use crate::experiments::{Block, Picture};
use crate::figures::{colored_path, crossings, line, single};
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
        return format!(
            "an effect without a name on the {acts_on} that depends on the {}",
            cause.depends_on
        );
    };
    let middle = area.middle_m + trace.shown().0.setup.scene.circuit().middle();
    let errors = &effect.standard_errors[effect.setting.spec.params.len()..];
    format!(
        "an effect without a name on the {acts_on} in an area of the floor ({} {}, at x = {} m, y = {} m, radius {} m)",
        with_error(area.amount, errors[0]),
        unit(cause),
        with_error(middle.x, errors[1]),
        with_error(middle.y, errors[2]),
        with_error(area.radius_m, errors[3]),
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

fn on_floor(trace: &Trace, coefficients: &[f64], label: String) -> Figure {
    let (recording, errors) = trace.shown();
    let circuit = recording.setup.scene.circuit();
    let middle = circuit.middle();
    let mut points = crossings(circuit, errors.before.mean_m());
    points.push(points[0]);
    let values: Vec<f64> = (points.iter())
        .map(|[x, y]| unlisted_on_floor(coefficients, Vec2::new(*x, *y) - middle))
        .collect();
    let panel = colored_path(circuit, points, values, label, 1e-9);
    single("A cause without a name", "Its size along the mean lap.", panel)
}

fn curve(trace: &Trace, coefficients: &[f64], variable: &str, label: String) -> Figure {
    let (recording, errors) = trace.shown();
    let machine = &recording.setup.model.machine;
    let laps = recording.shape().into_iter().max().unwrap_or(1);
    let run_s = errors.before.lap_s() * laps as f64;
    let (axis, low, high) = match variable {
        "heading" => ("heading, rad", -TAU / 2.0, TAU / 2.0),
        "gate" => ("place along the lap, rad", 0.0, TAU),
        "wheel angle" => ("angle of the wheel, rad", 0.0, TAU),
        "time" => ("time since the run began, s", 0.0, run_s),
        "speed" => (
            "mean of the commanded speeds, m/s",
            0.0,
            machine.robot.wheel_speed_limit_m_s,
        ),
        _ => (
            "difference of the commanded speeds, m/s",
            -machine.robot.wheel_speed_limit_m_s,
            machine.robot.wheel_speed_limit_m_s,
        ),
    };
    let points = (0..=200)
        .map(|i| low + (high - low) * f64::from(i) / 200.0)
        .map(|u| [u, unlisted_at(coefficients, u)])
        .collect();
    let marks = vec![Mark::new(
        "",
        line(Color::BLUE, Dash::Solid, 2.0),
        Shape::Line(points),
    )];
    let panel = Panel {
        x: Axis::linear(axis),
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
