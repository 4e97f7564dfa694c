//! What keeps a figure from being drawn.

use std::fmt;

/// One of the two axes of a panel, as error messages name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisName {
    /// The horizontal axis.
    X,
    /// The vertical axis.
    Y,
    /// The scale of the colours.
    Color,
}

impl fmt::Display for AxisName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Color => "colour",
        })
    }
}

/// Why a figure cannot be drawn; panels count from 1 in the messages.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The figure has no title, which readers that do not see the picture need.
    #[error("figure has no title")]
    NoTitle,
    /// The figure has no panels.
    #[error("figure `{figure}` has no panels")]
    NoPanels {
        /// The figure's title.
        figure: String,
    },
    /// The number of columns, or a panel's size, is not one that can be drawn.
    #[error("figure `{figure}`: {what} must be positive")]
    NotDrawable {
        /// The figure's title.
        figure: String,
        /// The quantity at fault.
        what: &'static str,
    },
    /// An axis has neither finite values nor a range of its own.
    #[error("panel {panel} has no finite value on its {axis} axis and no range is given")]
    NoValues {
        /// The panel's number, from 1.
        panel: usize,
        /// The axis without values.
        axis: AxisName,
    },
    /// A logarithmic axis meets a value that has no logarithm.
    #[error("panel {panel}: the logarithmic {axis} axis cannot show {value}; values must be positive")]
    NotPositive {
        /// The panel's number, from 1.
        panel: usize,
        /// The logarithmic axis.
        axis: AxisName,
        /// The smallest value met.
        value: f64,
    },
    /// A range is not finite or does not increase.
    #[error("panel {panel}: range [{low}, {high}] of the {axis} axis must be finite and increasing")]
    BadRange {
        /// The panel's number, from 1.
        panel: usize,
        /// The axis with that range.
        axis: AxisName,
        /// The range's first number.
        low: f64,
        /// The range's second number.
        high: f64,
    },
    /// Equal aspect was asked for where an axis is not linear.
    #[error("panel {panel} has equal aspect, which needs two linear axes")]
    NotLinear {
        /// The panel's number, from 1.
        panel: usize,
    },
    /// A shape's lists do not fit each other.
    #[error("panel {panel}, mark {mark}: {found} values where {expected} are needed")]
    Lengths {
        /// The panel's number, from 1.
        panel: usize,
        /// The mark's number, from 1.
        mark: usize,
        /// How many values the shape has.
        found: usize,
        /// How many it needs.
        expected: usize,
    },
    /// A shape is coloured by value in a panel without a colour scale.
    #[error("panel {panel} has marks coloured by value but no colour scale")]
    NoColorScale {
        /// The panel's number, from 1.
        panel: usize,
    },
}
