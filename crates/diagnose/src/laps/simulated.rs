//! What hypotheses lead one to expect, by simulation.

use std::ops::Range;

use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, Simulate, White};
use super::expectation::Expectation;
use super::hypothesis::Hypothesis;
use super::likelihood::Doubt;
use super::summary::Summary;

/// Data sets simulated of a hypothesis that is judged.
pub(super) const FINAL_SETS: u64 = 32;

/// A hypothesis simulated.
#[derive(Debug, Clone)]
pub(super) struct Evaluated {
    pub(super) expectation: Expectation,
    pub(super) doubt: Doubt,
    pub(super) summaries: Vec<Summary>,
}

impl Atlas {
    /// Data sets at each of so many points that determine the scatter of a lap too: short runs need more of them.
    pub(super) fn enough(&self, sets: u64, points: u64) -> u64 {
        const TIMES: usize = 3;
        let freedom: usize = (self.layout.laps.iter())
            .map(|laps| laps.iter().map(|n| n - 2).sum())
            .min()
            .unwrap_or(1);
        let needed = (TIMES * self.layout.lap).div_ceil(freedom) as u64;
        sets.max(needed.div_ceil(points)).min(self.samples.len() as u64)
    }

    /// What one step of each of these numbers of probes does, by the same draws; `None` where the robot crashes.
    pub(super) fn actions(
        &self,
        simulate: &Simulate<'_>,
        numbers: &[(usize, usize)],
        sets: u64,
    ) -> Vec<Option<White>> {
        let same_draws = self.declared_mean(0..sets);
        numbers
            .par_iter()
            .map(|&(probe, number)| {
                let setting = [self.probes[probe].step(number)];
                let found = self.simulated_plainly(simulate, &setting, 0..sets)?;
                Some(self.white(&found, &same_draws))
            })
            .collect()
    }

    /// The mean of data sets simulated with these settings, without the control variate of [`Atlas::evaluate`].
    pub(super) fn simulated_plainly(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        sets: Range<u64>,
    ) -> Option<Expectation> {
        let summaries = self.summaries(simulate, settings, sets)?;
        Some(Expectation::of(summaries.iter(), self.alike))
    }

    /// What effects leave of the data, in units of their own scatter; `None` where the robot crashes. That a lap is lost now and
    /// then does not speak against effects: the data sets without it judge them.
    pub(super) fn remainder(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        effects: &[Setting],
    ) -> Option<White> {
        /// Share of the data sets that must be whole.
        const ENOUGH: f64 = 0.75;
        let sets = self.enough(FINAL_SETS, 1);
        let found: Vec<(Summary, &Expectation)> = (0..sets)
            .into_par_iter()
            .filter_map(|set| Some((self.summary(simulate, effects, set)?, &self.samples[set as usize])))
            .collect();
        if (found.len() as f64) < ENOUGH * sets as f64 {
            return None;
        }
        let (summaries, declared): (Vec<Summary>, Vec<&Expectation>) = found.into_iter().unzip();
        let end = self.evaluated(summaries, &declared, self.are_alike(effects));
        Some(self.fit(data, &end)?.residual)
    }

    /// A hypothesis simulated; `None` where the robot crashes.
    pub(super) fn evaluate(
        &self,
        simulate: &Simulate<'_>,
        hypothesis: &Hypothesis,
        sets: u64,
    ) -> Option<Evaluated> {
        self.simulated(simulate, &hypothesis.settings(self), sets)
    }

    /// The same with data sets added until there are so many.
    pub(super) fn evaluate_more(
        &self,
        simulate: &Simulate<'_>,
        hypothesis: &Hypothesis,
        evaluated: Evaluated,
        sets: u64,
    ) -> Option<Evaluated> {
        let mut summaries = evaluated.summaries;
        let done = summaries.len() as u64;
        summaries.extend(self.summaries(simulate, &hypothesis.settings(self), done..sets.max(done))?);
        Some(self.paired(summaries, evaluated.doubt.alike))
    }

    fn simulated(&self, simulate: &Simulate<'_>, settings: &[Setting], sets: u64) -> Option<Evaluated> {
        let summaries = self.summaries(simulate, settings, 0..sets)?;
        Some(self.paired(summaries, self.are_alike(settings)))
    }

    /// Whether the declared model with these effects does the same in every run.
    fn are_alike(&self, settings: &[Setting]) -> bool {
        self.alike && settings.iter().all(Setting::same_in_every_run)
    }

    /// The first so many data sets of a hypothesis, each with the same draws as the declared model's.
    fn paired(&self, summaries: Vec<Summary>, alike: bool) -> Evaluated {
        let declared: Vec<&Expectation> = self.samples[..summaries.len()].iter().collect();
        self.evaluated(summaries, &declared, alike)
    }

    fn summaries(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        sets: Range<u64>,
    ) -> Option<Vec<Summary>> {
        sets.into_par_iter()
            .map(|set| self.summary(simulate, settings, set))
            .collect()
    }

    /// What simulated data sets say of their hypothesis. What their draws did to the declared model is taken off as far as
    /// it helps (a control variate).
    pub(super) fn evaluated(
        &self,
        summaries: Vec<Summary>,
        declared: &[&Expectation],
        alike: bool,
    ) -> Evaluated {
        let sets = summaries.len();
        let mean = Expectation::of(summaries.iter(), alike);
        let declared_mean = Expectation::mean(declared, alike);
        let (mut both, mut own) = (0.0, 0.0);
        for (summary, &sample) in summaries.iter().zip(declared) {
            let sample = self.white(sample, &declared_mean);
            both += self
                .white(&Expectation::of(std::iter::once(summary), false), &mean)
                .dot(&sample);
            own += sample.norm_squared();
        }
        let share = (both / own).clamp(0.0, 1.0);
        let expectation = mean.moved(share, &declared_mean, &self.null);
        let error = (1.0 - share * share) / sets as f64 + share * share / self.samples.len() as f64;
        Evaluated {
            expectation,
            doubt: Doubt { error, alike },
            summaries,
        }
    }
}
