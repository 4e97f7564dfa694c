//! What can go wrong, with what is needed to act.

/// Why a comparison has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A cluster or projection without laps, or whose laps have no gates.
    #[error("`{name}` has {laps} laps of {gates} gates: at least one of each is needed")]
    Empty {
        /// The cluster.
        name: String,
        /// How many laps it has.
        laps: usize,
        /// How many gates its first lap has.
        gates: usize,
    },
    /// A lap of another length than the first lap of its cluster.
    #[error("lap {lap} of `{name}` has {gates} gates, its first lap has {expected}")]
    Ragged {
        /// The cluster.
        name: String,
        /// The lap, counted from 1.
        lap: usize,
        /// How many gates that lap has.
        gates: usize,
        /// How many gates the first lap has.
        expected: usize,
    },
    /// A number that is not finite.
    #[error("lap {lap} of `{name}` is {value} at gate {gate}")]
    NotFinite {
        /// The cluster.
        name: String,
        /// The lap, counted from 1.
        lap: usize,
        /// The gate, counted from 1.
        gate: usize,
        /// What stands there.
        value: f64,
    },
    /// Two things that belong together and differ in their number of gates or modes.
    #[error("`{name}` has {dimension} coordinates, `{other}` has {expected}")]
    Dimension {
        /// The one that does not fit.
        name: String,
        /// How many gates or modes it has.
        dimension: usize,
        /// What it should fit.
        other: String,
        /// How many gates or modes that has.
        expected: usize,
    },
    /// Fewer laps than the covariance of so many coordinates needs.
    #[error(
        "{}: {coordinates} modes or gates need at least {each} laps each and {total} together; give more laps or compare in \
         fewer modes", list(.laps)
    )]
    TooFewLaps {
        /// The clusters and how many laps each has.
        laps: Vec<(String, usize)>,
        /// How many modes or gates were asked for.
        coordinates: usize,
        /// How many laps each cluster needs.
        each: usize,
        /// How many laps they need together.
        total: usize,
    },
    /// Laps that are all the same: there is no mode.
    #[error("all {laps} laps are the same: there is no mode to compare them in")]
    NoVariance {
        /// How many laps there are.
        laps: usize,
    },
    /// A singular value decomposition that did not settle.
    #[error("the modes of {laps} laps with {gates} gates did not converge")]
    NoConvergence {
        /// How many laps there are.
        laps: usize,
        /// How many gates they have.
        gates: usize,
    },
    /// More modes than there are, or none.
    #[error("{wanted} modes wanted, from 1 to {available} are available")]
    Modes {
        /// How many were asked for.
        wanted: usize,
        /// How many there are.
        available: usize,
    },
    /// A covariance without an inverse: the clusters do not vary in some direction of these modes.
    #[error("the covariance of {} is singular in {modes} modes: compare in fewer", names(.clusters))]
    SingularCovariance {
        /// The clusters whose covariance it is.
        clusters: Vec<String>,
        /// How many modes were asked for.
        modes: usize,
    },
    /// A gate at which both clusters stand still, at different places.
    #[error("`{x}` and `{y}` differ at gate {gate} and neither varies there")]
    ConstantGate {
        /// The first cluster.
        x: String,
        /// The second cluster.
        y: String,
        /// The gate, counted from 1.
        gate: usize,
    },
    /// A permutation test without permutations.
    #[error("a permutation test needs at least one permutation")]
    NoPermutations,
    /// An ellipse of no size.
    #[error("an ellipse of {sigmas} standard deviations cannot be drawn: a positive number is needed")]
    Sigmas {
        /// What was asked for.
        sigmas: f64,
    },
}

fn list(laps: &[(String, usize)]) -> String {
    let each: Vec<_> = laps
        .iter()
        .map(|(name, count)| match count {
            1 => format!("`{name}` has 1 lap"),
            _ => format!("`{name}` has {count} laps"),
        })
        .collect();
    each.join(", ")
}

fn names(clusters: &[String]) -> String {
    let each: Vec<_> = clusters.iter().map(|name| format!("`{name}`")).collect();
    each.join(" and ")
}
