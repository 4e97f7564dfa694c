//! Which variants, in which pattern over runs and time, are worth a refinement, and which of those wins.

use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::{Pattern, Setting, UNLISTED};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::catalogue::{Shape, Variant};
use super::evidence::{Assessment, Evidence, Knob};
use super::noise::{factor_again, is_noise};
use super::refine::{Fitted, hunt, jumps, knobs, one_step, refine};
use super::repeat::repeats;
use super::screen::{Normal, solve};

/// How an effect's values go over the runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum By {
    Constant,
    Time,
    Run,
}

/// A variant in a pattern with what linear algebra says that it gains.
#[derive(Debug, Clone)]
pub(crate) struct Lead {
    pub(crate) variant: usize,
    pub(crate) by: By,
    pub(crate) gain: f64,
    pub(crate) fitted: usize,
    /// Multiples of the columns: one list, or one for each run.
    pub(crate) multiples: Vec<DVector<f64>>,
    /// Squared signal, in standard errors, of each column at its step; none for sizes that have a pattern.
    pub(crate) information: DVector<f64>,
}

impl Lead {
    /// Gain less what chance and choice give to as many values (the Bayesian price of a value told to 1 in 80).
    pub(crate) fn score(&self) -> f64 {
        trusted(self.gain, self.fitted, self.by) - price(self.fitted, self.by)
    }

    /// Probability of as large a gain by chance.
    pub(crate) fn p(&self) -> f64 {
        tail(2.0 * self.gain, self.fitted)
    }
}

/// Log-likelihood that a candidate must pay for its values and its pattern.
pub(crate) fn price(fitted: usize, by: By) -> f64 {
    2.2 * fitted as f64 + if by == By::Constant { 0.0 } else { 4.0 }
}

/// What counts of a gain: at very high signal no model is exact, and free values follow its faults.
fn trusted(gain: f64, fitted: usize, by: By) -> f64 {
    const BY_VALUE: f64 = 0.002;
    const BY_PATTERN: f64 = 0.007;
    let pattern = if by == By::Constant { 0.0 } else { BY_PATTERN };
    let values = BY_VALUE * fitted.saturating_sub(1).min(3) as f64;
    (1.0 - pattern - values) * gain
}

/// Probability that a chi-squared variable exceeds a value.
pub(crate) fn tail(value: f64, freedom: usize) -> f64 {
    ChiSquared::new(freedom.max(1) as f64).map_or(1.0, |chi| chi.sf(value.max(0.0)))
}

/// Every variant in every pattern.
pub(crate) fn leads(evidence: &Evidence<'_>, variants: &[Variant], normals: &[Vec<Normal>]) -> Vec<Lead> {
    let runs = evidence.runs();
    (variants.iter().zip(normals).enumerate())
        .flat_map(|(i, (variant, normals))| {
            let mut leads = vec![constant(i, normals)];
            if patterns(variant) {
                leads.push(by_time(i, normals));
                if runs.len() > 1 {
                    leads.push(by_run(evidence, i, normals, &runs));
                }
            }
            leads
        })
        .collect()
}

/// Whether a variant may differ by run or change in time: not where its place or its size is one of a scan.
fn patterns(variant: &Variant) -> bool {
    match variant.shape {
        Shape::Scan => variant.spec.name == "cone-of-view",
        Shape::Along => variant.spec.name == "directional-light",
        Shape::Linear | Shape::Polar => *variant.spec != UNLISTED,
    }
}

fn sums(normals: impl Iterator<Item = Normal>) -> Option<Normal> {
    normals.reduce(|a, b| Normal {
        right: a.right + b.right,
        left: a.left + b.left,
        right_time: a.right_time + b.right_time,
        cross_time: a.cross_time + b.cross_time,
        left_time: a.left_time + b.left_time,
    })
}

pub(crate) fn constant(variant: usize, normals: &[Normal]) -> Lead {
    let sum = sums(normals.iter().cloned());
    let information = (sum.as_ref()).map_or(DVector::zeros(0), |sum| sum.left.diagonal());
    let solution = sum.map(|sum| solve(&sum.left, &sum.right));
    let (multiples, gain) = solution.map_or((DVector::zeros(0), 0.0), |s| (s.multiples, s.gain));
    Lead {
        variant,
        by: By::Constant,
        gain,
        fitted: multiples.len(),
        multiples: vec![multiples],
        information,
    }
}

fn by_time(variant: usize, normals: &[Normal]) -> Lead {
    let Some(sum) = sums(normals.iter().cloned()) else {
        return constant(variant, normals);
    };
    let k = sum.right.len();
    let mut left = DMatrix::zeros(2 * k, 2 * k);
    left.view_mut((0, 0), (k, k)).copy_from(&sum.left);
    left.view_mut((0, k), (k, k)).copy_from(&sum.cross_time);
    left.view_mut((k, 0), (k, k)).copy_from(&sum.cross_time);
    left.view_mut((k, k), (k, k)).copy_from(&sum.left_time);
    let right = DVector::from_iterator(2 * k, sum.right.iter().chain(sum.right_time.iter()).copied());
    let solution = solve(&left, &right);
    Lead {
        variant,
        by: By::Time,
        gain: solution.gain,
        fitted: 2 * k,
        multiples: vec![solution.multiples],
        information: DVector::zeros(0),
    }
}

