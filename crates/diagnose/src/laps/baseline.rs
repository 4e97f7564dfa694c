//! What simpler ways of naming would say of the same laps: for comparison, never for an answer.

use nalgebra::{DMatrix, DVector};

use super::atlas::{Atlas, White};
use super::expectation::Scatter;
use super::observed::ObservedRun;
use super::path::Path;
use super::summary::BLOCKS;
use crate::Error;

/// The three likeliest effects by two ways that do without the scatter of the laps, likeliest first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Baselines {
    /// By the root mean square distance of the mean lateral positions.
    pub mean_lap_rms: Vec<&'static str>,
    /// By the distance of the mean laps in the first two modes of the declared model's laps.
    pub two_modes: Vec<&'static str>,
}

/// Names kept of each way.
const KEPT: usize = 3;

impl Atlas {
    /// What ways of naming that look at the mean lap alone say, each effect at the size that suits them best.
    ///
    /// # Errors
    /// Runs of fewer than three laps, or of another shape than the atlas was made for.
    pub fn baselines(&self, runs: &[ObservedRun]) -> Result<Baselines, Error> {
        let residual = self.white(&self.observed(runs)?, &self.null);
        let modes: Vec<DMatrix<f64>> = self.scatter.iter().map(two_modes).collect();
        Ok(Baselines {
            mean_lap_rms: self.nearest_names(&residual, |_, offsets_mm| offsets_mm),
            two_modes: self.nearest_names(&residual, |recording, offsets_mm| {
                modes[recording].tr_mul(&offsets_mm)
            }),
        })
    }

    /// The effects that come nearest to a residual in what `view` shows of each recording's mean lap, nearest first.
    fn nearest_names(
        &self,
        residual: &White,
        view: impl Fn(usize, DVector<f64>) -> DVector<f64>,
    ) -> Vec<&'static str> {
        let seen = |white: &White| {
            let parts: Vec<DVector<f64>> = (self.mean_offsets_mm(white).into_iter().enumerate())
                .map(|(recording, offsets_mm)| view(recording, offsets_mm))
                .collect();
            DVector::from_iterator(
                parts.iter().map(DVector::len).sum(),
                parts.iter().flatten().copied(),
            )
        };
        let target = seen(residual);
        let distance = |probe: usize| {
            let nodes = self.nodes(probe).into_iter();
            let path = Path::of(nodes.map(|(size, white)| (size, seen(&white))));
            let nearest = path.likeliest(&target, 0..target.len())?;
            Some((&target - nearest.action).norm())
        };
        let mut ranked: Vec<(f64, &'static str)> = (0..self.probes.len())
            .filter_map(|probe| Some((distance(probe)?, self.probes[probe].spec.name)))
            .collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut names = Vec::new();
        for (_, name) in ranked {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names.truncate(KEPT);
        names
    }

    /// By how much the mean lateral positions of each recording differ, mm.
    fn mean_offsets_mm(&self, white: &White) -> Vec<DVector<f64>> {
        let mut run = 0;
        let of_recording = |(scatter, laps): (&Scatter, &Vec<usize>)| {
            let mut mean = DVector::zeros(self.layout.lap);
            for &count in laps {
                let range = self.layout.run(run);
                let own = white.rows(range.start, range.len()).into_owned();
                mean += scatter.unwhiten_mean(&own) / (count as f64).sqrt() / laps.len() as f64;
                run += 1;
            }
            mean.rows(0, self.layout.lap - BLOCKS).into_owned()
        };
        self.scatter
            .iter()
            .zip(&self.layout.laps)
            .map(of_recording)
            .collect()
    }
}

/// The two directions in which the lateral positions of one lap vary most, as columns.
fn two_modes(scatter: &Scatter) -> DMatrix<f64> {
    let lap = scatter.of_lap();
    let gates = lap.nrows() - BLOCKS;
    let eigen = lap.view((0, 0), (gates, gates)).into_owned().symmetric_eigen();
    let mut order: Vec<usize> = (0..gates).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    eigen.eigenvectors.select_columns(&order[..2.min(gates)])
}
