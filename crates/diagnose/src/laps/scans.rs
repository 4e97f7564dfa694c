//! Effects whose action jumps with their size, at sizes all over their range: derivatives say nothing of them.

use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, White};
use super::beside::{Base, difference, explains};
use super::hunt::{Hunt, Look};
use super::hypothesis::Hypothesis;
use super::pairs::{Columns, Piece};
use super::part::{Part, Shape};
use super::refine::Descent;
use super::rounds::{ROUNDS_OF_SEVERAL, near};
use super::search::{BASES, Found, Search, sort};
use super::trial::Trial;

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
        const SPACINGS: f64 = 1.5;
        self.jumping == other.jumping
            && (self.size - other.size).abs() < SPACINGS * self.spacing.max(other.spacing)
    }
}

impl Scan {
    /// A hunt from the best size; `None` where no size explains a fair share of what the base leaves.
    fn best(&self, base: &Base, chance: f64) -> Option<Hunt> {
        self.bottoms(base, chance).into_iter().next()
    }

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
    /// What a probe that jumps leaves beside a base; `None` where the base crashes.
    fn scan(&self, base: &Base, probe: usize) -> Option<Scan> {
        const SETS: u64 = 3;
        const FEW: u32 = 60;
        /// Excess, in units of what chance leaves, below which noise would hide which size is best.
        const LITTLE: f64 = 3.0;
        let without = if base.hypothesis.parts.is_empty() {
            self.atlas.null.clone()
        } else {
            self.evaluate(&base.hypothesis, SETS)?.expectation
        };
        let chance = self.atlas.layout.len() as f64;
        let excess = self.left_beyond(base, &without).norm_squared() - chance;
        // Many sizes with one data set each, or fewer with two pairs of them.
        let (count, sets) = if excess < LITTLE * chance {
            (FEW, [0..2, 2..4])
        } else {
            (self.atlas.probes[probe].scanned, [0..1, 0..1])
        };
        let sizes = &self.atlas.probes[probe].sizes;
        let (ratio, sizes) = in_constant_ratio(sizes[0], sizes[sizes.len() - 1], count);
        let looks = if base.hypothesis.parts.is_empty() {
            self.kept_looks(base, probe, &sizes, &sets)
        } else {
            self.looks(base, probe, &sizes, &sets)
        };
        Some(Scan {
            probe,
            ratio,
            excess,
            looks,
        })
    }

    /// A probe that jumps with each of those that do not, at sizes close about the one to which it came alone: the best few. What the
    /// other does is simulated beside it, because rounding makes another thing of it.
    fn screen_about(&self, probe: usize, size: f64, most: usize) -> Vec<Beside> {
        const SETS: [Range<u64>; 2] = [0..2, 2..4];
        const COUNT: u32 = 81;
        /// Share of the size to either side.
        const REACH: f64 = 0.004;
        let nothing = self.atlas.at_rest(Hypothesis::nothing());
        let left = |settings: &[Setting]| self.left_twice(&nothing, settings, &SETS);
        let jumping = self.atlas.probes[probe].setting(size);
        let Some(alone) = left(std::slice::from_ref(&jumping)) else {
            return Vec::new();
        };
        let (ratio, sizes) = in_constant_ratio(size * (1.0 - REACH), size * (1.0 + REACH), COUNT);
        let looks = self.looks(&nothing, probe, &sizes, &SETS);
        let before = self.left_beyond(&nothing, &self.atlas.null).norm_squared();
        let best_about = |&(other, other_size): &(usize, f64)| {
            let beside = left(&[jumping.clone(), self.atlas.probes[other].setting(other_size)])?;
            let action = difference(&alone, &beside);
            let at_look = |look: &Look| {
                let (multiple, gain) = explains(&action, &look.left);
                Beside {
                    score: self
                        .atlas
                        .score_of_pair([probe, other], 0.5 * (before - look.square()) + gain),
                    other,
                    other_size: self.atlas.probes[other].times(other_size, multiple),
                    jumping: probe,
                    size: look.size,
                    spacing: look.size * (ratio - 1.0),
                }
            };
            looks
                .iter()
                .map(at_look)
                .max_by(|a, b| a.score.total_cmp(&b.score))
        };
        let mut all: Vec<Beside> = (self.atlas.smallest_sizes().par_iter())
            .filter_map(best_about)
            .collect();
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        self.atlas.diverse_beside(all, most)
    }
}

