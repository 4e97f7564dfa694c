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
use super::refine::jumps;
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
    /// Innovations that count; of readings only those that are far from being cut.
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
    let first = recut(&scene, model, &wide, &declared, &[]);
    let mut search = Search::new(
        declared.elsewhere(first.as_ref().map_or(&scene, |found| &found.1)),
        step,
    )?;
    let corners = |cut: &Option<(Corners, Scene)>| cut.as_ref().map_or(EXACT, |found| found.0);
    let Some(leads) = search.alone() else {
        return Ok(search.answer(decide, corners(&first)));
    };
    // A large effect blurs where the corners are: they are looked for again beside the best candidate.
    let settings = search
        .found
        .first()
        .map_or(Vec::new(), |best| best.settings.clone());
    let again = recut(&scene, model, &wide, &declared, &settings);
    let better = again.as_ref().map_or(&scene, |found| &found.1);
    if corners(&again) == corners(&first) {
        search.finish(&leads);
        return Ok(search.answer(decide, corners(&first)));
    }
    let mut renewed = Search::new(declared.elsewhere(better), step)?;
    renewed.p = search.p;
    renewed.found = search
        .found
        .iter()
        .filter_map(|found| renewed.renew(found))
        .collect();
    renewed.sort();
    renewed.finish(&leads);
    Ok(renewed.answer(decide, corners(&again)))
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

/// Every run in its world, filtered, and the leads over them.
type Screened<'a> = (Vec<(World<'a>, Trace)>, Vec<Lead>);

impl<'a> Search<'a> {
    fn new(evidence: Evidence<'a>, step: Option<f64>) -> Result<Self, Error> {
        let course = &evidence.scene.circuit().course;
        let lengths_m = [Side::Outer, Side::Inner].map(|side| course.wall(side).length_m());
        let traces = evidence.traces(&[]).ok_or(Error::NoLog)?;
        let base: Vec<f64> = traces.iter().map(|(_, trace)| trace.log_likelihood).collect();
        let unrounded = Evidence {
            step_counts: 0.0,
            ..evidence.elsewhere(evidence.scene)
        };
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
    fn screen(&self, settings: &[Setting]) -> Option<Screened<'a>> {
        let traces = self.evidence.traces(settings)?;
        let normals = normals(&traces, &self.variants).ok()?;
        let leads = leads(&self.evidence, &self.variants, &normals);
        Some((traces, leads))
    }

    /// Single effects; `None` if there is nothing to explain, else the leads at the declared model.
    fn alone(&mut self) -> Option<Vec<Lead>> {
        let (_, leads) = self.screen(&[])?;
        let noise = noises(&self.evidence, &[], self.total());
        self.p = by_chance(&noise).min(least_p(&leads));
        if self.p >= ALARM {
            return None;
        }
        let list = self.promising(shortlist(&leads, &self.variants, 8));
        self.found = (list.par_iter())
            .filter_map(|lead| pursue(&self.evidence, &self.variants[lead.variant], lead, &self.base))
            .collect();
        self.sort();
        self.accept_noise(noise);
        self.sort();
        Some(leads)
    }

    /// The leads that gain, where linear algebra puts them, a fair share of what the best of them gains there.
    fn promising(&self, list: Vec<Lead>) -> Vec<Lead> {
        let gains: Vec<f64> = (list.par_iter())
            .map(|lead| {
                let setting = lead.start(&self.variants[lead.variant]);
                self.evidence
                    .likelihood(&[setting])
                    .map_or(0.0, |likelihood| likelihood - self.total())
            })
            .collect();
        let best = gains.iter().copied().fold(0.0, f64::max);
        let keeps =
            |(lead, gain): &(Lead, f64)| lead.by == By::Run || *gain > 0.2 * best || lead.gain > 0.9 * best;
        list.into_iter()
            .zip(gains)
            .filter(keeps)
            .map(|(lead, _)| lead)
            .collect()
    }

    /// A candidate refined again, from where it is.
    fn renew(&self, found: &Refined) -> Option<Refined> {
        let variant = self
            .variants
            .iter()
            .find(|variant| *variant.spec == *found.settings[0].spec);
        match (variant, found.by) {
            (Some(variant), By::Constant) if !jumps(&found.settings[0]) => together(
                &self.evidence,
                &[(variant.clone(), found.settings[0].clone())],
                self.total(),
            ),
            _ => {
                let gain = self.evidence.likelihood(&found.settings)? - self.total();
                Some(Refined {
                    gain,
                    ..found.clone()
                })
            }
        }
    }

