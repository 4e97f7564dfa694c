//! Single effects: which of what was screened is worth a simulation, and what becomes of it.

use rayon::prelude::*;

use super::hypothesis::Hypothesis;
use super::rounds::ROUNDS;
use super::screen::Screened;
use super::search::{Found, Search, WEAK, sort};

impl Search<'_> {
    /// The best single effects, tried to the end, best first.
    pub(super) fn singles(&self, screened: &[Screened]) -> Vec<Found> {
        let listed = self.shortlist(screened);
        let auditioned = self.auditioned(screened, &listed);
        let starts: Vec<&Hypothesis> = (listed.into_iter().chain(auditioned))
            .map(|s| &s.hypothesis)
            .collect();
        let found = self.try_rounds(starts.iter().copied(), &ROUNDS);
        let shows = |found: &Found| found.hypothesis.patterns_show(&found.errors);
        if found.first().is_none_or(shows) {
            return found;
        }
        // Sizes that go over the runs by chance gain by chance, and kept others from being tried to the end.
        let mut plain: Vec<Hypothesis> = Vec::new();
        for start in starts {
            let start = start
                .without_patterns(self.atlas())
                .unwrap_or_else(|| start.clone());
            if !plain.iter().any(|other| other.probes() == start.probes()) {
                plain.push(start);
            }
        }
        let mut again = self.try_rounds(plain.iter(), &ROUNDS);
        again.extend(found.into_iter().filter(shows));
        sort(&mut again);
        again
    }

    /// Of a weak signal the effects beside a shortlist that are likeliest at the sizes that a screening found: by the noise of its
    /// paths it tells little of them.
    fn auditioned<'s>(&self, screened: &'s [Screened], listed: &[&'s Screened]) -> Vec<&'s Screened> {
        const HEARD: usize = 20;
        const SHARE: f64 = 0.5;
        /// Data sets by which those that are left are told apart, and how many of them then are (a race).
        const RACE: [(u64, usize); 2] = [(3, 10), (8, 4)];
        let Some(best) = screened.first().filter(|best| best.score < WEAK) else {
            return Vec::new();
        };
        let probe = |s: &Screened| &self.atlas().probes[s.probe()];
        let mut heard: Vec<&Screened> = Vec::new();
        for candidate in screened {
            let known = |other: &&Screened| probe(other).acts_like(probe(candidate));
            let constant = candidate.hypothesis.is_constant();
            let new = !listed.iter().any(known) && !heard.iter().any(known);
            let may_win = candidate.may_win(best, SHARE);
            if heard.len() < HEARD && may_win && constant && new && !self.jumps(&candidate.hypothesis) {
                heard.push(candidate);
            }
        }
        let score = |candidate: &'s Screened, sets: u64| {
            let simulated = (self.trial).evaluate(&candidate.hypothesis, self.atlas().enough(sets, 1))?;
            let fit = self.trial.fit(&simulated)?;
            Some((self.atlas().score_of(&candidate.hypothesis, fit.gain), candidate))
        };
        for (sets, taken) in RACE {
            let scored = (heard.into_par_iter()).filter_map(|candidate| score(candidate, sets));
            let mut scored: Vec<(f64, &Screened)> = scored.collect();
            scored.sort_by(|a, b| b.0.total_cmp(&a.0));
            heard = (scored.into_iter().take(taken))
                .map(|(_, candidate)| candidate)
                .collect();
        }
        heard
    }

    /// The screened hypotheses worth a simulation: each probe in its best pattern, and without it, of one effect the best two.
    /// What acts at a place was screened at a coarse grid of places with one length, and is given more room.
    pub(super) fn shortlist<'s>(&self, screened: &'s [Screened]) -> Vec<&'s Screened> {
        const MOST: usize = 7;
        const OF_ONE_EFFECT: usize = 2;
        let Some(best) = screened.first() else {
            return Vec::new();
        };
        let spec = |s: &Screened| self.atlas().probes[s.probe()].spec;
        let mut list: Vec<&Screened> = Vec::new();
        for candidate in screened {
            if list.len() == MOST {
                break;
            }
            let share = if self.atlas().probes[candidate.probe()].has_place() {
                0.4
            } else {
                0.7
            };
            if !candidate.may_win(best, share) {
                continue;
            }
            let of_probe = |s: &&&Screened| s.probe() == candidate.probe();
            // A size by run may come first by the faults of a path alone.
            let plain = |s: &Screened| s.hypothesis.is_constant();
            let seen = list
                .iter()
                .filter(of_probe)
                .any(|s| plain(s) || !plain(candidate));
            let alike = list.iter().filter(|s| spec(s) == spec(candidate) && !of_probe(s));
            if !seen && alike.count() < OF_ONE_EFFECT {
                list.push(candidate);
            }
        }
        list
    }
}
