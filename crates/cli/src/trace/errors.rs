//! The laps that the error before and after is told by.

use std::borrow::Cow;
use std::ops::Range;

use anyhow::Result;
use diagnose::{Answer, MeanBeginning, MeanLaps, Unseen};
use rayon::prelude::*;
use sim::{Setting, Streams};
use track::Lap;

use super::beginnings::{Beginnings, simulated_beginning};
use super::recording::{HeldOut, Recording, RunPlace};
use crate::laps::SampledRun;
use crate::setup::Setup;

/// Runs behind every mean lap, and laps of each; as many laps in all are driven in runs as long as the measured ones where what the
/// robot does changes in the course of a run.
const RUNS: u64 = 32;
const LAPS: usize = 20;
/// Runs that share a seed.
const RUNS_PER_SEED: u64 = 4;
/// Modes of a PDM in which eq. 8 is told.
const EQ_8_MODES: [usize; 2] = [2, 10];
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
    /// How runs start, if that is known.
    pub(crate) starts: Option<Starts>,
}

impl Errors {
    /// Mean lap time of the held-out laps, s.
    pub(crate) fn measured_lap_s(&self) -> f64 {
        let times_s: Vec<f64> = self.held_out.iter().flat_map(SampledRun::lap_times_s).collect();
        times_s.iter().sum::<f64>() / times_s.len() as f64
    }

    /// Mean lap times of the simulation before and after, s.
    pub(crate) fn simulated_lap_s(&self) -> [f64; 2] {
        [self.before.lap_s(), self.after.lap_s()]
    }

    /// Eq. 8 between the simulated laps before and after and all held-out ones.
    pub(crate) fn eq_8(&self) -> [Eq8; 2] {
        let measured: Vec<Vec<f64>> = self.held_out.iter().flat_map(SampledRun::offsets_m).collect();
        let [before, after] = [&self.before, &self.after].map(|laps| eq_8(laps, &measured));
        [0, 1].map(|i| Eq8 {
            modes: EQ_8_MODES[i],
            before: before[i],
            after: after[i],
        })
    }
}

/// Eq. 8 in some modes of a PDM of simulated and measured laps; `None` of laps that have not so many.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eq8 {
    pub(crate) modes: usize,
    pub(crate) before: Option<f64>,
    pub(crate) after: Option<f64>,
}

/// How runs start on average.
#[derive(Debug)]
pub(crate) struct Starts {
    pub(crate) measured: MeanBeginning,
    pub(crate) before: MeanBeginning,
    pub(crate) after: MeanBeginning,
}

impl Starts {
    /// How far the robot is, in the first four control steps of its runs, from where it is simulated to be before and after, and what
    /// that is for as many runs of the model with the effects: root mean squares, mm.
    pub(crate) fn errors_mm(&self) -> [f64; 3] {
        [
            self.before.distance_mm(&self.measured),
            self.after.distance_mm(&self.measured),
            self.after.chance_mm(&self.measured),
        ]
    }
}

/// The errors of every recording; without data that no fit has seen each run is left out in turn.
pub(super) fn errors(
    recordings: &[Recording],
    answer: &Answer,
    held_out: Option<HeldOut>,
    seed: u64,
) -> Result<Vec<Errors>> {
    let of = |place: usize| Judged {
        recording: &recordings[place],
        place,
        answer,
        seed,
    };
    match held_out {
        Some(held_out) => Ok(vec![of(held_out.recording).held_out(held_out)?]),
        None => (0..recordings.len()).map(|place| of(place).in_turn()).collect(),
    }
}

/// A recording whose simulations an answer is judged by.
struct Judged<'a> {
    recording: &'a Recording,
    /// Which of all recordings.
    place: usize,
    answer: &'a Answer,
    seed: u64,
}

