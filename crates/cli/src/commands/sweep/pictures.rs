//! The pictures of a sweep: distances against the varied values, and the clusters in the plane of the modes.

use anyhow::Result;
use chart::{Axis, Color, Direction, Figure, Fill, Interval, Mark, Panel, Shape, Share, Side, Style, Ticks};

use super::Sweep;
use super::analysis::{Clusters, SeedResult};
use super::report::spread;
use crate::figures::{MM, Scale, cluster_marks, modes_panel, single};
use crate::laps::{SampledRun, mean_and_deviation};
use crate::output::OutDir;

/// More grid points than this are drawn as their means only, and more series than this not at all.
const MOST_CLUSTERS: usize = 8;

/// Distance against the varied values.
///
/// With one key there is a line for each measured run, with two one for each value of the second, both with bars of one
/// standard deviation over the seeds. Else each key has a panel of means over the other keys, with bars of one standard
/// deviation over them.
pub(super) fn distances(sweep: &Sweep, results: &[SeedResult]) -> Figure {
    let axes = &sweep.grid.axes;
    let (panels, bars) = match axes.as_slice() {
        [_] => (vec![(0, by_run(sweep, results))], "over the seeds"),
        [_, second] if second.values.len() <= MOST_CLUSTERS => {
            (vec![(0, by_second(sweep, results))], "over the seeds")
        }
        _ => {
            let panel = |axis: usize| (axis, over_the_others(sweep, results, axis));
            ((0..axes.len()).map(panel).collect(), "over the other keys")
        }
    };
    let panel = |(axis, marks): (usize, Vec<Mark>)| Panel {
        x: x_axis(sweep, axis),
        y: Axis::linear("distance (eq. 8)"),
        marks,
        ..Panel::default()
    };
    Figure {
        title: "Distance against the varied values".into(),
        description: format!(
            "Distance of simulated laps from measured runs; bars: one standard deviation {bars}."
        ),
        columns: panels.len().min(3),
        panels: panels.into_iter().map(panel).collect(),
        share: Share::Y,
        legend: Side::Right,
    }
}

/// The values as numbers where they are, on a logarithmic scale where they span more than a factor of 20.
fn x_axis(sweep: &Sweep, axis: usize) -> Axis {
    let axis = &sweep.grid.axes[axis];
    let Some(values) = axis.numbers() else {
        return Axis::categories(&axis.key, axis.values.clone());
    };
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    match (low > 0.0 && high > 20.0 * low, values.len()) {
        (true, ..=8) => Axis {
            ticks: Ticks::At(values),
            ..Axis::log(&axis.key)
        },
        (true, _) => Axis::log(&axis.key),
        (false, _) => Axis::linear(&axis.key),
    }
}

/// Where a value stands on the x axis.
fn x(sweep: &Sweep, axis: usize, place: usize) -> f64 {
    sweep.grid.axes[axis]
        .numbers()
        .map_or(place as f64, |values| values[place])
}

fn by_run(sweep: &Sweep, results: &[SeedResult]) -> Vec<Mark> {
    let series = |(run, measured): (usize, &SampledRun)| {
        let points = (0..sweep.grid.points.len())
            .map(|point| at_point(sweep, results, point, Some(run)))
            .collect();
        marks(
            sweep,
            0,
            &format!("run {}", measured.run),
            Style::series(run),
            points,
        )
    };
    sweep.measured.runs.iter().enumerate().flat_map(series).collect()
}

/// Means over the measured runs.
fn by_second(sweep: &Sweep, results: &[SeedResult]) -> Vec<Mark> {
    let second = &sweep.grid.axes[1];
    let series = |(place, value): (usize, &String)| {
        let points =
            (0..sweep.grid.points.len()).filter(|&point| sweep.grid.points[point].places[1] == place);
        let points = points
            .map(|point| at_point(sweep, results, point, None))
            .collect();
        marks(
            sweep,
            0,
            &format!("{}={value}", second.key),
            Style::series(place),
            points,
        )
    };
    second.values.iter().enumerate().flat_map(series).collect()
}

