//! Candidates with their best values.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use sim::{Pattern, Setting, Spec};
use statrs::statistics::Statistics;

use super::catalogue::{Variant, leaps};
use super::evidence::{Assessment, Evidence, Knob};
use super::leads::{By, Lead, price, trusted};
use super::noise::{factor_again, is_noise};
use super::pairs::Pair;
use super::refine::{Fitted, hunt, hunt_delay, jumps, knobs, knobs_of, one_step, refine};
use super::repeat::repeats;
use super::search::screened;
use crate::candidate::{OfRun, apart, filled};

/// A candidate with its best values and their pattern.
#[derive(Debug, Clone)]
pub(crate) struct Refined {
    pub(crate) settings: Vec<Setting>,
    /// Standard errors, setting by setting in the order of the pattern's values.
    pub(crate) standard_errors: Vec<Vec<f64>>,
    pub(crate) gain: f64,
    pub(crate) fitted: usize,
    pub(crate) by: By,
    /// What those effects whose sizes are put together of what each run tells are without that of one, by run and place among the
    /// settings.
    pub(crate) without: BTreeMap<usize, BTreeMap<usize, Setting>>,
    /// Log-likelihood that it may owe to faults of the filter, as simulated logs tell; infinite if they were not asked.
    pub(crate) faults: f64,
}

impl Refined {
    pub(crate) fn score(&self) -> f64 {
        let trusted = trusted(self.gain, self.fitted, self.by);
        trusted.max(self.gain - self.faults) - price(self.fitted, self.by)
    }

