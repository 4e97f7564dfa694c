//! Drawings that several commands share. Lengths across the track are in mm here, as in the reports.

use anyhow::Result;
use chart::{
    Aspect, Axis, Color, ColorMap, ColorScale, Dash, Ellipse, Figure, Fill, GAP, Legend, Mark, Marker, Panel,
    Shape, Side, Style, palette,
};
use pdm::{Modes, Pdm, Projection, covariance_ellipse};
use sim::Circuit;
use track::{Course, Lap, Wall};

/// Millimetres in a metre.
pub(crate) const MM: f64 = 1000.0;

/// How a drawing of the modes shows lengths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    /// What one becomes.
    factor: f64,
    /// The unit as it stands behind the name of an axis.
    unit: &'static str,
}

impl Scale {
    /// Metres in mm.
    pub(crate) const MM: Self = Self {
        factor: MM,
        unit: ", mm",
    };
    /// Numbers of a unit that nobody said, as they are.
    pub(crate) const PLAIN: Self = Self {
        factor: 1.0,
        unit: "",
    };
}

/// The outlines of both walls.
pub(crate) fn walls(course: &Course) -> Mark {
    let outline = |wall: &Wall| {
        (0..=600)
            .map(|i| wall.point(f64::from(i) / 600.0))
            .map(|p| [p.x, p.y])
            .chain([GAP])
            .collect::<Vec<_>>()
    };
    let points = [outline(&course.outer), outline(&course.inner)].concat();
    Mark::new(
        "",
        Style {
            width_px: 1.6,
            ..Style::color(Color::INK)
        },
        Shape::Line(points),
    )
}

/// The joints of the walls' b-splines.
pub(crate) fn joints(course: &Course) -> Mark {
    let points = course
        .outer
        .joints()
        .chain(course.inner.joints())
        .map(|p| [p.x, p.y])
        .collect();
    let style = Style {
        marker: Marker::Square,
        fill: Fill::Solid,
        size_px: 7.0,
        ..Style::color(Color::INK)
    };
    Mark::new("joints of the b-splines", style, Shape::Points(points))
}

/// All gates, from wall to wall.
pub(crate) fn gates(circuit: &Circuit) -> Mark {
    let style = Style {
        width_px: 0.7,
        ..Style::color(Color::GREY)
    };
    Mark::new(
        "gates",
        style,
        Shape::Segments(circuit.gates.iter().map(across_corridor).collect()),
    )
}

/// A gate's ends at the walls.
fn across_corridor(gate: &track::Gate) -> [[f64; 2]; 2] {
    let (left, right) = (
        gate.center + gate.left * gate.left_m,
        gate.center - gate.left * gate.right_m,
    );
    [[left.x, left.y], [right.x, right.y]]
}

/// Gate 0, and an arrow from it in the driving direction.
pub(crate) fn start(circuit: &Circuit) -> [Mark; 2] {
    let gate = &circuit.gates[0];
    let tip = gate.center + gate.forward() * (gate.left_m + gate.right_m);
    let style = Style {
        width_px: 2.5,
        ..Style::color(Color::VERMILLION)
    };
    [
        Mark::new("gate 0", style, Shape::Segments(vec![across_corridor(gate)])),
        Mark::new(
            "driving direction",
            style,
            Shape::Arrows(vec![[gate.center, tip].map(|p| [p.x, p.y])]),
        ),
    ]
}

/// Where a lap crosses the gates, m.
pub(crate) fn crossings(circuit: &Circuit, offsets_m: &[f64]) -> Vec<[f64; 2]> {
    let at = |(gate, offset): (&track::Gate, &f64)| {
        let p = gate.center + gate.left * *offset;
        [p.x, p.y]
    };
    circuit.gates.iter().zip(offsets_m).map(at).collect()
}

/// A map with equal scales.
pub(crate) fn map(title: impl Into<String>, marks: Vec<Mark>) -> Panel {
    Panel {
        title: title.into(),
        x: Axis::linear("x, m"),
        y: Axis::linear("y, m"),
        marks,
        aspect: Aspect::Equal,
        size_px: [520.0, 440.0],
        ..Panel::default()
    }
}

/// A path over the walls, coloured by a value at each of its points, on a scale that reaches at least so far to either side.
pub(crate) fn colored_path(
    circuit: &Circuit,
    points: Vec<[f64; 2]>,
    values: Vec<f64>,
    label: impl Into<String>,
    least: f64,
) -> Panel {
    let most = values.iter().fold(least, |most, value| most.max(value.abs()));
    let style = Style {
        width_px: 5.0,
        ..Style::color(Color::INK)
    };
    let marks = vec![
        walls(&circuit.course),
        Mark::new("", style, Shape::ColoredLine { points, values }),
    ];
    Panel {
        colors: Some(ColorScale {
            label: label.into(),
            map: ColorMap::Diverging,
            range: Some([-most, most]),
        }),
        ..map("", marks)
    }
}

