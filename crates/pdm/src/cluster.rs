//! A set of laps that belong together.

use nalgebra::DMatrix;

use crate::Error;

/// `K` laps sampled at the same `N` gates, with a name for tables and messages.
///
/// ```
/// let cluster = pdm::Cluster::new("a", &[vec![0.0, 1.0], vec![2.0, 1.0]])?;
/// assert_eq!(cluster.mean(), [1.0, 1.0]);
/// # Ok::<(), pdm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    name: String,
    laps: DMatrix<f64>,
}

impl Cluster {
    /// The cluster of `laps`, one per row of the `K x N` matrix (eq. 1), `K >= 1`, `N >= 1`.
    ///
    /// # Errors
    /// [`Error::Empty`] without laps or gates, [`Error::Ragged`] for laps of different lengths, [`Error::NotFinite`]
    /// for a NaN or an infinity.
    pub fn new(name: impl Into<String>, laps: &[Vec<f64>]) -> Result<Self, Error> {
        let name = name.into();
        let laps = matrix(&name, laps)?;
        Ok(Self { name, laps })
    }

    /// The name it was given.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The number of laps `K`, at least 1.
    #[must_use]
    #[expect(
        clippy::len_without_is_empty,
        reason = "a cluster without laps cannot be made"
    )]
    pub fn len(&self) -> usize {
        self.laps.nrows()
    }

    /// The number of gates `N`, at least 1.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.laps.ncols()
    }

    /// The laps, `K x N`, one per row.
    #[must_use]
    pub fn laps(&self) -> &DMatrix<f64> {
        &self.laps
    }

    /// The mean lap, `N` numbers.
    #[must_use]
    pub fn mean(&self) -> Vec<f64> {
        self.laps.row_mean().iter().copied().collect()
    }
}

/// The rows as a matrix, or which of them is not fit for one.
pub(crate) fn matrix(name: &str, rows: &[Vec<f64>]) -> Result<DMatrix<f64>, Error> {
    let gates = rows.first().map_or(0, Vec::len);
    if gates == 0 {
        return Err(Error::Empty {
            name: name.to_owned(),
            laps: rows.len(),
            gates,
        });
    }
    for (index, row) in rows.iter().enumerate() {
        check(name, index + 1, row, gates)?;
    }
    Ok(DMatrix::from_fn(rows.len(), gates, |lap, gate| rows[lap][gate]))
}

fn check(name: &str, lap: usize, row: &[f64], expected: usize) -> Result<(), Error> {
    let name = || name.to_owned();
    if row.len() != expected {
        return Err(Error::Ragged {
            name: name(),
            lap,
            gates: row.len(),
            expected,
        });
    }
    match row.iter().position(|value| !value.is_finite()) {
        Some(gate) => Err(Error::NotFinite {
            name: name(),
            lap,
            gate: gate + 1,
            value: row[gate],
        }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cluster_keeps_its_laps_in_rows() {
        let cluster = Cluster::new("a", &[vec![1.0, 2.0, 3.0], vec![3.0, 2.0, 7.0]]).unwrap();
        assert_eq!((cluster.name(), cluster.len(), cluster.dimension()), ("a", 2, 3));
        assert_eq!(cluster.laps()[(1, 2)], 7.0);
        assert_eq!(cluster.mean(), [2.0, 2.0, 5.0]);
    }

    #[test]
    fn what_is_no_matrix_is_refused_by_name_and_place() {
        let refusal = |laps: &[Vec<f64>]| Cluster::new("a", laps).unwrap_err().to_string();
        assert_eq!(
            refusal(&[]),
            "`a` has 0 laps of 0 gates: at least one of each is needed"
        );
        assert_eq!(
            refusal(&[vec![]]),
            "`a` has 1 laps of 0 gates: at least one of each is needed"
        );
        assert_eq!(
            refusal(&[vec![1.0], vec![1.0, 2.0]]),
            "lap 2 of `a` has 2 gates, its first lap has 1"
        );
        assert_eq!(refusal(&[vec![1.0, f64::NAN]]), "lap 1 of `a` is NaN at gate 2");
        assert_eq!(
            refusal(&[vec![0.0], vec![f64::INFINITY]]),
            "lap 2 of `a` is inf at gate 1"
        );
    }
}
