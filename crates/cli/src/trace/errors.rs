//! The laps that the error before and after is told by.

use std::borrow::Cow;
use std::ops::Range;

use anyhow::Result;
use diagnose::{Answer, MeanLaps};
use rayon::prelude::*;
use sim::{Setting, Step, Streams};
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

/// The errors of every recording; without data that no fit has seen each run is left out in turn.
pub(super) fn errors(
    recordings: &[Recording],
    answer: &Answer,
    held_out: Option<(usize, Vec<SampledRun>)>,
    seed: u64,
) -> Result<Vec<Errors>> {
    let mut all = Vec::new();
    for (place, recording) in recordings.iter().enumerate() {
        if held_out.as_ref().is_some_and(|(at, _)| *at != place) {
            continue;
        }
        let longest = recording.shape().into_iter().fold(1, usize::max);
        let laps_of = |effects: &[Setting], runs: Range<usize>| {
            let mut places = recording.places(effects)[runs].to_vec();
            if held_out.is_some() {
                // What is held out has holes of its own, or none.
                places.iter_mut().for_each(|place| place.unseen = None);
            }
            mean_laps(&recording.setup, effects, seed, longest, &places)
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
        let runs = match &held_out {
            Some((_, runs)) => runs,
            None => &recording.measured.runs,
        };
        let (mut before_m, mut after_m, mut floor_m) = (Vec::new(), Vec::new(), Vec::new());
        for (at, run) in runs.iter().enumerate() {
            let [own_before, own_after] = match &held_out {
                Some(_) => [Cow::Borrowed(&before), Cow::Borrowed(&after)],
                None => {
                    let alone = |effects| anyhow::Ok(Cow::Owned(laps_of(effects, at..at + 1)?));
                    let own_before = if recording.expects_the_same_of_runs() {
                        Cow::Borrowed(&before)
                    } else {
                        alone(&[])?
                    };
                    let without = &answer.left_out[recording.first_run + at];
                    let own_after = if without.is_empty() {
                        own_before.clone()
                    } else {
                        alone(without)?
                    };
                    [own_before, own_after]
                }
            };
            let of_chance = if recording.has_holes() { &own_after } else { &after };
            before_m.push(off_m(&own_before, run));
            after_m.push(off_m(&own_after, run));
            floor_m.push(of_chance.floor_m(run.laps.len()));
        }
        all.push(Errors {
            recording: place,
            held_out: runs.clone(),
            before,
            after,
            before_m,
            after_m,
            floor_m,
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
    places: &[RunPlace<'_>],
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
        let Some(unseen) = place.unseen else {
            return Ok(sim::drive_from(&world, streams, place.start, laps, |_| {})?.laps);
        };
        let mut path = Vec::new();
        let record = |step: &Step| path.push((step.time_s, step.observed));
        let mut driven = sim::drive_from(&world, streams, place.start, laps, record)?.laps;
        driven.retain(|lap| lap.missed.is_empty());
        Ok(setup.seen_through(unseen, driven, &mut path))
    };
    let driven = (0..runs).into_par_iter().map(drive).collect::<Result<Vec<_>>>()?;
    Ok(MeanLaps::new(&driven)?)
}
