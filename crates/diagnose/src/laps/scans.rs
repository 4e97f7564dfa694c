//! Effects whose action jumps with their size, at sizes all over their range: derivatives say nothing of them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, White};
use super::beside::{Base, difference, explains};
use super::hunt::{Hunt, Look};
use super::hypothesis::Hypothesis;
use super::part::{Part, Shape};
use super::pieces::{Columns, Piece};
use super::probe::Probe;
use super::refine::Descent;
use super::rounds::{ROUNDS_OF_SEVERAL, near};
use super::search::{BASES, Found, Search, of_other_effects, sort};
use super::simulated::Draws;
use super::trial::Trial;
use super::verdict;

/// Pairs with an effect that jumps that are simulated before the best few are tried.
const HEARD: usize = 8;

/// What a probe that jumps leaves of the data beside a base at sizes all over its range.
#[derive(Debug, Clone)]
pub(super) struct Scan {
    probe: usize,
    /// Of one size to the one before.
    ratio: f64,
    /// What the base leaves without it, in squared distance beyond chance.
    excess: f64,
    looks: Vec<Look>,
}

/// A probe beside one that jumps, at the sizes that together leave least of the data.
pub(super) struct Beside {
    pub(super) score: f64,
    other: usize,
    other_size: f64,
    jumping: usize,
    size: f64,
    spacing: f64,
}

impl Beside {
    /// Whether another has the same effect that jumps at about the same size.
    fn is_about(&self, other: &Self) -> bool {
        self.jumping == other.jumping && (self.is_at_about(other.size) || other.is_at_about(self.size))
    }

    /// Whether its effect that jumps has about a size.
    fn is_at_about(&self, size: f64) -> bool {
        const SPACINGS: f64 = 1.5;
        (self.size - size).abs() < SPACINGS * self.spacing
    }
}

impl Scan {
    /// Hunts from the best of the sizes that leave less than their neighbours; from none that explain less than a fair share of what
    /// the base leaves.
    fn bottoms(&self, base: &Base, chance: f64) -> Vec<Hunt> {
        const FAIR_SHARE: f64 = 0.25;
        const MOST: usize = 3;
        let squares: Vec<f64> = self.looks.iter().map(Look::square).collect();
        let is_fair = |&i: &usize| squares[i] - chance < (1.0 - FAIR_SHARE) * self.excess;
        let hunt = |i: usize| {
            let size = self.looks[i].size;
            Hunt::new(base.clone(), self.probe, size, self.spacing(size)).leaving(squares[i])
        };
        (bottoms(&squares).into_iter().filter(is_fair).take(MOST))
            .map(hunt)
            .collect()
    }

    /// How far off a size may be.
    fn spacing(&self, size: f64) -> f64 {
        size * (self.ratio - 1.0)
    }
}

