//! Effects on noise: judged by the log-likelihood alone, after everything that has a mean.

use sim::{Pattern, Setting, Spec, find};

use super::evidence::Evidence;
use super::search::{By, Refined};

/// The noise effects with their fitted factors, added to `settings`, whose log-likelihood is `base`.
pub(crate) fn noises(evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Vec<Refined> {
    ["slip-level", "camera-noise", "reading-noise"]
        .into_iter()
        .filter_map(|name| factor(evidence, settings, base, find(name).ok()?))
        .collect()
}

/// The best factor, by parabolas through the log-likelihood over its logarithm.
fn factor(evidence: &Evidence<'_>, settings: &[Setting], base: f64, spec: &'static Spec) -> Option<Refined> {
    let at = |log: f64| {
        let mut settings = settings.to_vec();
        settings.push(Setting::constant(spec, [log.exp()]));
        evidence.assess(&settings, &[]).map(|found| found.total())
    };
    let (mut middle, mut top, mut half) = (0.0, base, 0.1);
    let mut bend = -1.0;
    for _ in 0..6 {
        let (low, high) = (at(middle - half)?, at(middle + half)?);
        let slope = (high - low) / (2.0 * half);
        bend = (high - 2.0 * top + low) / (half * half);
        let step = if bend < 0.0 { (-slope / bend).clamp(-0.6, 0.6) } else { 0.6 * slope.signum() };
        let then = at(middle + step)?;
        if then > top {
            (middle, top) = (middle + step, then);
        }
        if step.abs() < 0.3 * half || then <= top && step.abs() < half {
            break;
        }
        half = (0.5 * half).max(0.02);
    }
    let error = middle.exp() / (-bend).max(1e-9).sqrt();
    let mut all = settings.to_vec();
    all.push(Setting { spec, pattern: Pattern::Constant(vec![middle.exp()]) });
    Some(Refined { settings: all, standard_errors: vec![vec![error]], gain: top - base, fitted: 1, by: By::Constant })
}