/// One panel as a figure.
pub(crate) fn single(title: &str, description: &str, panel: Panel) -> Figure {
    Figure {
        title: title.into(),
        description: description.into(),
        panels: vec![panel],
        legend: Side::Right,
        ..Figure::default()
    }
}

/// A run as it stands on a map.
#[derive(Debug, Clone)]
pub(crate) struct DrawnRun<'r> {
    pub(crate) label: String,
    pub(crate) laps: &'r [Lap],
    /// What was driven after the last lap kept up to where the robot stopped, m; empty where that is not shown.
    pub(crate) rest: Vec<[f64; 2]>,
}

impl DrawnRun<'_> {
    fn marks(&self, circuit: &Circuit, color: Color) -> Vec<Mark> {
        let lap = |lap: &Lap| {
            let mut points = crossings(circuit, &lap.offsets_m);
            points.extend([points[0], GAP]);
            points
        };
        let points: Vec<[f64; 2]> = self.laps.iter().flat_map(lap).collect();
        let style = Style {
            width_px: 0.7,
            opacity: 0.6,
            ..Style::color(color)
        };
        let mut marks = Vec::new();
        if !points.is_empty() {
            marks.push(Mark::new(&self.label, style, Shape::Line(points)));
        }
        if let Some(&end) = self.rest.last() {
            let way = if self.laps.is_empty() {
                "no lap kept:"
            } else {
                "on"
            };
            let label = format!("{}, {way} to where it stopped", self.label);
            let stop = Style {
                marker: Marker::Cross,
                size_px: 10.0,
                width_px: 2.0,
                ..Style::color(color)
            };
            marks.push(Mark::new(
                &label,
                line(color, Dash::Dashed, 1.0),
                Shape::Line(self.rest.clone()),
            ));
            marks.push(Mark::new(&label, stop, Shape::Points(vec![end])));
        }
        marks
    }
}

/// The laps of several runs over the walls; a lap's path is its positions at the gates.
pub(crate) fn laps_map(circuit: &Circuit, runs: &[DrawnRun<'_>]) -> Figure {
    let mut marks = vec![walls(&circuit.course)];
    for (i, run) in runs.iter().enumerate() {
        marks.extend(run.marks(circuit, palette(i)));
    }
    let mut description = String::from("Every lap kept, drawn through its positions at the gates.");
    if runs.iter().any(|run| !run.rest.is_empty()) {
        description +=
            " Dashed what was driven after the last of them, with a cross where the robot stopped.";
    }
    single("Laps", &description, map("", marks))
}

/// A cluster in the plane of the first two modes: its laps and the ellipse of two standard deviations.
pub(crate) fn cluster_marks(
    projection: &Projection,
    label: &str,
    style: Style,
    Scale { factor, .. }: Scale,
) -> Vec<Mark> {
    let points = projection.points();
    let laps = (0..points.nrows())
        .map(|k| [factor * points[(k, 0)], factor * points[(k, 1)]])
        .collect();
    let mut marks = vec![Mark::new(label, style, Shape::Points(laps))];
    if let Ok(ellipse) = covariance_ellipse(projection, 2.0) {
        let shape = Shape::Ellipses(vec![Ellipse {
            center: ellipse.centre.map(|c| factor * c),
            semi_axes: ellipse.semi_axes.map(|a| factor * a),
            angle_rad: ellipse.angle_rad,
        }]);
        marks.push(Mark::new(
            "",
            Style {
                width_px: 1.0,
                opacity: 0.9,
                fill: Fill::Open,
                ..style
            },
            shape,
        ));
    }
    marks
}

/// The axes of the plane of the first two modes.
pub(crate) fn modes_panel(title: &str, pdm: &Pdm, marks: Vec<Mark>, Scale { unit, .. }: Scale) -> Panel {
    let axis = |mode: usize| {
        let share = 100.0 * pdm.explained().get(mode).copied().unwrap_or(0.0);
        Axis::linear(format!("mode {}{unit} ({share:.0} % of the variance)", mode + 1))
    };
    Panel {
        title: title.into(),
        x: axis(0),
        y: axis(1),
        marks,
        legend: Legend::Shared,
        ..Panel::default()
    }
}

/// All clusters of a PDM in the plane of its first two modes.
pub(crate) fn modes_figure(pdm: &Pdm, clusters: &[pdm::Cluster], scale: Scale) -> Result<Figure> {
    let mut marks = Vec::new();
    for (i, cluster) in clusters.iter().enumerate() {
        let projection = pdm.project(cluster, Modes::First(2))?;
        marks.extend(cluster_marks(
            &projection,
            cluster.name(),
            Style::series(i),
            scale,
        ));
    }
    Ok(single(
        "Point Distribution Model",
        "Every lap in the plane of the first two modes, with an ellipse of two standard deviations round each cluster.",
        modes_panel("", pdm, marks, scale),
    ))
}

/// How a measured run looks: grey and open, so that simulations stand out.
pub(crate) fn measured(run: usize) -> Style {
    let shade = [0.0, 0.45][run % 2];
    let color = Color::INK.mix(Color::WHITE, shade);
    Style {
        width_px: 1.2,
        size_px: 6.0,
        marker: Marker::series(run),
        ..Style::color(color)
    }
}

/// How a simulation looks: solid and in colour.
pub(crate) fn simulated(variant: usize) -> Style {
    let markers = [
        Marker::Circle,
        Marker::Square,
        Marker::Diamond,
        Marker::Triangle,
        Marker::TriangleDown,
    ];
    let marker = markers[variant % markers.len()];
    Style {
        fill: Fill::Solid,
        size_px: 6.0,
        width_px: 0.8,
        opacity: 0.85,
        marker,
        ..Style::color(palette(variant))
    }
}

/// Laps as they were seen, each a line.
pub(crate) fn paths(label: &str, style: Style, paths: &[Vec<[f64; 2]>]) -> Mark {
    let points = paths
        .iter()
        .flat_map(|path| path.iter().copied().chain([GAP]))
        .collect();
    Mark::new(label, style, Shape::Line(points))
}

/// A cluster as it stands in a drawing of the modes.
#[derive(Debug, Clone)]
pub(crate) struct Shown<'a> {
    pub(crate) projection: &'a Projection,
    pub(crate) label: String,
    pub(crate) style: Style,
}

