//! The values of a candidate that explain the logs best.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use sim::{Pattern, Setting};

use super::catalogue::{Shape, Variant};
use super::evidence::{Assessment, Evidence, Knob};
use super::screen::{Solution, solve};

/// A candidate with its best values.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) settings: Vec<Setting>,
    pub(crate) knobs: Vec<Knob>,
    pub(crate) log_likelihood: f64,
    /// Standard error of each knob's value.
    pub(crate) standard_errors: Vec<f64>,
}

/// The knobs of one setting of a variant.
pub(crate) fn knobs(variant: &Variant, setting: usize, pattern: &Pattern) -> Vec<Knob> {
    let step = |value: usize| {
        let name = variant.spec.params.get(value).map_or("", |param| param.name);
        let along = variant
            .sizes
            .iter()
            .position(|&size| size == value && variant.shape != Shape::Scan);
        match (along, name) {
            (Some(i), _) => variant.steps[i],
            (None, "azimuth_rad") => 0.02,
            (None, "position") => 0.002,
            (None, "length_m") => 0.003,
            _ => 0.02 * variant.values[value].abs().max(1e-3),
        }
    };
    let of = |run: Option<usize>| {
        variant.free.iter().map(move |&value| Knob {
            setting,
            value,
            slope: false,
            run,
            step: step(value),
        })
    };
    if let Pattern::ByRun(runs) = pattern {
        return (0..runs.len()).flat_map(|run| of(Some(run))).collect();
    }
    let flat = of(None);
    if matches!(pattern, Pattern::ByTime { .. }) {
        // A step that changes as much by the middle of a run of a few minutes.
        let slopes = variant.free.iter().map(|&value| Knob {
            setting,
            value,
            slope: true,
            run: None,
            step: step(value) / 200.0,
        });
        return flat.chain(slopes).collect();
    }
    flat.collect()
}

/// The values of settings that a refinement may change: not those that jump.
pub(crate) fn knobs_of(settings: &[Setting], variants: &[Variant]) -> Vec<Knob> {
    (settings.iter().enumerate())
        .filter(|(_, setting)| !jumps(setting))
        .filter_map(|(i, setting)| Some(knobs(Variant::of(setting, variants)?, i, &setting.pattern)))
        .flatten()
        .collect()
}

/// Whether an effect's derivative says nothing about its size: it jumps.
pub(crate) fn jumps(setting: &Setting) -> bool {
    matches!(
        setting.spec.name,
        "command-delay" | "speed-step" | "dead-band" | "sensor-reach"
    )
}

/// Gauss and Newton's method on the whitened innovations; a step counts only if the log-likelihood rises.
pub(crate) fn refine(
    evidence: &Evidence<'_>,
    settings: Vec<Setting>,
    knobs: Vec<Knob>,
    steps: usize,
) -> Option<Fitted> {
    let mut settings = settings;
    let mut now = evidence.assess(&settings, &knobs)?;
    for _ in 0..steps {
        let (left, right) = pooled(&now, knobs.len());
        let solution = solve(&left, &right);
        if solution.gain.is_nan() || solution.gain <= 0.02 {
            break;
        }
        let accepted = trials(&settings, &knobs, &solution).find_map(|trial| {
            let then = evidence.assess(&trial, &knobs)?;
            (then.total() > now.total()).then_some((trial, then))
        });
        let Some((trial, then)) = accepted else { break };
        let small = then.total() - now.total() < 0.01;
        (settings, now) = (trial, then);
        if small {
            break;
        }
    }
    Some(fitted(settings, knobs, now))
}

/// The settings after one step of Gauss and Newton's method from where `now` was taken, which is as good as more of them from
/// settings that are near the best (Lehmann and Casella, Theory of Point Estimation, 1998, section 6.4); the settings as they
/// are if no step raises the log-likelihood.
pub(crate) fn one_step(
    evidence: &Evidence<'_>,
    settings: &[Setting],
    knobs: &[Knob],
    now: &Assessment,
) -> Vec<Setting> {
    let (left, right) = pooled(now, knobs.len());
    trials(settings, knobs, &solve(&left, &right))
        .find(|trial| evidence.likelihood(trial).is_some_and(|then| then > now.total()))
        .unwrap_or_else(|| settings.to_vec())
}

/// The settings at the end of a step, and at ever shorter parts of it.
fn trials<'a>(
    settings: &'a [Setting],
    knobs: &'a [Knob],
    step: &'a Solution,
) -> impl Iterator<Item = Vec<Setting>> + 'a {
    [1.0, 0.3, 0.08].into_iter().map(move |share| {
        (knobs.iter().zip(step.multiples.iter())).fold(settings.to_vec(), |trial, (knob, multiple)| {
            knob.turned(&trial, share * multiple)
        })
    })
}

