//! Marks: what stands on a panel, and how far it reaches.

use crate::style::{Anchor, Style};

/// A point that breaks a line: many laps are one [`Shape::Line`] with gaps between them.
pub const GAP: [f64; 2] = [f64::NAN, f64::NAN];

/// A shape with its style and the name the legend gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// The name in the legend; none if empty. Marks with one name share one entry, their samples drawn over each other.
    pub label: String,
    /// How it looks.
    pub style: Style,
    /// What it is.
    pub shape: Shape,
}

impl Mark {
    /// The mark with this label (empty: not in the legend), style and shape.
    ///
    /// ```
    /// use chart::{Mark, Shape, Style};
    ///
    /// let mark = Mark::new("run a", Style::series(0), Shape::Points(vec![[0.0, 1.0]]));
    /// assert_eq!(mark.label, "run a");
    /// ```
    #[must_use]
    pub fn new(label: impl Into<String>, style: Style, shape: Shape) -> Self {
        Self {
            label: label.into(),
            style,
            shape,
        }
    }
}

/// Which way a thing runs on the panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Direction {
    /// Upright: along the y axis.
    #[default]
    Vertical,
    /// Lying: along the x axis.
    Horizontal,
}

/// A stretch of one axis at a place on the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The place on the other axis.
    pub at: f64,
    /// One end.
    pub low: f64,
    /// The other end.
    pub high: f64,
}

/// An ellipse in data coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// The centre (x, y).
    pub center: [f64; 2],
    /// The two semi-axes.
    pub semi_axes: [f64; 2],
    /// The direction of the first semi-axis, rad, counter-clockwise from +x.
    pub angle_rad: f64,
}

/// A few words at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// The point (x, y).
    pub at: [f64; 2],
    /// The words, on one line.
    pub text: String,
    /// On which side of the point they stand.
    pub anchor: Anchor,
}

/// Cells of a rectangular grid, each with a value.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// The C + 1 edges of the columns along x, increasing.
    pub x_edges: Vec<f64>,
    /// The R + 1 edges of the rows along y, increasing.
    pub y_edges: Vec<f64>,
    /// The R x C values, row after row; one that is not finite leaves its cell empty.
    pub values: Vec<f64>,
    /// With how many decimals the values are written into their cells; not at all if absent.
    pub decimals: Option<usize>,
}

/// The numbers of a mark, in data coordinates, points as (x, y). What is not finite is left out.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A line through points; it breaks at each that is not finite (see [`GAP`]).
    Line(Vec<[f64; 2]>),
    /// A marker at each point.
    Points(Vec<[f64; 2]>),
    /// Separate straight segments.
    Segments(Vec<[[f64; 2]; 2]>),
    /// Arrows from the first point to the second.
    Arrows(Vec<[[f64; 2]; 2]>),
    /// A closed outline, filled as the style says.
    Polygon(Vec<[f64; 2]>),
    /// The area between `low` and `high` along x, faintly in the style's colour.
    Band(Vec<Interval>),
    /// Bars with caps from `low` to `high`; the value itself is a [`Shape::Points`] of the same label.
    ErrorBars {
        /// The stretches.
        intervals: Vec<Interval>,
        /// Which way they run.
        direction: Direction,
    },
    /// Filled bars from `low`, where they stand, to `high`.
    Bars {
        /// The bars.
        bars: Vec<Interval>,
        /// Their width along the other axis, in its units.
        width: f64,
        /// Which way they grow.
        direction: Direction,
    },
    /// Ellipses, filled as the style says.
    Ellipses(Vec<Ellipse>),
    /// Lines across the whole panel: vertical ones at values of x, horizontal ones at values of y.
    Rules {
        /// The values.
        at: Vec<f64>,
        /// Which way the lines run.
        direction: Direction,
    },
    /// Shaded stripes across the whole panel: vertical ones between two values of x, horizontal ones of y.
    Stripes {
        /// The two edges of each.
        between: Vec<[f64; 2]>,
        /// Which way the stripes run.
        direction: Direction,
    },
    /// Words at points.
    Notes(Vec<Note>),
    /// A line coloured by the panel's colour scale.
    ColoredLine {
        /// The points of the line.
        points: Vec<[f64; 2]>,
        /// A value for each point.
        values: Vec<f64>,
    },
    /// A grid of cells coloured by the panel's colour scale.
    Cells(Grid),
}

/// How far values reach along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    /// The least and greatest finite value.
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// The outermost values that are edges by nature, like the foot of a bar: no margin is left beyond them.
    edge_low: f64,
    edge_high: f64,
}

impl Reach {
    pub(crate) const NONE: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        edge_low: f64::INFINITY,
        edge_high: f64::NEG_INFINITY,
    };

    pub(crate) fn is_empty(&self) -> bool {
        self.low > self.high
    }

    pub(crate) fn ends_on_edge(&self) -> [bool; 2] {
        [self.edge_low <= self.low, self.edge_high >= self.high]
    }

    pub(crate) fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.low = self.low.min(value);
            self.high = self.high.max(value);
        }
    }

    fn add_edge(&mut self, value: f64) {
        self.add(value);
        if value.is_finite() {
            self.edge_low = self.edge_low.min(value);
            self.edge_high = self.edge_high.max(value);
        }
    }

    pub(crate) fn join(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.edge_low = self.edge_low.min(other.edge_low);
        self.edge_high = self.edge_high.max(other.edge_high);
    }
}

/// The reach along x and y.
pub(crate) type Reaches = [Reach; 2];