    /// The effects' names, whatever their order.
    pub(crate) fn names(&self) -> BTreeSet<&'static str> {
        self.settings.iter().map(|setting| setting.spec.name).collect()
    }

    /// Where a refinement of a pair begins; it gains nothing until it is judged by the logs.
    pub(crate) fn of_pair(pair: &Pair) -> Self {
        let settings: Vec<Setting> = pair.parts.iter().map(|(_, setting)| setting.clone()).collect();
        Self {
            standard_errors: settings.iter().map(unfitted).collect(),
            by: by_all(&settings),
            settings,
            gain: 0.0,
            fitted: 0,
            without: BTreeMap::new(),
            faults: f64::INFINITY,
        }
    }

    /// With one effect more, which is not refined; it gains nothing until it is judged by the logs.
    pub(crate) fn with(&self, further: Setting) -> Self {
        let mut with = self.clone();
        with.standard_errors.push(unfitted(&further));
        with.settings.push(further);
        with.by = by_all(&with.settings);
        with.gain = 0.0;
        with
    }

    /// With one effect less, the others as they are; it gains nothing until it is judged by the logs.
    pub(crate) fn less(&self, place: usize) -> Self {
        let mut less = self.clone();
        less.settings.remove(place);
        less.standard_errors.remove(place);
        less.by = by_all(&less.settings);
        (less.gain, less.faults) = (0.0, f64::INFINITY);
        for without in less.without.values_mut() {
            let moved = std::mem::take(without)
                .into_iter()
                .filter(|(other, _)| *other != place);
            *without = moved
                .map(|(other, setting)| (other - usize::from(other > place), setting))
                .collect();
        }
        less
    }

    /// Refined by further steps from where it is, but for what jumps or is noise; `base` is the log-likelihood of the
    /// declared model.
    pub(crate) fn further(
        self,
        evidence: &Evidence<'_>,
        variants: &[Variant],
        base: f64,
        steps: usize,
    ) -> Self {
        self.again(evidence, variants, base, steps).unwrap_or(self)
    }

    /// The same; `None` if the filter loses the robot with it.
    pub(super) fn again(
        &self,
        evidence: &Evidence<'_>,
        variants: &[Variant],
        base: f64,
        steps: usize,
    ) -> Option<Self> {
        let fitted = refine(evidence, self.settings.clone(), self.knobs(variants), steps)?;
        Some(refined(fitted, base, self.by).keeping(self))
    }

    /// The same values judged by other evidence with this log-likelihood of the declared model; `None` if it cannot drive so.
    pub(super) fn judged_by(&self, evidence: &Evidence<'_>, base: f64) -> Option<Self> {
        Some(Self {
            gain: evidence.likelihood(&self.settings)? - base,
            ..self.clone()
        })
    }

    /// With what `before` knew of those effects that were not refined since.
    fn keeping(mut self, before: &Self) -> Self {
        for place in 0..self.settings.len() {
            let own = &mut self.standard_errors[place];
            if own.iter().any(|error| *error > 0.0) {
                continue;
            }
            own.clone_from(&before.standard_errors[place]);
            for (&run, without) in &before.without {
                if let Some(setting) = without.get(&place) {
                    self.without
                        .entry(run)
                        .or_default()
                        .insert(place, setting.clone());
                }
            }
        }
        let is_known = |error: &&f64| **error > 0.0;
        self.fitted = self.standard_errors.iter().flatten().filter(is_known).count();
        self.faults = before.faults;
        self
    }

    /// Takes the sizes that each run tells as those of the effect at this place, which is the next to get errors.
    fn take(&mut self, place: usize, of_runs: OfRuns) {
        self.settings[place] = of_runs.setting;
        self.standard_errors.push(of_runs.errors);
        for (run, setting) in of_runs.without {
            self.without.entry(run).or_default().insert(place, setting);
        }
    }

    /// With the best sizes of what jumps beside the other effects, and those refined again there.
    pub(crate) fn hunted(mut self, evidence: &Evidence<'_>, variants: &[Variant], base: f64) -> Self {
        const STEPS: usize = 2;
        let places: Vec<usize> = (0..self.settings.len())
            .filter(|&place| jumps(&self.settings[place]))
            .collect();
        for place in places {
            if let Some(fitted) = leap(evidence, &self.settings, place) {
                self = refined(fitted, base, self.by).keeping(&self);
            }
            self = self.further(evidence, variants, base, STEPS);
        }
        self
    }

    /// See [`knobs_of`].
    fn knobs(&self, variants: &[Variant]) -> Vec<Knob> {
        knobs_of(&self.settings, variants)
    }

    /// The settings fitted again to other evidence, from where they are; those that jump stay.
    pub(super) fn refit(&self, evidence: &Evidence<'_>, variants: &[Variant]) -> Vec<Setting> {
        let knobs = self.knobs(variants);
        match self.assessed(evidence, &knobs) {
            Some(now) => one_step(evidence, &self.settings, &knobs, &now),
            None => self.settings.clone(),
        }
    }

    /// How well the settings explain the logs; `None` where nothing of them can be fitted.
    pub(super) fn assessed(&self, evidence: &Evidence<'_>, knobs: &[Knob]) -> Option<Assessment> {
        (!knobs.is_empty())
            .then(|| evidence.assess(&self.settings, knobs))
            .flatten()
    }

    /// Makes errors at least as large as how far its values are from those of the same effects fitted from elsewhere.
    pub(super) fn be_as_unsure_as_far_from(&mut self, other: &Self) {
        let values = self.settings.iter().zip(&other.settings);
        for ((own, other), errors) in values.zip(&mut self.standard_errors) {
            for (error, (own, other)) in errors
                .iter_mut()
                .zip(own.pattern.numbers().iter().zip(other.pattern.numbers()))
            {
                *error = error.max((own - other).abs());
            }
        }
    }

    /// The same with errors at least as large as those of fits to simulated logs of it (a parametric bootstrap; Efron and
    /// Tibshirani 1993): the filter is linear about a pose, from which large noise takes the robot far, and readings near
    /// edges do not count.
    pub(crate) fn with_honest_errors(mut self, evidence: &Evidence<'_>, variants: &[Variant]) -> Self {
        if self.knobs(variants).is_empty() && !self.settings.iter().any(is_noise) {
            return self;
        }
        let fits = repeats(evidence, &self.settings, |repeated| {
            let mut fit = self.refit(repeated, variants);
            if let Some((place, factor)) = factor_again(repeated, &self.settings) {
                fit[place] = Setting::constant(fit[place].spec, [factor]);
            }
            Some(fit)
        });
        for (i, (setting, errors)) in self.settings.iter().zip(&mut self.standard_errors).enumerate() {
            for (j, (value, error)) in setting.pattern.numbers().iter().zip(errors).enumerate() {
                let param = setting.param(j);
                let square = |fit: &Vec<Setting>| apart(fit[i].pattern.numbers()[j], *value, param).powi(2);
                let mean = fits.iter().map(square).sum::<f64>() / fits.len() as f64;
                if *error > 0.0 {
                    *error = error.max(mean.sqrt());
                }
            }
        }
        self
    }

    /// What was fitted beside another candidate, as one candidate of both.
    pub(crate) fn after(mut self, first: &Self) -> Self {
        let own = std::mem::replace(&mut self.standard_errors, first.standard_errors.clone());
        self.standard_errors.extend(own);
        self.gain += first.gain;
        self.fitted += first.fitted;
        self.by = first.by;
        self.without.clone_from(&first.without);
        self
    }
}