impl Trial<'_> {
    /// What a probe that jumps leaves beside a base, at the sizes at which it may explain a fair share of that; `None` where the base
    /// crashes.
    fn scan(&self, base: &Base, probe: usize) -> Option<Scan> {
        const SETS: u64 = 3;
        /// Excess, in units of what chance leaves, below which the noise of one data set would hide which size is best.
        const LITTLE: f64 = 3.0;
        let alone = base.hypothesis.parts.is_empty();
        let without = if alone {
            self.atlas.null.clone()
        } else {
            self.evaluate(&base.hypothesis, SETS)?.expectation
        };
        let chance = self.atlas.layout.len() as f64;
        let excess = self.left_beyond(base, &without).norm_squared() - chance;
        let closely = || {
            let second = if excess < LITTLE * chance { 1..2 } else { 0..1 };
            [Draws::Sets(0..1), Draws::Sets(second)]
        };
        let Probe { sizes, scanned, .. } = &self.atlas.probes[probe];
        let (ratio, sizes) = in_constant_ratio(sizes[0], sizes[sizes.len() - 1], *scanned);
        let sizes = self.may_explain(base, probe, sizes, excess);
        let looks = if alone {
            self.kept_looks(base, probe, &sizes, &closely())
        } else {
            let roughly = self.rough_draws(&base.hypothesis, excess / chance);
            self.looks_at_least(base, probe, &sizes, &roughly.unwrap_or_else(closely))
        };
        Some(Scan {
            probe,
            ratio,
            excess,
            looks,
        })
    }

    /// Draws that tell roughly what goes with a hypothesis that leaves so many times what chance does beyond that, unless their noise
    /// would hide it.
    fn rough_draws(&self, hypothesis: &Hypothesis, left: f64) -> Option<[Draws; 2]> {
        const ENOUGH: f64 = 0.8;
        let of_first_runs = self.first_runs_tell_all(&hypothesis.settings(self.atlas));
        (of_first_runs && left > ENOUGH).then_some([Draws::FirstRuns(0), Draws::FirstRuns(1)])
    }

    /// The sizes of a probe that jumps at which it may explain a fair share of what a base leaves: it does that much beside nothing, but
    /// for what the base's numbers follow, or a few times more or less.
    fn may_explain(&self, base: &Base, probe: usize, sizes: Vec<f64>, excess: f64) -> Vec<f64> {
        /// Squared actions that may explain it, in units of what the base leaves.
        const OF_EXCESS: Range<f64> = 0.01..10.0;
        let may = |&size: &f64| {
            let setting = self.atlas.probes[probe].setting(size);
            let action = self.kept_change(&[setting], &Draws::Sets(0..1));
            let square = |action: White| self.atlas.beyond(base, &action).norm_squared();
            action.is_some_and(|action| OF_EXCESS.contains(&(square(action) / excess)))
        };
        sizes.into_par_iter().filter(may).collect()
    }

    /// A probe that jumps with each of others that do not, at sizes close about the one to which it came alone: the best few. What the
    /// other does is simulated beside it, because rounding makes another thing of it. Only what a rough look shows to be the best is looked at
    /// closely; the look is the rougher the more the one leaves, as a multiple of what chance leaves.
    fn screen_about(&self, others: &[(usize, f64)], (probe, size): (usize, f64), left: f64) -> Vec<Beside> {
        const ROUGHLY: [Draws; 2] = [Draws::Sets(0..1), Draws::Sets(2..3)];
        const CLOSER: [Draws; 2] = [Draws::Sets(0..2), Draws::Sets(2..4)];
        const SIZES: u32 = 81;
        /// Share of the size to either side.
        const REACH: f64 = 0.004;
        const CLOSELY: usize = 12;
        let (ratio, mut sizes) = in_constant_ratio(size * (1.0 - REACH), size * (1.0 + REACH), SIZES);
        let hunt = Hunt::new(
            self.atlas.at_rest(Hypothesis::nothing()),
            probe,
            size,
            size * (ratio - 1.0),
        );
        let roughly = self.rough_draws(&hunt.base.hypothesis, left).unwrap_or(ROUGHLY);
        let mut best = self.beside_hunted(&hunt, &sizes, others, &roughly);
        best.truncate(CLOSELY);
        sizes.retain(|&size| best.iter().any(|best| best.is_at_about(size)));
        let others: Vec<(usize, f64)> = best.iter().map(|best| (best.other, best.other_size)).collect();
        let closer = self.beside_hunted(&hunt, &sizes, &others, &CLOSER);
        self.atlas.diverse_beside(closer, HEARD)
    }

    /// Each of other probes, with a size at which it is simulated beside one that jumps where that is hunted: both at their best, the
    /// one that jumps at one of some sizes close about there. The best first.
    fn beside_hunted(
        &self,
        hunt: &Hunt,
        sizes: &[f64],
        others: &[(usize, f64)],
        draws: &[Draws; 2],
    ) -> Vec<Beside> {
        let &Hunt {
            ref base,
            probe,
            size,
            spacing,
            ..
        } = hunt;
        let left = |settings: &[Setting]| self.left_twice(base, settings, draws);
        let jumping = self.atlas.probes[probe].setting(size);
        let Some(alone) = left(std::slice::from_ref(&jumping)) else {
            return Vec::new();
        };
        let looks = self.looks(base, probe, sizes, draws);
        let before = self.left_beyond(base, &self.atlas.null).norm_squared();
        let best_about = |&(other, other_size): &(usize, f64)| {
            let beside = left(&[jumping.clone(), self.atlas.probes[other].setting(other_size)])?;
            let action = difference(&alone, &beside);
            let at_look = |look: &Look| {
                let (multiple, gain) = explains(&action, &look.left, self.atlas.probes[other].odd);
                let gained = 0.5 * (before - look.square()) + gain;
                Beside {
                    score: self.atlas.score_of_pair([probe, other], gained),
                    other,
                    other_size: self.atlas.probes[other].times(other_size, multiple),
                    jumping: probe,
                    size: look.size,
                    spacing,
                }
            };
            let at_looks = looks.iter().map(at_look);
            at_looks.max_by(|a, b| a.score.total_cmp(&b.score))
        };
        let mut all: Vec<Beside> = others.par_iter().filter_map(best_about).collect();
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        all
    }
}

