//! What the declared model leads one to expect, and how every probe changes it.

use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sim::Setting;

use super::expectation::{Expectation, Scatter};
use super::probe::{Probe, probes};
use super::summary::{BLOCKS, Summary};
use crate::Error;

/// Simulates one data set of the measured one's shape: laps of each run, or `None` where a run crashes or stops.
///
/// The same number gives the same draws whatever the effects, so differences between effects are theirs alone.
pub type Simulate<'a> = dyn Fn(&[Setting], u64) -> Option<Vec<Vec<track::Lap>>> + Sync + 'a;

/// Data sets simulated with the declared model.
pub(super) const NULL_SETS: u64 = 200;

/// Data sets simulated for each size of a probe.
const PROBE_SETS: u64 = 8;

/// One data set in units of the declared model's scatter, less its expectation: for each run the mean lap times the root of the number of
/// laps, then the trend times the root of the number of runs, then the second-order numbers. Under the declared model
/// its entries are independent with variance 1.
pub(super) type White = DVector<f64>;

/// The declared model's expectation, scatter, and the paths of the probes away from it.
#[derive(Debug, Clone)]
pub struct Atlas {
    pub(super) null: Expectation,
    pub(super) scatter: Scatter,
    /// What each simulated data set of the declared model says.
    pub(super) samples: Vec<Expectation>,
    /// Laps of each run.
    pub(super) laps: Vec<usize>,
    pub(super) probes: Vec<Probe>,
    /// For each probe, for each of its sizes, the expectation in white; `None` where the robot crashes.
    pub(super) paths: Vec<Vec<Option<White>>>,
}

impl Atlas {
    /// Simulates everything; `tick` is called after each simulated data set.
    ///
    /// # Errors
    /// A declared model that does not complete its laps.
    pub fn new(simulate: &Simulate<'_>, tick: &(dyn Fn() + Sync)) -> Result<Self, Error> {
        Self::with_probes(simulate, probes(), tick)
    }

    /// An atlas that knows no effect: enough to judge laps by, not to name what they lack.
    ///
    /// # Errors
    /// As [`Atlas::new`].
    pub fn without_effects(simulate: &Simulate<'_>, tick: &(dyn Fn() + Sync)) -> Result<Self, Error> {
        Self::with_probes(simulate, Vec::new(), tick)
    }

    fn with_probes(
        simulate: &Simulate<'_>,
        probes: Vec<Probe>,
        tick: &(dyn Fn() + Sync),
    ) -> Result<Self, Error> {
        let null: Vec<Summary> = (0..NULL_SETS)
            .into_par_iter()
            .map(|set| {
                tick();
                summary(simulate, &[], set).ok_or(Error::DeclaredModelStops)
            })
            .collect::<Result<_, _>>()?;
        let expectation = Expectation::of(null.iter(), true);
        let scatter = Scatter::of(null.iter()).ok_or(Error::TooFewLaps)?;
        let laps: Vec<usize> = null[0].runs.iter().map(|run| run.laps).collect();
        let samples = null.iter().map(observed).collect();
        let mut atlas = Self {
            null: expectation,
            scatter,
            samples,
            laps,
            probes,
            paths: Vec::new(),
        };
        let same_draws = Expectation::of(null[..PROBE_SETS as usize].iter(), true);
        drop(null);
        let jobs: Vec<(usize, usize)> = atlas
            .probes
            .iter()
            .enumerate()
            .flat_map(|(p, probe)| (0..probe.sizes.len()).map(move |k| (p, k)))
            .collect();
        let points: Vec<Option<White>> = jobs
            .par_iter()
            .map(|&(p, k)| {
                let setting = [atlas.probes[p].setting(atlas.probes[p].sizes[k])];
                let sets: Option<Vec<Summary>> = (0..PROBE_SETS)
                    .map(|set| {
                        tick();
                        summary(simulate, &setting, set)
                    })
                    .collect();
                sets.map(|sets| atlas.white(&Expectation::of(sets.iter(), true), &same_draws))
            })
            .collect();
        let mut points = points.into_iter();
        atlas.paths = atlas
            .probes
            .iter()
            .map(|probe| points.by_ref().take(probe.sizes.len()).collect())
            .collect();
        Ok(atlas)
    }

    /// The atlas as bytes, for a cache.
    pub fn to_bytes(&self) -> Vec<u8> {
        postcard::to_stdvec(&Stored {
            probes: fingerprint(&self.probes),
            null: self.null.clone(),
            scatter: self.scatter.clone(),
            samples: self.samples.clone(),
            laps: self.laps.clone(),
            paths: self.paths.clone(),
        })
        .expect("numbers and lists have a form as bytes")
    }

    /// The atlas of [`Atlas::to_bytes`]; `None` for bytes that are none, or that were made with other probes.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let Stored {
            probes: made_with,
            null,
            scatter,
            samples,
            laps,
            paths,
        } = postcard::from_bytes(bytes).ok()?;
        let probes = probes();
        (made_with == fingerprint(&probes)).then_some(Self {
            null,
            scatter,
            samples,
            laps,
            probes,
            paths,
        })
    }

    /// Number of data sets that [`Atlas::new`] simulates.
    pub fn sets() -> u64 {
        NULL_SETS + PROBE_SETS * probes().iter().map(|probe| probe.sizes.len() as u64).sum::<u64>()
    }

    /// Number of data sets that [`Atlas::without_effects`] simulates.
    pub fn null_sets() -> u64 {
        NULL_SETS
    }

    /// Time of a lap, s.
    pub(super) fn lap_s(&self) -> f64 {
        let lap = &self.null.means[0];
        lap.rows(lap.len() - BLOCKS, BLOCKS).sum() / 100.0
    }

    /// The difference of two expectations in units of the declared model's scatter.
    pub(super) fn white(&self, to: &Expectation, from: &Expectation) -> White {
        white(&self.scatter, &self.laps, to, from)
    }
}

/// What a cache holds of an atlas.
#[derive(Serialize, Deserialize)]
struct Stored {
    probes: String,
    null: Expectation,
    scatter: Scatter,
    samples: Vec<Expectation>,
    laps: Vec<usize>,
    paths: Vec<Vec<Option<White>>>,
}

/// What tells two lists of probes apart.
fn fingerprint(probes: &[Probe]) -> String {
    probes
        .iter()
        .map(|probe| format!("{} {:?};", probe.label(), probe.sizes))
        .collect()
}

/// The difference of two expectations in units of a scatter.
pub(super) fn white(scatter: &Scatter, laps: &[usize], to: &Expectation, from: &Expectation) -> White {
    let runs = laps
        .iter()
        .enumerate()
        .map(|(r, &n)| scatter.whiten(&(&to.means[r] - &from.means[r])) * (n as f64).sqrt());
    let trend = scatter.whiten(&(&to.trend - &from.trend)) * (laps.len() as f64).sqrt();
    let second = scatter.whiten_second(&(&to.second - &from.second));
    let parts: Vec<DVector<f64>> = runs.chain([trend, second]).collect();
    DVector::from_iterator(
        parts.iter().map(|p| p.len()).sum(),
        parts.iter().flat_map(|p| p.iter().copied()),
    )
}

/// What one data set says, in the form of an expectation: its runs are not pooled.
pub(super) fn observed(summary: &Summary) -> Expectation {
    Expectation::of(std::iter::once(summary), false)
}

/// The summary of one simulated data set.
pub(super) fn summary(simulate: &Simulate<'_>, effects: &[Setting], set: u64) -> Option<Summary> {
    Summary::new(&simulate(effects, set)?)
}