/// Refines a lead. `base` is the log-likelihood of the declared model by stretch.
pub(crate) fn pursue(
    evidence: &Evidence<'_>,
    variant: &Variant,
    lead: &Lead,
    base: &[f64],
    steps: usize,
) -> Option<Refined> {
    match lead.by {
        By::Constant => {
            let setting = Setting::constant(variant.spec, variant.values_at(lead.multiples[0].as_slice()));
            let fitted = follow(evidence, variant, setting, steps)?;
            Some(refined(fitted, base.iter().sum(), By::Constant))
        }
        By::Time => {
            let k = variant.sizes.len();
            let start = variant.values_at(&lead.multiples[0].as_slice()[..k]);
            let per_s = vec![0.0; start.len()];
            let setting = Setting {
                spec: variant.spec,
                pattern: Pattern::ByTime { start, per_s },
            };
            let knobs = knobs(variant, 0, &setting.pattern);
            Some(refined(
                refine(evidence, vec![setting], knobs, steps)?,
                base.iter().sum(),
                By::Time,
            ))
        }
        By::Run => {
            let runs = evidence.runs();
            let parts = (runs.par_iter().zip(&lead.multiples))
                .map(|(&run, multiples)| {
                    let setting = Setting::constant(variant.spec, variant.values_at(multiples.as_slice()));
                    follow(&evidence.of_run(run), variant, setting, steps)
                })
                .collect::<Option<Vec<_>>>()?;
            by_runs(evidence, variant, &runs, &parts, base)
        }
    }
}

fn follow(evidence: &Evidence<'_>, variant: &Variant, setting: Setting, steps: usize) -> Option<Fitted> {
    if jumps(&setting) {
        return leap(evidence, &[setting], 0);
    }
    let knobs = knobs(variant, 0, &setting.pattern);
    refine(evidence, vec![setting], knobs, steps)
}

/// The best size of an effect that jumps beside others.
fn leap(evidence: &Evidence<'_>, settings: &[Setting], place: usize) -> Option<Fitted> {
    let settings = &leapt(evidence, settings, place);
    let spread = match settings[place].spec.name {
        "command-delay" => return hunt_delay(evidence, settings, place),
        "speed-step" => 1e-4,
        "sensor-reach" => 0.04,
        _ => 0.003,
    };
    hunt(evidence, settings, place, spread)
}

