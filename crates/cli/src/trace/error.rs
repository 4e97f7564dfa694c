//! How far the simulated laps are from measured ones, before and after.

use anyhow::{Context, Result};
use rayon::prelude::*;
use sim::{Setting, Streams};

use crate::laps::SampledRun;
use crate::setup::Setup;

/// Data sets of four runs behind every mean lap: 16 x 4 x 20 laps.
const SETS: u64 = 16;
const RUNS: u64 = 4;
/// Seeds of the laps that errors are measured with lie far from those of the fit.
const SEED_OFFSET: u64 = 1 << 40;

/// Mean laps of simulated runs, m.
#[derive(Debug, Clone)]
pub(crate) struct MeanLaps {
    /// Over all runs: one position for each gate.
    pub(crate) mean_m: Vec<f64>,
    /// Of each run.
    runs_m: Vec<Vec<f64>>,
    /// Mean lap time, s.
    pub(crate) lap_s: f64,
    /// Every simulated lap, laps x gates, m.
    pub(crate) laps_m: Vec<Vec<f64>>,
}

impl MeanLaps {
    /// Simulates a model with effects: 16 x 4 runs of `laps` laps. By run, the runs take the effects' values in turn.
    pub(crate) fn new(setup: &Setup, effects: &[Setting], seed: u64, laps: usize) -> Result<Self> {
        let mut model = setup.model.clone();
        model.effects.extend_from_slice(effects);
        let variant = Setup {
            model,
            scene: setup.scene.clone(),
        };
        let drives: Vec<sim::Drive> = (0..SETS * RUNS)
            .into_par_iter()
            .map(|i| {
                let streams = Streams {
                    seed: seed + SEED_OFFSET + i / RUNS,
                    run: i % RUNS,
                };
                variant.drive(streams, laps, |_| {})
            })
            .collect::<Result<_, _>>()?;
        let closed = |drive: &sim::Drive| -> Vec<Vec<f64>> {
            drive
                .laps
                .iter()
                .filter(|lap| lap.missed.is_empty())
                .map(|lap| lap.offsets_m.clone())
                .collect()
        };
        let runs: Vec<Vec<Vec<f64>>> = drives
            .iter()
            .map(closed)
            .filter(|laps| !laps.is_empty())
            .collect();
        let laps_m: Vec<Vec<f64>> = runs.iter().flatten().cloned().collect();
        let mean_m = mean(&laps_m).context("the simulated robot completes no lap")?;
        let times: Vec<f64> = drives
            .iter()
            .flat_map(|d| &d.laps)
            .map(track::Lap::duration_s)
            .filter(|t| t.is_finite())
            .collect();
        let lap_s = times.iter().sum::<f64>() / times.len() as f64;
        Ok(Self {
            mean_m,
            runs_m: runs.iter().filter_map(|laps| mean(laps)).collect(),
            lap_s,
            laps_m,
        })
    }

    /// The root mean square over the gates of the difference to a measured run's mean lap, m.
    pub(crate) fn distance_m(&self, run: &SampledRun) -> f64 {
        mean(&run.offsets_m()).map_or(f64::NAN, |mean_m| rms(&self.mean_m, &mean_m))
    }

    /// What [`MeanLaps::distance_m`] is on average for a run that this very model drove, m.
    pub(crate) fn floor_m(&self) -> f64 {
        self.runs_m.iter().map(|run| rms(&self.mean_m, run)).sum::<f64>() / self.runs_m.len() as f64
    }
}

/// The mean of laps, gate by gate.
pub(crate) fn mean(laps: &[Vec<f64>]) -> Option<Vec<f64>> {
    let gates = laps.first()?.len();
    Some(
        (0..gates)
            .map(|g| laps.iter().map(|lap| lap[g]).sum::<f64>() / laps.len() as f64)
            .collect(),
    )
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / a.len() as f64).sqrt()
}
