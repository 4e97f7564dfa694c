//! Effects on noise: judged by the log-likelihood alone, after everything that has a mean.

use sim::{Pattern, Setting, Spec, find};

use super::evidence::Evidence;
use super::search::{By, Refined};

/// The noise effects with their fitted factors, added to `settings`, whose log-likelihood is `base`.
pub(crate) fn noises(evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Vec<Refined> {
    ["slip-level", "camera-noise", "reading-noise"]
        .into_iter()
        .filter(|name| settings.iter().all(|setting| setting.spec.name != *name))
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
    /// Log-likelihood gained below which the exact factor does not matter.
    const NOTHING: f64 = 3.0;
    /// Logarithm of the factor to either side over which the log-likelihood's curvature tells the error.
    const WIDE: f64 = 0.08;
    let (mut middle, mut top, mut half) = (0.0, base, 0.15);
    let mut bend = -1.0;
    for _ in 0..12 {
        let (low, high) = (at(middle - half)?, at(middle + half)?);
        let slope = (high - low) / (2.0 * half);
        bend = (high - 2.0 * top + low) / (half * half);
        let step = if bend < 0.0 {
            (-slope / bend).clamp(-1.2, 1.2)
        } else {
            0.8 * slope.signum()
        };
        // The best of the three is a start as good as the vertex of their parabola.
        let tried = [
            (middle + step, at(middle + step)?),
            (middle - half, low),
            (middle + half, high),
        ];
        let best = tried.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let moved = (best.0 - middle).abs();
        if best.1 > top {
            (middle, top) = best;
        }
        if bend < 0.0 && top - base < NOTHING && middle.abs() < half {
            break;
        }
        if bend < 0.0 && half < 0.03 && (moved < 0.2 * half || step.abs() < 0.2 * half) {
            break;
        }
        half = (0.4 * half).max(0.02);
    }
    if middle == 0.0 {
        return None;
    }
    // The log-likelihood is rough at a small scale: readings come and go at edges.
    if top - base > NOTHING
        && let (Some(low), Some(high)) = (at(middle - WIDE), at(middle + WIDE))
    {
        bend = (high - 2.0 * top + low) / (WIDE * WIDE);
    }
    let error = middle.exp() / (-bend).max(1e-9).sqrt();
    let mut all = settings.to_vec();
    all.push(Setting {
        spec,
        pattern: Pattern::Constant(vec![middle.exp()]),
    });
    Some(Refined {
        settings: all,
        standard_errors: vec![vec![error]],
        gain: top - base,
        fitted: 1,
        by: By::Constant,
    })
}
