//! From logs to an answer.

use std::sync::Arc;

use rayon::prelude::*;
use sim::{Model, Scene, Setting, Stage, UNLISTED, World, find};
use track::Side;

use super::catalogue::{Variant, stage_of, unlisted_variants, variants};
use super::corners::{Corners, EXACT, recut};
use super::decide::{Decided, decided};
use super::evidence::Evidence;
use super::filter::{MEASURED, Trace};
use super::noise::noises;
use super::pairs::pairs;
use super::rows::LogRow;
use super::screen::normals;
use super::search::{By, Lead, Refined, leads, price, pursue, shortlist, tail, together};
use super::steps::reading_step;
use crate::{Candidate, Error};

/// What is said in the end of everything but the controller, which [`LogDiagnosis::decide`] judges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogVerdict {
    /// Nothing significant is left out of the declared model.
    Faithful,
    /// The effects named leave nothing that matters.
    Explained,
    /// They help, and a significant remainder matters.
    PartlyExplained,
    /// No listed effect would be an honest name.
    Unlisted,
}

/// Effects that together explain the logs to some degree.
#[derive(Debug, Clone, PartialEq)]
pub struct LogExplanation {
    /// The effects with their values; each one's gain is that of all of them together.
    pub effects: Vec<Candidate>,
    /// Log-likelihood gained over the declared model.
    pub gain: f64,
    /// What the number of fitted values and their pattern cost of it.
    pub price: f64,
}

impl LogExplanation {
    /// Gain less price.
    pub fn score(&self) -> f64 {
        self.gain - self.price
    }
}

/// An effect that has no name, by what it acts on and depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct UnlistedEffect {
    /// Where in the loop it sits.
    pub stage: Stage,
    /// What it acts on.
    pub acts_on: String,
    /// What it depends on; `chance` where it is noise.
    pub depends_on: String,
    /// As a setting of [`sim::UNLISTED`], where it is no noise.
    pub setting: Option<Setting>,
    /// Log-likelihood gained over the declared model.
    pub gain: f64,
}

/// How white the filter's innovations of one measured number are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// Innovations that count.
    pub count: usize,
    /// Their mean square, 1 under the model.
    pub mean_square: f64,
    /// Fourth moment over squared second moment, 3 for normal ones.
    pub kurtosis: f64,
    /// Product of neighbours over the mean square, 0 under the model.
    pub correlation: f64,
}

/// What robot logs say of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct LogDiagnosis {
    /// The answer for all but the controller.
    pub verdict: LogVerdict,
    /// The controller.
    pub decide: Decided,
    /// Probability that as much is found in the logs of a robot that is as declared.
    pub p: f64,
    /// What might explain the logs, the best score first.
    pub explanations: Vec<LogExplanation>,
    /// Share of the explained log-likelihood that further effects would add to the best explanation, and its p.
    pub remainder_share: f64,
    /// Probability of such a remainder by chance.
    pub remainder_p: f64,
    /// Set where no listed effect is the answer.
    pub unlisted: Option<UnlistedEffect>,
    /// Camera x and y, then S0 to S7, under the best explanation.
    pub channels: [Channel; MEASURED],
    /// Where the walls seem to be cut.
    pub corners: Corners,
    /// Control steps that were used.
    pub steps: usize,
}

/// What the robot's logs say that the model lacks. Runs are rows in time order, from the run's start.
///
/// # Errors
/// A model that the scene was not made for; logs of which no stretch of 200 control steps with positions and commands
/// can be followed.
pub fn diagnose_logs(model: &Model, scene: &Scene, runs: &[&[LogRow]]) -> Result<LogDiagnosis, Error> {
    let decide = decided(model, runs);
    let mut wide = model.clone();
    // Rays a little longer than the range tell how far beyond it a wall is.
    wide.machine.range_m *= 1.2;
    let unwind = |error: sim::Error| Error::Simulation(error);
    let scene = Scene::new(Arc::new(scene.circuit().clone()), &wide, None).map_err(unwind)?;
    let step = reading_step(runs);
    let declared = Evidence::new(&scene, model, runs, step.unwrap_or(0.0)).map_err(unwind)?;
    if declared.stretches.is_empty() {
        return Err(Error::NoLog);
    }
    let (corners, recut) = recut(&scene, model, &wide, &declared).map_or((EXACT, None), |(c, s)| (c, Some(s)));
    let evidence = recut.as_ref().map_or_else(|| declared.elsewhere(&scene), |scene| declared.elsewhere(scene));
    let mut search = Search::new(evidence, step)?;
    search.run();
    Ok(search.answer(decide, corners))
}

