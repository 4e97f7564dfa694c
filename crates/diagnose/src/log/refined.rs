//! Candidates with their best values.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use sim::{Pattern, Setting};
use statrs::statistics::Statistics;

use super::catalogue::Variant;
use super::evidence::{Assessment, Evidence, Knob};
use super::leads::{By, Lead, price, trusted};
use super::noise::{factor_again, is_noise};
use super::refine::{Fitted, hunt, hunt_delay, jumps, knobs, knobs_of, one_step, refine};
use super::repeat::repeats;
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
    /// Where the first of its sizes are put together of what each run tells: what they are without that of one.
    pub(crate) without: BTreeMap<usize, Vec<Setting>>,
}

impl Refined {
    pub(crate) fn score(&self) -> f64 {
        trusted(self.gain, self.fitted, self.by) - price(self.fitted, self.by)
    }

    /// The effects' names, whatever their order.
    pub(crate) fn names(&self) -> BTreeSet<&'static str> {
        self.settings.iter().map(|setting| setting.spec.name).collect()
    }

    /// Refined by further steps from where it is; `base` is the log-likelihood of the declared model.
    pub(crate) fn further(
        self,
        evidence: &Evidence<'_>,
        variants: &[Variant],
        base: f64,
        steps: usize,
    ) -> Self {
        let knobs = self.knobs(variants);
        match refine(evidence, self.settings.clone(), knobs, steps) {
            Some(fitted) => refined(fitted, base, self.by),
            None => self,
        }
    }

    /// See [`knobs_of`].
    fn knobs(&self, variants: &[Variant]) -> Vec<Knob> {
        knobs_of(&self.settings, variants)
    }

    /// The settings fitted again to other evidence, from where they are; those that jump or go by run stay.
    fn refit(&self, evidence: &Evidence<'_>, variants: &[Variant]) -> Vec<Setting> {
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
            for (error, (own, other)) in errors.iter_mut().zip(numbers(own).iter().zip(numbers(other))) {
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
            for (j, (value, error)) in numbers(setting).iter().zip(errors).enumerate() {
                let param = setting.spec.params.get(j);
                let square = |fit: &Vec<Setting>| apart(numbers(&fit[i])[j], *value, param).powi(2);
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
    if setting.spec.name == "command-delay" {
        return hunt_delay(evidence, &setting);
    }
    if jumps(&setting) {
        let spread = match setting.spec.name {
            "speed-step" => 5e-4,
            "sensor-reach" => 0.04,
            _ => 0.003,
        };
        return hunt(evidence, &setting, spread);
    }
    let knobs = knobs(variant, 0, &setting.pattern);
    refine(evidence, vec![setting], knobs, steps)
}

fn refined(fitted: Fitted, base: f64, by: By) -> Refined {
    let standard_errors = (fitted.settings.iter().enumerate())
        .map(|(i, setting)| spread_errors(setting, i, &fitted))
        .collect();
    Refined {
        gain: fitted.log_likelihood - base,
        fitted: fitted.knobs.len(),
        settings: fitted.settings,
        standard_errors,
        by,
        without: BTreeMap::new(),
    }
}

/// The pattern's values, in the order of their standard errors; none where they go by run.
fn numbers(setting: &Setting) -> Vec<f64> {
    match &setting.pattern {
        Pattern::ByRun(_) => Vec::new(),
        pattern => pattern.numbers(),
    }
}

/// Standard errors in the order of the pattern's values, 0 where a value was not fitted.
fn spread_errors(setting: &Setting, number: usize, fitted: &Fitted) -> Vec<f64> {
    let (count, slots) = match &setting.pattern {
        Pattern::ByTime { start, .. } => (start.len(), 2 * start.len()),
        Pattern::Constant(values) => (values.len(), values.len()),
        Pattern::ByRun(runs) => (runs[0].len(), runs[0].len()),
    };
    let mut errors = vec![0.0; slots];
    for (knob, error) in fitted
        .knobs
        .iter()
        .zip(&fitted.standard_errors)
        .filter(|(knob, _)| knob.setting == number)
    {
        errors[knob.value + if knob.slope { count } else { 0 }] = *error;
    }
    errors
}

/// One candidate of what was fitted to each run alone, [`filled`] where the log does not tell the size; `None` if no log does.
fn by_runs(
    evidence: &Evidence<'_>,
    variant: &Variant,
    runs: &[usize],
    parts: &[Fitted],
    base: &[f64],
) -> Option<Refined> {
    let is_place = |i: usize| variant.spec.param(i).is_some_and(|param| param.neutral.is_none());
    let mut told = vec![None; evidence.measured_runs];
    for (&run, part) in runs.iter().zip(parts) {
        let errors = spread_errors(&part.settings[0], 0, part);
        let values = numbers(&part.settings[0]);
        let is_told = |(i, error): (usize, &f64)| error.is_finite() || is_place(i);
        told[run] = (errors.iter().enumerate().all(is_told)).then_some(OfRun { values, errors });
    }
    give_places(&mut told);
    let (values, errors) = filled(&told)?;
    let of = |values| Setting {
        spec: variant.spec,
        pattern: Pattern::ByRun(values),
    };
    let without = |run: usize| {
        let mut others = told.clone();
        others[run].take()?;
        Some((run, vec![of(filled(&others)?.0)]))
    };
    Some(Refined {
        without: (0..told.len()).filter_map(without).collect(),
        settings: vec![of(values)],
        standard_errors: vec![errors],
        gain: parts.iter().map(|part| part.log_likelihood).sum::<f64>() - base.iter().sum::<f64>(),
        fitted: parts.iter().map(|part| part.knobs.len()).sum(),
        by: By::Run,
    })
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
