//! The pictures of a trace.

use chart::{Axis, Color, Dash, Direction, Figure, Interval, Mark, Panel, Shape, Style};
use diagnose::{MeanBeginning, MeanLaps, mean_lap};
use track::Lap;

use super::Trace;
use super::recording::Recording;
use crate::figures::{MM, across, colored_path, crossings, line, map, single, walls};
use crate::laps::SampledRun;

/// The mean of all measured laps of a recording, gate by gate, m.
fn mean_measured(recording: &Recording) -> Vec<f64> {
    let laps: Vec<Vec<f64>> = recording
        .measured
        .runs
        .iter()
        .flat_map(SampledRun::offsets_m)
        .collect();
    mean_lap(&laps).unwrap_or_default()
}

/// What is simulated, with the declared model and, where anything is claimed, with the answer: label, what is drawn, and its line.
fn simulated<T>(trace: &Trace, before: T, after: T) -> Vec<(&'static str, T, Style)> {
    let declared = (
        "declared model",
        before,
        line(Color::VERMILLION, Dash::Dashed, 1.6),
    );
    let answer = || ("with the answer", after, line(Color::BLUE, Dash::Solid, 1.6));
    let claimed = trace.answer.claimed().map(|_| answer());
    std::iter::once(declared).chain(claimed).collect()
}

/// How far the mean measured lap is from the declared model's, gate by gate, mm (left: positive).
pub(super) fn residual_mm(trace: &Trace) -> Vec<f64> {
    let (recording, errors) = trace.shown();
    let pairs = mean_measured(recording).into_iter().zip(errors.before.mean_m());
    pairs
        .map(|(measured, simulated)| MM * (measured - simulated))
        .collect()
}

/// Within which distance of a simulation as many laps of the same model are by chance at 95 of 100 gates, gate by gate, mm.
pub(super) fn chance_mm(trace: &Trace, simulated: &MeanLaps) -> Vec<f64> {
    let errors_m = simulated.standard_error_m(&trace.shown().0.shape());
    errors_m.into_iter().map(|error_m| 1.96 * MM * error_m).collect()
}

/// Where on the circuit the residual sits; what is within chance, with the answer if there is one, is pale.
pub(super) fn residual_map(trace: &Trace) -> Figure {
    /// Reach of the colours as a multiple of what is within chance.
    const REACH: f64 = 4.0;
    let (recording, errors) = trace.shown();
    let circuit = recording.setup.scene.circuit();
    let mut points = crossings(circuit, &mean_measured(recording));
    let mut values = residual_mm(trace);
    let least = REACH * chance_mm(trace, &errors.after).into_iter().fold(0.0, f64::max);
    points.push(points[0]);
    values.push(values[0]);
    let label = "measured less simulated, mm (left: positive)";
    let panel = colored_path(circuit, points, values, label, least);
    single(
        "Residual map",
        "The mean measured lap, coloured by its distance from the declared model's mean lap.",
        panel,
    )
}

/// Mean laps, and below them what is left of the measured one.
pub(super) fn mean_laps(trace: &Trace) -> Figure {
    let (recording, errors) = trace.shown();
    let measured = mean_measured(recording);
    let simulated = simulated(trace, &errors.before, &errors.after);
    let left = |&(label, laps, style): &(&str, &MeanLaps, Style)| {
        let pairs = measured.iter().zip(laps.mean_m());
        let left: Vec<f64> = pairs.map(|(measured, simulated)| measured - simulated).collect();
        (label.to_owned(), left, style)
    };
    let mut below = across(&simulated.iter().map(left).collect::<Vec<_>>());
    below.y = Axis::linear("measured less simulated, mm");
    let band = |(gate, chance_mm): (usize, f64)| Interval {
        at: gate as f64,
        low: -chance_mm,
        high: chance_mm,
    };
    let chance = chance_mm(trace, &errors.after)
        .into_iter()
        .enumerate()
        .map(band)
        .collect();
    let style = Style::color(Color::INK);
    below
        .marks
        .insert(0, Mark::new("95 % by chance", style, Shape::Band(chance)));
    let means = (simulated.iter()).map(|(label, laps, style)| (*label, laps.mean_m().to_vec(), *style));
    let of_robot = ("measured", measured.clone(), line(Color::INK, Dash::Solid, 2.0));
    let curves = std::iter::once(of_robot).chain(means);
    let curves: Vec<_> = curves
        .map(|(label, mean_m, style)| (label.to_owned(), mean_m, style))
        .collect();
    let above = across(&curves);
    Figure {
        title: "Mean laps".into(),
        description: "Mean position at each gate, measured and simulated; and what simulations leave.".into(),
        panels: vec![above, below],
        ..Figure::default()
    }
}

/// How runs start, if that is known.
pub(super) fn starts(trace: &Trace) -> Option<Figure> {
    let starts = trace.shown().1.starts.as_ref()?;
    let points = |of: &MeanBeginning| of.ahead_mm().map(|(time_s, mm)| [time_s, mm]).collect::<Vec<_>>();
    let [.., chance_mm] = starts.errors_mm();
    let measured = points(&starts.measured);
    let bar = |&[at, mm]: &[f64; 2]| Interval {
        at,
        low: mm - 1.96 * chance_mm,
        high: mm + 1.96 * chance_mm,
    };
    let bars = Shape::ErrorBars {
        intervals: measured.iter().map(bar).collect(),
        direction: Direction::Vertical,
    };
    let simulated = simulated(trace, &starts.before, &starts.after).into_iter();
    let mut marks: Vec<Mark> = simulated
        .map(|(label, of, style)| Mark::new(label, style, Shape::Line(points(of))))
        .collect();
    let style = Style::color(Color::INK);
    marks.push(Mark::new("measured", style, bars));
    marks.push(Mark::new("measured", style, Shape::Points(measured)));
    let panel = Panel {
        x: Axis::linear("time since the run began, s"),
        y: Axis::linear("ahead of steady motion, mm"),
        marks,
        ..Panel::default()
    };
    let description = "How far the robot is ahead of steady motion, measured and simulated.";
    Some(single("How runs start", description, panel))
}

/// Laps before and after over measured ones.
pub(super) fn laps(trace: &Trace) -> Figure {
    let (recording, errors) = trace.shown();
    let circuit = recording.setup.scene.circuit();
    let mut marks = vec![walls(&circuit.course)];
    let closed = |offsets: &[f64]| {
        let mut points = crossings(circuit, offsets);
        points.extend([points[0], chart::GAP]);
        points
    };
    let measured_laps: Vec<[f64; 2]> = recording
        .measured
        .runs
        .iter()
        .flat_map(|run| run.laps.iter().take(5))
        .flat_map(|lap: &Lap| closed(&lap.offsets_m))
        .collect();
    let few = |laps: &MeanLaps| {
        laps.laps_m()
            .step_by(64)
            .take(10)
            .flat_map(|lap| closed(lap))
            .collect::<Vec<_>>()
    };
    let style = |color: Color| Style {
        width_px: 0.8,
        opacity: 0.6,
        ..Style::color(color)
    };
    marks.push(Mark::new(
        "measured",
        style(Color::INK),
        Shape::Line(measured_laps),
    ));
    for (label, laps, line) in simulated(trace, &errors.before, &errors.after) {
        marks.push(Mark::new(label, style(line.color), Shape::Line(few(laps))));
    }
    single("Laps", "Simulated laps over measured ones.", map("", marks))
}