/// These clusters in the plane of the first two modes.
pub(crate) fn plane(title: &str, pdm: &Pdm, clusters: &[Shown<'_>]) -> Panel {
    let marks = clusters
        .iter()
        .flat_map(|shown| cluster_marks(shown.projection, &shown.label, shown.style, Scale::MM));
    Panel {
        size_px: [380.0, 300.0],
        ..modes_panel(title, pdm, marks.collect(), Scale::MM)
    }
}

/// These clusters in the plane of the first two modes, and beside it a close-up of those that `near` picks.
pub(crate) fn plane_and_close_up(title: &str, pdm: &Pdm, clusters: &[Shown<'_>], near: &[usize]) -> Figure {
    let all = plane("all clusters", pdm, clusters);
    let mut close = plane("close-up", pdm, clusters);
    let boxes: Vec<[[f64; 2]; 2]> = near.iter().map(|&i| reach(clusters[i].projection)).collect();
    let range = |axis: usize| {
        let low = boxes.iter().map(|b| b[axis][0]).fold(f64::INFINITY, f64::min);
        let high = boxes.iter().map(|b| b[axis][1]).fold(f64::NEG_INFINITY, f64::max);
        let margin = 0.06 * (high - low);
        Some([low - margin, high + margin])
    };
    (close.x.range, close.y.range) = (range(0), range(1));
    Figure {
        title: title.into(),
        description:
            "Every lap in the plane of the first two modes, with an ellipse of two standard deviations round \
                      each cluster; at the right a close-up."
                .into(),
        panels: vec![all, close],
        columns: 2,
        legend: Side::Below,
        ..Figure::default()
    }
}

/// How far a cluster with its ellipse reaches along the first two modes, mm.
fn reach(projection: &Projection) -> [[f64; 2]; 2] {
    let points = projection.points();
    [0, 1].map(|mode| {
        let column = points.column(mode);
        let (mean, deviation) = (column.mean(), column.variance().sqrt());
        let (low, high) = (
            column.min().min(mean - 2.2 * deviation),
            column.max().max(mean + 2.2 * deviation),
        );
        [MM * low, MM * high]
    })
}

/// Positions across the track against the gate, mm, positive to the left.
pub(crate) fn across(curves: &[(String, Vec<f64>, Style)]) -> Panel {
    let curve = |(label, offsets_m, style): &(String, Vec<f64>, Style)| {
        let points = offsets_m
            .iter()
            .enumerate()
            .map(|(gate, offset_m)| [gate as f64, MM * offset_m])
            .collect();
        Mark::new(label, *style, Shape::Line(points))
    };
    Panel {
        x: Axis {
            range: curves
                .first()
                .map(|(_, offsets_m, _)| [0.0, offsets_m.len() as f64]),
            ..Axis::linear("gate")
        },
        y: Axis::linear("position on the gate, mm (left of its centre: positive)"),
        marks: curves.iter().map(curve).collect(),
        ..Panel::default()
    }
}

/// A line in this style, of this pattern and width.
pub(crate) fn line(color: Color, dash: Dash, width_px: f64) -> Style {
    Style {
        dash,
        width_px,
        ..Style::color(color)
    }
}