impl Judged<'_> {
    /// The errors on runs that no fit has seen, each seen through its own holes.
    fn held_out(&self, held_out: HeldOut) -> Result<Errors> {
        let simulated = |unseen: Option<&Unseen>| {
            self.before_and_after(|effects| {
                let mut places = self.recording.places(effects);
                places.iter_mut().for_each(|place| place.unseen = unseen);
                self.mean_laps(effects, &places)
            })
        };
        let all = simulated(None)?;
        let mut distances_m = Vec::new();
        for (run, unseen) in held_out.runs.iter().zip(&held_out.unseen) {
            let own = (!unseen.is_nothing())
                .then(|| simulated(Some(unseen)))
                .transpose()?;
            let [before, after] = own.as_ref().unwrap_or(&all);
            distances_m.push(distances(run, before, after, after));
        }
        let starts = self.starts(&held_out.beginnings)?;
        Ok(self.errors(all, held_out.runs, &distances_m, starts))
    }

    /// The errors on each measured run, of sizes that were fitted to the others.
    fn in_turn(&self) -> Result<Errors> {
        let recording = self.recording;
        let simulated = |effects: &[Setting], runs: Range<usize>| {
            self.mean_laps(effects, &recording.places(effects)[runs])
        };
        let runs = &recording.measured.runs;
        let all = self.before_and_after(|effects| simulated(effects, 0..runs.len()))?;
        let [before, after] = &all;
        let mut distances_m = Vec::new();
        for (at, run) in runs.iter().enumerate() {
            let alone = |effects| anyhow::Ok(Cow::Owned(simulated(effects, at..at + 1)?));
            let own_before = if recording.expects_the_same_of_runs() {
                Cow::Borrowed(before)
            } else {
                alone(&[])?
            };
            let without = &self.answer.left_out[recording.first_run + at];
            let own_after = if without.is_empty() {
                own_before.clone()
            } else {
                alone(without)?
            };
            // Where each run is expected for itself, chance is what is left about that.
            let of_chance = if recording.expects_the_same_of_runs() {
                after
            } else {
                &own_after
            };
            distances_m.push(distances(run, &own_before, &own_after, of_chance));
        }
        let starts = self.starts(&recording.beginnings)?;
        Ok(self.errors(all, runs.clone(), &distances_m, starts))
    }

    /// The mean laps of the declared model and of that with the answer's effects, if it has any.
    fn before_and_after(&self, simulated: impl Fn(&[Setting]) -> Result<MeanLaps>) -> Result<[MeanLaps; 2]> {
        let before = simulated(&[])?;
        let settings = self.answer.settings();
        let after = if settings.is_empty() {
            before.clone()
        } else {
            simulated(&settings)?
        };
        Ok([before, after])
    }

    fn mean_laps(&self, effects: &[Setting], places: &[RunPlace<'_>]) -> Result<MeanLaps> {
        let longest = self.recording.shape().into_iter().fold(1, usize::max);
        mean_laps(&self.recording.setup, effects, self.seed, longest, places)
    }

    fn errors(
        &self,
        [before, after]: [MeanLaps; 2],
        held_out: Vec<SampledRun>,
        distances_m: &[[f64; 3]],
        starts: Option<Starts>,
    ) -> Errors {
        let of = |which: usize| distances_m.iter().map(|run| run[which]).collect();
        Errors {
            recording: self.place,
            held_out,
            before,
            after,
            before_m: of(0),
            after_m: of(1),
            floor_m: of(2),
            starts,
        }
    }

    /// How runs start that begin so, if that is known.
    fn starts(&self, measured: &Beginnings) -> Result<Option<Starts>> {
        let Some(measured) = measured.mean() else {
            return Ok(None);
        };
        let simulated = |effects: &[Setting]| {
            let places = self.recording.places(effects);
            simulated_beginning(&self.recording.setup, effects, self.seed + SEED_OFFSET, &places)
        };
        let both = (simulated(&[])?, simulated(&self.answer.settings())?);
        let (Some(before), Some(after)) = both else {
            return Ok(None);
        };
        Ok(Some(Starts {
            measured,
            before,
            after,
        }))
    }
}

/// Eq. 8 between simulated laps and as many measured ones, in [`EQ_8_MODES`]; `None` where it cannot be told.
fn eq_8(simulated: &MeanLaps, measured_m: &[Vec<f64>]) -> [Option<f64>; 2] {
    let fit = || {
        let simulated: Vec<Vec<f64>> = simulated.laps_m().take(measured_m.len()).cloned().collect();
        let simulated = pdm::Cluster::new("simulated", &simulated).ok()?;
        let measured = pdm::Cluster::new("measured", measured_m).ok()?;
        let model = pdm::Pdm::fit([&simulated, &measured]).ok()?;
        Some((model, simulated, measured))
    };
    let Some((model, simulated, measured)) = fit() else {
        return [None; 2];
    };
    EQ_8_MODES.map(|modes| {
        let project = |cluster| model.project(cluster, pdm::Modes::First(modes)).ok();
        pdm::distance(&project(&simulated)?, &project(&measured)?).ok()
    })
}

/// How far a run is from the simulations before and after, and from others of the latter by chance, m.
fn distances(run: &SampledRun, before: &MeanLaps, after: &MeanLaps, of_chance: &MeanLaps) -> [f64; 3] {
    let offsets_m = run.offsets_m();
    [
        before.distance_m(&offsets_m),
        after.distance_m(&offsets_m),
        of_chance.floor_m(run.laps.len()),
    ]
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
        Ok(place.drive(setup, &world, streams, laps)?.0)
    };
    let driven = (0..runs).into_par_iter().map(drive).collect::<Result<Vec<_>>>()?;
    Ok(MeanLaps::new(&driven)?)
}
