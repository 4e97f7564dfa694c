//! From logs to an answer.

use std::collections::BTreeSet;
use std::sync::Arc;

use rayon::prelude::*;
use sim::{Model, Pattern, Scene, Setting, Stage, World, find};

use super::catalogue::Variant;
use super::decide::{Decided, decided};
use super::detectable::detectable;
use super::evidence::Evidence;
use super::filter::{MEASURED, Trace};
use super::groups::unlisted_variants;
use super::noise::{Factor, by_chance, noises, p_among, p_among_repeats, with_memory};
use super::pairs::pairs;
use super::recut::recut;
use super::refine::jumps;
use super::repeat::repeats;
use super::rows::LogRow;
use super::screen::normals;
use super::search::{By, Lead, Refined, leads, price, pursue, shortlist, together};
use super::settling::settling;
use super::steps::reading_step;
use super::wheels::out_of_round;
use crate::answer::{ALTERNATIVE, indistinguishable};
use crate::candidate::label;
use crate::corners::{Corners, EXACT};
use crate::{Answer, Candidate, Cause, Detectable, Error, Explanation, Verdict, Watch};

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
    /// What is claimed.
    pub answer: Answer,
    /// The controller.
    pub decide: Decided,
    /// Probability that as much is found in the logs of a robot that is as declared.
    pub p: f64,
    /// Camera x and y, then S0 to S7, under the best explanation.
    pub channels: [Channel; MEASURED],
    /// Where the walls seem to be cut.
    pub corners: Corners,
    /// Control steps that were used.
    pub steps: usize,
    /// How large effects on motion, readings, walls and camera must be to show in these logs.
    pub detectable: Vec<Detectable>,
}

/// What the robot's logs say that the model lacks. Runs are rows in time order, from the run's start; `watch` is told what is
/// being tried.
///
/// # Errors
/// A model that the scene was not made for; logs of which no stretch of 200 control steps with positions and commands
/// can be followed.
pub fn diagnose_logs(
    model: &Model,
    scene: &Scene,
    runs: &[&[LogRow]],
    watch: &Watch<'_>,
) -> Result<LogDiagnosis, Error> {
    watch("the controller");
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
    watch("where the walls are cut");
    let first = recut(&scene, &wide, &declared, &[]).and_then(|found| found.cut);
    let mut search = Search::new(
        declared.elsewhere(first.as_ref().map_or(&scene, |found| &found.1)),
        step,
    )?;
    let corners = |cut: &Option<(Corners, Scene)>| cut.as_ref().map_or(EXACT, |found| found.0);
    watch("each effect by the log");
    let Some(leads) = search.alone() else {
        return Ok(search.answer(decide, corners(&first)));
    };
    // Where walls or the robot then are elsewhere, so are the readings that no edge spoils.
    let clear = search.evidence.clear_with_each(search.rivals());
    let was_clear = clear.is_none();
    if let Some(clear) = clear {
        watch(&format!(
            "the readings that count with {}",
            search.best_in_words()
        ));
        search = search.renewed(clear)?;
    }
    watch(&format!(
        "where the walls are cut with {}",
        search.best_in_words()
    ));
    // A large effect blurs where the corners are: they are looked for again beside the best candidate, with the size that it has
    // there and, as corners that are wrong spoil that too, with the one that it has between the declared walls.
    let uncut = search.evidence.elsewhere(&scene);
    let sizes = [
        Some(search.best().to_vec()),
        first.as_ref().and_then(|_| search.best_by(&uncut)),
    ];
    let again = (sizes.into_iter().flatten())
        .filter_map(|settings| recut(&scene, &wide, &uncut, &settings))
        .max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))
        .and_then(|found| found.cut);
    watch(&format!("what is beside {}", search.best_in_words()));
    if was_clear && corners(&again) == corners(&first) {
        search.finish(&leads);
        return Ok(search.answer(decide, corners(&first)));
    }
    let declared = declared.elsewhere(again.as_ref().map_or(&scene, |found| &found.1));
    let clear = declared.clear_with_each(search.rivals());
    let mut renewed = search.renewed(clear.unwrap_or(declared))?;
    renewed.finish(&leads);
    Ok(renewed.answer(decide, corners(&again)))
}