impl Atlas {
    /// Every probe that does not jump at its smallest sizes; to one side alone where the other does the opposite.
    fn smallest_sizes(&self) -> Vec<(usize, f64)> {
        let of_probe = |number: usize| {
            let probe = &self.probes[number];
            let sides = if probe.odd { 1 } else { 2 };
            let sizes = probe.smallest_sizes().into_iter().take(sides);
            sizes.map(move |size| (number, size))
        };
        (0..self.probes.len())
            .filter(|&probe| !self.probes[probe].jumps())
            .flat_map(of_probe)
            .collect()
    }

    /// The constant probes that do not jump which explain a residual best beside every scanned one, and better than alone, best first:
    /// of a probe that jumps few at a size and about it.
    fn screen_beside_scans(&self, residual: &White, scans: &[Scan], most: usize) -> Vec<Beside> {
        let pieces = self.smooth_pieces();
        let Columns { from, along } = Columns::of(&pieces);
        let (along_residual, from_residual) = (along.tr_mul(residual), from.tr_mul(residual));
        let mut alone: BTreeMap<usize, f64> = BTreeMap::new();
        for (i, piece) in pieces.iter().enumerate() {
            let (gain, _) = piece.best(along_residual[i], from_residual[i]);
            let score = self.score_of_constant(piece.probe, 0.5 * gain);
            let best = alone.entry(piece.probe).or_insert(score);
            *best = best.max(score);
        }
        let mut all: Vec<Beside> = Vec::new();
        for scan in scans.iter().filter(|scan| !scan.looks.is_empty()) {
            let left: Vec<White> = scan.looks.iter().map(Look::mean).collect();
            let left = DMatrix::from_columns(&left);
            let (along_left, from_left) = (along.tr_mul(&left), from.tr_mul(&left));
            for (k, look) in scan.looks.iter().enumerate() {
                let gained = residual.norm_squared() - look.square();
                let beside = |(i, piece): (usize, &Piece)| {
                    let (gain, size) = piece.best(along_left[(i, k)], from_left[(i, k)]);
                    Beside {
                        score: self.score_of_pair([scan.probe, piece.probe], 0.5 * (gained + gain)),
                        other: piece.probe,
                        other_size: size,
                        jumping: scan.probe,
                        size: look.size,
                        spacing: scan.spacing(look.size),
                    }
                };
                let mut at_size: Vec<Beside> = pieces.iter().enumerate().map(beside).collect();
                at_size.sort_by(|a, b| b.score.total_cmp(&a.score));
                at_size.truncate(most);
                all.extend(at_size);
            }
        }
        all.retain(|beside| beside.score > alone[&beside.other]);
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        self.diverse_beside(all, most)
    }

    /// The best of probes beside those that jump: few at a size and about it, each effect once.
    fn diverse_beside(&self, sorted: Vec<Beside>, most: usize) -> Vec<Beside> {
        const AT_A_SIZE: usize = 2;
        let spec = |beside: &Beside| self.probes[beside.other].spec;
        let mut kept: Vec<Beside> = Vec::new();
        for beside in sorted {
            let near = kept.iter().filter(|other| beside.is_about(other));
            let (mut count, mut known) = (0, false);
            for other in near {
                count += 1;
                known |= spec(other) == spec(&beside);
            }
            if kept.len() < most && count < AT_A_SIZE && !known {
                kept.push(beside);
            }
        }
        kept
    }
}

