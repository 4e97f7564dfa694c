//! The laps that the error before and after is told by.

use std::ops::Range;

use anyhow::Result;
use diagnose::{Answer, MeanLaps};
use rayon::prelude::*;
use sim::{Setting, Streams};
use track::Lap;

use super::recording::{Recording, RunPlace};
use crate::laps::SampledRun;
use crate::setup::Setup;

/// Runs behind every mean lap, and laps of each; as many laps in all are driven in runs as long as the measured ones where what the
/// robot does changes in the course of a run.
const RUNS: u64 = 32;
const LAPS: usize = 20;
/// Runs that share a seed.
const RUNS_PER_SEED: u64 = 4;
/// Seeds of the laps that errors are measured with lie far from those of the fit.
const SEED_OFFSET: u64 = 1 << 40;

/// How far one recording's held-out runs are from the simulation.
#[derive(Debug)]
pub(crate) struct Errors {
    /// Which of the recordings.
    pub(crate) recording: usize,
    pub(crate) held_out: Vec<SampledRun>,
    pub(crate) before: MeanLaps,
    pub(crate) after: MeanLaps,
    /// For each held-out run: root mean square distances, m.
    pub(crate) before_m: Vec<f64>,
    pub(crate) after_m: Vec<f64>,
    /// What it is for runs of the model with the effects, m.
    pub(crate) floor_m: Vec<f64>,
}

/// The errors of every recording; without unseen data each run is left out of the fit in turn.
pub(super) fn errors(
    recordings: &[Recording],
    answer: &Answer,
    unseen: Option<(usize, Vec<SampledRun>)>,
    seed: u64,
) -> Result<Vec<Errors>> {
    let mut all = Vec::new();
    for (place, recording) in recordings.iter().enumerate() {
        if unseen.as_ref().is_some_and(|(at, _)| *at != place) {
            continue;
        }
        let longest = recording.shape().into_iter().fold(1, usize::max);
        let laps_of = |effects: &[Setting], runs: Range<usize>| {
            let places = &recording.places(effects)[runs];
            mean_laps(&recording.setup, effects, seed, longest, places)
        };
        let off_m = |laps: &MeanLaps, run: &SampledRun| laps.distance_m(&run.offsets_m());
        let all_runs = 0..recording.measured.runs.len();
        let before = laps_of(&[], all_runs.clone())?;
        let settings = answer.settings();
        let after = if settings.is_empty() {
            before.clone()
        } else {
            laps_of(&settings, all_runs)?
        };
        let (held_out, before_m, after_m) = match &unseen {
            Some((_, runs)) => (
                runs.clone(),
                runs.iter().map(|run| off_m(&before, run)).collect(),
                runs.iter().map(|run| off_m(&after, run)).collect(),
            ),
            None => {
                let runs = recording.measured.runs.clone();
                let (mut before_m, mut after_m) = (Vec::new(), Vec::new());
                for (at, run) in runs.iter().enumerate() {
                    let without = &answer.left_out[recording.first_run + at];
                    let distance_m = |effects| anyhow::Ok(off_m(&laps_of(effects, at..at + 1)?, run));
                    let own_m = if recording.runs_are_alike() {
                        off_m(&before, run)
                    } else {
                        distance_m(&[])?
                    };
                    before_m.push(own_m);
                    after_m.push(if without.is_empty() {
                        own_m
                    } else {
                        distance_m(without)?
                    });
                }
                (runs, before_m, after_m)
            }
        };
        all.push(Errors {
            recording: place,
            before_m,
            floor_m: held_out.iter().map(|run| after.floor_m(run.laps.len())).collect(),
            held_out,
            before,
            after,
            after_m,
        });
    }
    Ok(all)
}

/// The mean lap of a model with effects: of runs that take the places of some measured runs, of up to `longest` laps, in turn.
///
/// # Errors
/// A model that cannot drive, or hardly completes a lap.
fn mean_laps(
    setup: &Setup,
    effects: &[Setting],
    seed: u64,
    longest: usize,
    places: &[RunPlace],
) -> Result<MeanLaps> {
    let changes = places.iter().any(|place| place.start.is_some());
    let (laps, runs) = if changes {
        (longest, RUNS.max(RUNS * LAPS as u64 / longest as u64))
    } else {
        (longest.max(LAPS), RUNS)
    };
    let mut model = setup.model.clone();
    model.effects.extend_from_slice(effects);
    let drive = |i: u64| -> Result<Vec<Lap>> {
        let streams = Streams {
            seed: seed + SEED_OFFSET + i / RUNS_PER_SEED,
            run: i % RUNS_PER_SEED,
        };
        let place = places[i as usize % places.len()];
        let world = setup.scene.world(&model, place.number)?;
        Ok(sim::drive_from(&world, streams, place.start, laps, |_| {})?.laps)
    };
    let driven = (0..runs).into_par_iter().map(drive).collect::<Result<Vec<_>>>()?;
    Ok(MeanLaps::new(&driven)?)
}