/// A probability below which something is there: one false alarm in a hundred data sets.
const ALARM: f64 = 0.01;
/// Share of the explained log-likelihood that a remainder may have at very high signal.
const MATTERS: f64 = 0.02;

/// The state of the search for effects.
struct Search<'a> {
    evidence: Evidence<'a>,
    variants: Vec<Variant>,
    base: Vec<f64>,
    found: Vec<Refined>,
    p: f64,
    remainder: (f64, f64),
    unlisted: Option<UnlistedEffect>,
    channels: [Channel; MEASURED],
    step: Option<f64>,
    step_gain: f64,
    steps: usize,
}

impl<'a> Search<'a> {
    fn new(evidence: Evidence<'a>, step: Option<f64>) -> Result<Self, Error> {
        let course = &evidence.scene.circuit().course;
        let lengths_m = [Side::Outer, Side::Inner].map(|side| course.wall(side).length_m());
        let traces = evidence.traces(&[]).ok_or(Error::NoLog)?;
        let base: Vec<f64> = traces.iter().map(|(_, trace)| trace.log_likelihood).collect();
        let unrounded = Evidence { step_counts: 0.0, ..evidence.elsewhere(evidence.scene) };
        let step_gain = match step {
            Some(_) => base.iter().sum::<f64>() - unrounded.likelihood(&[]).unwrap_or(f64::NEG_INFINITY),
            None => 0.0,
        };
        Ok(Self {
            variants: variants(lengths_m),
            channels: channels(&traces),
            steps: traces.iter().map(|(_, trace)| trace.instants.len()).sum(),
            base,
            evidence,
            found: Vec::new(),
            p: 1.0,
            remainder: (0.0, 1.0),
            unlisted: None,
            step,
            step_gain,
        })
    }

    fn total(&self) -> f64 {
        self.base.iter().sum()
    }

