//! What the declared model leads one to expect, and how every probe changes it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sim::Setting;

use super::expectation::{Expectation, Scatter};
use super::hypothesis::Hypothesis;
use super::kept::{Action, Kept};
use super::layout::Layout;
use super::observed::ObservedRun;
use super::probe::{Probe, probes};
use super::ripple::{Power, Ripples, power, wheel_sets};
use super::spread::{Axes, PAIRED, Spread, Variances};
use super::summary::{BLOCKS, Summary};
use crate::Error;

/// Simulates one data set of the measured one's shape, as far as it is asked for: laps of each run, or `None` where one of these
/// crashes or stops.
///
/// The same number gives the same draws whatever the effects, so differences between effects are theirs alone.
pub type Simulate<'a> = dyn Fn(&[Setting], u64, Extent) -> Option<Vec<ObservedRun>> + Sync + 'a;

/// How much of a data set is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Every run.
    Whole,
    /// Every run from where the measured one began.
    FromTheirStarts,
    /// The first run of every recording.
    FirstRuns,
}

impl Extent {
    /// How many of so many runs of a recording it is.
    pub fn runs(self, of: usize) -> usize {
        match self {
            Self::Whole | Self::FromTheirStarts => of,
            Self::FirstRuns => of.min(1),
        }
    }
}

/// Data sets simulated with the declared model.
pub(super) const NULL_SETS: u64 = 200;

/// Data sets simulated for each size of a probe at most, and the variance, in data sets' own, that fewer are enough for.
pub(super) const PATH_SETS: u64 = 3;
const PATH_ERROR: f64 = 0.12;

/// Data sets simulated for each other way to cut the walls.
const CUT_SETS: u64 = 8;

/// One data set in units of the declared model's scatter, less its expectation: for each run the mean lap times the root of the number of
/// laps, then the trend times the root of the number of runs, then the second-order numbers and those of how runs begin; see [`Layout`]. Under the
/// declared model its entries are independent with variance 1.
pub(super) type White = DVector<f64>;

/// The declared model's expectation, scatter, and the paths of the probes away from it.
#[derive(Debug, Clone)]
pub struct Atlas {
    pub(super) null: Expectation,
    /// Whether the declared model expects the same of each run of a recording.
    pub(super) alike: bool,
    /// Of each recording.
    pub(super) scatter: Vec<Scatter>,
    /// What each simulated data set of the declared model says.
    pub(super) samples: Vec<Expectation>,
    pub(super) layout: Layout,
    pub(super) probes: Vec<Probe>,
    /// For each probe, for each of its sizes, what it does; `None` where the robot crashes.
    pub(super) paths: Vec<Vec<Option<Departure>>>,
    /// Of each recording.
    pub(super) axes: Vec<Axes>,
    /// How laps of the declared model scatter in its first data sets.
    pub(super) variances: Vec<Variances>,
    /// How laps of the declared model ripple.
    pub(super) ripples: Ripples,
    /// What screens asked for.
    pub(super) kept: Kept,
    /// Laps that were simulated to make it.
    made: u64,
    pub(super) spent: Spent,
}

/// What a size of a probe does to the declared model.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Departure {
    /// To its expectation.
    pub(super) action: White,
    /// To how its laps scatter.
    pub(super) spread: Spread,
}

impl Departure {
    /// The same of several recordings as one.
    fn join(parts: &[&Self]) -> Self {
        let numbers = parts.iter().flat_map(|part| part.action.iter().copied());
        let length = parts.iter().map(|part| part.action.len()).sum();
        Self {
            action: White::from_iterator(length, numbers),
            spread: Spread::join(parts.iter().map(|part| &part.spread)),
        }
    }
}

/// A count of the laps that a diagnosis asked for.
#[derive(Debug, Default)]
pub(super) struct Spent(AtomicU64);

impl Spent {
    pub(super) fn add(&self, laps: u64) {
        self.0.fetch_add(laps, Ordering::Relaxed);
    }