pub(crate) fn by_run(evidence: &Evidence<'_>, variant: usize, normals: &[Normal], runs: &[usize]) -> Lead {
    let of = |run: usize| {
        let mine = evidence
            .stretches
            .iter()
            .zip(normals)
            .filter(move |(s, _)| s.run == run);
        sums(mine.map(|(_, n)| n.clone())).map(|sum| solve(&sum.left, &sum.right))
    };
    let solutions: Vec<_> = runs.iter().filter_map(|&run| of(run)).collect();
    Lead {
        variant,
        by: By::Run,
        gain: solutions.iter().map(|s| s.gain).sum(),
        fitted: solutions.iter().map(|s| s.multiples.len()).sum(),
        multiples: solutions.into_iter().map(|s| s.multiples).collect(),
        information: DVector::zeros(0),
    }
}

/// The leads worth a refinement: the best of each effect, at most two of one, the best first.
pub(crate) fn shortlist(leads: &[Lead], variants: &[Variant], most: usize) -> Vec<Lead> {
    let mut sorted: Vec<&Lead> = leads.iter().collect();
    sorted.sort_by(|a, b| b.score().total_cmp(&a.score()));
    let mut list: Vec<Lead> = Vec::new();
    let name = |lead: &Lead| variants[lead.variant].spec.name;
    for lead in sorted {
        let same = list.iter().filter(|other| name(other) == name(lead)).count();
        let again = list
            .iter()
            .any(|other| other.variant == lead.variant && other.by <= lead.by);
        if same < 2 && !again && list.len() < most {
            list.push(lead.clone());
        }
    }
    list
}

/// A candidate with its best values and their pattern.
#[derive(Debug, Clone)]
pub(crate) struct Refined {
    pub(crate) settings: Vec<Setting>,
    /// Standard errors, setting by setting in the order of the pattern's values.
    pub(crate) standard_errors: Vec<Vec<f64>>,
    pub(crate) gain: f64,
    pub(crate) fitted: usize,
    pub(crate) by: By,
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

    /// The values that a refinement may change: not those that jump or go by run.
    fn knobs(&self, variants: &[Variant]) -> Vec<Knob> {
        (self.settings.iter().enumerate())
            .filter(|(_, setting)| !jumps(setting) && !matches!(setting.pattern, Pattern::ByRun(_)))
            .filter_map(|(i, setting)| {
                let variant = Variant::of(setting, variants)?;
                Some(knobs(variant, i, &setting.pattern))
            })
            .flatten()
            .collect()
    }

    /// The settings fitted again to other evidence, from where they are; those that jump or go by run stay.
    fn refit(&self, evidence: &Evidence<'_>, variants: &[Variant]) -> Vec<Setting> {
        let knobs = self.knobs(variants);
        match self.assessed(evidence, &knobs) {
            Some(now) => one_step(evidence, &self.settings, &knobs, &now),
            None => self.settings.clone(),
        }
    }

    /// The settings fitted again without each of so many runs; those that jump or go by run stay.
    pub(crate) fn refit_without_each(
        &self,
        evidence: &Evidence<'_>,
        variants: &[Variant],
        runs: usize,
    ) -> Vec<Vec<Setting>> {
        let knobs = self.knobs(variants);
        let Some(now) = self.assessed(evidence, &knobs) else {
            return vec![self.settings.clone(); runs];
        };
        let without = |run: usize| {
            let others = evidence.without(run);
            one_step(&others, &self.settings, &knobs, &now.without(run, evidence))
        };
        (0..runs).into_par_iter().map(without).collect()
    }

    /// How well the settings explain the logs; `None` where nothing of them can be fitted.
    fn assessed(&self, evidence: &Evidence<'_>, knobs: &[Knob]) -> Option<Assessment> {
        (!knobs.is_empty())
            .then(|| evidence.assess(&self.settings, knobs))
            .flatten()
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
                let square = |fit: &Vec<Setting>| (numbers(&fit[i])[j] - value).powi(2);
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
            Some(by_runs(evidence, variant, &runs, &parts, base))
        }
    }
}

fn follow(evidence: &Evidence<'_>, variant: &Variant, setting: Setting, steps: usize) -> Option<Fitted> {
    if jumps(&setting) {
        let spread = match setting.spec.name {
            "command-delay" => 0.032,
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
    }
}

/// The pattern's values, in the order of their standard errors; none where they go by run.
fn numbers(setting: &Setting) -> Vec<f64> {
    match &setting.pattern {
        Pattern::Constant(values) => values.clone(),
        Pattern::ByTime { start, per_s } => [start.as_slice(), per_s].concat(),
        Pattern::ByRun(_) => Vec::new(),
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

fn by_runs(
    evidence: &Evidence<'_>,
    variant: &Variant,
    runs: &[usize],
    parts: &[Fitted],
    base: &[f64],
) -> Refined {
    let mut values = vec![variant.values.clone(); runs.last().map_or(0, |last| last + 1)];
    let mut errors = Vec::new();
    for (&run, part) in runs.iter().zip(parts) {
        if let Pattern::Constant(found) = &part.settings[0].pattern {
            values[run].clone_from(found);
        }
        errors.extend(spread_errors(&part.settings[0], 0, part));
    }
    let base: f64 = (evidence.stretches.iter().zip(base)).map(|(_, base)| base).sum();
    Refined {
        settings: vec![Setting {
            spec: variant.spec,
            pattern: Pattern::ByRun(values),
        }],
        standard_errors: vec![errors],
        gain: parts.iter().map(|part| part.log_likelihood).sum::<f64>() - base,
        fitted: parts.iter().map(|part| part.knobs.len()).sum(),
        by: By::Run,
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

/// The variants' multiples in a joint solution as a setting.
pub(crate) fn start(variant: &Variant, multiples: &[f64]) -> Setting {
    Setting::constant(variant.spec, variant.values_at(multiples))
}

impl Lead {
    /// Where a refinement of the constant pattern begins.
    pub(crate) fn start(&self, variant: &Variant) -> Setting {
        start(variant, self.multiples[0].as_slice())
    }
}