    /// The screening of all variants at given settings.
    fn screen(&self, settings: &[Setting]) -> Option<(Vec<(World<'a>, Trace)>, Vec<Lead>)> {
        let traces = self.evidence.traces(settings)?;
        let normals = normals(&traces, &self.variants).ok()?;
        let leads = leads(&self.evidence, &self.variants, &normals);
        Some((traces, leads))
    }

    fn run(&mut self) {
        let Some((traces, leads)) = self.screen(&[]) else { return };
        let noise = noises(&self.evidence, &[], self.total());
        let chance = noise.iter().map(|n| tail(2.0 * n.gain, 1) * 6.0).fold(1.0, f64::min);
        self.p = chance.min(least_p(&leads));
        if self.p >= ALARM {
            return;
        }
        let list = shortlist(&leads, &self.variants, 8);
        let pursued: Vec<Refined> = (list.par_iter())
            .filter_map(|lead| pursue(&self.evidence, &self.variants[lead.variant], lead, &self.base))
            .collect();
        self.found = pursued;
        self.sort();
        self.accept_noise(noise);
        self.sort();
        self.second(&traces, &leads);
        self.sort();
        self.judge();
    }

    fn sort(&mut self) {
        self.found.sort_by(|a, b| b.score().total_cmp(&a.score()));
    }

    /// A noise effect is a candidate only where nothing with a mean is left once it is fitted.
    fn accept_noise(&mut self, noise: Vec<Refined>) {
        /// Log-likelihood that a column may still gain then.
        const LEFT: f64 = 14.0;
        let best = self.found.first().map_or(0.0, Refined::score);
        let strongest = noise.into_iter().filter(|n| n.score() > best.max(4.0)).collect::<Vec<_>>();
        for one in strongest {
            let left = self.screen(&one.settings).map_or(f64::INFINITY, |(_, leads)| {
                leads.iter().map(Lead::score).fold(0.0, f64::max)
            });
            if left < LEFT {
                self.found.push(one);
            }
        }
    }

    /// Looks for a second effect beside the best ones, and for the best pairs.
    fn second(&mut self, traces: &[(World<'a>, Trace)], first: &[Lead]) {
        let Some(best) = self.found.first().cloned() else { return };
        let Some((_, leads)) = self.screen(&best.settings) else { return };
        let noise = noises(&self.evidence, &best.settings, self.total() + best.gain);
        let chance = noise.iter().map(|n| tail(2.0 * n.gain, 1) * 6.0).fold(1.0, f64::min);
        if least_p(&leads).min(chance) >= 1e-3 {
            return;
        }
        let mut more: Vec<Refined> = Vec::new();
        for one in noise.into_iter().filter(|n| n.gain > 10.0) {
            let mut one = one;
            one.gain += best.gain;
            one.fitted += best.fitted;
            let mut errors = best.standard_errors.clone();
            errors.extend(one.standard_errors);
            one.standard_errors = errors;
            more.push(one);
        }
        if best.by == By::Constant {
            more.extend(self.beside(&best, &leads));
            more.extend(self.joint(traces, first));
        }
        // Each further value must gain ten.
        more.retain(|pair| pair.gain - best.gain > 10.0 * (pair.fitted.saturating_sub(best.fitted)).max(1) as f64);
        self.found.extend(more);
    }

    /// The best effect with each of the leads that are left beside it.
    fn beside(&self, best: &Refined, leads: &[Lead]) -> Vec<Refined> {
        let of_best = self.variants.iter().find(|v| *v.spec == *best.settings[0].spec);
        let Some(of_best) = of_best else { return Vec::new() };
        let constant: Vec<Lead> = leads.iter().filter(|lead| lead.by == By::Constant).cloned().collect();
        let list = shortlist(&constant, &self.variants, 4);
        (list.par_iter())
            .filter_map(|lead| {
                let variant = &self.variants[lead.variant];
                let parts = [(of_best.clone(), best.settings[0].clone()), (variant.clone(), lead.start(variant))];
                together(&self.evidence, &parts, self.total())
            })
            .collect()
    }

    /// The best pairs over the columns of the declared model.
    fn joint(&self, traces: &[(World<'a>, Trace)], leads: &[Lead]) -> Vec<Refined> {
        const AMONG: usize = 36;
        let constant: Vec<Lead> = leads.iter().filter(|lead| lead.by == By::Constant).cloned().collect();
        let list: Vec<usize> = shortlist(&constant, &self.variants, AMONG).iter().map(|lead| lead.variant).collect();
        (pairs(traces, &self.variants, &list, 4).par_iter())
            .filter_map(|pair| {
                let parts = pair.parts.clone().map(|(i, setting)| (self.variants[i].clone(), setting));
                together(&self.evidence, &parts, self.total())
            })
            .collect()
    }

    /// What is left beside the best explanation, and whether that makes it dishonest to name it.
    fn judge(&mut self) {
        let settings = self.found.first().map_or(Vec::new(), |best| best.settings.clone());
        let gain = self.found.first().map_or(0.0, |best| best.gain);
        if let Some((traces, leads)) = self.screen(&settings) {
            self.channels = channels(&traces);
            let left = leads.iter().map(Lead::score).fold(0.0, f64::max);
            self.remainder = (left / (left + gain).max(1e-9), least_p(&leads));
        }
        let matters = self.remainder.1 < 1e-3 && self.remainder.0 > MATTERS;
        if matters || self.found.is_empty() {
            self.unlisted = self.characterise(gain);
        }
        if self.unlisted.is_none() {
            self.unlisted = self.rough();
        }
    }

    /// The group of basis functions that explains most, if it explains more than the best listed effects.
    fn characterise(&self, listed: f64) -> Option<UnlistedEffect> {
        let groups = unlisted_variants();
        let traces = self.evidence.traces(&[])?;
        let found = leads(&self.evidence, &groups, &normals(&traces, &groups).ok()?);
        let score = |lead: &Lead| lead.gain - price(lead.fitted, By::Constant);
        let most = found.iter().map(score).fold(0.0, f64::max);
        let lead = (found.iter())
            .filter(|lead| score(lead) >= 0.97 * most)
            .min_by(|a, b| a.fitted.cmp(&b.fitted).then(b.gain.total_cmp(&a.gain)))?;
        let variant = &groups[lead.variant];
        let setting = lead.start(variant);
        let refined = together(&self.evidence, &[(variant.clone(), setting)], self.total())?;
        if refined.gain < listed {
            return None;
        }
        let word = |i: usize| UNLISTED.params[i].choices[variant.values[i] as usize].to_owned();
        Some(UnlistedEffect {
            stage: stage_of(&refined.settings[0]),
            acts_on: word(0),
            depends_on: word(1),
            setting: Some(refined.settings[0].clone()),
            gain: refined.gain,
        })
    }

    /// Noise that no normal distribution has: innovations with heavy tails that are no edges of readings.
    fn rough(&self) -> Option<UnlistedEffect> {
        let camera = [self.channels[0], self.channels[1]];
        let excess = camera.iter().map(|c| (c.kurtosis - 3.0) / (24.0 / c.count.max(1) as f64).sqrt()).fold(0.0, f64::max);
        let heavy = camera.iter().map(|c| c.kurtosis).fold(0.0, f64::max) > 3.25;
        (heavy && excess > 8.0).then(|| {
            let lasting = camera.iter().map(|c| c.correlation).fold(0.0, f64::max) > -0.02;
            UnlistedEffect {
                stage: if lasting { Stage::Act } else { Stage::Observe },
                acts_on: if lasting { "wheel speed" } else { "camera" }.to_owned(),
                depends_on: "chance".to_owned(),
                setting: None,
                gain: self.found.first().map_or(0.0, |best| best.gain),
            }
        })
    }

    fn answer(self, decide: Decided, corners: Corners) -> LogDiagnosis {
        let step = self.step.and_then(|counts| {
            let spec = find("reading-step").ok()?;
            let setting = Setting::constant(spec, [counts]);
            Some(Candidate { setting, standard_errors: vec![2e-4 * counts], gain: self.step_gain, fitted: 1 })
        });
        let mut explanations: Vec<LogExplanation> = (self.found.iter().take(12))
            .map(|refined| explanation(refined, step.as_ref()))
            .collect();
        if let (true, Some(step)) = (explanations.is_empty(), step) {
            explanations.push(LogExplanation { gain: step.gain, price: price(1, By::Constant), effects: vec![step] });
        }
        let matters = self.remainder.1 < 1e-3 && self.remainder.0 > MATTERS;
        let verdict = match (&self.unlisted, explanations.is_empty(), matters) {
            (Some(_), ..) => LogVerdict::Unlisted,
            (None, true, _) => LogVerdict::Faithful,
            (None, false, true) => LogVerdict::PartlyExplained,
            (None, false, false) => LogVerdict::Explained,
        };
        LogDiagnosis {
            verdict,
            decide,
            p: if self.step.is_some() { 0.0 } else { self.p },
            explanations,
            remainder_share: self.remainder.0,
            remainder_p: self.remainder.1,
            unlisted: self.unlisted,
            channels: self.channels,
            corners,
            steps: self.steps,
        }
    }
}

fn explanation(refined: &Refined, step: Option<&Candidate>) -> LogExplanation {
    let own = refined.settings.iter().zip(&refined.standard_errors).map(|(setting, errors)| Candidate {
        setting: setting.clone(),
        standard_errors: errors.clone(),
        gain: refined.gain,
        fitted: errors.iter().filter(|error| **error > 0.0).count(),
    });
    let effects: Vec<Candidate> = step.cloned().into_iter().chain(own).collect();
    let more = step.map_or(0.0, |step| step.gain);
    LogExplanation { effects, gain: refined.gain + more, price: price(refined.fitted, refined.by) }
}

/// Probability of the best lead by chance, given how many there are.
fn least_p(leads: &[Lead]) -> f64 {
    let least = leads.iter().map(Lead::p).fold(1.0, f64::min);
    (least * leads.len() as f64).min(1.0)
}

/// Moments of the innovations.
fn channels(traces: &[(World<'_>, Trace)]) -> [Channel; MEASURED] {
    std::array::from_fn(|m| {
        let (mut count, mut sums, mut before) = (0_usize, [0.0; 3], 0.0);
        for (_, trace) in traces {
            for instant in trace.instants.iter().filter(|instant| instant.used >> m & 1 == 1) {
                let e = instant.innovation[m];
                count += 1;
                sums[0] += e * e;
                sums[1] += e.powi(4);
                sums[2] += e * before;
                before = e;
            }
        }
        let n = count.max(1) as f64;
        let mean_square = sums[0] / n;
        let scale = mean_square.max(1e-12);
        Channel { count, mean_square, kurtosis: sums[1] / n / (scale * scale), correlation: sums[2] / n / scale }
    })
}