impl Atlas {
    /// Every probe that does not jump at its smallest sizes.
    fn smallest_sizes(&self) -> Vec<(usize, f64)> {
        let of_probe = |number: usize| {
            let sizes = self.probes[number].smallest_sizes().into_iter();
            sizes.map(move |size| (number, size))
        };
        (0..self.probes.len())
            .filter(|&probe| !self.probes[probe].jumps())
            .flat_map(of_probe)
            .collect()
    }

    /// The constant probes that do not jump which explain a residual best beside every scanned one, best first: of a probe that
    /// jumps few at a size and about it.
    fn screen_beside_scans(&self, residual: &White, scans: &[Scan], most: usize) -> Vec<Beside> {
        let pieces = self.smooth_pieces();
        let Columns { from, along } = Columns::of(&pieces);
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
            // Where a reading or a speed is so many steps, one more or one less does nearly the same.
            let closer = (scan.bottoms(&nothing, self.chance()).into_iter())
                .filter_map(|hunt| self.trial.hunted_once(hunt));
            let hunt = Hunt::least_first(closer.collect()).into_iter().next()?;
            self.settled(&self.trial.hunted(&hunt)?)
        };
        self.scanned().iter().filter_map(closer).collect()
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
                let screened = (self.trial).screen_about(part.probe, part.mean_size(self.atlas()), HEARD);
                self.pairs_that_jump(&self.hunts_of_pairs(&screened))
            }
            _ => Vec::new(),
        }
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
        /// Squared distance, and the share of what the best leaves, by which a pair may lie behind it.
        const BEHIND: (f64, f64) = (100.0, 0.5);
        let least = hunts.first().map_or(0.0, |hunt| hunt.left);
        let bound = least + BEHIND.0.max(BEHIND.1 * (least - self.chance()));
        (hunts.iter().take(KEPT).filter(|hunt| hunt.left <= bound))
            .filter_map(|hunt| self.trial.hunted_for(hunt, LOOKS))
            .collect()
    }

    /// Effects whose action jumps with their size beside the best single effects and beside either of the best pair's; those that
    /// come nowhere near the best are not tried to the end.
    pub(super) fn scans_beside(&self, found: &[Found]) -> Vec<Found> {
        const CLOSER: usize = 2;
        let mut bases: Vec<Hypothesis> = Vec::new();
        for part in found.iter().flat_map(|found| &found.hypothesis.parts) {
            let spec = |part: &Part| self.atlas().probes[part.probe].spec;
            let constant = part.shape == Shape::Constant;
            if constant && bases.len() < BASES && bases.iter().all(|base| spec(&base.parts[0]) != spec(part))
            {
                bases.push(Hypothesis::of(part.clone()));
            }
        }
        let mut hunts: Vec<Hunt> = Vec::new();
        for base in bases {
            let spec = self.atlas().probes[base.parts[0].probe].spec;
            let base = self.trial.base(base);
            for probe in self
                .jumping()
                .filter(|&probe| self.atlas().probes[probe].spec != spec)
            {
                let name = self.atlas().probes[probe].spec.name;
                self.tell(format_args!("every size of {name} beside {}", spec.name));
                let scan = self.trial.scan(&base, probe);
                hunts.extend(scan.and_then(|scan| scan.best(&base, self.chance())));
            }
        }
        let starts: Vec<Hypothesis> = (Hunt::least_first(hunts).iter().take(CLOSER))
            .filter_map(|hunt| self.trial.hunted(hunt))
            .collect();
        self.settle(self.descend_several(&starts, &ROUNDS_OF_SEVERAL, near(found)))
    }

    fn jumping(&self) -> impl Iterator<Item = usize> {
        (0..self.atlas().probes.len()).filter(|&probe| self.atlas().probes[probe].jumps())
    }
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
