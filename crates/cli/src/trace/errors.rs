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
    /// The same with the run's own size, where sizes go by run: no fit without a run knows it.
    pub(crate) own_m: Option<Vec<f64>>,
    /// What it is for runs of the model with the effects, m.
    pub(crate) floor_m: Vec<f64>,
    pub(crate) lap_times: LapTimes,
    /// Eq. 8 between the laps simulated for each held-out run and the measured ones, in [`EQ_8_MODES`].
    pub(crate) eq_8: [Eq8; 2],
    /// How runs start, if that is known.
    pub(crate) starts: Option<Starts>,
}

/// Mean lap times of held-out runs and of what is simulated for each of them, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LapTimes {
    pub(crate) measured_s: f64,
    pub(crate) before_s: f64,
    pub(crate) after_s: f64,
    /// Standard deviation by chance.
    pub(crate) chance_s: f64,
}

/// Eq. 8 in some modes of a PDM of simulated and measured laps; `None` of laps that have not so many.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eq8 {
    pub(crate) modes: usize,
    pub(crate) before: Option<f64>,
    pub(crate) after: Option<f64>,
    /// What it is between as many simulated laps and others.
    pub(crate) chance: Option<f64>,
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
        let mut beside = Vec::new();
        for unseen in &held_out.unseen {
            let own = (!unseen.is_nothing())
                .then(|| simulated(Some(unseen)))
                .transpose()?;
            let [before, after] =
                own.map_or_else(|| all.each_ref().map(Cow::Borrowed), |own| own.map(Cow::Owned));
            beside.push(Beside {
                of_chance: after.clone(),
                before,
                after,
            });
        }
        let starts = self.starts(&held_out.beginnings)?;
        Ok(self.errors(&all, held_out.runs, &beside, starts))
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
        let mut beside = Vec::new();
        for at in 0..runs.len() {
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
                Cow::Borrowed(after)
            } else {
                own_after.clone()
            };
            beside.push(Beside {
                before: own_before,
                after: own_after,
                of_chance,
            });
        }
        let starts = self.starts(&recording.beginnings)?;
        let mut errors = self.errors(&all, runs.clone(), &beside, starts);
        let settings = self.answer.settings();
        if settings.iter().any(Setting::goes_by_run) {
            let own = |(at, run): (usize, &SampledRun)| {
                Ok(simulated(&settings, at..at + 1)?.distance_m(&run.offsets_m()))
            };
            errors.own_m = Some(runs.iter().enumerate().map(own).collect::<Result<_>>()?);
        }
        Ok(errors)
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
        [before, after]: &[MeanLaps; 2],
        held_out: Vec<SampledRun>,
        beside: &[Beside<'_>],
        starts: Option<Starts>,
    ) -> Errors {
        let laps_m: Vec<Vec<Vec<f64>>> = held_out.iter().map(SampledRun::offsets_m).collect();
        let of_each = |distance_m: fn(&Beside<'_>, &Vec<Vec<f64>>) -> f64| {
            let runs = beside.iter().zip(&laps_m);
            runs.map(|(beside, run)| distance_m(beside, run)).collect()
        };
        Errors {
            recording: self.place,
            before: before.clone(),
            after: after.clone(),
            before_m: of_each(|beside, run| beside.before.distance_m(run)),
            after_m: of_each(|beside, run| beside.after.distance_m(run)),
            own_m: None,
            floor_m: of_each(|beside, run| beside.of_chance.floor_m(run.len())),
            lap_times: LapTimes::of(&held_out, beside),
            eq_8: eq_8(&laps_m, beside),
            held_out,
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

/// What is simulated for one held-out run, of which no fit knows.
struct Beside<'a> {
    before: Cow<'a, MeanLaps>,
    after: Cow<'a, MeanLaps>,
    /// What runs like it are drawn from, once the effects are added.
    of_chance: Cow<'a, MeanLaps>,
}

type LapsOf = for<'a> fn(&'a Beside<'a>) -> &'a MeanLaps;

impl LapTimes {
    /// How much longer simulated laps take before and after, s.
    pub(crate) fn longer_s(&self) -> [f64; 2] {
        [self.before_s, self.after_s].map(|simulated_s| simulated_s - self.measured_s)
    }

    fn of(held_out: &[SampledRun], beside: &[Beside<'_>]) -> Self {
        let measured_s: Vec<f64> = held_out.iter().flat_map(SampledRun::lap_times_s).collect();
        let laps = measured_s.len() as f64;
        let share = |run: &SampledRun| run.laps.len() as f64 / laps;
        let runs = || held_out.iter().zip(beside);
        let variance = |(run, beside): (&SampledRun, &Beside<'_>)| {
            (share(run) * beside.of_chance.lap_chance_s(run.laps.len())).powi(2)
        };
        Self {
            measured_s: measured_s.iter().sum::<f64>() / laps,
            before_s: runs()
                .map(|(run, beside)| share(run) * beside.before.lap_s())
                .sum(),
            after_s: runs()
                .map(|(run, beside)| share(run) * beside.after.lap_s())
                .sum(),
            chance_s: runs().map(variance).sum::<f64>().sqrt(),
        }
    }
}

/// Eq. 8 between measured runs and as many simulated laps of each, in [`EQ_8_MODES`].
fn eq_8(runs_m: &[Vec<Vec<f64>>], beside: &[Beside<'_>]) -> [Eq8; 2] {
    /// Pairs of simulated clusters that tell chance.
    const PAIRS: usize = 4;
    let total = runs_m.iter().map(Vec::len).sum::<usize>();
    // No lap stands for two: neither in one cluster nor in another.
    let simulated = |laps: LapsOf, cluster: usize| -> Option<Vec<Vec<f64>>> {
        let mut own = Vec::new();
        for (run, beside) in runs_m.iter().zip(beside) {
            let first = cluster * total + own.len();
            own.extend(laps(beside).laps_m().skip(first).take(run.len()).cloned());
        }
        (own.len() == total).then_some(own)
    };
    let measured = runs_m.concat();
    let to_measured = |laps: LapsOf| {
        simulated(laps, 0).map_or([None; 2], |simulated| distances_in_modes(&simulated, &measured))
    };
    let (before, after) = (to_measured(|b| &b.before), to_measured(|b| &b.after));
    let chance: Vec<[Option<f64>; 2]> = (0..PAIRS)
        .map_while(|pair| {
            let of_chance = |cluster| simulated(|b| &b.of_chance, cluster);
            Some(distances_in_modes(
                &of_chance(2 * pair)?,
                &of_chance(2 * pair + 1)?,
            ))
        })
        .collect();
    [0, 1].map(|i| {
        let told: Vec<f64> = chance.iter().filter_map(|of| of[i]).collect();
        Eq8 {
            modes: EQ_8_MODES[i],
            before: before[i],
            after: after[i],
            chance: (!told.is_empty()).then(|| told.iter().sum::<f64>() / told.len() as f64),
        }
    })
}

/// Eq. 8 between two clusters of laps, in [`EQ_8_MODES`] of a PDM of both; `None` where it cannot be told.
fn distances_in_modes(one_m: &[Vec<f64>], other_m: &[Vec<f64>]) -> [Option<f64>; 2] {
    let fit = || {
        let one = pdm::Cluster::new("one", one_m).ok()?;
        let other = pdm::Cluster::new("other", other_m).ok()?;
        let model = pdm::Pdm::fit([&one, &other]).ok()?;
        Some((model, one, other))
    };
    let Some((model, one, other)) = fit() else {
        return [None; 2];
    };
    EQ_8_MODES.map(|modes| {
        let project = |cluster| model.project(cluster, pdm::Modes::First(modes)).ok();
        pdm::distance(&project(&one)?, &project(&other)?).ok()
    })
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