/// A probability below which something is there: one false alarm in a hundred data sets.
const ALARM: f64 = 0.01;
/// Share of a gain that faults of the model may take: at very high signal none is exact.
const FAULTS: f64 = 0.01;
/// A probability below which a remainder is significant.
const SIGNIFICANT_P: f64 = 1e-3;
/// Share of the explained log-likelihood that a remainder may have at very high signal.
const MATTERS: f64 = 0.02;

/// Leads that are refined.
const PROMISING: usize = 8;

/// The state of the search for effects.
struct Search<'a> {
    evidence: Evidence<'a>,
    variants: Vec<Variant>,
    base: Vec<f64>,
    found: Vec<Refined>,
    p: f64,
    remainder: (f64, f64),
    unlisted: Option<Unnamed>,
    channels: [Channel; MEASURED],
    step: Option<f64>,
    step_gain: f64,
    steps: usize,
    detectable: Vec<Detectable>,
    /// The last screening and its settings.
    screened: Option<(Vec<Setting>, Arc<Screened<'a>>)>,
}

/// Two effects, each with the setting where a refinement of both begins.
type Parts = [(Variant, Setting); 2];

/// Every run in its world, filtered, and the leads over them.
type Screened<'a> = (Vec<(World<'a>, Trace)>, Vec<Lead>);

