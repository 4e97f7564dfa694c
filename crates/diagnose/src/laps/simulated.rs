//! What hypotheses lead one to expect, by simulation.

use std::ops::Range;

use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, Extent, Simulate, Spent, White};
use super::expectation::Expectation;
use super::hypothesis::Hypothesis;
use super::likelihood::Doubt;
use super::path::Node;
use super::summary::Summary;
use super::trial::Trial;

/// Data sets simulated of a hypothesis that is judged.
pub(super) const FINAL_SETS: u64 = 32;

/// Data sets by which something is looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Draws {
    /// These, or as few of them as make it as good with the control variate of [`Trial::evaluate`].
    Sets(Range<u64>),
    /// Of one the first run of every recording, for all its runs where they are alike: a rough look in a fraction of the time.
    FirstRuns(u64),
}

impl Draws {
    /// The variance of what they tell, in that of a data set of so many runs.
    pub(super) fn error(&self, runs: usize) -> f64 {
        match self {
            Self::Sets(sets) => 1.0 / (sets.end - sets.start) as f64,
            Self::FirstRuns(_) => runs as f64,
        }
    }
}

/// A hypothesis simulated.
#[derive(Debug, Clone)]
pub(super) struct Evaluated {
    pub(super) expectation: Expectation,
    pub(super) doubt: Doubt,
    pub(super) summaries: Vec<Summary>,
}

/// What draws do to a hypothesis, as far as what they do to the declared model tells it.
struct Control {
    /// Of the one, in units of the other.
    share: f64,
    /// The square of their correlation.
    told: f64,
}

impl Control {
    /// By the sums of the products of deviations from the means, and of the squares of either.
    fn new(both: f64, own: f64, of_declared: f64) -> Self {
        let share = (both / of_declared.max(f64::MIN_POSITIVE)).max(0.0);
        Self {
            share,
            told: share * both / own.max(f64::MIN_POSITIVE),
        }
    }
}