/// The settings with the best of those sizes of an effect that jumps, and of its own, that linear algebra likes beside the others: its
/// likelihood has tops far from each other.
fn leapt(evidence: &Evidence<'_>, settings: &[Setting], place: usize) -> Vec<Setting> {
    const LIKED: usize = 3;
    let own = leaps(settings[place].spec, evidence.variants());
    let mut others = settings.to_vec();
    others.remove(place);
    let mut leads = screened(evidence, &others, &own).map_or(Vec::new(), |(_, leads)| leads);
    leads.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let liked = leads.iter().take(LIKED).map(|lead| {
        let mut liked = settings.to_vec();
        liked[place] = lead.start(&own[lead.variant]);
        liked
    });
    let tried: Vec<Vec<Setting>> = [settings.to_vec()].into_iter().chain(liked).collect();
    (tried.into_par_iter())
        .filter_map(|tried| Some((evidence.likelihood(&tried)?, tried)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(|| settings.to_vec(), |best| best.1)
}

fn refined(fitted: Fitted, base: f64, by: By) -> Refined {
    let mut refined = Refined {
        standard_errors: Vec::new(),
        gain: fitted.log_likelihood - base,
        fitted: fitted.knobs.len(),
        settings: fitted.settings.clone(),
        by,
        without: BTreeMap::new(),
        faults: f64::INFINITY,
    };
    for (place, setting) in fitted.settings.iter().enumerate() {
        let errors = spread_errors(setting, place, &fitted);
        let of_runs = match &setting.pattern {
            Pattern::ByRun(runs) if errors.iter().any(|error| *error > 0.0) => {
                let of_run = errors.chunks(runs[0].len()).map(<[f64]>::to_vec);
                let told = runs
                    .iter()
                    .zip(of_run)
                    .map(|(values, errors)| told(setting.spec, values.clone(), errors));
                of_runs(setting.spec, told.collect())
            }
            _ => None,
        };
        match of_runs {
            Some(of_runs) => refined.take(place, of_runs),
            None => refined.standard_errors.push(errors),
        }
    }
    refined
}

/// How the values of several effects go over the runs: as those that go most freely.
fn by_all(settings: &[Setting]) -> By {
    let by = |setting: &Setting| match setting.pattern {
        Pattern::Constant(_) => By::Constant,
        Pattern::ByTime { .. } => By::Time,
        Pattern::ByRun(_) => By::Run,
    };
    settings.iter().map(by).max().unwrap_or(By::Constant)
}

/// Standard errors of an effect that was not refined.
fn unfitted(setting: &Setting) -> Vec<f64> {
    vec![0.0; setting.pattern.numbers().len()]
}

/// Standard errors in the order of the pattern's values, 0 where a value was not fitted.
fn spread_errors(setting: &Setting, number: usize, fitted: &Fitted) -> Vec<f64> {
    let (count, slots) = match &setting.pattern {
        Pattern::ByTime { start, .. } => (start.len(), 2 * start.len()),
        Pattern::Constant(values) => (values.len(), values.len()),
        Pattern::ByRun(runs) => (runs[0].len(), runs.len() * runs[0].len()),
    };
    let mut errors = vec![0.0; slots];
    for (knob, error) in fitted
        .knobs
        .iter()
        .zip(&fitted.standard_errors)
        .filter(|(knob, _)| knob.setting == number)
    {
        let row = knob.run.unwrap_or(usize::from(knob.slope));
        errors[knob.value + row * count] = *error;
    }
    errors
}

/// One candidate of what was fitted to each run alone; `None` if no log tells the size.
fn by_runs(
    evidence: &Evidence<'_>,
    variant: &Variant,
    runs: &[usize],
    parts: &[Fitted],
    base: &[f64],
) -> Option<Refined> {
    let mut all = vec![None; evidence.measured_runs];
    for (&run, part) in runs.iter().zip(parts) {
        let errors = spread_errors(&part.settings[0], 0, part);
        all[run] = told(variant.spec, part.settings[0].pattern.numbers(), errors);
    }
    let of_runs = of_runs(variant.spec, all)?;
    let mut refined = Refined {
        settings: vec![of_runs.setting.clone()],
        standard_errors: Vec::new(),
        gain: parts.iter().map(|part| part.log_likelihood).sum::<f64>() - base.iter().sum::<f64>(),
        fitted: parts.iter().map(|part| part.knobs.len()).sum(),
        by: By::Run,
        without: BTreeMap::new(),
        faults: f64::INFINITY,
    };
    refined.take(0, of_runs);
    Some(refined)
}

/// An effect's sizes run by run.
struct OfRuns {
    setting: Setting,
    /// Run by run in a row.
    errors: Vec<f64>,
    /// What they are without what one run tells, by run.
    without: BTreeMap<usize, Setting>,
}

/// An effect's sizes of what each run tells, [`filled`] where the log does not; `None` if no log does.
fn of_runs(spec: &'static Spec, mut told: Vec<Option<OfRun>>) -> Option<OfRuns> {
    give_places(&mut told);
    let (values, errors) = filled(&told)?;
    let of = |values| Setting {
        spec,
        pattern: Pattern::ByRun(values),
    };
    let without = |run: usize| {
        let mut others = told.clone();
        others[run].take()?;
        Some((run, of(filled(&others)?.0)))
    };
    Some(OfRuns {
        without: (0..told.len()).filter_map(without).collect(),
        setting: of(values),
        errors,
    })
}

/// What a run tells of an effect: its values, if all but places are known.
fn told(spec: &Spec, values: Vec<f64>, errors: Vec<f64>) -> Option<OfRun> {
    let is_place = |i: usize| spec.param(i).is_some_and(|param| param.neutral.is_none());
    let is_told = |(i, error): (usize, &f64)| error.is_finite() || is_place(i);
    (errors.iter().enumerate().all(is_told)).then_some(OfRun { values, errors })
}

/// Gives values that a run does not tell, as the place of what does nothing there, the mean of the other runs'; they are not fitted.
fn give_places(told: &mut [Option<OfRun>]) {
    let numbers = told
        .iter()
        .flatten()
        .map(|run| run.values.len())
        .max()
        .unwrap_or(0);
    for i in 0..numbers {
        let known: Vec<f64> = (told.iter().flatten())
            .filter(|run| run.errors[i].is_finite())
            .map(|run| run.values[i])
            .collect();
        for run in told.iter_mut().flatten().filter(|run| !run.errors[i].is_finite()) {
            if !known.is_empty() {
                run.values[i] = known.as_slice().mean();
            }
            run.errors[i] = 0.0;
        }
    }
}

/// Refines several settings together from where each of them was best alone.
pub(crate) fn together(
    evidence: &Evidence<'_>,
    parts: &[(Variant, Setting)],
    base: f64,
    steps: usize,
) -> Option<Refined> {
    let settings: Vec<Setting> = parts.iter().map(|(_, setting)| setting.clone()).collect();
    let knobs = (parts.iter().enumerate())
        .filter(|(_, (_, setting))| !jumps(setting))
        .flat_map(|(i, (variant, setting))| knobs(variant, i, &setting.pattern))
        .collect();
    Some(refined(
        refine(evidence, settings, knobs, steps)?,
        base,
        By::Constant,
    ))
}
