//! Seeded samples for the tests.

use nalgebra::{DMatrix, RowDVector};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

use crate::{Cluster, Projection};

/// A matrix of independent standard normal numbers.
pub(crate) fn gaussian(seed: u64, rows: usize, columns: usize) -> DMatrix<f64> {
    let mut stream = ChaCha8Rng::seed_from_u64(seed);
    DMatrix::from_fn(rows, columns, |_, _| stream.sample(StandardNormal))
}

/// The rows of `points`, moved by `shift`.
pub(crate) fn shifted(points: &DMatrix<f64>, shift: &[f64]) -> DMatrix<f64> {
    let shift = RowDVector::from_row_slice(shift);
    DMatrix::from_fn(points.nrows(), points.ncols(), |row, column| {
        points[(row, column)] + shift[column]
    })
}

pub(crate) fn rows(points: &DMatrix<f64>) -> Vec<Vec<f64>> {
    points
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect()
}

pub(crate) fn cluster(name: &str, points: &DMatrix<f64>) -> Cluster {
    Cluster::new(name, &rows(points)).unwrap()
}

pub(crate) fn projection(name: &str, points: &DMatrix<f64>) -> Projection {
    Projection::new(name, &rows(points)).unwrap()
}

/// Whether two numbers agree to `tolerance` of the larger one.
pub(crate) fn close(is: f64, should: f64, tolerance: f64) -> bool {
    (is - should).abs() <= tolerance * is.abs().max(should.abs())
}