impl Trial<'_> {
    /// What one step of each of these numbers of probes does, by the same draws; `None` where the robot crashes.
    pub(super) fn actions(&self, numbers: &[(usize, usize)], sets: u64) -> Vec<Option<White>> {
        numbers
            .par_iter()
            .map(|&(probe, number)| {
                let step = [self.atlas.probes[probe].step(number)];
                let actions = (0..sets).map(|set| self.kept_action(&step, set));
                let sum = actions.reduce(|sum, action| Some(sum? + action?)).flatten()?;
                Some(sum / sets as f64)
            })
            .collect()
    }

    /// The mean of data sets simulated with these settings, without the control variate of [`Trial::evaluate`].
    pub(super) fn simulated_plainly(&self, settings: &[Setting], sets: Range<u64>) -> Option<Expectation> {
        let summaries = self.summaries(settings, sets)?;
        Some(Expectation::of(summaries.iter(), self.atlas.alike))
    }

    /// Whether the first run of every recording tells what all runs do that are driven with these settings.
    pub(super) fn first_runs_tell_all(&self, settings: &[Setting]) -> bool {
        self.atlas.are_alike(settings) && self.atlas.layout.first_runs_tell_all()
    }

    /// What these draws tell of settings.
    pub(super) fn simulated_by(&self, settings: &[Setting], draws: &Draws) -> Option<Expectation> {
        match draws {
            Draws::Sets(sets) => self.simulated_briefly(settings, sets.clone()),
            Draws::FirstRuns(set) if self.first_runs_tell_all(settings) => {
                self.spend(1, Extent::FirstRuns);
                let summary = self
                    .atlas
                    .summary(self.simulate, settings, *set, Extent::FirstRuns)?;
                let first = Expectation::of(std::iter::once(&summary), true);
                Some(first.for_runs(self.atlas.layout.laps.iter().map(Vec::len)))
            }
            &Draws::FirstRuns(set) => self.simulated_briefly(settings, set..set + 1),
        }
    }

    /// Counts so many data sets as simulated.
    pub(super) fn spend(&self, sets: u64, extent: Extent) {
        self.spent.add(sets * self.atlas.layout.laps_of_extent(extent));
    }

    /// The mean of data sets as [`Trial::simulated_plainly`] tells it, by as few of them as make it as good with the control variate
    /// of [`Trial::evaluate`].
    pub(super) fn simulated_briefly(&self, settings: &[Setting], sets: Range<u64>) -> Option<Expectation> {
        let error = 1.0 / (sets.end - sets.start) as f64;
        let found = self
            .atlas
            .simulated_until(self.simulate, settings, sets, error, self.spent)?;
        Some(found.expectation)
    }

    /// What a hypothesis leaves of the data, turned, and how wide it scatters about nothing, as so many data sets tell or as few of them
    /// as make it as good; `None` where the robot crashes.
    pub(super) fn heard(&self, hypothesis: &Hypothesis, sets: u64) -> Option<(White, Node)> {
        let (atlas, error) = (self.atlas, 1.0 / sets as f64);
        let settings = hypothesis.settings(atlas);
        let found = atlas.simulated_until(self.simulate, &settings, 0..sets, error, self.spent)?;
        let left = atlas.turned(&atlas.white(self.data, &found.expectation));
        Some((left, Node::at_rest(atlas.widened(&found.summaries))))
    }

    /// What effects leave of the data, in units of their own scatter; `None` where the robot crashes. That a lap is lost now and
    /// then does not speak against effects: the data sets without it judge them.
    pub(super) fn remainder(&self, effects: &[Setting]) -> Option<White> {
        /// Share of the data sets that must be whole.
        const ENOUGH: f64 = 0.75;
        let sets = self.atlas.enough(FINAL_SETS, 1);
        self.spend(sets, Extent::Whole);
        let found: Vec<(Summary, &Expectation)> = (0..sets)
            .into_par_iter()
            .filter_map(|set| {
                Some((
                    self.atlas.summary(self.simulate, effects, set, Extent::Whole)?,
                    &self.atlas.samples[set as usize],
                ))
            })
            .collect();
        if (found.len() as f64) < ENOUGH * sets as f64 {
            return None;
        }
        let (summaries, declared): (Vec<Summary>, Vec<&Expectation>) = found.into_iter().unzip();
        let end = self
            .atlas
            .evaluated(summaries, &declared, self.atlas.are_alike(effects));
        Some(self.fit(&end)?.residual)
    }

    /// A hypothesis simulated; `None` where the robot crashes.
    pub(super) fn evaluate(&self, hypothesis: &Hypothesis, sets: u64) -> Option<Evaluated> {
        let settings = hypothesis.settings(self.atlas);
        self.atlas.simulated(self.simulate, &settings, sets, self.spent)
    }

    /// The same with data sets added until there are so many.
    pub(super) fn evaluate_more(
        &self,
        hypothesis: &Hypothesis,
        evaluated: &Evaluated,
        sets: u64,
    ) -> Option<Evaluated> {
        let done = evaluated.summaries.len() as u64;
        if done >= sets {
            return Some(evaluated.clone());
        }
        let mut summaries = evaluated.summaries.clone();
        summaries.extend(self.summaries(&hypothesis.settings(self.atlas), done..sets)?);
        Some(self.atlas.paired(summaries, 0, evaluated.doubt.alike))
    }

    fn summaries(&self, settings: &[Setting], sets: Range<u64>) -> Option<Vec<Summary>> {
        self.atlas.summaries(self.simulate, settings, sets, self.spent)
    }
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

    /// Settings simulated with so many data sets, which count as spent; `None` where the robot crashes.
    pub(super) fn simulated(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        sets: u64,
        spent: &Spent,
    ) -> Option<Evaluated> {
        let summaries = self.summaries(simulate, settings, 0..sets, spent)?;
        Some(self.paired(summaries, 0, self.are_alike(settings)))
    }

    /// Settings simulated with as few of some data sets as tell them within an error, in a data set's variance, or else with all.
    pub(super) fn simulated_until(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        sets: Range<u64>,
        error: f64,
        spent: &Spent,
    ) -> Option<Evaluated> {
        let alike = self.are_alike(settings);
        // How runs differ that should be alike tells what draws do, or else how data sets do.
        let runs_tell = alike && self.layout.laps.iter().any(|laps| laps.len() > 1);
        let all = sets.end - sets.start;
        let fewest = if runs_tell { 1 } else { 2 }.min(all);
        let (start, few) = (sets.start, sets.start + fewest);
        let first = self.paired(
            self.summaries(simulate, settings, start..few, spent)?,
            start,
            alike,
        );
        let of_one = first.doubt.error * fewest as f64;
        let enough = ((of_one / error).round() as u64).clamp(fewest, all);
        if enough == fewest {
            return Some(first);
        }
        let mut summaries = first.summaries;
        summaries.extend(self.summaries(simulate, settings, few..start + enough, spent)?);
        Some(self.paired(summaries, start, alike))
    }

    fn summaries(
        &self,
        simulate: &Simulate<'_>,
        settings: &[Setting],
        sets: Range<u64>,
        spent: &Spent,
    ) -> Option<Vec<Summary>> {
        spent.add((sets.end - sets.start) * self.layout.laps_of_extent(Extent::Whole));
        sets.into_par_iter()
            .map(|set| self.summary(simulate, settings, set, Extent::Whole))
            .collect()
    }

    /// Whether the declared model with these effects does the same in every run.
    pub(super) fn are_alike(&self, settings: &[Setting]) -> bool {
        self.alike && settings.iter().all(Setting::same_in_every_run)
    }

    /// Data sets of a hypothesis from one on, each with the same draws as the declared model's.
    fn paired(&self, summaries: Vec<Summary>, first: u64, alike: bool) -> Evaluated {
        let same_draws = self.samples.iter().skip(first as usize);
        let declared: Vec<&Expectation> = same_draws.take(summaries.len()).collect();
        self.evaluated(summaries, &declared, alike)
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
        let (mut both, mut own, mut of_declared) = (0.0, 0.0, 0.0);
        for (summary, &sample) in summaries.iter().zip(declared) {
            let sample = self.white(sample, &declared_mean);
            let found = self.white(&Expectation::of(std::iter::once(summary), false), &mean);
            both += found.dot(&sample);
            own += found.norm_squared();
            of_declared += sample.norm_squared();
        }
        let Control { share, told } = Control::new(both, own, of_declared);
        let expectation = mean.moved(share, &declared_mean, &self.null);
        let error = (1.0 - told) / sets as f64 + told / self.samples.len() as f64;
        Evaluated {
            expectation,
            doubt: Doubt { error, alike },
            summaries,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Control;

    #[test]
    fn draws_that_do_twice_as_much_are_told_altogether() {
        let control = Control::new(2.0 * 5.0, 4.0 * 5.0, 5.0);
        assert_eq!((control.share, control.told), (2.0, 1.0));
    }

    #[test]
    fn draws_of_a_noisier_robot_are_told_in_part() {
        // Own deviations are the declared model's and others of three times their square.
        let control = Control::new(5.0, 4.0 * 5.0, 5.0);
        assert_eq!((control.share, control.told), (1.0, 0.25));
    }

    #[test]
    fn without_deviations_nothing_is_told() {
        for (both, own, of_declared) in [(0.0, 0.0, 0.0), (-1.0, 2.0, 2.0)] {
            let control = Control::new(both, own, of_declared);
            assert_eq!((control.share, control.told), (0.0, 0.0));
        }
    }
}