    pub(super) fn count(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

impl Clone for Spent {
    fn clone(&self) -> Self {
        Self(AtomicU64::new(self.0.load(Ordering::Relaxed)))
    }
}

impl Atlas {
    /// Changes whenever the numbers of an atlas of the same model mean something else: atlases of another recipe are not to be
    /// read.
    pub const RECIPE: u32 = 13;

    /// Simulates everything for one recording; `cuts` simulate the declared model with walls that another program may have
    /// cut, which is no departure from it; `alike` says whether the declared model does the same in every run, whose physics steps
    /// take `physics_step_s`. `tick` is called after each simulated data set.
    ///
    /// # Errors
    /// A declared model that does not complete its laps.
    pub fn new(
        simulate: &Simulate<'_>,
        cuts: &[&Simulate<'_>],
        alike: bool,
        physics_step_s: f64,
        tick: &(dyn Fn() + Sync),
    ) -> Result<Self, Error> {
        Self::with_probes(simulate, cuts, alike, probes(physics_step_s), tick)
    }

    /// An atlas that knows no effect: enough to judge laps by, not to name what they lack.
    ///
    /// # Errors
    /// As [`Atlas::new`].
    pub fn without_effects(
        simulate: &Simulate<'_>,
        cuts: &[&Simulate<'_>],
        alike: bool,
        tick: &(dyn Fn() + Sync),
    ) -> Result<Self, Error> {
        Self::with_probes(simulate, cuts, alike, Vec::new(), tick)
    }

    pub(super) fn with_probes(
        simulate: &Simulate<'_>,
        cuts: &[&Simulate<'_>],
        alike: bool,
        probes: Vec<Probe>,
        tick: &(dyn Fn() + Sync),
    ) -> Result<Self, Error> {
        let simulated = AtomicU64::new(0);
        let counting = || {
            simulated.fetch_add(1, Ordering::Relaxed);
            tick();
        };
        let ticking = |effects: &[Setting], set: u64, extent: Extent| {
            counting();
            simulate(effects, set, extent)
        };
        let first = simulate(&[], 0, Extent::Whole).ok_or(Error::DeclaredModelStops)?;
        let gates = (first.iter().flat_map(|run| &run.laps).next()).map_or(0, |lap| lap.seen.offsets_m.len());
        if (1..BLOCKS).contains(&gates) {
            return Err(Error::TooFewGates { gates, least: BLOCKS });
        }
        let declared = |set: u64| -> Result<(Summary, Power), Error> {
            let runs = ticking(&[], set, Extent::Whole).ok_or(Error::DeclaredModelStops)?;
            let summary = Summary::new(&runs, &[runs.len()]).ok_or(Error::TooFewLaps)?;
            Ok((summary, power(&runs)))
        };
        let declared: Vec<_> = (0..NULL_SETS).into_par_iter().map(declared).collect();
        let (null, round): (Vec<Summary>, Vec<Power>) = (declared.into_iter())
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .unzip();
        let expectation = Expectation::of(null.iter(), alike);
        let layout = Layout::of_recording(&first, expectation.0[0].trend.len());
        let directions = directions(cuts, &null, &counting);
        let mean_laps = layout.total_laps() as f64 / layout.runs() as f64;
        let scatter = Scatter::of(null.iter().map(|summary| &summary.0[0]))
            .and_then(|scatter| scatter.left_open(&directions, mean_laps))
            .ok_or(Error::NoScatter)?;
        let mut atlas = Self {
            samples: null.iter().map(observed).collect(),
            layout,
            null: expectation,
            alike,
            axes: vec![Axes::of(&scatter)],
            variances: Vec::new(),
            scatter: vec![scatter],
            probes,
            paths: Vec::new(),
            ripples: Ripples::default(),
            kept: Kept::default(),
            made: 0,
            spent: Spent::default(),
        };
        let paired = null[..PAIRED].iter().map(std::slice::from_ref);
        atlas.variances = paired.map(|set| Variances::of(&atlas.axes, set)).collect();
        drop(null);
        atlas.paths = atlas.simulate_paths(&ticking, tick);
        atlas.ripples = atlas.ripples(&ticking, &Hypothesis::nothing(), round);
        atlas.made = simulated.into_inner() * atlas.layout.total_laps() as u64;
        atlas.spent = Spent::default();
        Ok(atlas)
    }

    /// What every probe does at every size; `tick` is called for each data set that need not be simulated.
    fn simulate_paths(
        &self,
        simulate: &Simulate<'_>,
        tick: &(dyn Fn() + Sync),
    ) -> Vec<Vec<Option<Departure>>> {
        let jobs: Vec<(usize, usize)> = (self.probes.iter().enumerate())
            .flat_map(|(p, probe)| (0..probe.sizes.len()).map(move |k| (p, k)))
            .collect();
        let points: Vec<Option<Departure>> = jobs
            .par_iter()
            .map(|&(p, k)| {
                let probe = &self.probes[p];
                let setting = [probe.setting(probe.sizes[k])];
                let found =
                    self.simulated_until(simulate, &setting, 0..PATH_SETS, PATH_ERROR, &self.spent)?;
                (found.summaries.len() as u64..PATH_SETS).for_each(|_| tick());
                Some(Departure {
                    action: self.white(&found.expectation, &self.null),
                    spread: Spread::of(&self.axes, &found.summaries, &self.variances),
                })
            })
            .collect();
        let mut points = points.into_iter();
        (self.probes.iter())
            .map(|probe| points.by_ref().take(probe.sizes.len()).collect())
            .collect()
    }

    /// The atlas of several recordings together, from those of each.
    pub fn join(mut parts: Vec<Self>) -> Option<Self> {
        if parts.len() == 1 {
            return parts.pop();
        }
        let probes = parts.first()?.probes.clone();
        let samples = (0..NULL_SETS as usize)
            .map(|set| Expectation::join(parts.iter().map(|part| part.samples[set].clone())))
            .collect();
        let paths =
            (0..probes.len()).map(|p| (0..probes[p].sizes.len()).map(|k| joined(&parts, p, k)).collect());
        let variances =
            (0..PAIRED).map(|set| Variances::join(parts.iter().map(|part| part.variances[set].clone())));
        Some(Self {
            axes: parts.iter().flat_map(|part| part.axes.clone()).collect(),
            variances: variances.collect(),
            null: Expectation::join(parts.iter().map(|part| part.null.clone())),
            alike: parts.iter().all(|part| part.alike),
            scatter: parts.iter().flat_map(|part| part.scatter.clone()).collect(),
            samples,
            layout: Layout::join(parts.iter().map(|part| &part.layout))?,
            paths: paths.collect(),
            ripples: Ripples::join(&parts.iter().map(|part| &part.ripples).collect::<Vec<_>>()),
            probes,
            kept: Kept::default(),
            made: parts.iter().map(|part| part.made).sum(),
            spent: Spent::default(),
        })
    }

    /// Whether a diagnosis simulated what another of the same model would ask for again: worth keeping the atlas anew.
    pub fn has_grown(&self) -> bool {
        self.kept.has_grown()
    }

    /// The atlas as bytes, for a cache.
    pub fn to_bytes(&self) -> Vec<u8> {
        postcard::to_stdvec(&Stored {
            probes: fingerprint(&self.probes),
            null: self.null.clone(),
            alike: self.alike,
            scatter: self.scatter.clone(),
            samples: self.samples.clone(),
            layout: self.layout.clone(),
            paths: self.paths.clone(),
            variances: self.variances.clone(),
            ripples: self.ripples.clone(),
            made: self.made,
            kept: self.kept.to_map(),
        })
        .expect("numbers and lists have a form as bytes")
    }

    /// The atlas of [`Atlas::to_bytes`] with such physics steps; `None` for bytes that are none, or that were made with other probes.
    pub fn from_bytes(bytes: &[u8], physics_step_s: f64) -> Option<Self> {
        let Stored {
            probes: made_with,
            null,
            alike,
            scatter,
            samples,
            layout,
            paths,
            variances,
            ripples,
            made,
            kept,
        } = postcard::from_bytes(bytes).ok()?;
        let probes = if made_with.is_empty() {
            Vec::new()
        } else {
            probes(physics_step_s)
        };
        (made_with == fingerprint(&probes)).then(|| Self {
            axes: scatter.iter().map(Axes::of).collect(),
            null,
            alike,
            scatter,
            samples,
            layout,
            probes,
            paths,
            variances,
            ripples,
            kept: Kept::of(kept),
            made,
            spent: Spent::default(),
        })
    }

    /// Number of data sets that [`Atlas::new`] simulates at most with so many other cuts.
    pub fn sets(cuts: usize) -> u64 {
        let sets = |probe: &Probe| PATH_SETS * probe.sizes.len() as u64;
        // As many whatever the step.
        let probes = probes(1.0);
        Self::null_sets(cuts) + probes.iter().map(sets).sum::<u64>() + wheel_sets(&probes)
    }

    /// Number of data sets that [`Atlas::without_effects`] simulates with so many other cuts.
    pub fn null_sets(cuts: usize) -> u64 {
        NULL_SETS + CUT_SETS * cuts as u64
    }

    /// Number of laps that diagnoses asked for and that the atlas was made of, whenever that was.
    pub fn spent(&self) -> u64 {
        self.made + self.spent.count()
    }

    /// The mean of some of the data sets simulated of the declared model.
    pub(super) fn declared_mean(&self, sets: Range<u64>) -> Expectation {
        let samples: Vec<&Expectation> = self.samples[sets.start as usize..sets.end as usize]
            .iter()
            .collect();
        Expectation::mean(&samples, self.alike)
    }

    /// Time of a lap, s: that of the first recording.
    pub(super) fn lap_s(&self) -> f64 {
        let lap = &self.null.0[0].means[0];
        lap.rows(lap.len() - BLOCKS, BLOCKS).sum() / 100.0
    }

    /// Laps of a run, on average.
    pub(super) fn run_laps(&self) -> f64 {
        self.layout.total_laps() as f64 / self.layout.runs() as f64
    }

    /// What data say, if they have the shape that the atlas was made for, run by run.
    pub(super) fn observed(&self, runs: &[ObservedRun]) -> Result<Expectation, Error> {
        let counts: Vec<usize> = self.layout.laps.iter().map(Vec::len).collect();
        let expected = self.layout.laps.concat();
        let found: Vec<usize> = runs.iter().map(|run| run.laps.len()).collect();
        if found != expected {
            return Err(Error::Shape { expected, found });
        }
        Ok(observed(&Summary::new(runs, &counts).ok_or(Error::TooFewLaps)?))
    }

    /// What the data say without one run, which is one of several of its recording.
    pub(super) fn observed_without(&self, runs: &[ObservedRun], run: usize) -> Result<Expectation, Error> {
        let recording = self.layout.places().nth(run).map(|at| at.0);
        let counts = (self.layout.laps.iter().enumerate())
            .map(|(g, laps)| laps.len() - usize::from(Some(g) == recording));
        let counts: Vec<usize> = counts.collect();
        let mut others = runs.to_vec();
        others.remove(run);
        Ok(observed(
            &Summary::new(&others, &counts).ok_or(Error::TooFewLaps)?,
        ))
    }

    /// The summary of one simulated data set; `None` where a run crashes.
    pub(super) fn summary(
        &self,
        simulate: &Simulate<'_>,
        effects: &[Setting],
        set: u64,
        extent: Extent,
    ) -> Option<Summary> {
        let counts = self.layout.laps.iter().map(|laps| extent.runs(laps.len()));
        let counts: Vec<usize> = counts.collect();
        Summary::new(&simulate(effects, set, extent)?, &counts)
    }

    /// The difference of two expectations in units of the declared model's scatter.
    pub(super) fn white(&self, to: &Expectation, from: &Expectation) -> White {
        white(&self.scatter, &self.layout, to, from)
    }
}

/// What a probe's size does to all recordings.
fn joined(parts: &[Atlas], probe: usize, size: usize) -> Option<Departure> {
    let parts = parts.iter().map(|part| part.paths[probe][size].as_ref());
    Some(Departure::join(&parts.collect::<Option<Vec<_>>>()?))
}

/// How other cuts of the walls change the mean lap, by the same draws; a cut with which the robot crashes is left out.
fn directions(cuts: &[&Simulate<'_>], null: &[Summary], tick: &(dyn Fn() + Sync)) -> Vec<DVector<f64>> {
    let same_draws = Expectation::of(null[..CUT_SETS as usize].iter(), true);
    let direction = |cut: &&Simulate<'_>| {
        let sets: Option<Vec<Summary>> = (0..CUT_SETS)
            .map(|set| {
                tick();
                let runs = cut(&[], set, Extent::Whole)?;
                Summary::new(&runs, &[runs.len()])
            })
            .collect();
        let mean = Expectation::of(sets?.iter(), true);
        Some(&mean.0[0].means[0] - &same_draws.0[0].means[0])
    };
    cuts.par_iter().filter_map(direction).collect()
}

/// What a cache holds of an atlas.
#[derive(Serialize, Deserialize)]
struct Stored {
    probes: String,
    null: Expectation,
    alike: bool,
    scatter: Vec<Scatter>,
    samples: Vec<Expectation>,
    layout: Layout,
    paths: Vec<Vec<Option<Departure>>>,
    variances: Vec<Variances>,
    ripples: Ripples,
    made: u64,
    kept: BTreeMap<String, Action>,
}

/// What tells two lists of probes apart.
fn fingerprint(probes: &[Probe]) -> String {
    probes
        .iter()
        .map(|probe| format!("{} {:?};", probe.label(), probe.sizes))
        .collect()
}

/// The difference of two expectations in units of the scatter of each recording.
pub(super) fn white(scatter: &[Scatter], layout: &Layout, to: &Expectation, from: &Expectation) -> White {
    let mut parts: Vec<DVector<f64>> = Vec::new();
    for (g, (scatter, laps)) in scatter.iter().zip(&layout.laps).enumerate() {
        let (to, from) = (&to.0[g], &from.0[g]);
        let run = |(r, &n): (usize, &usize)| {
            scatter.whiten_mean(&(&to.means[r] - &from.means[r])) * (n as f64).sqrt()
        };
        parts.extend(laps.iter().enumerate().map(run));
        parts.push(scatter.whiten(&(&to.trend - &from.trend)) * (laps.len() as f64).sqrt());
        parts.push(scatter.whiten_second(&(&to.second - &from.second)));
    }
    DVector::from_iterator(layout.len(), parts.iter().flat_map(|p| p.iter().copied()))
}

/// A difference in units of another scatter.
pub(super) fn in_other_units(white: &White, layout: &Layout, from: &[Scatter], to: &[Scatter]) -> White {
    let mut other = white.clone();
    let mut convert = |range: Range<usize>, units: &dyn Fn(&White) -> White| {
        let part = white.rows(range.start, range.len()).into_owned();
        other.rows_mut(range.start, range.len()).copy_from(&units(&part));
    };
    let mut runs = 0;
    for (g, laps) in layout.laps.iter().enumerate() {
        let (from, to) = (&from[g], &to[g]);
        for run in runs..runs + laps.len() {
            convert(layout.run(run), &|mean| to.whiten_mean(&from.unwhiten_mean(mean)));
        }
        runs += laps.len();
        convert(layout.trend(g), &|trend| to.whiten(&from.unwhiten(trend)));
        convert(layout.second(g), &|second| {
            to.whiten_second(&from.unwhiten_second(second))
        });
    }
    other
}

/// What one data set says, in the form of an expectation: its runs are not pooled.
pub(super) fn observed(summary: &Summary) -> Expectation {
    Expectation::of(std::iter::once(summary), false)
}