    /// Further effects, and whether what is left matters.
    fn finish(&mut self, leads: &[Lead]) {
        self.second(leads);
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
        let Some(one) = noise.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain)) else {
            return;
        };
        if one.score() > best.max(4.0) {
            let left = self
                .screen(&one.settings)
                .map_or(f64::INFINITY, |(_, leads)| most(&leads));
            if left < LEFT {
                self.found.push(one);
            }
        }
    }

    /// Looks for a second effect beside the best one, and for the best pairs.
    fn second(&mut self, first: &[Lead]) {
        let Some(best) = self.found.first().cloned() else {
            return;
        };
        let Some((traces, leads)) = self.screen(&best.settings) else {
            return;
        };
        self.settle(&traces, &leads, best.gain);
        let noise = noises(&self.evidence, &best.settings, self.total() + best.gain);
        if self.remainder.1.min(by_chance(&noise)) >= 1e-3 {
            return;
        }
        let mut more: Vec<Refined> = Vec::new();
        if self.remainder.0 < MATTERS || self.remainder.1 >= 1e-3 {
            let noise = noise
                .into_iter()
                .filter(|n| n.gain > 10.0)
                .max_by(|a, b| a.gain.total_cmp(&b.gain));
            more.extend(noise.map(|n| n.after(&best)));
        }
        if best.by == By::Constant {
            more.extend(self.beside(&best, &leads));
            more.extend(self.joint(first));
        }
        // Each further value must gain ten.
        more.retain(|pair| {
            pair.gain - best.gain > 10.0 * (pair.fitted.saturating_sub(best.fitted)).max(1) as f64
        });
        if more.is_empty() {
            return;
        }
        self.found.extend(more);
        self.sort();
        let best = self.found[0].clone();
        if let Some((traces, leads)) = self.screen(&best.settings) {
            self.settle(&traces, &leads, best.gain);
        }
    }

    /// Notes what is left beside an explanation.
    fn settle(&mut self, traces: &[(World<'a>, Trace)], leads: &[Lead], gain: f64) {
        self.channels = channels(traces);
        let left = most(leads);
        self.remainder = (left / (left + gain).max(1e-9), least_p(leads));
    }

    /// The best effect with each of the leads that are left beside it.
    fn beside(&self, best: &Refined, leads: &[Lead]) -> Vec<Refined> {
        let of_best = self.variants.iter().find(|v| *v.spec == *best.settings[0].spec);
        let Some(of_best) = of_best else { return Vec::new() };
        let constant: Vec<Lead> = leads
            .iter()
            .filter(|lead| lead.by == By::Constant)
            .cloned()
            .collect();
        let list = shortlist(&constant, &self.variants, 3);
        (list.par_iter())
            .filter_map(|lead| {
                let variant = &self.variants[lead.variant];
                let parts = [
                    (of_best.clone(), best.settings[0].clone()),
                    (variant.clone(), lead.start(variant)),
                ];
                together(&self.evidence, &parts, self.total())
            })
            .collect()
    }

    /// The best pairs over the columns of the declared model.
    fn joint(&self, leads: &[Lead]) -> Vec<Refined> {
        const AMONG: usize = 36;
        let constant: Vec<Lead> = leads
            .iter()
            .filter(|lead| lead.by == By::Constant)
            .cloned()
            .collect();
        let list: Vec<usize> = shortlist(&constant, &self.variants, AMONG)
            .iter()
            .map(|lead| lead.variant)
            .collect();
        let Some(traces) = self.evidence.traces(&[]) else {
            return Vec::new();
        };
        (pairs(&traces, &self.variants, &list, 3).par_iter())
            .filter_map(|pair| {
                let parts = pair
                    .parts
                    .clone()
                    .map(|(i, setting)| (self.variants[i].clone(), setting));
                together(&self.evidence, &parts, self.total())
            })
            .collect()
    }

    /// What is left beside the best explanation, and whether that makes it dishonest to name it.
    fn judge(&mut self) {
        let gain = self.found.first().map_or(0.0, |best| best.gain);
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
        let heavy = |channel: &Channel| {
            let deviation = (24.0 / channel.count.max(1) as f64).sqrt();
            channel.kurtosis > 3.3 && channel.kurtosis - 3.0 > 10.0 * deviation
        };
        let camera = self.channels[..2].iter().any(heavy);
        let readings = self.channels[2..].iter().filter(|channel| heavy(channel)).count();
        if !camera && readings == 0 {
            return None;
        }
        let (stage, acts_on) = match (camera, readings) {
            (true, 0) => (Stage::Observe, "camera"),
            (false, 1 | 2) => (Stage::Sense, "reading"),
            _ => (Stage::Act, "wheel speed"),
        };
        let gain = self.found.first().map_or(0.0, |best| best.gain);
        Some(UnlistedEffect {
            stage,
            acts_on: acts_on.into(),
            depends_on: "chance".into(),
            setting: None,
            gain,
        })
    }

    fn answer(self, decide: Decided, corners: Corners) -> LogDiagnosis {
        let step = self.step.and_then(|counts| {
            let spec = find("reading-step").ok()?;
            let setting = Setting::constant(spec, [counts]);
            Some(Candidate {
                setting,
                standard_errors: vec![2e-4 * counts],
                gain: self.step_gain,
                fitted: 1,
            })
        });
        let mut explanations: Vec<LogExplanation> = (self.found.iter().take(12))
            .map(|refined| explanation(refined, step.as_ref()))
            .collect();
        if let (true, Some(step)) = (explanations.is_empty(), step) {
            explanations.push(LogExplanation {
                gain: step.gain,
                price: price(1, By::Constant),
                effects: vec![step],
            });
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
    let own = refined
        .settings
        .iter()
        .zip(&refined.standard_errors)
        .map(|(setting, errors)| Candidate {
            setting: setting.clone(),
            standard_errors: errors.clone(),
            gain: refined.gain,
            fitted: errors.iter().filter(|error| **error > 0.0).count(),
        });
    let effects: Vec<Candidate> = step.cloned().into_iter().chain(own).collect();
    let more = step.map_or(0.0, |step| step.gain);
    LogExplanation {
        effects,
        gain: refined.gain + more,
        price: price(refined.fitted, refined.by),
    }
}

/// The best score.
fn most(leads: &[Lead]) -> f64 {
    leads.iter().map(Lead::score).fold(0.0, f64::max)
}

/// Probability that one of the noise effects gains as much by chance.
fn by_chance(noise: &[Refined]) -> f64 {
    noise
        .iter()
        .map(|n| tail(2.0 * n.gain, 1) * 6.0)
        .fold(1.0, f64::min)
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
                if m >= 2 && instant.uncut[m - 2] < 4.0 * instant.deviation[m - 2] {
                    continue;
                }
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
        Channel {
            count,
            mean_square,
            kurtosis: sums[1] / n / (scale * scale),
            correlation: sums[2] / n / scale,
        }
    })
}
