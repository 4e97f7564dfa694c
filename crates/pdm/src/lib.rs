//! Compares sets of laps with a Point Distribution Model (Roduit, Martinoli, Jacot, IROS 2007, section II).
//!
//! A lap is a row of `N` numbers, one per gate; a [`Cluster`] is `K` of them, say one run. [`Pdm::fit`] takes all
//! clusters to be compared and finds the modes in which their laps differ most; [`Pdm::project`] expresses a cluster
//! in these modes, and [`distance`] and [`hotelling`] say how far two projections lie apart and how surprising that is.
//! [`energy_test`] and [`standardised_differences`] do without the model.
//!
//! Letters are the paper's everywhere: `K` laps, `N` gates, `R` modes. The unit of a distance to the mean is the unit
//! of the laps; the crate never asks which one it is, so whatever suffix it has is the caller's.
//!
//! ```
//! use pdm::{Cluster, Modes, Pdm, distance, hotelling};
//!
//! let square = [vec![0.0, 0.0], vec![2.0, 0.0], vec![0.0, 2.0], vec![2.0, 2.0]];
//! let moved: Vec<_> = square.iter().map(|lap| vec![lap[0] + 4.0, lap[1]]).collect();
//! let (x, y) = (Cluster::new("square", &square)?, Cluster::new("moved", &moved)?);
//!
//! let pdm = Pdm::fit([&x, &y])?;
//! let (x, y) = (pdm.project(&x, Modes::All)?, pdm.project(&y, Modes::All)?);
//! assert!((distance(&x, &y)? - 12_f64.sqrt()).abs() < 1e-12);
//! assert!((hotelling(&x, &y)?.p - 5_f64.powf(-2.5)).abs() < 1e-12);
//! # Ok::<(), pdm::Error>(())
//! ```

mod cluster;
mod contrast;
mod covariance;
mod decomposition;
mod distance;
mod ellipse;
mod error;
mod hypothesis;
#[cfg(test)]
mod iris;
mod model;
mod projection;
#[cfg(test)]
mod samples;

pub use cluster::Cluster;
pub use contrast::covariance_contrast;
pub use distance::{distance, mahalanobis};
pub use ellipse::{Ellipse, covariance_ellipse};
pub use error::Error;
pub use hypothesis::{
    Hotelling, Points, TestResult, energy_test, hotelling, max_standardised_difference,
    standardised_differences,
};
pub use model::{Modes, Pdm};
pub use projection::Projection;