fn fitted(settings: Vec<Setting>, knobs: Vec<Knob>, now: Assessment) -> Fitted {
    let (left, _) = pooled(&now, knobs.len());
    // What changes nothing is not known, and leaves the others as they are: the direction of a light that is out.
    let told: Vec<usize> = (0..knobs.len()).filter(|&i| left[(i, i)] > 0.0).collect();
    let of_told = DMatrix::from_fn(told.len(), told.len(), |a, b| left[(told[a], told[b])]);
    let covariance = of_told.cholesky().map(|factor| factor.inverse());
    let error = |i: usize| {
        let place = told.iter().position(|&other| other == i);
        let variance = covariance.as_ref().zip(place).map(|(c, place)| c[(place, place)]);
        variance.map_or(f64::INFINITY, |variance| variance.sqrt() * knobs[i].step)
    };
    Fitted {
        standard_errors: (0..knobs.len()).map(error).collect(),
        log_likelihood: now.total(),
        settings,
        knobs,
    }
}

/// The normal equations of all stretches together.
pub(crate) fn pooled(assessment: &Assessment, count: usize) -> (DMatrix<f64>, DVector<f64>) {
    assessment.normals.iter().fold(
        (DMatrix::zeros(count, count), DVector::zeros(count)),
        |(left, right), normal| (left + &normal.left, right + &normal.right),
    )
}

/// The best delay beside the other settings: trial delays about the best one so far, in whole physics steps, as all others do what the nearest of these
/// does.
pub(crate) fn hunt_delay(evidence: &Evidence<'_>, settings: &[Setting], place: usize) -> Option<Fitted> {
    let step_s = evidence.physics_step_s()?;
    let setting = &settings[place];
    let (Pattern::Constant(values), param) = (&setting.pattern, &setting.spec.params[0]) else {
        return None;
    };
    let mut known: BTreeMap<i64, Option<f64>> = BTreeMap::new();
    let mut at = |steps: i64| -> Option<(i64, f64)> {
        let delay_s = (steps as f64 * step_s).clamp(param.low, param.high);
        let likelihood = || evidence.likelihood(&resized(settings, place, delay_s));
        known
            .entry(steps)
            .or_insert_with(likelihood)
            .map(|likelihood| (steps, likelihood))
    };
    let mut best = at((values[0] / step_s).round() as i64)?;
    loop {
        let about = [-2, -1, 1, 2].map(|by| best.0 + by);
        let tried = about.into_iter().filter(|steps| *steps >= 0).filter_map(&mut at);
        match tried.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some(found) if found.1 > best.1 => best = found,
            _ => break,
        }
    }
    let knob = Knob {
        setting: place,
        value: 0,
        slope: false,
        run: None,
        step: step_s,
    };
    Some(Fitted {
        settings: resized(settings, place, best.0 as f64 * step_s),
        knobs: vec![knob],
        log_likelihood: best.1,
        // Of all that are nearest to it.
        standard_errors: vec![step_s / 12.0_f64.sqrt()],
    })
}

/// The settings with another size at one place.
fn resized(settings: &[Setting], place: usize, size: f64) -> Vec<Setting> {
    let mut resized = settings.to_vec();
    resized[place] = Setting::constant(settings[place].spec, [size]);
    resized
}

/// The best size of an effect that jumps beside the other settings: trial sizes about its own, then ever closer ones until they are about as good.
pub(crate) fn hunt(
    evidence: &Evidence<'_>,
    settings: &[Setting],
    place: usize,
    spread: f64,
) -> Option<Fitted> {
    /// Rounds at most, and log-likelihood that a round must gain, or lose on either side, for another one to follow.
    const MOST: usize = 10;
    const NOTHING: f64 = 0.5;
    const LITTLE: f64 = 2.0;
    /// Rounds at least.
    const LEAST: usize = 4;
    let at = |size: f64| -> Option<(f64, f64)> {
        let log_likelihood = evidence.likelihood(&resized(settings, place, size))?;
        Some((size, log_likelihood))
    };
    let Setting { spec, pattern } = &settings[place];
    let (Pattern::Constant(values), param) = (pattern, &spec.params[0]) else {
        return None;
    };
    let mut best = at(values[0])?;
    let mut spread = spread;
    for round in 0..MOST {
        let (middle, before) = (best.0.min(values[0] * 4.0), best.1);
        let mut lost: f64 = 0.0;
        for side in [-1.0, -0.5, 0.5, 1.0] {
            let size = (middle + side * spread).clamp(param.low, param.high);
            let Some(found) = at(size) else { continue };
            lost = lost.max(before - found.1);
            if found.1 > best.1 {
                best = found;
            }
        }
        spread *= 0.4;
        if round + 1 >= LEAST && best.1 - before < NOTHING && lost < LITTLE {
            break;
        }
    }
    let knob = Knob {
        setting: place,
        value: 0,
        slope: false,
        run: None,
        step: spread,
    };
    Some(Fitted {
        settings: resized(settings, place, best.0),
        knobs: vec![knob],
        log_likelihood: best.1,
        standard_errors: vec![spread.max(0.004 * best.0)],
    })
}