impl Search<'_> {
    /// Adds effects whose action jumps with their size, at the best of many sizes, to single effects: they replace those at which
    /// descents ended.
    pub(super) fn scan(&self, singles: &mut Vec<Found>) {
        let scans = self.scans();
        if !scans.is_empty() {
            singles.retain(|found| !self.jumped(found));
        }
        singles.extend(scans);
        sort(singles);
    }

    fn scans(&self) -> Vec<Found> {
        let nothing = self.atlas().at_rest(Hypothesis::nothing());
        let closer = |scan: &Scan| {
            self.tell(format_args!(
                "closer sizes of {}",
                self.atlas().probes[scan.probe].spec.name
            ));
            let hunt = self.best_of_bottoms(scan, &nothing)?;
            self.settled(&self.trial.hunted(&hunt)?)
        };
        self.scanned().iter().filter_map(closer).collect()
    }

    /// A hunt from the best of a scan's sizes that leave less than their neighbours, as sizes closer to each tell: where a reading or
    /// a speed is so many steps, one more or one less does nearly the same.
    fn best_of_bottoms(&self, scan: &Scan, base: &Base) -> Option<Hunt> {
        let closer =
            (scan.bottoms(base, self.chance()).into_iter()).filter_map(|hunt| self.trial.hunted_once(hunt));
        Hunt::least_first(closer.collect()).into_iter().next()
    }

    /// A hypothesis simulated often enough to judge it, where it is.
    pub(super) fn settled(&self, hypothesis: &Hypothesis) -> Option<Found> {
        let end = Descent::start(self.atlas(), hypothesis);
        Some(self.found(&self.trial.settle(&end)?))
    }

    /// Whether sizes all over the range of effects that jump were simulated already.
    pub(super) fn was_scanned(&self) -> bool {
        self.scanned.get().is_some()
    }

    /// Whether an effect that jumps leaves no more at one of the sizes all over its range than the best single effect, but for the noise
    /// of few simulations.
    pub(super) fn jumps_promise_as_much(&self, singles: &[Found]) -> bool {
        /// That noise, in units of what chance leaves.
        const NOISE: f64 = 0.5;
        let looks = self.scanned().iter().flat_map(|scan| &scan.looks);
        let least = looks.map(Look::square).fold(f64::INFINITY, f64::min);
        let best = singles
            .first()
            .map_or(f64::INFINITY, |best| best.left.norm_squared());
        least < best + NOISE * self.chance()
    }

    /// What every effect that jumps leaves at sizes all over its range; simulated once.
    fn scanned(&self) -> &[Scan] {
        self.scanned.get_or_init(|| {
            let nothing = self.atlas().at_rest(Hypothesis::nothing());
            let scan = |probe: usize| {
                let name = self.atlas().probes[probe].spec.name;
                self.tell(format_args!("every size of {name}"));
                self.trial.scan(&nothing, probe)
            };
            self.jumping().filter_map(scan).collect()
        })
    }

    /// The most promising pairs of an effect that jumps and one that does not. What both do is taken to add up: no single effect need
    /// come near.
    pub(super) fn screened_pairs_that_jump(&self) -> Vec<Beside> {
        self.atlas()
            .screen_beside_scans(self.residual, self.scanned(), HEARD)
    }

    /// A single effect that jumps with what goes best with it at sizes close about its own: another effect beside which that does not
    /// show may have had a share in it.
    pub(super) fn pairs_about(&self, single: &Found) -> Vec<Hypothesis> {
        match single.hypothesis.parts.as_slice() {
            [part] if part.held.is_some() => {
                self.tell(format_args!("sizes about that of {}", single.explanation.label()));
                let left = self.excess(&single.residual) / self.chance();
                let likely = self.likely_beside(single);
                let mut screened =
                    (self.trial).screen_about(&likely, (part.probe, part.mean_size(self.atlas())), left);
                let missing = |beside: &Beside| 2.0 * (self.signal() - beside.score);
                let least = screened.iter().map(missing).fold(f64::INFINITY, f64::min);
                screened.retain(|beside| missing(beside) <= least + may_be_behind(least));
                self.pairs_that_jump(&self.hunts_of_pairs(&screened))
            }
            _ => Vec::new(),
        }
    }

    /// The probes that explain best what a single effect leaves, by paths, each at its smallest sizes: of every effect the best one, and
    /// the best of all.
    fn likely_beside(&self, single: &Found) -> Vec<(usize, f64)> {
        /// Three times as far as right ones were down the list beside an effect that jumps: paths were simulated without it.
        const LIKELY: usize = 60;
        let base = self.trial.base(single.hypothesis.clone());
        let screened = self.screened_beside(&base, &single.left);
        let constant = screened.iter().filter(|other| other.hypothesis.is_constant());
        let mut effects = BTreeSet::new();
        let (best_of_effect, others): (Vec<usize>, Vec<usize>) = (constant.map(|other| other.probe()))
            .partition(|&probe| effects.insert(self.atlas().probes[probe].spec.name));
        let likely: Vec<usize> = best_of_effect.into_iter().chain(others).take(LIKELY).collect();
        let mut sizes = self.atlas().smallest_sizes();
        sizes.retain(|(probe, _)| likely.contains(probe));
        sizes
    }

    /// Such pairs, those that come nearest first, as far as the other's size follows.
    pub(super) fn hunts_of_pairs(&self, screened: &[Beside]) -> Vec<Hunt> {
        self.tell(format_args!("which sizes that jump go with another effect"));
        let look = |beside: &Beside| {
            let other = Part::screened(self.atlas(), beside.other, Shape::Constant, &[beside.other_size]);
            let base = self.trial.following(Hypothesis::of(other));
            let hunt = Hunt::new(base, beside.jumping, beside.size, beside.spacing);
            self.trial.hunted_once(hunt)
        };
        Hunt::least_first(screened.par_iter().filter_map(look).collect())
    }

    /// The best of these pairs at the best of sizes ever closer.
    pub(super) fn pairs_that_jump(&self, hunts: &[Hunt]) -> Vec<Hypothesis> {
        const KEPT: usize = 3;
        /// Looks closer before the other effect's size follows.
        const LOOKS: usize = 2;
        let least = hunts.first().map_or(0.0, |hunt| hunt.left);
        let bound = least + may_be_behind(least - self.chance());
        (hunts.iter().take(KEPT).filter(|hunt| hunt.left <= bound))
            .filter_map(|hunt| self.trial.hunted_for(hunt, LOOKS))
            .collect()
    }

    /// Sizes that jump all over their range beside what goes with them in the best explanations, as that has moved since they were
    /// found; where these explain little, beside the best single effects and either of the best pair's, and beside a single one that
    /// explains most. Those that come nowhere near the best are not tried to the end.
    pub(super) fn scans_beside(&self, found: &[Found]) -> Vec<Found> {
        let mut hunts: Vec<Hunt> = Vec::new();
        let mut known: Vec<Vec<usize>> = Vec::new();
        for (rest, probe) in found
            .iter()
            .flat_map(|found| self.beside_what_jumps(&found.hypothesis))
        {
            let mut probes = rest.probes();
            probes.push(probe);
            if known.len() < BASES && !known.contains(&probes) {
                known.push(probes);
                hunts.extend(self.hunts_beside(rest, std::iter::once(probe)));
            }
        }
        if (found.first()).is_some_and(|best| best.explanation.share <= verdict::MOST) {
            for base in self.single_bases(found) {
                hunts.extend(self.hunts_beside(base, self.jumping()));
            }
        }
        let mut starts = self.closest(hunts);
        // What explains most leaves a second effect rather than two; beside what explains nearly all they were looked for.
        let is_single = |one: &&Found| one.explanation.effects.len() == 1 && !one.explanation.has_no_name();
        let singles = found.iter().filter(is_single);
        let most = verdict::MOST..verdict::ENOUGH;
        if (singles.clone().next()).is_some_and(|single| most.contains(&single.explanation.share)) {
            starts.extend(self.jumping_beside(singles));
        }
        self.settle(self.descend_several(&starts, &ROUNDS_OF_SEVERAL, near(found)))
    }

    /// What goes with each effect that jumps of a hypothesis of several, and the probe of that.
    fn beside_what_jumps(&self, hypothesis: &Hypothesis) -> Vec<(Hypothesis, usize)> {
        let several = hypothesis.parts.len() > 1;
        (0..hypothesis.parts.len())
            .map(|i| (i, hypothesis.parts[i].probe))
            .filter(|&(_, probe)| several && self.atlas().probes[probe].jumps())
            .map(|(i, probe)| (hypothesis.without(i), probe))
            .collect()
    }

    /// Effects of the best explanations that are of one size, each for itself.
    fn single_bases(&self, found: &[Found]) -> Vec<Hypothesis> {
        let mut bases: Vec<Hypothesis> = Vec::new();
        for part in found.iter().flat_map(|found| &found.hypothesis.parts) {
            let spec = |part: &Part| self.atlas().probes[part.probe].spec;
            let constant = part.shape == Shape::Constant;
            if constant && bases.len() < BASES && bases.iter().all(|base| spec(&base.parts[0]) != spec(part))
            {
                bases.push(Hypothesis::of(part.clone()));
            }
        }
        bases
    }

    /// The best single effect and others that lack little more of explaining everything, with effects whose action jumps with their size
    /// beside them: those that come closest.
    pub(super) fn jumping_beside<'f>(
        &self,
        singles: impl Iterator<Item = &'f Found> + Clone,
    ) -> Vec<Hypothesis> {
        /// How often as much another single effect may lack.
        const NEAR: f64 = 2.0;
        let lacks = |single: &Found| self.signal() - single.explanation.score;
        let best = singles.clone().next();
        let most = best.map_or(0.0, |best| NEAR * lacks(best).max(0.0));
        let near = |single: &&Found| lacks(single) <= most;
        let mut hunts: Vec<Hunt> = Vec::new();
        for single in (of_other_effects(singles.filter(near)).into_iter()).take(BASES) {
            // What jumps beside the best does so beside the others.
            let best = hunts.iter().min_by(|a, b| a.left.total_cmp(&b.left));
            let probe = best.map(|best| best.probe);
            let probes = self
                .jumping()
                .filter(|&other| probe.is_none_or(|probe| probe == other));
            hunts.extend(self.hunts_beside(single.hypothesis.clone(), probes));
        }
        self.closest(hunts)
    }

    /// Hunts from the best size of each of some probes that jump beside a hypothesis that has none of its effect.
    fn hunts_beside(&self, base: Hypothesis, probes: impl Iterator<Item = usize>) -> Vec<Hunt> {
        let spec = |probe: usize| self.atlas().probes[probe].spec;
        let own: Vec<_> = base.parts.iter().map(|part| spec(part.probe)).collect();
        let names = own.iter().map(|own| own.name).collect::<Vec<_>>().join(" + ");
        let base = self.trial.base(base);
        let hunt = |probe: usize| {
            self.tell(format_args!("every size of {} beside {names}", spec(probe).name));
            self.best_of_bottoms(&self.trial.scan(&base, probe)?, &base)
        };
        probes
            .filter(|&probe| !own.contains(&spec(probe)))
            .filter_map(hunt)
            .collect()
    }

    /// The hunts that leave least, each at the best of sizes ever closer.
    fn closest(&self, hunts: Vec<Hunt>) -> Vec<Hypothesis> {
        const CLOSEST: usize = 2;
        (Hunt::least_first(hunts).iter().take(CLOSEST))
            .filter_map(|hunt| self.trial.hunted(hunt))
            .collect()
    }

    fn jumping(&self) -> impl Iterator<Item = usize> {
        (0..self.atlas().probes.len()).filter(|&probe| self.atlas().probes[probe].jumps())
    }
}

