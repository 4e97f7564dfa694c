//! Wheels out of round: what a wheel's speed has of the wheel's own angle, which is another one at the start of every run.

use rayon::prelude::*;
use sim::{Pattern, Setting};
use statrs::statistics::Statistics;

use super::catalogue::Variant;
use super::evidence::Evidence;
use super::groups::wheel_variants;
use super::leads::{By, Lead, by_run, start};
use super::refined::{Refined, together};
use super::screen::normals;
use crate::candidate::WORDS;

/// Steps of a refinement at most.
const STEPS: usize = 8;

/// The wheels out of round that the innovations beside some effects show surely, fitted in place of these effects: a cosine and a sine
/// of each wheel's angle in each run, of which the amplitude is the answer's size. `worth` is the log-likelihood that each wheel must
/// gain at least.
pub(crate) fn out_of_round(evidence: &Evidence<'_>, beside: &[Setting], worth: f64) -> Option<Refined> {
    /// Probability that is no chance.
    const NO_CHANCE_P: f64 = 1e-6;
    let variants = wheel_variants();
    let runs = evidence.runs();
    let normals = normals(&evidence.traces(beside)?, &variants).ok()?;
    let shown: Vec<(&Variant, Lead)> = (variants.iter().zip(&normals).enumerate())
        .map(|(i, (variant, normals))| (variant, by_run(evidence, i, normals, &runs)))
        .filter(|(_, lead)| lead.p() < NO_CHANCE_P && lead.gain > worth)
        .collect();
    if shown.is_empty() {
        return None;
    }
    let of_run = |(nth, &run): (usize, &usize)| {
        let evidence = evidence.of_run(run);
        let parts: Vec<(Variant, Setting)> = (shown.iter())
            .map(|(variant, lead)| ((*variant).clone(), start(variant, lead.multiples[nth].as_slice())))
            .collect();
        together(&evidence, &parts, evidence.likelihood(&[])?, STEPS)
    };
    let fits: Vec<Refined> = (runs.par_iter().enumerate()).map(of_run).collect::<Option<_>>()?;
    let of_fits = |fits: &[Refined]| -> (Vec<Setting>, Vec<Vec<f64>>) {
        let of_part = |(part, (variant, _)): (usize, &(&Variant, Lead))| over_runs(variant, fits, part);
        shown.iter().enumerate().map(of_part).unzip()
    };
    let without = |nth: usize| {
        let mut others = fits.clone();
        others.remove(nth);
        (!others.is_empty()).then(|| (runs[nth], of_fits(&others).0.into_iter().enumerate().collect()))
    };
    let (settings, standard_errors) = of_fits(&fits);
    Some(Refined {
        settings,
        standard_errors,
        without: (0..runs.len()).filter_map(without).collect(),
        faults: f64::INFINITY,
        gain: fits.iter().map(|fit| fit.gain).sum(),
        fitted: fits.iter().map(|fit| fit.fitted).sum(),
        by: By::Constant,
    })
}

/// A wheel whose amplitude is the weighted mean of those of several runs, and the errors of its values.
fn over_runs(variant: &Variant, fits: &[Refined], part: usize) -> (Setting, Vec<f64>) {
    let (amplitudes, weights): (Vec<f64>, Vec<f64>) = (fits.iter())
        .filter_map(|fit| {
            let Pattern::Constant(values) = &fit.settings[part].pattern else {
                return None;
            };
            let amplitude = values[WORDS].hypot(values[WORDS + 1]);
            let share = |i: usize| values[i] * fit.standard_errors[part][i] / amplitude;
            let own = share(WORDS).hypot(share(WORDS + 1));
            Some((amplitude, own.max(f64::MIN_POSITIVE).powi(-2)))
        })
        .unzip();
    let total: f64 = weights.iter().sum();
    let weighted = amplitudes.iter().zip(&weights).map(|(a, w)| a * w);
    let amplitude = weighted.sum::<f64>() / total;
    // What a filter does not know shows in how much the runs differ.
    let seen = if amplitudes.len() > 1 {
        amplitudes.as_slice().variance() / amplitudes.len() as f64
    } else {
        0.0
    };
    let error = seen.max(1.0 / total).sqrt();
    let values = [&variant.values[..WORDS], &[amplitude]].concat();
    let errors = [&[0.0; WORDS][..], &[error]].concat();
    (Setting::constant(variant.spec, values), errors)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn a_wheel_has_the_amplitude_that_its_runs_have_whatever_their_phases() {
        let variant = &wheel_variants()[1];
        let fit = |cosine: f64, sine: f64, error: f64| Refined {
            settings: vec![start(
                variant,
                &[cosine / variant.steps[0], sine / variant.steps[1]],
            )],
            standard_errors: vec![vec![0.0, 0.0, 0.0, error, error]],
            gain: 100.0,
            fitted: 2,
            by: By::Constant,
            without: BTreeMap::new(),
            faults: f64::INFINITY,
        };
        // Amplitudes .05, .05 and .08, the last one known half as well.
        let fits = [
            fit(0.03, 0.04, 0.001),
            fit(0.0, -0.05, 0.001),
            fit(-0.08, 0.0, 0.002),
        ];
        let (wheel, errors) = over_runs(variant, &fits, 0);
        let Pattern::Constant(values) = &wheel.pattern else {
            panic!("{wheel:?}");
        };
        assert_eq!(values[..WORDS], variant.values[..WORDS]);
        assert!(
            (values[WORDS] - (0.05 + 0.05 + 0.25 * 0.08) / 2.25).abs() < 1e-12,
            "{values:?}"
        );
        // The runs differ by more than their errors say: variance 3e-4 of three.
        assert!((errors[WORDS] - 1e-2).abs() < 1e-12, "{errors:?}");
    }
}
