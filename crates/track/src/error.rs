use crate::{Direction, Vec2};

/// What can be wrong with a world, a request for segments or gates, or a lap.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Another error, and the line of the world file that it is about.
    #[error("line {line}: {what}")]
    At {
        /// Line of the file, from 1.
        line: usize,
        /// What is wrong there.
        what: Box<Error>,
    },
    /// The file is no TOML, or not of the shape of a world.
    #[error("{message}")]
    Format {
        /// What the reader of the file says.
        message: String,
    },
    /// A spline has too few control points to have a direction.
    #[error("a spline needs at least 2 control points, here are {count}")]
    FewPoints {
        /// Number of control points.
        count: usize,
    },
    /// A number is infinite or not a number.
    #[error("{what} is {value}, not a finite number")]
    NotFinite {
        /// What should have been a number.
        what: String,
        /// What it is.
        value: f64,
    },
    /// The arena has no area.
    #[error("arena = [{width_m}, {height_m}] needs a width and a height above 0 m")]
    Arena {
        /// Its width.
        width_m: f64,
        /// Its height.
        height_m: f64,
    },
    /// A wall without splines.
    #[error("{wall} wall has no spline; add a [[wall.spline]] with its control_points")]
    NoSplines {
        /// Name of the wall.
        wall: String,
    },
    /// Neighbouring splines do not meet.
    #[error(
        "{wall} wall: spline {spline} ends {mismatch_m:.6} m away from where spline {next} starts; \
         let spline {next} start at [{:.5}, {:.5}]", mend_m.x, mend_m.y
    )]
    Gap {
        /// Name of the wall.
        wall: String,
        /// Number of the spline that ends at the joint, from 1.
        spline: usize,
        /// Number of the spline that starts there, from 1.
        next: usize,
        /// Distance between the two points.
        mismatch_m: f64,
        /// First control point of `next` that closes the gap.
        mend_m: Vec2,
    },
    /// The first derivative jumps where neighbouring splines meet.
    #[error(
        "{wall} wall: the first derivative jumps by {mismatch_m:.6} m from spline {spline} to spline {next}; \
         move the second control point of spline {next} to [{:.5}, {:.5}]", mend_m.x, mend_m.y
    )]
    Corner {
        /// Name of the wall.
        wall: String,
        /// Number of the spline that ends at the joint, from 1.
        spline: usize,
        /// Number of the spline that starts there, from 1.
        next: usize,
        /// Length of the difference of the derivatives.
        mismatch_m: f64,
        /// Second control point of `next` that makes the joint smooth.
        mend_m: Vec2,
    },
    /// A wall stands still or turns back on the spot.
    #[error(
        "{wall} wall: spline {spline} turns back on the spot near [{:.4}, {:.4}]; move its control points apart",
        at_m.x, at_m.y
    )]
    Cusp {
        /// Name of the wall.
        wall: String,
        /// Number of the spline, from 1.
        spline: usize,
        /// Where.
        at_m: Vec2,
    },
    /// A wall crosses itself.
    #[error(
        "{wall} wall crosses itself near [{:.4}, {:.4}], spline {spline} and spline {other}; \
         move their control points there apart", at_m.x, at_m.y
    )]
    SelfCrossing {
        /// Name of the wall.
        wall: String,
        /// Number of the first spline, from 1.
        spline: usize,
        /// Number of the second spline, from 1; may be the same.
        other: usize,
        /// Where.
        at_m: Vec2,
    },
    /// The world has a wall that is neither outer nor inner.
    #[error("unknown wall `{name}`; known: outer, inner")]
    UnknownWall {
        /// Its name.
        name: String,
    },
    /// A wall is there twice or not at all.
    #[error("the world has {count} walls named `{name}`, it needs exactly one")]
    WallCount {
        /// Name of the wall.
        name: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A wall runs the other way round than the world says.
    #[error(
        "{wall} wall runs {} but direction is {}; turn the order of its splines and of their points round, \
         or change direction", declared.reversed().name(), declared.name()
    )]
    Orientation {
        /// Name of the wall.
        wall: String,
        /// The direction that the world declares.
        declared: Direction,
    },
    /// A wall leaves the arena.
    #[error("{wall} wall leaves the arena at [{:.4}, {:.4}]; move it inside or enlarge the arena", at_m.x, at_m.y)]
    OutsideArena {
        /// Name of the wall.
        wall: String,
        /// Where.
        at_m: Vec2,
    },
    /// The walls leave no corridor.
    #[error("the walls cross or touch near [{:.4}, {:.4}]; move them apart", at_m.x, at_m.y)]
    WallsTouch {
        /// Where.
        at_m: Vec2,
    },
    /// The inner wall is not inside the outer wall.
    #[error("the inner wall lies outside the outer wall; swap their names or move the inner wall inside")]
    NotInside,
    /// The midline could not be followed.
    #[error(
        "the midline is lost near [{:.4}, {:.4}]; the walls are too jagged there for the width of the corridor",
        at_m.x, at_m.y
    )]
    Midline {
        /// Where.
        at_m: Vec2,
    },
    /// The maximal error asked for is not a positive length.
    #[error("maximal error {max_error_m} m is outside [1e-9, 10]")]
    MaxError {
        /// What was asked for.
        max_error_m: f64,
    },
    /// The maximal error leaves nothing of the wall.
    #[error(
        "maximal error {max_error_m} m leaves only {segments} segments of the {wall} wall; take a smaller one"
    )]
    TooCoarse {
        /// Name of the wall.
        wall: String,
        /// What was asked for.
        max_error_m: f64,
        /// Number of segments that would be left, below 3.
        segments: usize,
    },
    /// Too few gates to follow the bends of the corridor.
    #[error("{count} gates are too few: the midline bends too much from one to the next; take more")]
    FewGates {
        /// What was asked for.
        count: usize,
    },
    /// Two gates cross, so that no order of crossing would be right.
    #[error(
        "gates {first} and {second} of {of} cross near [{:.4}, {:.4}]; widen the bend of the walls there, or set run.gates lower",
        at_m.x, at_m.y
    )]
    GatesCross {
        /// The one with the lower number.
        first: usize,
        /// The one with the higher number.
        second: usize,
        /// Number of gates.
        of: usize,
        /// Where.
        at_m: Vec2,
    },
    /// A lap without a position at one of the gates.
    #[error("lap misses gate {gate} of {of}")]
    MissedGate {
        /// The first gate that it misses.
        gate: usize,
        /// Number of gates.
        of: usize,
    },
}

impl Error {
    /// The line of the world file that this is about, from 1, where one is known.
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::At { line, .. } => Some(*line),
            _ => None,
        }
    }

    /// Number of the spline to mend, from 1, where it is one spline's fault.
    pub(crate) fn spline(&self) -> Option<usize> {
        match self {
            Self::Gap { next, .. } | Self::Corner { next, .. } => Some(*next),
            Self::Cusp { spline, .. } | Self::SelfCrossing { spline, .. } => Some(*spline),
            _ => None,
        }
    }
}
