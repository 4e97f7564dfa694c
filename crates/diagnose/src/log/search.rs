//! The search for effects through what linear algebra ranks and refinements decide.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use sim::{Setting, World};

use super::catalogue::Variant;
use super::channels::{Channel, channels};
use super::detectable::detectable;
use super::evidence::{Asked, Evidence};
use super::filter::{MEASURED, Trace};
use super::leads::{By, Lead, leads, least_p, most, shortlist};
use super::noise::{Factor, by_chance, detectable_noises, noises, p_among, p_among_repeats, with_memory};
use super::pairs::Pair;
use super::refine::jumps;
use super::refined::{Refined, pursue};
use super::repeat::{p_in_repeats, repeats};
use super::screen::normals;
use super::unnamed::Unnamed;
use crate::candidate::label;
use crate::laps::SIGNIFICANT_P;
use crate::{Detectable, Error};

/// A probability below which something is there: one false alarm in a hundred data sets.
const ALARM: f64 = 0.01;
/// Share of a gain that faults of the model may take: at very high signal none is exact.
pub(super) const FAULTS: f64 = 0.01;
/// Share of the explained log-likelihood that a remainder may have at very high signal.
pub(super) const MATTERS: f64 = 0.02;
/// Leads that are refined.
pub(super) const PROMISING: usize = 8;
/// Steps of a refinement at most, and those after which what is far behind is left where it is.
pub(super) const STEPS: usize = 8;
pub(super) const FIRST_STEPS: usize = 2;

/// Shares of the best score with which a single effect may change places with it, and with which it is not far behind.
pub(super) const RIVAL: f64 = 0.8;
pub(super) const NOT_FAR: f64 = 0.5;

/// What further effects would gain beside an explanation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Remainder {
    /// The effects of that explanation.
    pub(super) beside: Vec<Setting>,
    /// Log-likelihood that they gain.
    pub(super) gain: f64,
    /// Its share of what both gain together.
    pub(super) share: f64,
    /// Probability of as much by chance.
    pub(super) p: f64,
}

impl Remainder {
    const NONE: Self = Self {
        beside: Vec::new(),
        gain: 0.0,
        share: 0.0,
        p: 1.0,
    };

    pub(super) fn matters(&self) -> bool {
        self.p < SIGNIFICANT_P && self.share > MATTERS
    }
}

/// The state of the search for effects.
pub(super) struct Search<'a> {
    pub(super) evidence: Evidence<'a>,
    pub(super) variants: Vec<Variant>,
    /// Log-likelihood of the declared model, by stretch.
    pub(super) base: Vec<f64>,
    /// Candidates with their best values, best first.
    pub(super) found: Vec<Refined>,
    /// Probability that as much is found in the logs of a robot that is as declared.
    pub(super) p: f64,
    /// Beside the answer, or else beside the best candidate.
    pub(super) remainder: Remainder,
    /// A cause without a name, if that is the answer.
    pub(super) unnamed: Option<Unnamed>,
    /// Under the same.
    pub(super) channels: [Channel; MEASURED],
    /// Step that the readings were rounded to, counts, and what it gains in log-likelihood.
    pub(super) rounding_counts: Option<f64>,
    pub(super) rounding_gain: f64,
    /// Control steps that are used.
    pub(super) control_steps: usize,
    pub(super) detectable: Vec<Detectable>,
    /// The last screenings and their settings, the latest last.
    screened: Vec<(Vec<Setting>, Arc<Screened<'a>>)>,
    /// The best pairs over the columns of the declared model, once they were asked for.
    pub(super) joint: OnceLock<Vec<Pair>>,
    /// The group of basis functions that explains most, once that was asked for.
    pub(super) by_groups: OnceLock<Option<Refined>>,
}

/// Every run in its world, filtered, and the leads over them.
type Screened<'a> = (Vec<(World<'a>, Trace)>, Vec<Lead>);

