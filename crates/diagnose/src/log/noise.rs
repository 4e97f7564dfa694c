//! Effects on noise: judged by the log-likelihood alone, after everything that has a mean.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use rayon::prelude::*;
use sim::{Pattern, Setting, Spec, find};
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::statistics::Statistics;

use super::evidence::Evidence;
use super::leads::{By, tail};
use super::refined::Refined;
use super::repeat::{REPEATS, p_in_repeats};
use crate::detectable::{Detectable, QUANTILE_95};
use crate::slip::memory_of;

/// The effects on noise.
const NOISES: [&str; 3] = ["slip-level", "camera-noise", "reading-noise"];

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
    (NOISES.into_iter())
        .filter(|name| settings.iter().all(|setting| setting.spec.name != *name))
        .filter_map(|name| {
            let mut factor = Factor::neutral(find(name).ok()?);
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

/// Probability that one of the noise effects gains as much by chance, if the likelihood were exact.
pub(crate) fn by_chance(noise: &[Factor]) -> f64 {
    noise.iter().map(Factor::p).fold(1.0, f64::min)
}

/// Probability that one of the noise effects gains as much by chance beside `settings`.
///
/// The filter is linear about its pose, so that a factor scatters more than its likelihood says, and not about 1: in 240 laps of
/// robots as declared the slip level is found 2 to 4 % low, with a stated error of 0.5 %. A gain that this could make is
/// compared with those in simulated logs (Student's t), and so is one of `faults` or less; one whose p is `level` or more by the
/// likelihood stays as it is. Readings in coarse steps are no normal numbers: no gain is beyond their faults.
pub(crate) fn p_among_repeats(
    evidence: &Evidence<'_>,
    settings: &[Setting],
    noise: &[Factor],
    level: f64,
    faults: f64,
) -> f64 {
    /// Log-likelihood that no fault of the filter gains.
    const SURE: f64 = 50.0;
    /// How far to either side the first parabola of a simulated log reaches.
    const NEAR: f64 = 0.06;
    let of_factor = |factor: &Factor| {
        let p = factor.p();
        if p >= level || factor.gain > faults.max(SURE) && !evidence.is_coarse() {
            return p;
        }
        let of_log = |repeated: &Evidence<'_>| {
            let base = repeated.likelihood(settings)?;
            // Found as the measured one is: what is best on a rough likelihood is nearer to 1 than the top of a smooth one.
            let near = Factor {
                half: NEAR,
                ..Factor::neutral(factor.spec)
            };
            Some(near.best(repeated, settings, base)?.middle)
        };
        let among =
            |logs: &[f64]| p_among(factor.middle, logs).map_or(p, |among| p.max(FACTORS * among).min(1.0));
        p_in_repeats(evidence, settings, of_log, among)
    };
    noise.iter().map(of_factor).fold(1.0, f64::min)
}

/// Probability that a further normal number is as far from the mean of some as this one is, on either side; `None` of too few, or
/// of numbers that do not scatter.
pub(crate) fn p_among(number: f64, others: &[f64]) -> Option<f64> {
    /// Numbers that tell a scatter.
    const FEW: usize = 4;
    let n = others.len() as f64;
    let error = (others.variance() * (1.0 + 1.0 / n)).sqrt();
    if others.len() < FEW || error.is_nan() || error <= 0.0 {
        return None;
    }
    let law = StudentsT::new(0.0, 1.0, n - 1.0).ok()?;
    Some(2.0 * law.sf((number - others.mean()).abs() / error))
}

/// The smallest and largest factors of the noise effects that raise an alarm of this probability in 95 of 100 cases, by how sharply the
/// likelihood, which is `base` as declared, tells them among simulated logs ([`p_among_repeats`]); and the memory of slip that does as
/// the level.
pub(crate) fn detectable_noises(evidence: &Evidence<'_>, base: f64, alarm: f64) -> Vec<Detectable> {
    let needed = among_repeats(0.5 * alarm / FACTORS);
    let sized = |name: &&str| {
        let factor = Factor::neutral(find(name).ok()?);
        let log = needed * factor.error(evidence, &[], base)?;
        Some(seen(factor.spec, [(-log).exp(), log.exp()]))
    };
    let mut all: Vec<Detectable> = NOISES.par_iter().filter_map(sized).collect();
    let more = (all.iter().find(|of| of.spec.name == "slip-level")).and_then(|slip| slip.above);
    if let (Some(more), Ok(memory)) = (more, find("slip-memory")) {
        all.push(seen(memory, [f64::NEG_INFINITY, memory_of(more)]));
    }
    all
}

/// Standard deviations by which a number must differ from those of as many as [`REPEATS`] simulated logs for a Student's t of such a
/// one-sided probability in 95 of 100 cases: the noncentral t is about normal, with a variance of 1 + t^2 / 2f (Johnson and Welch 1940).
fn among_repeats(p: f64) -> f64 {
    let logs = REPEATS as f64;
    let t = StudentsT::new(0.0, 1.0, logs - 1.0).map_or(f64::NAN, |law| -law.inverse_cdf(p));
    let deviation = (1.0 + t * t / (2.0 * (logs - 1.0))).sqrt();
    (t + QUANTILE_95 * deviation) * (1.0 + 1.0 / logs).sqrt()
}

/// An effect that is seen beyond these sizes, as far as its range goes.
fn seen(spec: &'static Spec, [below, above]: [f64; 2]) -> Detectable {
    let param = &spec.params[0];
    Detectable {
        spec,
        label: spec.name.to_owned(),
        parameter: param.name,
        unit: param.unit,
        below: Some(below).filter(|below| *below > param.low),
        above: Some(above).filter(|above| *above < param.high),
    }
}

/// Factors that are tried, each upwards and downwards (Bonferroni).
const FACTORS: f64 = 2.0 * NOISES.len() as f64;

impl Factor {
    /// As declared.
    fn neutral(spec: &'static Spec) -> Self {
        Self {
            spec,
            gain: 0.0,
            middle: 0.0,
            half: 0.15,
        }
    }

    /// Probability of the gain by chance among all factors, if the likelihood were exact.
    fn p(&self) -> f64 {
        FACTORS * tail(2.0 * self.gain, 1)
    }

    /// Whether there is less noise than declared, which nothing with a mean makes of it.
    pub(crate) fn is_quieter(&self) -> bool {
        self.middle < 0.0
    }

    /// The likelihood at a logarithm of the factor.
    fn at(&self, evidence: &Evidence<'_>, settings: &[Setting], log: f64) -> Option<f64> {
        evidence.likelihood(&self.beside(settings, log))
    }

    /// The gain there and so far to either side, the smaller factor first.
    fn about(&self, evidence: &Evidence<'_>, settings: &[Setting], base: f64, half: f64) -> Option<[f64; 3]> {
        let at = |log: f64| Some(self.at(evidence, settings, log)? - base);
        Some([at(self.middle - half)?, self.gain, at(self.middle + half)?])
    }

    fn beside(&self, settings: &[Setting], log: f64) -> Vec<Setting> {
        let own = Setting::constant(self.spec, [log.exp()]);
        settings.iter().cloned().chain([own]).collect()
    }

    /// The logarithms of the smallest and the largest factor.
    fn range(&self) -> [f64; 2] {
        let param = &self.spec.params[0];
        [param.low, param.high].map(f64::ln)
    }

    /// Whether factors so far to either side are in range.
    fn reaches(&self, half: f64) -> bool {
        let [lowest, highest] = self.range();
        self.middle - half >= lowest && self.middle + half <= highest
    }

    /// Goes to the top of a parabola through the log-likelihood over the factor's logarithm, or to the best of its points;
    /// breaks where it came to rest.
    fn round(&mut self, evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Option<ControlFlow<()>> {
        /// How far to either side a parabola reaches at least.
        const LEAST: f64 = 0.02;
        let (middle, half) = (self.middle, self.half);
        let [lowest, highest] = self.range();
        if !self.reaches(half) {
            return Some(ControlFlow::Break(()));
        }
        let at = |log: f64| Some(self.at(evidence, settings, log)? - base);
        let about @ [low, _, high] = self.about(evidence, settings, base, half)?;
        let top = top_of_parabola(about).map(|steps| steps * half);
        let step = top.map_or(0.8 * (high - low).signum(), |step| step.clamp(-1.2, 1.2));
        let step = step.clamp(lowest - middle, highest - middle);
        // The best of the three is a start as good as the vertex of their parabola.
        let tried = [
            (middle + step, at(middle + step)?),
            (middle - half, low),
            (middle + half, high),
        ];
        let best = tried.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let moved = (best.0 - middle).abs();
        let is_better = best.1 > self.gain;
        if is_better {
            (self.middle, self.gain) = best;
        }
        self.half = (0.4 * half).max(LEAST);
        let nothing = self.gain < NOTHING && self.middle.abs() < half;
        let rests = half < 0.03 && (moved < 0.2 * half || step.abs() < 0.2 * half);
        // The next round would ask for the same.
        let stays = !is_better && half <= LEAST;
        Some(if stays || top.is_some() && (nothing || rests) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    }

    /// The logarithm at the top of the next parabola, if that is near; outer `None` if the filter loses the robot.
    fn top(&self, evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Option<Option<f64>> {
        /// How far off it is trusted, in units of how far the parabola reaches.
        const TRUSTED: f64 = 2.0;
        if !self.reaches(self.half) {
            return Some(None);
        }
        let top = top_of_parabola(self.about(evidence, settings, base, self.half)?);
        let near = top.filter(|steps| steps.abs() < TRUSTED);
        Some(near.map(|steps| self.middle + steps * self.half))
    }

    /// At its best.
    fn best(mut self, evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Option<Self> {
        for _ in 0..ROUNDS {
            if self.round(evidence, settings, base)?.is_break() {
                break;
            }
        }
        Some(self)
    }

    /// The same factor beside other settings, from where it is.
    pub(crate) fn elsewhere(&self, evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Option<Self> {
        let gain = self.at(evidence, settings, self.middle)? - base;
        Some(Self { gain, ..self.clone() })
    }

    /// The standard error of its logarithm.
    fn error(&self, evidence: &Evidence<'_>, settings: &[Setting], base: f64) -> Option<f64> {
        /// Logarithm of the factor to either side over which the log-likelihood's curvature tells the error: it is rough at
        /// a smaller scale, as readings come and go at edges.
        const WIDE: f64 = 0.08;
        let [low, middle, high] = self.about(evidence, settings, base, WIDE)?;
        let bend = (high - 2.0 * middle + low) / (WIDE * WIDE);
        Some((-bend).max(1e-9).sqrt().recip())
    }

    /// The settings with the best factor and its error.
    pub(crate) fn refined(
        mut self,
        evidence: &Evidence<'_>,
        settings: &[Setting],
        base: f64,
    ) -> Option<Refined> {
        self = self.best(evidence, settings, base)?;
        let error = self.error(evidence, settings, base)?;
        Some(Refined {
            settings: self.beside(settings, self.middle),
            standard_errors: vec![vec![self.middle.exp() * error]],
            gain: self.gain,
            fitted: 1,
            by: By::Constant,
            without: BTreeMap::new(),
            faults: f64::INFINITY,
        })
    }
}

/// An answer that holds a larger slip level, with slip that has a memory instead ([`memory_of`]): it adds as much to the pose's
/// covariance, and the filter, which takes slip to be white, does not tell them apart. `None` for other answers.
pub(crate) fn with_memory(answer: &Refined) -> Option<Refined> {
    let place = answer.settings.iter().position(|s| s.spec.name == "slip-level")?;
    let Pattern::Constant(values) = &answer.settings[place].pattern else {
        return None;
    };
    let correlation = memory_of(values[0]);
    if correlation <= 0.0 {
        return None;
    }
    let mut twin = answer.clone();
    twin.settings[place] = Setting::constant(find("slip-memory").ok()?, [correlation]);
    twin.standard_errors[place][0] *= 4.0 * values[0] / (values[0].powi(2) + 1.0).powi(2);
    Some(twin)
}

/// Whether a setting is one of an effect on noise.
pub(crate) fn is_noise(setting: &Setting) -> bool {
    NOISES.contains(&setting.spec.name)
}

/// The place of the noise effect among settings, if there is one, with its factor fitted to other logs by one parabola: it is near.
pub(crate) fn factor_again(evidence: &Evidence<'_>, settings: &[Setting]) -> Option<(usize, f64)> {
    /// How far to either side the parabola reaches: it is off by a thousandth then.
    const NEAR: f64 = 0.06;
    let place = settings.iter().position(is_noise)?;
    let mut others = settings.to_vec();
    let noise = others.remove(place);
    let Pattern::Constant(values) = &noise.pattern else {
        return None;
    };
    let mut factor = Factor {
        middle: values[0].ln(),
        half: NEAR,
        ..Factor::neutral(noise.spec)
    };
    let base = evidence.likelihood(settings)?;
    if let Some(log) = factor.top(evidence, &others, base)? {
        factor.middle = log;
    } else {
        let _ = factor.round(evidence, &others, base)?;
    }
    Some((place, factor.middle.exp()))
}

/// Where the top of a parabola through three numbers at equal steps is, in steps from the middle one; `None` if it has none.
pub(super) fn top_of_parabola([low, middle, high]: [f64; 3]) -> Option<f64> {
    let bend = high - 2.0 * middle + low;
    (bend < 0.0).then(|| -0.5 * (high - low) / bend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_far_off_raise_the_alarm_in_95_of_100_cases() {
        const P: f64 = 0.005;
        let far = among_repeats(P);
        let mut stream = sim::Streams { seed: 11, run: 0 }.open("logs");
        let mut rings = || {
            let logs: Vec<f64> = (0..REPEATS).map(|_| stream.normal()).collect();
            p_among(far + stream.normal(), &logs).is_some_and(|p| p < 2.0 * P)
        };
        let rung = (0..2000).filter(|_| rings()).count();
        assert!((1840..1980).contains(&rung), "{rung}");
    }

    #[test]
    fn a_number_among_others_is_judged_by_student_s_law() {
        // Mean 0 and variance 1 of five: t = 2.776 sqrt(1 + 1/5) is their 95 % bound with four degrees of freedom.
        let others = [-1.0, -1.0, 0.0, 1.0, 1.0];
        assert!((p_among(2.776 * 1.2_f64.sqrt(), &others).unwrap() - 0.05).abs() < 1e-4);
        assert!((p_among(0.0, &others).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(p_among(0.0, &others[..3]), None);
        assert_eq!(p_among(0.0, &[1.0; 8]), None);
    }

    #[test]
    fn memory_stands_for_a_level_that_adds_as_much_to_the_covariance() {
        let of = |factor: f64| Refined {
            settings: vec![Setting::constant(find("slip-level").unwrap(), [factor])],
            standard_errors: vec![vec![0.1]],
            gain: 100.0,
            fitted: 1,
            by: By::Constant,
            without: BTreeMap::new(),
            faults: f64::INFINITY,
        };
        let twin = with_memory(&of(2.0)).unwrap();
        let Pattern::Constant(values) = &twin.settings[0].pattern else {
            panic!("{twin:?}");
        };
        let level = |a: f64| ((1.0 + a) / (1.0 - a)).sqrt();
        assert!((level(values[0]) - 2.0).abs() < 1e-12);
        // The error follows by the derivative.
        let h = 1e-6;
        let slope = (level(values[0] + h) - level(values[0] - h)) / (2.0 * h);
        assert!((slope * twin.standard_errors[0][0] - 0.1).abs() < 1e-6);
        assert_eq!(twin.score(), of(2.0).score());
        assert!(with_memory(&of(0.8)).is_none());
    }
}
