//! A cluster in the space of the modes.

use nalgebra::{DMatrix, RowDVector};

use crate::cluster::matrix;
use crate::covariance::{scatter, zero_variance};
use crate::{Error, Modes};

/// The laps of a cluster as points in the space of the modes, `K x R`.
///
/// ```
/// let points = pdm::Projection::new("a", &[vec![0.0, 1.0], vec![2.0, 3.0]])?;
/// assert_eq!(points.mean(), [1.0, 2.0]);
/// assert_eq!(points.covariance()?[(0, 1)], 2.0);
/// # Ok::<(), pdm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    name: String,
    points: DMatrix<f64>,
    modes: Modes,
    zero_variance: f64,
}

impl Projection {
    /// The projection with these `points`, one per row, for comparing what is already in few coordinates.
    ///
    /// # Errors
    /// As [`Cluster::new`](crate::Cluster::new).
    pub fn new(name: impl Into<String>, points: &[Vec<f64>]) -> Result<Self, Error> {
        let name = name.into();
        let points = matrix(&name, points)?;
        let zero_variance = zero_variance(&points);
        Ok(Self {
            modes: Modes::First(points.ncols()),
            name,
            points,
            zero_variance,
        })
    }

    pub(crate) fn in_modes(name: &str, points: DMatrix<f64>, modes: Modes, zero_variance: f64) -> Self {
        Self {
            name: name.to_owned(),
            points,
            modes,
            zero_variance,
        }
    }

    /// The name of the cluster.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The points `B_k` of eq. 5, `K x R`, one per row.
    #[must_use]
    pub fn points(&self) -> &DMatrix<f64> {
        &self.points
    }

    /// The mean point, `R` numbers.
    #[must_use]
    pub fn mean(&self) -> Vec<f64> {
        self.row_mean().iter().copied().collect()
    }

    /// The covariance of the points, `R x R`, with divisor `K - 1`.
    ///
    /// # Errors
    /// [`Error::TooFewLaps`] for a single lap.
    pub fn covariance(&self) -> Result<DMatrix<f64>, Error> {
        self.carries(1)?;
        Ok(scatter(&self.points) / (self.points.nrows() - 1) as f64)
    }

    pub(crate) fn row_mean(&self) -> RowDVector<f64> {
        self.points.row_mean()
    }

    /// How many modes were asked for.
    pub(crate) fn modes(&self) -> Modes {
        self.modes
    }

    pub(crate) fn zero_variance(&self) -> f64 {
        self.zero_variance
    }

    /// The same laps in the first `count` modes.
    pub(crate) fn first(&self, count: usize) -> DMatrix<f64> {
        self.points.columns(0, count).into_owned()
    }

    /// Whether the laps can carry a covariance in so many modes.
    pub(crate) fn carries(&self, modes: usize) -> Result<(), Error> {
        let laps = self.points.nrows();
        if laps > modes {
            return Ok(());
        }
        let laps = vec![(self.name.clone(), laps)];
        Err(Error::TooFewLaps {
            laps,
            coordinates: modes,
            each: modes + 1,
            total: modes + 1,
        })
    }
}