impl<'a> Search<'a> {
    pub(super) fn new(evidence: Evidence<'a>, rounding_counts: Option<f64>) -> Result<Self, Error> {
        let traces = evidence.traces(&[]).ok_or(Error::NoLog)?;
        let base: Vec<f64> = traces.iter().map(|(_, trace)| trace.log_likelihood).collect();
        let unrounded = Evidence {
            step_counts: 0.0,
            asked: Asked::nothing(),
            ..evidence.elsewhere(evidence.scene)
        };
        let rounding_gain = match rounding_counts {
            Some(_) => base.iter().sum::<f64>() - unrounded.likelihood(&[]).unwrap_or(f64::NEG_INFINITY),
            None => 0.0,
        };
        Ok(Self {
            variants: evidence.variants(),
            channels: channels(&traces),
            control_steps: traces.iter().map(|(_, trace)| trace.instants.len()).sum(),
            base,
            evidence,
            found: Vec::new(),
            p: 1.0,
            remainder: Remainder::NONE,
            unnamed: None,
            rounding_counts,
            rounding_gain,
            detectable: Vec::new(),
            screened: Vec::new(),
            joint: OnceLock::new(),
            by_groups: OnceLock::new(),
        })
    }

    pub(super) fn total(&self) -> f64 {
        self.base.iter().sum()
    }

