//! A figure's numbers as CSV.

use std::fmt::Write;

use crate::figure::Figure;
use crate::mark::{Direction, Interval, Mark, Shape};

/// One row: the columns of [`Figure::to_csv`] behind panel and mark.
#[derive(Debug, Clone, Copy, Default)]
struct Row {
    /// Which of a mark's pieces, from 0.
    piece: usize,
    x: Option<f64>,
    y: Option<f64>,
    low: Option<f64>,
    high: Option<f64>,
    value: Option<f64>,
}

impl Figure {
    /// All numbers that are drawn, in data coordinates: `panel,mark,piece,x,y,low,high,value`, a row for each point.
    ///
    /// Pieces are the parts of a line between its gaps, and single segments, outlines and stripes. What reaches from `low` to `high`
    /// does so along y where `x` is given, and along x where `y` is; `value` is what a colour stands for. Words are not numbers.
    ///
    /// ```
    /// use chart::{Figure, Mark, Panel, Shape, Style};
    ///
    /// let line = Mark::new("run a", Style::series(0), Shape::Line(vec![[0.0, 1.0], [0.5, 2.0]]));
    /// let panel = Panel { marks: vec![line], ..Panel::default() };
    /// let figure = Figure { panels: vec![panel], ..Figure::default() };
    /// assert_eq!(figure.to_csv(), "panel,mark,piece,x,y,low,high,value\n0,run a,0,0,1,,,\n0,run a,0,0.5,2,,,\n");
    /// ```
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut csv = String::from("panel,mark,piece,x,y,low,high,value\n");
        for (number, panel) in self.panels.iter().enumerate() {
            for mark in &panel.marks {
                let label = quoted(&mark.label);
                for row in rows(mark) {
                    let Row {
                        piece,
                        x,
                        y,
                        low,
                        high,
                        value,
                    } = row;
                    let cells =
                        [x, y, low, high, value].map(|cell| cell.map_or(String::new(), |c| c.to_string()));
                    writeln!(csv, "{number},{label},{piece},{}", cells.join(",")).expect("a string grows");
                }
            }
        }
        csv
    }
}

/// A field as CSV has it.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn rows(mark: &Mark) -> Vec<Row> {
    match &mark.shape {
        Shape::Line(points) => pieces(points.iter().map(|&point| (point, None))),
        Shape::ColoredLine { points, values } => {
            let values = values.iter().map(|&value| Some(value));
            pieces(points.iter().copied().zip(values))
        }
        Shape::Points(points) | Shape::Polygon(points) => {
            let finite = points.iter().filter(|point| is_finite(point));
            finite.map(|&point| at(0, point)).collect()
        }
        Shape::Segments(segments) | Shape::Arrows(segments) => (segments.iter().enumerate())
            .flat_map(|(piece, ends)| ends.map(|end| at(piece, end)))
            .collect(),
        Shape::Band(intervals) => along(intervals, Direction::Vertical),
        Shape::ErrorBars { intervals, direction }
        | Shape::Bars {
            bars: intervals,
            direction,
            ..
        } => along(intervals, *direction),
        Shape::Ellipses(ellipses) => (ellipses.iter().enumerate())
            .map(|(piece, ellipse)| at(piece, ellipse.center))
            .collect(),
        Shape::Rules { at, direction } => (at.iter().enumerate())
            .map(|(piece, &at)| Row {
                piece,
                ..on(*direction, at)
            })
            .collect(),
        Shape::Stripes { between, .. } => (between.iter().enumerate())
            .map(|(piece, &[low, high])| Row {
                piece,
                low: Some(low),
                high: Some(high),
                ..Row::default()
            })
            .collect(),
        Shape::Notes(_) => Vec::new(),
        Shape::Cells(grid) => {
            let middle = |edges: &[f64], cell: usize| 0.5 * (edges[cell] + edges[cell + 1]);
            let columns = grid.x_edges.len() - 1;
            (grid.values.iter().enumerate())
                .filter(|(_, value)| value.is_finite())
                .map(|(cell, &value)| Row {
                    x: Some(middle(&grid.x_edges, cell % columns)),
                    y: Some(middle(&grid.y_edges, cell / columns)),
                    value: Some(value),
                    ..Row::default()
                })
                .collect()
        }
    }
}

fn is_finite(point: &[f64; 2]) -> bool {
    point.iter().all(|x| x.is_finite())
}

fn at(piece: usize, [x, y]: [f64; 2]) -> Row {
    Row {
        piece,
        x: Some(x),
        y: Some(y),
        ..Row::default()
    }
}

/// The points of a line between its gaps.
fn pieces(points: impl Iterator<Item = ([f64; 2], Option<f64>)>) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    let mut is_broken = false;
    for (point, value) in points {
        if !is_finite(&point) {
            is_broken = true;
            continue;
        }
        let piece = rows.last().map_or(0, |last| last.piece + usize::from(is_broken));
        rows.push(Row {
            value,
            ..at(piece, point)
        });
        is_broken = false;
    }
    rows
}

/// Where something stands that runs one way.
fn on(direction: Direction, at: f64) -> Row {
    match direction {
        Direction::Vertical => Row {
            x: Some(at),
            ..Row::default()
        },
        Direction::Horizontal => Row {
            y: Some(at),
            ..Row::default()
        },
    }
}

fn along(intervals: &[Interval], direction: Direction) -> Vec<Row> {
    (intervals.iter())
        .map(|interval| Row {
            low: Some(interval.low),
            high: Some(interval.high),
            ..on(direction, interval.at)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GAP, Grid, Panel, Style};

    fn csv(label: &str, shape: Shape) -> Vec<String> {
        let panel = Panel {
            marks: vec![Mark::new(label, Style::series(0), shape)],
            ..Panel::default()
        };
        let figure = Figure {
            panels: vec![panel],
            ..Figure::default()
        };
        figure.to_csv().lines().skip(1).map(str::to_owned).collect()
    }

    #[test]
    fn pieces_of_lines_are_numbered_and_gaps_left_out() {
        let line = Shape::Line(vec![GAP, [0.0, 1.0], [1.0, 1.5], GAP, GAP, [2.0, 3.0]]);
        assert_eq!(
            csv("a, b", line),
            [
                "0,\"a, b\",0,0,1,,,",
                "0,\"a, b\",0,1,1.5,,,",
                "0,\"a, b\",1,2,3,,,"
            ]
        );
    }

    #[test]
    fn bands_bars_and_cells_have_their_numbers() {
        let interval = Interval {
            at: 2.0,
            low: -1.0,
            high: 0.5,
        };
        assert_eq!(csv("", Shape::Band(vec![interval])), ["0,,0,2,,-1,0.5,"]);
        let lying = Shape::Bars {
            bars: vec![interval],
            width: 0.8,
            direction: Direction::Horizontal,
        };
        assert_eq!(csv("", lying), ["0,,0,,2,-1,0.5,"]);
        let grid = Grid {
            x_edges: vec![0.0, 1.0, 2.0],
            y_edges: vec![0.0, 2.0],
            values: vec![f64::NAN, 7.0],
            decimals: None,
        };
        assert_eq!(csv("", Shape::Cells(grid)), ["0,,0,1.5,1,,,7"]);
    }
}
