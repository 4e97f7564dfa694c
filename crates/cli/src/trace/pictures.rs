//! The pictures of a trace.

use chart::{Axis, Color, Dash, Direction, Figure, Interval, Mark, Panel, Shape, Style};
use diagnose::{MeanBeginning, MeanLaps, mean_lap};
use track::Lap;

use super::Trace;
use super::errors::Starts;
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

/// Where on the circuit the residual sits.
pub(super) fn residual_map(trace: &Trace) -> Figure {
    let (recording, errors) = trace.shown();
    let circuit = recording.setup.scene.circuit();
    let measured = mean_measured(recording);
    let mut points = crossings(circuit, &measured);
    let mut values: Vec<f64> = measured
        .iter()
        .zip(errors.before.mean_m())
        .map(|(m, s)| MM * (m - s))
        .collect();
    points.push(points[0]);
    values.push(values[0]);
    let label = "measured less simulated, mm (left: positive)";
    let panel = colored_path(circuit, points, values, label, 0.1);
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
    let declared = line(Color::VERMILLION, Dash::Dashed, 1.6);
    let answer = line(Color::BLUE, Dash::Solid, 1.6);
    let left = |laps: &MeanLaps| -> Vec<f64> {
        let pairs = measured.iter().zip(laps.mean_m());
        pairs.map(|(measured, simulated)| measured - simulated).collect()
    };
    let mut below = across(&[
        ("declared model".into(), left(&errors.before), declared),
        ("with the answer".into(), left(&errors.after), answer),
    ]);
    below.y = Axis::linear("measured less simulated, mm");
    let band = |(gate, error_m): (usize, f64)| Interval {
        at: gate as f64,
        low: -1.96 * MM * error_m,
        high: 1.96 * MM * error_m,
    };
    let shape = recording.shape();
    let errors_m = errors.after.standard_error_m(&shape);
    let chance = errors_m.into_iter().enumerate().map(band).collect();
    let style = Style::color(Color::INK);
    below
        .marks
        .insert(0, Mark::new("95 % by chance", style, Shape::Band(chance)));
    let above = across(&[
        (
            "measured".into(),
            measured.clone(),
            line(Color::INK, Dash::Solid, 2.0),
        ),
        ("declared model".into(), errors.before.mean_m().to_vec(), declared),
        ("with the answer".into(), errors.after.mean_m().to_vec(), answer),
    ]);
    Figure {
        title: "Mean laps".into(),
        description:
            "Mean position at each gate: measured, declared model, with the answer; and what the two leave."
                .into(),
        panels: vec![above, below],
        ..Figure::default()
    }
}

/// How runs start.
pub(super) fn starts(starts: &Starts) -> Figure {
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
    let simulated = |label: &str, of: &MeanBeginning, color, dash| {
        Mark::new(label, line(color, dash, 1.6), Shape::Line(points(of)))
    };
    let style = Style::color(Color::INK);
    let panel = Panel {
        x: Axis::linear("time since the run began, s"),
        y: Axis::linear("ahead of steady motion, mm"),
        marks: vec![
            simulated("declared model", &starts.before, Color::VERMILLION, Dash::Dashed),
            simulated("with the answer", &starts.after, Color::BLUE, Dash::Solid),
            Mark::new("measured", style, bars),
            Mark::new("measured", style, Shape::Points(measured)),
        ],
        ..Panel::default()
    };
    let description =
        "How far the robot is ahead of steady motion: measured, declared model, with the answer.";
    single("How runs start", description, panel)
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
    marks.push(Mark::new(
        "declared model",
        style(Color::VERMILLION),
        Shape::Line(few(&errors.before)),
    ));
    marks.push(Mark::new(
        "with the answer",
        style(Color::BLUE),
        Shape::Line(few(&errors.after)),
    ));
    single(
        "Laps before and after",
        "Laps of the declared model and with the answer over the measured ones.",
        map("", marks),
    )
}
