//! Why something cannot be fitted.

/// Where from the pairs that there are others are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Toward {
    /// At smaller distances.
    Nearer,
    /// At larger ones.
    Farther,
}

impl std::fmt::Display for Toward {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Nearer => "nearer than",
            Self::Farther => "farther than",
        })
    }
}

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
    /// Readings that do not fall with the distance.
    #[error(
        "the readings do not fall as the distance grows; measure farther away too, and look whether the first column holds the \
         distances and the second the readings, or name them with --columns"
    )]
    NotFalling,
    /// Pairs that responses far apart fit alike.
    #[error("the pairs do not determine {parameter}; measure more of them {toward} {from_m} m")]
    Undetermined {
        /// The number that they leave open most.
        parameter: &'static str,
        /// Where pairs are missing.
        toward: Toward,
        /// Seen from this distance, m.
        from_m: f64,
    },
    /// Laps that the declared model cannot complete.
    #[error(
        "the declared model does not complete its laps: nothing can be traced from it; look at `lapwing drive` with the same settings"
    )]
    DeclaredModelStops,
    /// A model that hardly completes a lap.
    #[error(
        "the simulated robot completes laps in {completing} of {runs} runs: no error can be told; look at `lapwing drive` with the \
         same effects"
    )]
    NoLaps {
        /// Runs with a lap that passes all gates.
        completing: usize,
        /// Runs that were driven.
        runs: usize,
    },
    /// Runs that nothing can be told from.
    #[error(
        "every run needs at least three whole laps that pass all gates: measure more laps, or leave the run out"
    )]
    TooFewLaps,
    /// Gates so far apart that a lap is not divided into stretches by them.
    #[error("{gates} gates are too few to trace by: at least {least} are needed; raise run.gates")]
    TooFewGates {
        /// Gates of a lap.
        gates: usize,
        /// Gates that are enough.
        least: usize,
    },
    /// Runs that are not those that the declared model was simulated for.
    #[error("the declared model was simulated for runs of {expected:?} laps, and these have {found:?}")]
    Shape {
        /// Laps of each run that was simulated.
        expected: Vec<usize>,
        /// Laps of each run that was given.
        found: Vec<usize>,
    },
    /// A declared model of which all laps are the same.
    #[error(
        "the laps of the declared model do not scatter, so that nothing is more than chance: give it slip, noise of readings or noise of the camera"
    )]
    NoScatter,
    /// Logs that cannot be followed.
    #[error(
        "no stretch of 200 control steps with commands and camera positions can be followed, and at least one run needs one: look at \
         the times (a row every control step, in s), at the positions (in m) and at the commands (in m/s) of its logs"
    )]
    NoLog,
    /// What the simulator says of the model.
    #[error(transparent)]
    Simulation(#[from] sim::Error),
}
