//! How far the simulated laps are from measured ones, before and after.

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use sim::{Setting, Streams};

use crate::laps::SampledRun;
use crate::setup::Setup;

use super::recording::RunPlace;

/// Runs behind every mean lap, each of at least 20 laps.
const RUNS: u64 = 32;
/// Runs that share a seed.
const RUNS_PER_SEED: u64 = 4;
/// Seeds of the laps that errors are measured with lie far from those of the fit.
const SEED_OFFSET: u64 = 1 << 40;

/// Laps simulated for a mean lap, with that mean.
#[derive(Debug, Clone)]
pub(crate) struct MeanLaps {
    /// Over all runs: one position for each gate, m.
    pub(crate) mean_m: Vec<f64>,
    /// Runs x laps x gates, m.
    runs_m: Vec<Vec<Vec<f64>>>,
    /// Mean lap time, s.
    pub(crate) lap_s: f64,
}

impl MeanLaps {
    /// Simulates a model with effects: 32 runs of `laps` laps, which take the places of some measured runs in turn.
    pub(crate) fn new(
        setup: &Setup,
        effects: &[Setting],
        seed: u64,
        laps: usize,
        places: &[RunPlace],
    ) -> Result<Self> {
        let mut model = setup.model.clone();
        model.effects.extend_from_slice(effects);
        let drives: Vec<sim::Drive> = (0..RUNS)
            .into_par_iter()
            .map(|i| {
                let streams = Streams {
                    seed: seed + SEED_OFFSET + i / RUNS_PER_SEED,
                    run: i % RUNS_PER_SEED,
                };
                let place = places[i as usize % places.len()];
                let world = setup.scene.world(&model, place.number)?;
                sim::drive_from(&world, streams, place.start, laps, |_| {})
            })
            .collect::<Result<_, _>>()?;
        let closed = |drive: &sim::Drive| -> Vec<Vec<f64>> {
            (drive.laps.iter())
                .filter(|lap| lap.missed.is_empty())
                .map(|lap| lap.offsets_m.clone())
                .collect()
        };
        let runs_m: Vec<Vec<Vec<f64>>> = (drives.iter().map(closed))
            .filter(|laps| !laps.is_empty())
            .collect();
        ensure!(
            runs_m.len() > 1,
            "the simulated robot completes laps in {} of {RUNS} runs: no error can be told; look at `lapwing drive` with the same effects",
            runs_m.len()
        );
        let mean_m = mean(runs_m.iter().flatten()).context("the simulated robot completes no lap")?;
        let times: Vec<f64> = (drives.iter().flat_map(|d| &d.laps))
            .map(track::Lap::duration_s)
            .filter(|t| t.is_finite())
            .collect();
        let lap_s = times.iter().sum::<f64>() / times.len() as f64;
        Ok(Self {
            mean_m,
            runs_m,
            lap_s,
        })
    }

    /// Every simulated lap, gate by gate, m.
    pub(crate) fn laps_m(&self) -> impl Iterator<Item = &Vec<f64>> {
        self.runs_m.iter().flatten()
    }

    /// The root mean square over the gates of the difference to a measured run's mean lap, m.
    pub(crate) fn distance_m(&self, run: &SampledRun) -> f64 {
        mean(run.offsets_m().iter()).map_or(f64::NAN, |mean_m| rms(&self.mean_m, &mean_m))
    }

    /// Mean lap of each simulated run's first so many laps, m.
    fn run_means_m(&self, laps: usize) -> Vec<Vec<f64>> {
        (self.runs_m.iter())
            .filter_map(|run| mean(run.iter().take(laps)))
            .collect()
    }

    /// Standard error, gate by gate, of the mean lap of runs of so many laps each that this very model drove, m.
    pub(crate) fn standard_error_m(&self, laps: &[usize]) -> Vec<f64> {
        let fewest = laps.iter().copied().min().unwrap_or(1);
        let means = self.run_means_m(fewest);
        let at = |gate: usize| {
            let off = |run: &Vec<f64>| (run[gate] - self.mean_m[gate]).powi(2);
            let variance = means.iter().map(off).sum::<f64>() / (means.len() as f64 - 1.0);
            (variance / laps.len() as f64).sqrt()
        };
        (0..self.mean_m.len()).map(at).collect()
    }

    /// What [`MeanLaps::distance_m`] is on average for a run of so many laps that this very model drove, m.
    pub(crate) fn floor_m(&self, laps: usize) -> f64 {
        let distances: Vec<f64> = (self.run_means_m(laps).iter())
            .map(|run| rms(&self.mean_m, run))
            .collect();
        // Each run is a part of the mean that it is held against.
        let alone = distances.len() as f64 / (distances.len() as f64 - 1.0);
        alone * distances.iter().sum::<f64>() / distances.len() as f64
    }
}

/// The mean of laps, gate by gate; `None` of none.
pub(crate) fn mean<'a>(laps: impl Iterator<Item = &'a Vec<f64>>) -> Option<Vec<f64>> {
    let (mut sum, mut count) = (Vec::new(), 0.0);
    for lap in laps {
        sum.resize(lap.len(), 0.0);
        sum.iter_mut().zip(lap).for_each(|(s, x)| *s += x);
        count += 1.0;
    }
    (count > 0.0).then(|| sum.into_iter().map(|s: f64| s / count).collect())
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / a.len() as f64).sqrt()
}
