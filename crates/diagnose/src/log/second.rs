//! A second effect beside the best one, and the best pairs.

use std::collections::BTreeSet;

use rayon::prelude::*;
use sim::Setting;

use super::catalogue::Variant;
use super::leads::{By, Lead, of_constant_size, shortlist};
use super::noise::{Factor, by_chance, noises, p_among_repeats};
use super::pairs::{Pair, pairs};
use super::refine::jumps;
use super::refined::{Refined, together};
use super::search::{FAULTS, FIRST_STEPS, MATTERS, SIGNIFICANT_P, STEPS, Search, least_in_reach};

/// Two effects, each with the setting where a refinement of both begins.
type Parts = [(Variant, Setting); 2];

impl Search<'_> {
    /// Looks for a second effect beside the best one, and for the best pairs.
    pub(super) fn second(&mut self, first: &[Lead]) {
        let Some(best) = self.found.first().cloned() else {
            return;
        };
        let Some(screened) = self.settle(&best) else {
            return;
        };
        let (_, leads) = &*screened;
        let noise = noises(&self.evidence, &best.settings, self.total() + best.gain);
        let left = noise.iter().map(|n| n.gain).fold(0.0, f64::max) / best.gain.max(1e-9);
        if self.remainder.p.min(by_chance(&noise)) >= SIGNIFICANT_P || self.remainder.share.max(left) < FAULTS
        {
            return;
        }
        let mut more: Vec<Refined> = Vec::new();
        if self.remainder.share < MATTERS || self.remainder.p >= SIGNIFICANT_P {
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
            starts.extend(self.joint(first).iter().map(|pair| self.start_of(pair)));
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
        self.settle(&best);
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

    /// The best effect with each of the leads that are left beside it, where a refinement of the two begins.
    fn beside(&self, best: &Refined, leads: &[Lead]) -> Vec<Parts> {
        let Some(of_best) = Variant::of(&best.settings[0], &self.variants) else {
            return Vec::new();
        };
        let list = shortlist(&of_constant_size(leads), &self.variants, 3);
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

    /// The best pairs over the columns of the declared model, which rank the leads.
    pub(super) fn joint(&self, leads: &[Lead]) -> &[Pair] {
        const AMONG: usize = 36;
        self.joint.get_or_init(|| {
            let list = shortlist(&of_constant_size(leads), &self.variants, AMONG);
            let list: Vec<usize> = list.iter().map(|lead| lead.variant).collect();
            let traces = self.evidence.traces(&[]);
            traces.map_or(Vec::new(), |traces| {
                pairs(&traces, &self.variants, &list, 3).unwrap_or_default()
            })
        })
    }

    fn start_of(&self, pair: &Pair) -> Parts {
        let part = |(i, setting): &(usize, Setting)| (self.variants[*i].clone(), setting.clone());
        pair.parts.each_ref().map(part)
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
}
