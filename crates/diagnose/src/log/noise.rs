//! Effects on noise: judged by the log-likelihood alone, after everything that has a mean.

use std::ops::ControlFlow;

use sim::{Setting, Spec, find};

use super::evidence::Evidence;
use super::search::{By, Refined};

/// A noise effect's factor beside other settings: how far its best value is known.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    spec: &'static Spec,
    /// Log-likelihood gained at the best factor so far.
    pub(crate) gain: f64,
    /// Its logarithm.
    middle: f64,
    /// How far to either side the next parabola reaches.
    half: f64,
}

/// Log-likelihood gained below which the exact factor does not matter.
const NOTHING: f64 = 3.0;
/// Rounds of parabolas at most.
const ROUNDS: usize = 12;

/// The noise effects that gain something beside `settings`, whose log-likelihood is `base`: the gain to about a tenth.
pub(crate) fn noises(evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Vec<Factor> {
    const FAIR: f64 = 0.1;
    ["slip-level", "camera-noise", "reading-noise"]
        .into_iter()
        .filter(|name| settings.iter().all(|setting| setting.spec.name != *name))
        .filter_map(|name| {
            let mut factor = Factor {
                spec: find(name).ok()?,
                gain: 0.0,
                middle: 0.0,
                half: 0.15,
            };
            for _ in 0..ROUNDS {
                let before = factor.gain;
                let end = factor.round(evidence, settings, base)?.is_break();
                let gained = factor.gain - before;
                if end || before > 0.0 && factor.gain > 10.0 * NOTHING && gained < FAIR * factor.gain {
                    break;
                }
            }
            (factor.middle != 0.0).then_some(factor)
        })
        .collect()
}

impl Factor {
    /// The likelihood at a logarithm of the factor.
    fn at(&self, evidence: &Evidence<'_>, settings: &[Setting], log: f64) -> Option<f64> {
        evidence.likelihood(&self.beside(settings, log))
    }

    fn beside(&self, settings: &[Setting], log: f64) -> Vec<Setting> {
        let own = Setting::constant(self.spec, [log.exp()]);
        settings.iter().cloned().chain([own]).collect()
    }

    /// Goes to the top of a parabola through the log-likelihood over the factor's logarithm, or to the best of its points;
    /// breaks where it came to rest.
    fn round(&mut self, evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Option<ControlFlow<()>> {
        let (middle, half) = (self.middle, self.half);
        let at = |log: f64| Some(self.at(evidence, settings, log)? - base);
        let (low, high) = (at(middle - half)?, at(middle + half)?);
        let slope = (high - low) / (2.0 * half);
        let bend = (high - 2.0 * self.gain + low) / (half * half);
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
        if best.1 > self.gain {
            (self.middle, self.gain) = best;
        }
        self.half = (0.4 * half).max(0.02);
        let nothing = self.gain < NOTHING && self.middle.abs() < half;
        let rests = half < 0.03 && (moved < 0.2 * half || step.abs() < 0.2 * half);
        Some(if bend < 0.0 && (nothing || rests) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    }

    /// The settings with the best factor and its error.
    pub(crate) fn refined(
        mut self,
        evidence: &Evidence<'_>,
        settings: &[Setting],
        base: f64,
    ) -> Option<Refined> {
        /// Logarithm of the factor to either side over which the log-likelihood's curvature tells the error: it is rough at
        /// a smaller scale, as readings come and go at edges.
        const WIDE: f64 = 0.08;
        for _ in 0..ROUNDS {
            if self.round(evidence, settings, base)?.is_break() {
                break;
            }
        }
        let at = |log: f64| Some(self.at(evidence, settings, log)? - base);
        let (low, high) = (at(self.middle - WIDE)?, at(self.middle + WIDE)?);
        let bend = (high - 2.0 * self.gain + low) / (WIDE * WIDE);
        Some(Refined {
            settings: self.beside(settings, self.middle),
            standard_errors: vec![vec![self.middle.exp() / (-bend).max(1e-9).sqrt()]],
            gain: self.gain,
            fitted: 1,
            by: By::Constant,
        })
    }
}