/// Place on the first axis, mean distance and its deviation over the seeds.
fn at_point(sweep: &Sweep, results: &[SeedResult], point: usize, run: Option<usize>) -> [f64; 3] {
    let s = spread(results, point, run);
    [
        x(sweep, 0, sweep.grid.points[point].places[0]),
        s.mean,
        s.deviation,
    ]
}

fn over_the_others(sweep: &Sweep, results: &[SeedResult], axis: usize) -> Vec<Mark> {
    let at = |place: usize| {
        let points =
            (0..sweep.grid.points.len()).filter(|&point| sweep.grid.points[point].places[axis] == place);
        let distances: Vec<f64> = points
            .map(|point| spread(results, point, None).mean)
            .filter(|mean| mean.is_finite())
            .collect();
        let (mean, deviation) = mean_and_deviation(&distances);
        [x(sweep, axis, place), mean, deviation]
    };
    let points = (0..sweep.grid.axes[axis].values.len()).map(at).collect();
    marks(
        sweep,
        axis,
        "mean over all measured runs",
        Style::series(0),
        points,
    )
}

/// Points (x, mean, deviation) as markers with error bars, and between numbers a line in the order of x.
fn marks(sweep: &Sweep, axis: usize, label: &str, style: Style, mut points: Vec<[f64; 3]>) -> Vec<Mark> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let means: Vec<[f64; 2]> = points.iter().map(|&[x, mean, _]| [x, mean]).collect();
    let bar = |&[at, mean, s]: &[f64; 3]| Interval {
        at,
        low: mean - s,
        high: mean + s,
    };
    let intervals = points
        .iter()
        .filter(|point| point[2].is_finite())
        .map(bar)
        .collect();
    let bars = Shape::ErrorBars {
        intervals,
        direction: Direction::Vertical,
    };
    let line = sweep.grid.axes[axis]
        .numbers()
        .map(|_| Shape::Line(means.clone()));
    let line = line.map(|line| {
        Mark::new(
            label,
            Style {
                width_px: 1.0,
                ..style
            },
            line,
        )
    });
    line.into_iter()
        .chain([
            Mark::new(label, style, bars),
            Mark::new(label, style, Shape::Points(means)),
        ])
        .collect()
}

/// The clusters of the first seed in the plane of the first two modes.
pub(super) fn modes(sweep: &Sweep, out: &OutDir) -> Result<Figure> {
    let clusters = Clusters::new(sweep, &sweep.units(out, 0)?)?;
    let mut marks = Vec::new();
    for cluster in &clusters.measured {
        let style = Style {
            opacity: 0.5,
            size_px: 4.0,
            fill: Fill::Solid,
            ..Style::color(Color::GREY)
        };
        marks.extend(cluster_marks(
            &clusters.project(cluster)?,
            "measured runs",
            style,
            Scale::MM,
        ));
    }
    let mut means = Vec::new();
    for (i, cluster) in clusters.points.iter().enumerate() {
        let Some(cluster) = cluster else { continue };
        let projection = clusters.project(cluster)?;
        if clusters.points.len() <= MOST_CLUSTERS {
            marks.extend(cluster_marks(
                &projection,
                cluster.name(),
                Style::series(i),
                Scale::MM,
            ));
        } else {
            let mean = projection.mean();
            means.push([MM * mean[0], MM * mean[1]]);
        }
    }
    if !means.is_empty() {
        marks.push(Mark::new(
            "means of the grid points",
            Style::color(Color::VERMILLION),
            Shape::Points(means),
        ));
    }
    Ok(single(
        "Point Distribution Model of the sweep",
        "Laps of the first seed in the plane of the first two modes, with ellipses of two standard deviations.",
        modes_panel("", &clusters.pdm, marks, Scale::MM),
    ))
}