/// The squared distance by which a pair may lie behind the best one, by what that leaves beyond chance.
fn may_be_behind(excess: f64) -> f64 {
    const LEAST: f64 = 100.0;
    const SHARE: f64 = 0.5;
    LEAST.max(SHARE * excess)
}

/// So many sizes between two in a constant ratio, and that: what matters is how many steps fit into a speed or a reading.
fn in_constant_ratio(low: f64, high: f64, count: u32) -> (f64, Vec<f64>) {
    let ratio = (high / low).powf(1.0 / f64::from(count - 1));
    let sizes = (0..count).map(|i| low * ratio.powf(f64::from(i))).collect();
    (ratio, sizes)
}

/// The places of numbers that are not larger than their neighbours, the smallest number first.
fn bottoms(numbers: &[f64]) -> Vec<usize> {
    let is_bottom = |&i: &usize| {
        let before = i.checked_sub(1).map(|before| numbers[before]);
        let mut beside = before.iter().chain(numbers.get(i + 1));
        beside.all(|beside| numbers[i] <= *beside)
    };
    let mut found: Vec<usize> = (0..numbers.len()).filter(is_bottom).collect();
    found.sort_by(|&a, &b| numbers[a].total_cmp(&numbers[b]));
    found
}

#[cfg(test)]
mod tests {
    use super::bottoms;

    #[test]
    fn bottoms_are_lower_than_their_neighbours_and_may_lie_at_an_end() {
        assert_eq!(bottoms(&[3.0, 1.0, 2.0, 0.5, 5.0, 4.0]), [3, 1, 5]);
        assert_eq!(bottoms(&[1.0]), [0]);
        assert!(bottoms(&[]).is_empty());
    }
}
