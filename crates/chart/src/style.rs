//! How marks look.

use crate::color::{Color, palette};

/// The pattern of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dash {
    /// Without gaps.
    #[default]
    Solid,
    /// Long dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// Dash, dot.
    DashDot,
}

impl Dash {
    const ALL: [Self; 4] = [Self::Solid, Self::Dashed, Self::DashDot, Self::Dotted];

    /// The pattern of the series with this number, from 0; four, then over again.
    #[must_use]
    pub fn series(series: usize) -> Self {
        Self::ALL[series % Self::ALL.len()]
    }

    /// Lengths of dashes and gaps, in line widths.
    pub(crate) fn lengths(self) -> &'static [f64] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[4.5, 2.5],
            Self::Dotted => &[1.2, 1.8],
            Self::DashDot => &[5.0, 2.0, 1.2, 2.0],
        }
    }
}

/// The outline of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Marker {
    /// A circle.
    #[default]
    Circle,
    /// A diagonal cross.
    Cross,
    /// An upright cross.
    Plus,
    /// A triangle on its base.
    Triangle,
    /// A square.
    Square,
    /// A square on its corner.
    Diamond,
    /// A triangle on its tip.
    TriangleDown,
    /// A star of eight rays.
    Star,
}

impl Marker {
    const ALL: [Self; 8] = [
        Self::Circle,
        Self::Cross,
        Self::Triangle,
        Self::Plus,
        Self::Square,
        Self::Diamond,
        Self::TriangleDown,
        Self::Star,
    ];

    /// The marker of the series with this number, from 0; eight, then over again.
    #[must_use]
    pub fn series(series: usize) -> Self {
        Self::ALL[series % Self::ALL.len()]
    }
}

/// What is inside an outline: of a marker, a polygon or an ellipse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fill {
    /// Nothing.
    #[default]
    Open,
    /// The colour of the outline.
    Solid,
    /// The colour of the outline, faintly: what lies behind stays visible.
    Faint,
    /// A colour of its own.
    With(Color),
}

/// Where a text stands, seen from its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Anchor {
    /// On it.
    Center,
    /// To its left.
    Left,
    /// To its right.
    #[default]
    Right,
    /// Above it.
    Above,
    /// Below it.
    Below,
}

/// Colour, line and marker of a mark; each shape takes from it what it needs.
///
/// ```
/// use chart::{Color, Dash, Style};
///
/// let model = Style { dash: Dash::Dashed, ..Style::color(Color::GREEN) };
/// assert_eq!(model.width_px, 1.5);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// The colour of lines, outlines, text and areas.
    pub color: Color,
    /// The width of lines, px; with 0 outlines are not drawn.
    pub width_px: f64,
    /// The pattern of lines.
    pub dash: Dash,
    /// From 0, invisible, to 1, opaque.
    pub opacity: f64,
    /// The outline of points.
    pub marker: Marker,
    /// The size across of points, px.
    pub size_px: f64,
    /// The height of text, px.
    pub text_px: f64,
    /// The inside of markers, polygons and ellipses.
    pub fill: Fill,
}

impl Style {
    /// The default style in a colour: solid lines, open circles.
    #[must_use]
    pub fn color(color: Color) -> Self {
        Self {
            color,
            ..Self::default()
        }
    }

    /// Colour and marker of the series with this number, from 0, drawn with solid lines.
    #[must_use]
    pub fn series(series: usize) -> Self {
        Self {
            color: palette(series),
            marker: Marker::series(series),
            ..Self::default()
        }
    }
}

impl Default for Style {
    fn default() -> Self {
        Self {
            color: Color::INK,
            width_px: 1.5,
            dash: Dash::Solid,
            opacity: 1.0,
            marker: Marker::Circle,
            size_px: 7.0,
            text_px: 11.5,
            fill: Fill::Open,
        }
    }
}