impl<'a> Search<'a> {
    fn new(evidence: Evidence<'a>, step: Option<f64>) -> Result<Self, Error> {
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
            variants: evidence.variants(),
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
            detectable: Vec::new(),
            screened: None,
        })
    }

    fn total(&self) -> f64 {
        self.base.iter().sum()
    }

    /// The screening of all variants at given settings.
    fn screen(&mut self, settings: &[Setting]) -> Option<Arc<Screened<'a>>> {
        if let Some((_, found)) = self.screened.as_ref().filter(|last| last.0 == settings) {
            return Some(Arc::clone(found));
        }
        let found = Arc::new(screened(&self.evidence, settings, &self.variants)?);
        self.screened = Some((settings.to_vec(), Arc::clone(&found)));
        Some(found)
    }

    /// Single effects; `None` if there is nothing to explain, else the leads at the declared model.
    fn alone(&mut self) -> Option<Vec<Lead>> {
        let leads = self.screen(&[])?.1.clone();
        self.detectable = detectable(&leads, &self.variants, ALARM);
        let noise = noises(&self.evidence, &[], self.total());
        let by_mean = self.p_by_mean(&leads);
        self.p = by_mean.min(if by_mean < ALARM {
            by_chance(&noise)
        } else {
            p_among_repeats(&self.evidence, &[], &noise, ALARM)
        });
        if self.p >= ALARM {
            return None;
        }
        let list = self.promising(shortlist(&leads, &self.variants, PROMISING));
        self.found = self.pursued(&list);
        self.sort();
        self.accept_noise(noise, &list);
        self.sort();
        Some(leads)
    }

    /// Probability of the best lead by chance. Readings in coarse steps are no normal numbers: where they were rounded, the
    /// best leads are compared with what they gain in simulated logs too.
    fn p_by_mean(&self, leads: &[Lead]) -> f64 {
        /// What is no gain at all, so that logarithms of gains exist.
        const LEAST: f64 = 1.0;
        let p = least_p(leads);
        if self.step.is_none() || p >= ALARM {
            return p;
        }
        let best = self.variants_of(&shortlist(leads, &self.variants, PROMISING));
        let logs = repeats(&self.evidence, &[], |repeated| {
            Some(most_left(repeated, &[], &best)?.max(LEAST).ln())
        });
        p.max(p_among(most(leads).max(LEAST).ln(), &logs))
    }

    /// The leads refined: a few steps each, then to the end those that may still be the best.
    fn pursued(&self, list: &[Lead]) -> Vec<Refined> {
        let pursue = |lead: &Lead, steps| {
            pursue(
                &self.evidence,
                &self.variants[lead.variant],
                lead,
                &self.base,
                steps,
            )
        };
        let first: Vec<(&Lead, Refined)> = (list.par_iter())
            .filter_map(|lead| Some((lead, pursue(lead, FIRST_STEPS)?)))
            .collect();
        let least = least_in_reach(first.iter().map(|(_, refined)| refined));
        first
            .into_par_iter()
            .map(|(lead, refined)| {
                if refined.score() < least || refined.settings.iter().all(jumps) {
                    return refined;
                }
                match lead.by {
                    By::Run => pursue(lead, STEPS).unwrap_or(refined),
                    By::Constant | By::Time => {
                        refined.further(&self.evidence, &self.variants, self.total(), STEPS)
                    }
                }
            })
            .collect()
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

    fn variants_of(&self, leads: &[Lead]) -> Vec<Variant> {
        let variant = |lead: &Lead| self.variants[lead.variant].clone();
        leads.iter().map(variant).collect()
    }

    /// The effects of the best candidate; none if there is none.
    fn best(&self) -> &[Setting] {
        self.found.first().map_or(&[], |best| &best.settings)
    }

    fn best_in_words(&self) -> String {
        let labels: Vec<String> = self.best().iter().map(label).collect();
        labels.join(" + ")
    }

    /// The effects of the best candidates, which may change places where other readings count.
    fn rivals(&self) -> impl Iterator<Item = &[Setting]> {
        const NEARLY: f64 = 0.8;
        const MOST: usize = 3;
        let best = self.found.first().map_or(0.0, Refined::score);
        (self.found.iter().take(MOST))
            .filter(move |other| other.score() >= NEARLY * best)
            .map(|other| other.settings.as_slice())
    }

    /// The same search with other evidence, its candidates refined again by it.
    fn renewed<'b>(self, evidence: Evidence<'b>) -> Result<Search<'b>, Error> {
        let mut renewed = Search::new(evidence, self.step)?;
        (renewed.p, renewed.detectable) = (self.p, self.detectable);
        renewed.found = (self.found.iter())
            .filter_map(|found| renewed.renew(found, &renewed.evidence, renewed.total()))
            .collect();
        renewed.sort();
        Ok(renewed)
    }

    /// The effects of the best candidate refined again by other evidence.
    fn best_by(&self, evidence: &Evidence<'_>) -> Option<Vec<Setting>> {
        let renewed = self.renew(self.found.first()?, evidence, evidence.likelihood(&[])?)?;
        Some(renewed.settings)
    }

    /// A candidate refined again, from where it is, by evidence with this log-likelihood of the declared model.
    fn renew(&self, found: &Refined, evidence: &Evidence<'_>, base: f64) -> Option<Refined> {
        let variant = Variant::of(&found.settings[0], &self.variants);
        match (variant, found.by) {
            (Some(variant), By::Constant) if !jumps(&found.settings[0]) => together(
                evidence,
                &[(variant.clone(), found.settings[0].clone())],
                base,
                STEPS,
            ),
            _ => {
                let gain = evidence.likelihood(&found.settings)? - base;
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
        if let (Some(best), None, None) = (self.found.first_mut(), self.step, &self.unlisted) {
            *best = best.clone().with_honest_errors(&self.evidence, &self.variants);
        }
        if let Some(twin) = self.found.first().and_then(with_memory) {
            self.found.insert(1, twin);
        }
    }

    fn sort(&mut self) {
        self.found.sort_by(|a, b| b.score().total_cmp(&a.score()));
    }

    /// A noise effect is a candidate only where nothing with a mean is left once it is fitted; `promising` would be first.
    fn accept_noise(&mut self, noise: Vec<Factor>, promising: &[Lead]) {
        /// Log-likelihood that a column may still gain then: twice what it usually does at small noise.
        const LEFT: f64 = 14.0;
        const TIMES: f64 = 2.0;
        const HOPELESS: f64 = 10.0;
        /// Share of the best score by which a gain known to a tenth may fall short of it.
        const NEAR: f64 = 0.8;
        let best = self.found.first().map_or(0.0, Refined::score);
        let largest = noise.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
        let Some(one) = largest
            .filter(|one| one.gain > NEAR * best)
            .and_then(|one| one.refined(&self.evidence, &[], self.total()))
        else {
            return;
        };
        let promising = self.variants_of(promising);
        let hopes = |left: f64| left < HOPELESS * LEFT;
        if one.score() > best.max(4.0)
            && most_left(&self.evidence, &one.settings, &promising).is_some_and(hopes)
        {
            let left = self
                .screen(&one.settings)
                .map_or(f64::INFINITY, |found| most(&found.1));
            if left < LEFT || hopes(left) && left < TIMES * self.usually_left(&one) {
                self.found.push(one);
            }
        }
    }

    /// What a column gains at most beside a noise effect in logs that have this effect alone: at large noise the filter is not
    /// linear enough to leave nothing.
    fn usually_left(&self, noise: &Refined) -> f64 {
        let left = |repeated: &Evidence<'_>| most_left(repeated, &noise.settings, &self.variants);
        let all = repeats(&self.evidence, &noise.settings, left);
        all.into_iter().fold(0.0, f64::max)
    }

    /// Looks for a second effect beside the best one, and for the best pairs.
    fn second(&mut self, first: &[Lead]) {
        let Some(best) = self.found.first().cloned() else {
            return;
        };
        let Some(screened) = self.screen(&best.settings) else {
            return;
        };
        let (traces, leads) = &*screened;
        self.settle(traces, leads, best.gain);
        let noise = noises(&self.evidence, &best.settings, self.total() + best.gain);
        let left = noise.iter().map(|n| n.gain).fold(0.0, f64::max) / best.gain.max(1e-9);
        if self.remainder.1.min(by_chance(&noise)) >= SIGNIFICANT_P || self.remainder.0.max(left) < FAULTS {
            return;
        }
        let mut more: Vec<Refined> = Vec::new();
        if self.remainder.0 < MATTERS || self.remainder.1 >= 1e-3 {
            let noise = noise
                .into_iter()
                .filter(|n| n.gain > 10.0)
                .max_by(|a, b| a.gain.total_cmp(&b.gain))
                .filter(|n| {
                    let one = std::slice::from_ref(n);
                    p_among_repeats(&self.evidence, &best.settings, one, SIGNIFICANT_P) < SIGNIFICANT_P
                })
                .map(|n| self.beside_rivals(&n, &best));
            more.extend(noise.into_iter().flatten());
        }
        if best.by == By::Constant {
            let mut starts = self.beside(&best, leads);
            starts.extend(self.joint(first));
            more.extend(self.pursued_together(&starts));
        }
        // An effect that linear algebra did not see may stand alone.
        let pair = more.iter().max_by(|a, b| a.score().total_cmp(&b.score()));
        let alone = pair.map_or(Vec::new(), |pair| self.each_alone(pair));
        let better = alone.into_iter().filter(|alone| alone.score() > best.score());
        self.found.extend(better);
        self.sort();
        let best = self.found[0].clone();
        // Each further value must gain ten.
        more.retain(|pair| {
            let further = pair.fitted.saturating_sub(best.fitted).max(1) as f64;
            pair.gain - best.gain > (10.0 * further).max(FAULTS * best.gain)
        });
        self.found.extend(more);
        self.sort();
        let best = self.found[0].clone();
        if let Some(screened) = self.screen(&best.settings) {
            self.settle(&screened.0, &screened.1, best.gain);
        }
    }

    /// A noise effect beside the best candidate, and beside single effects that explain nearly as much: large noise hides what tells
    /// them apart.
    fn beside_rivals(&self, noise: &Factor, best: &Refined) -> Vec<Refined> {
        const NEARLY: f64 = 0.98;
        const MOST: usize = 3;
        let is_rival = |other: &&Refined| {
            other.settings == best.settings
                || other.score() > NEARLY * best.score() && other.names() != best.names()
        };
        (self.found.iter().filter(is_rival).take(MOST))
            .filter_map(|one| {
                let base = self.total() + one.gain;
                let noise = noise.elsewhere(&self.evidence, &one.settings, base)?;
                Some(noise.refined(&self.evidence, &one.settings, base)?.after(one))
            })
            .collect()
    }

    /// Each effect of a pair refined without the other, from where it is.
    fn each_alone(&self, pair: &Refined) -> Vec<Refined> {
        (pair.settings.par_iter())
            .filter(|setting| !jumps(setting))
            .filter_map(|setting| {
                let variant = Variant::of(setting, &self.variants)?;
                together(
                    &self.evidence,
                    &[(variant.clone(), setting.clone())],
                    self.total(),
                    STEPS,
                )
            })
            .collect()
    }

    /// Notes what is left beside an explanation.
    fn settle(&mut self, traces: &[(World<'a>, Trace)], leads: &[Lead], gain: f64) {
        self.channels = channels(traces);
        let left = most(leads);
        self.remainder = (left / (left + gain).max(1e-9), least_p(leads));
    }

    /// The best effect with each of the leads that are left beside it, where a refinement of the two begins.
    fn beside(&self, best: &Refined, leads: &[Lead]) -> Vec<Parts> {
        let Some(of_best) = Variant::of(&best.settings[0], &self.variants) else {
            return Vec::new();
        };
        let list = shortlist(&constant(leads), &self.variants, 3);
        (list.iter())
            .map(|lead| {
                let variant = &self.variants[lead.variant];
                [
                    (of_best.clone(), best.settings[0].clone()),
                    (variant.clone(), lead.start(variant)),
                ]
            })
            .collect()
    }

    /// The best pairs over the columns of the declared model, where their refinements begin.
    fn joint(&self, leads: &[Lead]) -> Vec<Parts> {
        const AMONG: usize = 36;
        let list: Vec<usize> = shortlist(&constant(leads), &self.variants, AMONG)
            .iter()
            .map(|lead| lead.variant)
            .collect();
        let Some(traces) = self.evidence.traces(&[]) else {
            return Vec::new();
        };
        let found = pairs(&traces, &self.variants, &list, 3).unwrap_or_default();
        (found.into_iter())
            .map(|pair| pair.parts.map(|(i, setting)| (self.variants[i].clone(), setting)))
            .collect()
    }

    /// Pairs refined together: a few steps, then to the end the best of every two names that may still be the best of all.
    fn pursued_together(&self, starts: &[Parts]) -> Vec<Refined> {
        let mut first: Vec<Refined> = (starts.par_iter())
            .filter_map(|parts| together(&self.evidence, parts, self.total(), FIRST_STEPS))
            .collect();
        first.sort_by(|a, b| b.score().total_cmp(&a.score()));
        let least = least_in_reach(first.iter());
        let mut names = BTreeSet::new();
        let (hopeful, others): (Vec<Refined>, Vec<Refined>) =
            (first.into_iter()).partition(|pair| names.insert(pair.names()) && pair.score() >= least);
        let further =
            |pair: Refined| pair.further(&self.evidence, &self.variants, self.total(), STEPS - FIRST_STEPS);
        (hopeful.into_par_iter().map(further)).chain(others).collect()
    }

    /// What is left beside the best explanation, and whether that makes it dishonest to name it.
    fn judge(&mut self) {
        let gain = self.found.first().map_or(0.0, |best| best.gain);
        if let Some(wheels) = out_of_round(&self.evidence, self.best(), FAULTS * gain) {
            self.unlisted = Cause::of(&wheels.settings[0]).map(|cause| {
                let refined = Some(wheels).filter(|wheels| wheels.score() > gain);
                Unnamed { cause, refined }
            });
            return;
        }
        let settles = (self.found.first()).and_then(|best| settling(&self.evidence, best, self.total()));
        if let Some(settles) = settles {
            self.unlisted = Cause::of(&settles.settings[0]).map(|cause| Unnamed {
                cause,
                refined: Some(settles),
            });
            return;
        }
        let matters = self.remainder.1 < 1e-3 && self.remainder.0 > MATTERS;
        if matters || self.found.is_empty() {
            self.unlisted = self.characterise(gain);
        }
        if self.unlisted.is_none() {
            self.unlisted = rough(&self.channels, FAULTS * gain).filter(|_| !self.is_rough_by_itself());
        }
    }

    /// The group of basis functions that explains most, if it explains more than the best listed effects.
    fn characterise(&self, listed: f64) -> Option<Unnamed> {
        let groups = unlisted_variants();
        let (_, found) = screened(&self.evidence, &[], &groups)?;
        let score = |lead: &Lead| lead.gain - price(lead.fitted, By::Constant);
        let most = found.iter().map(score).fold(0.0, f64::max);
        let lead = (found.iter())
            .filter(|lead| score(lead) >= 0.97 * most)
            .min_by(|a, b| a.fitted.cmp(&b.fitted).then(b.gain.total_cmp(&a.gain)))?;
        let variant = &groups[lead.variant];
        let setting = lead.start(variant);
        let refined = together(&self.evidence, &[(variant.clone(), setting)], self.total(), STEPS)?;
        if refined.gain < listed {
            return None;
        }
        Cause::of(&refined.settings[0]).map(|cause| Unnamed {
            cause,
            refined: Some(refined),
        })
    }

    /// Whether the filter finds tails about as heavy in simulated logs of the best explanation: where rounding or large noise
    /// takes the robot far from the pose about which it is linear.
    fn is_rough_by_itself(&self) -> bool {
        /// Excess kurtosis, as a multiple of the largest in simulated logs, that is no chance.
        const TIMES: f64 = 1.5;
        let Some(best) = self.found.first() else {
            return false;
        };
        let heaviest = |channels: &[Channel; MEASURED]| {
            let excess = channels.iter().map(|channel| channel.kurtosis - 3.0);
            excess.fold(0.0, f64::max)
        };
        let simulated = repeats(&self.evidence, &best.settings, |repeated| {
            Some(heaviest(&channels(&repeated.traces(&best.settings)?)))
        });
        heaviest(&self.channels) < TIMES * simulated.into_iter().fold(0.0, f64::max)
    }

    fn answer(self, decide: Decided, corners: Corners) -> LogDiagnosis {
        let certain = self.certain(&decide);
        let mut explanations: Vec<Explanation> = Vec::new();
        for refined in self.found.iter().take(12) {
            let explanation = self.explanation(refined, &certain);
            // What was refined from several sizes may have come to one.
            if explanations
                .iter()
                .all(|other| other.label() != explanation.label())
            {
                explanations.push(explanation);
            }
        }
        let unnamed = self.unlisted.as_ref().and_then(|u| u.refined.as_ref());
        if let Some(refined) = unnamed {
            explanations.insert(0, self.explanation(refined, &certain));
        }
        if explanations.is_empty() && !certain.is_empty() {
            explanations.push(Explanation {
                gain: certain[0].gain,
                score: certain[0].gain,
                effects: certain,
                share: 1.0,
                remainder_p: Some(self.p),
                remainder: None,
            });
        }
        let no_controller = matches!(decide, Decided::NoController { .. });
        let matters = self.remainder.1 < SIGNIFICANT_P && self.remainder.0 > MATTERS;
        let verdict = match &self.unlisted {
            _ if no_controller => Verdict::Unexplained,
            Some(Unnamed { refined: None, .. }) => Verdict::Unexplained,
            Some(_) if matters => Verdict::PartlyExplained,
            None if explanations.is_empty() => Verdict::Faithful,
            None if matters => Verdict::PartlyExplained,
            _ => Verdict::Explained,
        };
        let cause = if no_controller {
            Some(Cause {
                stage: Stage::Decide,
                acts_on: "command".into(),
                depends_on: "reading".into(),
            })
        } else {
            self.unlisted.as_ref().map(|unnamed| unnamed.cause.clone())
        };
        let indistinguishable = indistinguishable(explanations.iter(), ALTERNATIVE);
        let runs = self.evidence.runs().last().map_or(0, |last| last + 1);
        let mut answer = Answer {
            verdict,
            explanations,
            indistinguishable,
            left_out: Vec::new(),
            cause,
        };
        answer.left_out = self.without_each(runs, unnamed.or(self.found.first()), &answer);
        LogDiagnosis {
            answer,
            decide,
            p: if self.step.is_some() { 0.0 } else { self.p },
            channels: self.channels,
            corners,
            steps: self.steps,
            detectable: self.detectable,
        }
    }

    /// The effects that need no fit: the controller's, and the multiples that readings were rounded to.
    fn certain(&self, decide: &Decided) -> Vec<Candidate> {
        let mut certain = match decide {
            Decided::Changed(effects) => effects.clone(),
            _ => Vec::new(),
        };
        certain.extend(self.step.and_then(|counts| {
            let spec = find("reading-step").ok()?;
            Some(Candidate {
                setting: Setting::constant(spec, [counts]),
                standard_errors: vec![2e-4 * counts],
                gain: self.step_gain,
                fitted: 1,
            })
        }));
        certain
    }

    fn explanation(&self, refined: &Refined, certain: &[Candidate]) -> Explanation {
        let own = (refined.settings.iter())
            .zip(&refined.standard_errors)
            .map(|(setting, errors)| Candidate {
                setting: setting.clone(),
                standard_errors: errors.clone(),
                gain: refined.gain,
                fitted: errors.iter().filter(|error| **error > 0.0).count(),
            });
        let is_best = self
            .found
            .first()
            .is_none_or(|best| best.settings == refined.settings);
        Explanation {
            effects: certain.iter().cloned().chain(own).collect(),
            gain: refined.gain,
            score: refined.score(),
            share: refined.gain / (refined.gain + self.left_beside(refined)).max(1e-9),
            remainder_p: is_best.then_some(self.remainder.1),
            remainder: None,
        }
    }

    /// Log-likelihood that further effects would gain beside the best explanation; other explanations lack what they gain
    /// less than the best.
    fn left_beside(&self, refined: &Refined) -> f64 {
        let best = self.found.first().map_or(0.0, |best| best.gain);
        let left = best * self.remainder.0 / (1.0 - self.remainder.0).max(1e-9);
        left + (best - refined.gain).max(0.0)
    }

    /// The answer's effects with sizes fitted to all runs but one, for each of so many runs.
    fn without_each(&self, runs: usize, best: Option<&Refined>, answer: &Answer) -> Vec<Vec<Setting>> {
        let whole = answer.settings();
        let Some(best) = best.filter(|_| !whole.is_empty()) else {
            return vec![whole; runs];
        };
        let variants = [self.variants.as_slice(), &unlisted_variants()].concat();
        let refitted = best.refit_without_each(&self.evidence, &variants, runs);
        let certain = whole.len().saturating_sub(best.settings.len());
        let without = |(run, refitted): (usize, Vec<Setting>)| {
            let mut settings = whole.clone();
            settings.truncate(certain);
            settings.extend(refitted);
            for setting in &mut settings {
                if let Pattern::ByRun(values) = &mut setting.pattern {
                    *setting = Setting {
                        spec: setting.spec,
                        pattern: Pattern::ByRun(with_mean_of_others(values, run)),
                    };
                }
            }
            settings
        };
        refitted.into_iter().enumerate().map(without).collect()
    }
}

/// The values of runs with those of one replaced by the mean of the others'.
fn with_mean_of_others(values: &[Vec<f64>], run: usize) -> Vec<Vec<f64>> {
    let mut replaced = values.to_vec();
    let others = values.len() as f64 - 1.0;
    if others > 0.0 && run < values.len() {
        for i in 0..values[run].len() {
            let sum: f64 = values.iter().map(|v| v[i]).sum();
            replaced[run][i] = (sum - values[run][i]) / others;
        }
    }
    replaced
}

/// A cause without a name: its best coefficients, unless it is noise.
#[derive(Debug)]
struct Unnamed {
    cause: Cause,
    refined: Option<Refined>,
}

/// Noise that no normal distribution has: innovations with heavy tails that are no edges of readings, and that are worth more than
/// `small` units of log-likelihood.
fn rough(channels: &[Channel; MEASURED], small: f64) -> Option<Unnamed> {
    let heavy = |channel: &Channel| {
        let count = channel.count.max(1) as f64;
        let excess = channel.kurtosis - 3.0;
        // What a law with that fourth cumulant gains over the normal one, to second order (Edgeworth's series).
        let gain = count * excess * excess / 48.0;
        excess > 0.3 && excess > 10.0 * (24.0 / count).sqrt() && gain > small
    };
    let camera = channels[..2].iter().any(heavy);
    let readings = channels[2..].iter().filter(|channel| heavy(channel)).count();
    if !camera && readings == 0 {
        return None;
    }
    let (stage, acts_on) = match (camera, readings) {
        (true, 0) => (Stage::Observe, "camera"),
        (false, 1 | 2) => (Stage::Sense, "reading"),
        _ => (Stage::Act, "wheel speed"),
    };
    Some(Unnamed {
        cause: Cause {
            stage,
            acts_on: acts_on.into(),
            depends_on: "chance".into(),
        },
        refined: None,
    })
}

/// Steps of a refinement at most, and those after which what is far behind is left where it is.
const STEPS: usize = 8;
const FIRST_STEPS: usize = 2;

/// The score from which, after the first steps, a candidate may still become the best one of these.
fn least_in_reach<'a>(first: impl Iterator<Item = &'a Refined>) -> f64 {
    /// Log-likelihood, and share of the best one's, by which what lies behind does not come back.
    const BEHIND: (f64, f64) = (30.0, 0.06);
    let best = first.map(Refined::score).fold(0.0, f64::max);
    best - BEHIND.0.max(BEHIND.1 * best)
}

/// Those of a constant size.
fn constant(leads: &[Lead]) -> Vec<Lead> {
    (leads.iter().filter(|lead| lead.by == By::Constant))
        .cloned()
        .collect()
}

/// The logs filtered with settings, and what variants gain beside these.
fn screened<'a>(evidence: &Evidence<'a>, settings: &[Setting], variants: &[Variant]) -> Option<Screened<'a>> {
    let traces = evidence.traces(settings)?;
    let normals = normals(&traces, variants).ok()?;
    let leads = leads(evidence, variants, &normals);
    Some((traces, leads))
}

/// The best score of some variants beside settings.
fn most_left(evidence: &Evidence<'_>, settings: &[Setting], variants: &[Variant]) -> Option<f64> {
    screened(evidence, settings, variants).map(|(_, leads)| most(&leads))
}

/// The best score.
fn most(leads: &[Lead]) -> f64 {
    leads.iter().map(Lead::score).fold(0.0, f64::max)
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