impl Direction {
    /// The index (0 for x, 1 for y) of the axis along which it runs.
    pub(crate) fn along(self) -> usize {
        match self {
            Self::Vertical => 1,
            Self::Horizontal => 0,
        }
    }

    /// The index of the other axis.
    pub(crate) fn across(self) -> usize {
        1 - self.along()
    }
}

impl Interval {
    pub(crate) fn is_finite(&self) -> bool {
        self.at.is_finite() && self.low.is_finite() && self.high.is_finite()
    }
}

impl Ellipse {
    /// Half the width and half the height of the box around the ellipse.
    fn half_box(&self) -> [f64; 2] {
        let (sin, cos) = self.angle_rad.sin_cos();
        let [a, b] = self.semi_axes;
        [(a * cos).hypot(b * sin), (a * sin).hypot(b * cos)]
    }
}

fn add_point(reaches: &mut Reaches, point: [f64; 2]) {
    if point[0].is_finite() && point[1].is_finite() {
        reaches[0].add(point[0]);
        reaches[1].add(point[1]);
    }
}

impl Shape {
    /// How far the shape reaches along x and y.
    pub(crate) fn reaches(&self) -> Reaches {
        let mut reaches = [Reach::NONE; 2];
        match self {
            Self::Line(points)
            | Self::Points(points)
            | Self::Polygon(points)
            | Self::ColoredLine { points, .. } => {
                points.iter().for_each(|&point| add_point(&mut reaches, point));
            }
            Self::Segments(pairs) | Self::Arrows(pairs) => {
                pairs
                    .iter()
                    .flatten()
                    .for_each(|&point| add_point(&mut reaches, point));
            }
            Self::Notes(notes) => notes.iter().for_each(|note| add_point(&mut reaches, note.at)),
            Self::Ellipses(ellipses) => ellipses.iter().for_each(|ellipse| {
                let ([x, y], [w, h]) = (ellipse.center, ellipse.half_box());
                add_point(&mut reaches, [x - w, y - h]);
                add_point(&mut reaches, [x + w, y + h]);
            }),
            Self::Band(intervals) => add_intervals(&mut reaches, intervals, Direction::Vertical),
            Self::ErrorBars { intervals, direction } => add_intervals(&mut reaches, intervals, *direction),
            Self::Bars {
                bars,
                width,
                direction,
            } => add_bars(&mut reaches, bars, *width, *direction),
            Self::Rules { at, direction } => at
                .iter()
                .for_each(|&value| reaches[direction.across()].add(value)),
            Self::Stripes { between, direction } => {
                let reach = &mut reaches[direction.across()];
                between.iter().flatten().for_each(|&value| reach.add(value));
            }
            Self::Cells(grid) => {
                grid.x_edges.iter().for_each(|&value| reaches[0].add_edge(value));
                grid.y_edges.iter().for_each(|&value| reaches[1].add_edge(value));
            }
        }
        reaches
    }

    /// The values that the panel's colour scale has to span.
    pub(crate) fn color_values(&self) -> &[f64] {
        match self {
            Self::ColoredLine { values, .. } => values,
            Self::Cells(grid) => &grid.values,
            _ => &[],
        }
    }

    /// How many colour values there must be, for shapes that have them.
    pub(crate) fn color_value_count(&self) -> usize {
        match self {
            Self::ColoredLine { points, .. } => points.len(),
            Self::Cells(grid) => grid.x_edges.len().saturating_sub(1) * grid.y_edges.len().saturating_sub(1),
            _ => 0,
        }
    }
}

fn add_intervals(reaches: &mut Reaches, intervals: &[Interval], direction: Direction) {
    for interval in intervals.iter().filter(|interval| interval.is_finite()) {
        reaches[direction.across()].add(interval.at);
        reaches[direction.along()].add(interval.low);
        reaches[direction.along()].add(interval.high);
    }
}

fn add_bars(reaches: &mut Reaches, bars: &[Interval], width: f64, direction: Direction) {
    for bar in bars.iter().filter(|bar| bar.is_finite()) {
        reaches[direction.across()].add(bar.at - width / 2.0);
        reaches[direction.across()].add(bar.at + width / 2.0);
        reaches[direction.along()].add_edge(bar.low);
        reaches[direction.along()].add(bar.high);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_are_not_finite_do_not_count() {
        let [x, y] = Shape::Line(vec![[0.0, 1.0], GAP, [f64::INFINITY, 9.0], [2.0, -1.0]]).reaches();
        assert_eq!([x.low, x.high, y.low, y.high], [0.0, 2.0, -1.0, 1.0]);
    }

    #[test]
    fn a_turned_ellipse_fits_its_box() {
        let ellipse = Ellipse {
            center: [1.0, 2.0],
            semi_axes: [3.0, 1.0],
            angle_rad: std::f64::consts::FRAC_PI_2,
        };
        let [x, y] = Shape::Ellipses(vec![ellipse]).reaches();
        for (found, expected) in [(x.low, 0.0), (x.high, 2.0), (y.low, -1.0), (y.high, 5.0)] {
            assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
        }
    }

    #[test]
    fn bars_stand_on_an_edge() {
        let bars = vec![Interval {
            at: 1.0,
            low: 0.0,
            high: 4.0,
        }];
        let [x, y] = Shape::Bars {
            bars,
            width: 0.5,
            direction: Direction::Vertical,
        }
        .reaches();
        assert_eq!([x.low, x.high], [0.75, 1.25]);
        assert_eq!(y.ends_on_edge(), [true, false]);
    }
}
