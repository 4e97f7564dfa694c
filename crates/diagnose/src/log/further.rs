//! Further effects beside the best one, and the best pairs.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::evidence::Evidence;
use super::leads::{By, Lead, most, of_constant_size, shortlist};
use super::noise::{Factor, by_chance, is_noise, noises, p_among_repeats};
use super::pairs::{Pair, pairs};
use super::refined::Refined;
use super::repeat::repeats;
use super::search::{
    FAULTS, FIRST_STEPS, MATTERS, PROMISING, STEPS, Search, least_in_reach, most_left, screened,
};
use crate::laps::SIGNIFICANT_P;

impl Search<'_> {
    /// Looks for one more effect beside the best candidate, and beside one of one effect for the best pairs, if that leaves more than it
    /// does in logs that have nothing else; whether the best candidate has other effects then.
    pub(super) fn one_more(&mut self, first: &[Lead]) -> bool {
        let effects = |search: &Self| {
            search
                .found
                .first()
                .map(|best| (best.settings.len(), best.names()))
        };
        let before = effects(self);
        self.look_beside_best(first);
        effects(self) != before
    }

    fn look_beside_best(&mut self, first: &[Lead]) {
        let Some(best) = self.found.first().cloned() else {
            return;
        };
        let Some(screened) = self.settle(&best) else {
            return;
        };
        let (_, leads) = &*screened;
        let faults = FAULTS * best.gain;
        let means = if self.remainder.p < SIGNIFICANT_P {
            self.means_beside(&best, leads, faults)
        } else {
            f64::INFINITY
        };
        let has_mean = most(leads) >= means;
        // Where something with a mean is left, that alone makes noise seem larger.
        let may_be_louder = self.remainder.share < MATTERS || self.remainder.p >= SIGNIFICANT_P;
        let mut more = self.noise_beside(&best, faults, may_be_louder);
        if has_mean {
            let mut starts = self.beside(&best, leads);
            if best.settings.len() == 1 {
                starts.extend(self.joint(first).iter().map(Refined::of_pair));
            }
            more.extend(self.pursued_together(starts));
        }
        if more.is_empty() {
            return;
        }
        // An effect that linear algebra did not see may do without one of the others.
        let several = more.iter().max_by(|a, b| a.score().total_cmp(&b.score()));
        let fewer = several.map_or(Vec::new(), |several| self.without_one(several));
        let better = fewer.into_iter().filter(|fewer| fewer.score() > best.score());
        self.found.extend(better);
        self.sort();
        let best = self.found[0].clone();
        // Each further value must gain ten.
        let owed = if has_mean { means } else { 0.0 };
        more.retain(|several| {
            let values = several.fitted.saturating_sub(best.fitted).max(1) as f64;
            several.gain - best.gain > (10.0 * values).max(owed)
        });
        more.iter_mut().for_each(|several| several.faults = owed);
        self.found.extend(more);
        self.sort();
    }

    /// Looks, where the best candidate of several effects leaves what matters, for others in place of each of them, and where it leaves
    /// anything for others in place of noise: the first effects stood for a part of those that were not found yet, and noise for
    /// several of them. Whether there is a better candidate then.
    pub(super) fn exchange(&mut self) -> bool {
        /// Leads in place of an effect.
        const EACH: usize = 3;
        /// Log-likelihood that is worth it.
        const BETTER: f64 = 10.0;
        let Some(best) = self.found.first().filter(|best| best.settings.len() > 1).cloned() else {
            return false;
        };
        if self.settle(&best).is_none() || self.remainder.p >= SIGNIFICANT_P {
            return false;
        }
        let matters = self.remainder.matters();
        let may_stand_for_others = |place: &usize| matters || is_noise(&best.settings[*place]);
        let in_place_of = |place: usize| {
            let (less, own) = (best.less(place), best.settings[place].spec);
            let screened = screened(&self.evidence, &less.settings, &self.variants);
            let leads = screened.map_or(Vec::new(), |(_, leads)| leads);
            let list = shortlist(&of_constant_size(&leads), &self.variants, EACH + 1);
            (list.iter())
                .map(|lead| (lead, &self.variants[lead.variant]))
                .filter(|(_, variant)| variant.spec != own)
                .take(EACH)
                .map(|(lead, variant)| less.with(lead.in_pattern(variant, &self.evidence)))
                .collect::<Vec<_>>()
        };
        let places = (0..best.settings.len()).filter(may_stand_for_others);
        let starts: Vec<Refined> = places.flat_map(in_place_of).collect();
        let mut others = self.pursued_together(starts);
        others.retain(|other| other.score() > best.score() + BETTER);
        let is_better = !others.is_empty();
        self.found.extend(others);
        self.sort();
        is_better
    }

    /// Log-likelihood that a column must gain beside the best candidate to be more than a fault of the filter, which is linear
    /// about its pose: a share of what that one gains itself, or less, if that is more than is gained so in simulated logs that have
    /// nothing else. Readings in coarse steps have likelihoods that linear algebra does not know.
    fn means_beside(&self, best: &Refined, leads: &[Lead], share: f64) -> f64 {
        const TIMES: f64 = 2.0;
        if most(leads) >= share || self.evidence.is_coarse() {
            return share;
        }
        let promising = self.variants_of(&shortlist(leads, &self.variants, PROMISING));
        let left = |repeated: &Evidence<'_>| {
            let again = best.refit(repeated, &self.variants);
            most_left(repeated, &again, &promising)
        };
        let usually = repeats(&self.evidence, &best.settings, left);
        share.min(TIMES * usually.into_iter().fold(0.0, f64::max))
    }

    /// The noise effect that gains most beside the best candidate and its rivals, if simulated logs do not have as much of it.
    fn noise_beside(&self, best: &Refined, faults: f64, may_be_louder: bool) -> Vec<Refined> {
        /// Log-likelihood that is worth a further value.
        const WORTH: f64 = 10.0;
        let noise = noises(&self.evidence, &best.settings, self.total() + best.gain);
        if by_chance(&noise) >= SIGNIFICANT_P {
            return Vec::new();
        }
        // See `means_beside`.
        let worth = if self.evidence.is_coarse() {
            faults.max(WORTH)
        } else {
            WORTH
        };
        let largest = (noise.into_iter())
            .filter(|noise| noise.gain > worth && (may_be_louder || noise.is_quieter()))
            .max_by(|a, b| a.gain.total_cmp(&b.gain));
        let is_sure = |noise: &Factor| {
            let one = std::slice::from_ref(noise);
            p_among_repeats(&self.evidence, &best.settings, one, SIGNIFICANT_P, faults) < SIGNIFICANT_P
        };
        (largest.filter(is_sure)).map_or(Vec::new(), |noise| self.beside_rivals(&noise, best))
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
                let both = noise.refined(&self.evidence, &one.settings, base)?.after(one);
                Some(both.further(&self.evidence, &self.variants, self.total(), FIRST_STEPS))
            })
            .collect()
    }

    /// Several effects less each of them, refined from where they are.
    fn without_one(&self, several: &Refined) -> Vec<Refined> {
        (0..several.settings.len())
            .into_par_iter()
            .map(|left_out| {
                several
                    .less(left_out)
                    .further(&self.evidence, &self.variants, self.total(), STEPS)
            })
            .collect()
    }

    /// The best candidate with each of the leads that are left beside it, where a refinement of all begins: of constant size, and what
    /// goes by run or by time if it is ahead of these.
    fn beside(&self, best: &Refined, leads: &[Lead]) -> Vec<Refined> {
        const CONSTANT: usize = 3;
        let mut list = shortlist(&of_constant_size(leads), &self.variants, CONSTANT);
        let first = shortlist(leads, &self.variants, 1);
        list.extend(first.into_iter().filter(|lead| lead.by != By::Constant));
        (list.iter())
            .map(|lead| best.with(lead.in_pattern(&self.variants[lead.variant], &self.evidence)))
            .collect()
    }

    /// The best pairs over the columns of the declared model, which rank the leads.
    pub(super) fn joint(&self, leads: &[Lead]) -> &[Pair] {
        const AMONG: usize = 36;
        self.joint.get_or_init(|| {
            let list = shortlist(&of_constant_size(leads), &self.variants, AMONG);
            let list: Vec<usize> = list.iter().map(|lead| lead.variant).collect();
            let traces = self.evidence.traces(&[]);
            traces.map_or(Vec::new(), |traces| {
                pairs(&self.evidence, &traces, &self.variants, &list, 3).unwrap_or_default()
            })
        })
    }

    /// Several effects refined together, the best of every list of names: a few steps, then to the end those that may still be the best
    /// of all.
    fn pursued_together(&self, starts: Vec<Refined>) -> Vec<Refined> {
        let steps = |one: Refined, steps| one.further(&self.evidence, &self.variants, self.total(), steps);
        let mut first: Vec<Refined> = (starts.into_par_iter())
            .map(|start| steps(start, FIRST_STEPS))
            .collect();
        first.sort_by(|a, b| b.score().total_cmp(&a.score()));
        let mut names = BTreeSet::new();
        first.retain(|one| names.insert(one.names()));
        let least = least_in_reach(first.iter());
        let (hopeful, others): (Vec<Refined>, Vec<Refined>) =
            (first.into_iter()).partition(|one| one.score() >= least);
        let refined: Vec<Refined> = (hopeful.into_par_iter())
            .map(|one| steps(one, STEPS - FIRST_STEPS))
            .collect();
        let least = least_in_reach(refined.iter());
        let (hopeful, behind): (Vec<Refined>, Vec<Refined>) =
            (refined.into_iter()).partition(|one| one.score() >= least);
        (hopeful.into_par_iter())
            .map(|one| one.hunted(&self.evidence, &self.variants, self.total()))
            .chain(behind)
            .chain(others)
            .collect()
    }
}
