//! What can be wrong with a model or a world.

/// Why a model cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number outside the range in which it means something.
    #[error("{key} = {value} is outside [{low}, {high}]")]
    OutOfRange {
        /// Dotted key of `model.toml`.
        key: String,
        /// What was given.
        value: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// A setting that makes no sense for another reason.
    #[error("{key}: {reason}")]
    Invalid {
        /// Dotted key of `model.toml`.
        key: String,
        /// What is wrong and what to do.
        reason: String,
    },
    /// An effect that the registry does not hold.
    #[error("unknown effect `{name}`; nearest known: {nearest}")]
    UnknownEffect {
        /// What was asked for.
        name: String,
        /// The known name that is spelt most like it.
        nearest: String,
    },
    /// A body that does not fit between the walls.
    #[error(
        "the corridor is {narrowest_m:.4} m wide at ({x_m:.3}, {y_m:.3}), too narrow for a robot of {body_m:.4} m; widen it there, or lower robot.body_radius_m or wall.thickness_m"
    )]
    TooNarrow {
        /// Distance between the faces of the walls there, m.
        narrowest_m: f64,
        /// Where, m.
        x_m: f64,
        /// Where, m.
        y_m: f64,
        /// Diameter of the robot, m.
        body_m: f64,
    },
    /// What the walls say.
    #[error(transparent)]
    Track(#[from] track::Error),
}

impl Error {
    /// The dotted key of `model.toml` that is to blame, if one is.
    pub fn key(&self) -> Option<&str> {
        match self {
            Self::OutOfRange { key, .. } | Self::Invalid { key, .. } => Some(key),
            _ => None,
        }
    }
}
