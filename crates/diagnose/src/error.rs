//! Why something cannot be fitted.

/// Why something cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A pair that is no distance and reading.
    #[error(
        "distance {distance_m} m with reading {reading} is no measured pair: distances are finite and not negative, readings finite"
    )]
    Pair {
        /// The distance, m.
        distance_m: f64,
        /// The reading, counts.
        reading: f64,
    },
    /// Too few pairs for three parameters and an error.
    #[error(
        "{pairs} pairs with positive readings at {distances} distances do not determine a response: 5 pairs at 3 distances are needed"
    )]
    TooFewPairs {
        /// Pairs with positive readings.
        pairs: usize,
        /// Different distances.
        distances: usize,
    },
    /// Pairs that every response of the family fits alike.
    #[error(
        "the pairs do not determine a, d0 and p: measure below and above the distance where the reading falls to half"
    )]
    Undetermined,
    /// Laps that the declared model cannot complete.
    #[error(
        "the declared model does not complete its laps: nothing can be traced from it; look at `lapwing drive` with the same settings"
    )]
    DeclaredModelStops,
    /// Too few simulated laps for the number of coordinates.
    #[error("too few laps for the number of gates: more runs or more laps are needed")]
    TooFewLaps,
    /// A robot that crashes or stops with the effects found.
    #[error("with the effects found the simulated robot does not complete its laps")]
    Crash,
    /// Logs that cannot be followed.
    #[error(
        "no stretch of 200 control steps with commands and camera positions can be followed: at least one run needs one"
    )]
    NoLog,
    /// What the simulator says of the model.
    #[error(transparent)]
    Simulation(#[from] sim::Error),
}