    /// The screening of all variants at given settings.
    pub(super) fn screen(&mut self, settings: &[Setting]) -> Option<Arc<Screened<'a>>> {
        /// What is come back to: the best effect, after another look at a cause without a name.
        const KEPT: usize = 2;
        if let Some((_, found)) = self.screened.iter().find(|screened| screened.0 == settings) {
            return Some(Arc::clone(found));
        }
        let found = Arc::new(screened(&self.evidence, settings, &self.variants)?);
        if self.screened.len() == KEPT {
            self.screened.remove(0);
        }
        self.screened.push((settings.to_vec(), Arc::clone(&found)));
        Some(found)
    }

    /// Single effects; `None` if there is nothing to explain, else the leads at the declared model.
    pub(super) fn alone(&mut self) -> Option<Vec<Lead>> {
        let leads = self.screen(&[])?.1.clone();
        self.detectable = detectable(&leads, &self.variants, ALARM);
        (self.detectable).extend(detectable_noises(&self.evidence, self.total(), ALARM));
        let noise = noises(&self.evidence, &[], self.total());
        let by_mean = self.p_by_mean(&leads);
        self.p = by_mean.min(if by_mean < ALARM {
            by_chance(&noise)
        } else {
            p_among_repeats(&self.evidence, &[], &noise, ALARM, 0.0)
        });
        if self.p >= ALARM {
            return None;
        }
        let list = self.promising(shortlist(&leads, &self.variants, PROMISING));
        let list = self.once_if_they_jump(list);
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
        if self.rounding_counts.is_none() || p >= ALARM {
            return p;
        }
        let best = self.variants_of(&shortlist(leads, &self.variants, PROMISING));
        let of_log = |repeated: &Evidence<'_>| Some(most_left(repeated, &[], &best)?.max(LEAST).ln());
        let own = most(leads).max(LEAST).ln();
        let among = |logs: &[f64]| p_among(own, logs).map_or(p, |among| p.max(among));
        p_in_repeats(&self.evidence, &[], of_log, among)
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

    /// The leads but for those to a further constant size of an effect that jumps: a hunt tries the others.
    fn once_if_they_jump(&self, list: Vec<Lead>) -> Vec<Lead> {
        let mut kept: Vec<Lead> = Vec::new();
        for lead in list {
            let setting = lead.start(&self.variants[lead.variant]);
            let is_same =
                |other: &Lead| other.by == By::Constant && self.variants[other.variant].spec == setting.spec;
            let again = lead.by == By::Constant && jumps(&setting) && kept.iter().any(is_same);
            if !again {
                kept.push(lead);
            }
        }
        kept
    }

    pub(super) fn variants_of(&self, leads: &[Lead]) -> Vec<Variant> {
        let variant = |lead: &Lead| self.variants[lead.variant].clone();
        leads.iter().map(variant).collect()
    }

    /// The effects of the best candidate; none if there is none.
    pub(super) fn best(&self) -> &[Setting] {
        self.found.first().map_or(&[], |best| &best.settings)
    }

    pub(super) fn best_in_words(&self) -> String {
        let labels: Vec<String> = self.best().iter().map(label).collect();
        labels.join(" + ")
    }

    /// The effects of the best candidates, which may change places where other readings count.
    pub(super) fn rivals(&self) -> impl Iterator<Item = &[Setting]> {
        const MOST: usize = 3;
        let best = self.found.first().map_or(0.0, Refined::score);
        (self.found.iter().take(MOST))
            .filter(move |other| other.score() >= RIVAL * best)
            .map(|other| other.settings.as_slice())
    }

    /// The same search with other evidence, its candidates refined again by it, but for those far behind: single effects with less than
    /// a share of the best score. Of several effects most is known already.
    pub(super) fn renewed<'b>(self, evidence: Evidence<'b>, share: f64) -> Result<Search<'b>, Error> {
        let mut renewed = Search::new(evidence, self.rounding_counts)?;
        let best = self.found.first();
        let least = match best {
            Some(best) if best.settings.len() == 1 => share * best.score(),
            _ => least_in_reach(best.into_iter()),
        };
        let base = renewed.total();
        let again = |found: &Refined| {
            if found.score() < least {
                found.judged_by(&renewed.evidence, base)
            } else {
                found.again(&renewed.evidence, &renewed.variants, base, STEPS)
            }
        };
        let found = self.found.par_iter().filter_map(again).collect();
        (renewed.p, renewed.detectable, renewed.found) = (self.p, self.detectable, found);
        renewed.sort();
        Ok(renewed)
    }

    /// The effects of the best candidate refined again by other evidence.
    pub(super) fn best_by(&self, evidence: &Evidence<'_>) -> Option<Vec<Setting>> {
        let base = evidence.likelihood(&[])?;
        let again = self.found.first()?.again(evidence, &self.variants, base, STEPS)?;
        Some(again.settings)
    }

    /// Whether what is left matters, and how well the answer's sizes are known.
    pub(super) fn finish(&mut self) {
        if let Some(best) = self.found.first().cloned() {
            self.settle(&best);
        }
        self.judge();
        self.settle_beside_unnamed();
        if let (Some(best), None, None) = (self.found.first_mut(), self.rounding_counts, &self.unnamed) {
            *best = best.clone().with_honest_errors(&self.evidence, &self.variants);
        }
        if let Some(twin) = self.found.first().and_then(with_memory) {
            self.found.insert(1, twin);
        }
    }

    pub(super) fn sort(&mut self) {
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

    /// Notes what is left beside an explanation, and what gains most there; `None` if it cannot drive so.
    pub(super) fn settle(&mut self, explanation: &Refined) -> Option<Arc<Screened<'a>>> {
        let screened = self.screen(&explanation.settings)?;
        let (traces, leads) = &*screened;
        self.channels = channels(traces);
        let (left, gain) = (most(leads), explanation.gain);
        self.remainder = Remainder {
            beside: explanation.settings.clone(),
            gain,
            share: left / (left + gain).max(1e-9),
            p: least_p(leads),
        };
        Some(screened)
    }

    /// Notes what is left beside a cause without a name. Not beside a wheel out of round: it begins each run at another angle, and its
    /// amplitude alone, which the runs share, cannot be filtered.
    fn settle_beside_unnamed(&mut self) {
        let unnamed = self.unnamed.as_ref().filter(|unnamed| !unnamed.is_a_wheel());
        let Some(refined) = unnamed.and_then(|unnamed| unnamed.refined.clone()) else {
            return;
        };
        self.settle(&refined);
    }
}

/// The score from which, after the first steps, a candidate may still become the best one of these.
pub(super) fn least_in_reach<'a>(first: impl Iterator<Item = &'a Refined>) -> f64 {
    /// Log-likelihood, and share of the best one's, by which what lies behind does not come back.
    const BEHIND: (f64, f64) = (30.0, 0.06);
    let best = first.map(Refined::score).fold(0.0, f64::max);
    best - BEHIND.0.max(BEHIND.1 * best)
}

/// The logs filtered with settings, and what variants gain beside these.
pub(super) fn screened<'a>(
    evidence: &Evidence<'a>,
    settings: &[Setting],
    variants: &[Variant],
) -> Option<Screened<'a>> {
    let traces = evidence.traces(settings)?;
    let normals = normals(&traces, variants).ok()?;
    let leads = leads(evidence, variants, &normals);
    Some((traces, leads))
}

/// The best score of some variants beside settings.
pub(super) fn most_left(evidence: &Evidence<'_>, settings: &[Setting], variants: &[Variant]) -> Option<f64> {
    screened(evidence, settings, variants).map(|(_, leads)| most(&leads))
}
