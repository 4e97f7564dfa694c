//! The size of an effect whose action jumps with it.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, White};
use super::beside::{Base, twice};
use super::hypothesis::Hypothesis;
use super::part::Part;
use super::simulated::{Draws, FINAL_SETS};
use super::trial::Trial;

/// Data sets simulated at each size, at one spacing after the other.
const CLOSER: [u64; 4] = [3, 4, 8, 8];
/// By how much one spacing is smaller than the one before.
const CLOSER_BY: f64 = 3.0;
/// Share of the data sets by which all sizes are looked at.
const FIRST: u64 = 4;

/// A size of a probe that jumps about which a better one is to be found.
#[derive(Debug, Clone)]
pub(super) struct Hunt {
    pub(super) base: Base,
    pub(super) probe: usize,
    pub(super) size: f64,
    /// How far off it may be.
    pub(super) spacing: f64,
    /// How often sizes closer to it were looked at.
    looks: usize,
    /// The squared distance of the data that it leaves, as the last look saw it; infinite before the first.
    pub(super) left: f64,
}

/// How far the effects beside one that jumps have moved since its size was found: it may be off by some per cent, or by a tenth of
/// that.
#[derive(Debug, Clone, Copy)]
pub(super) enum Moved {
    Far,
    Little,
}

impl Hunt {
    pub(super) fn new(base: Base, probe: usize, size: f64, spacing: f64) -> Self {
        Self {
            base,
            probe,
            size,
            spacing,
            looks: 0,
            left: f64::INFINITY,
        }
    }

    /// The same where a scan saw what it leaves.
    pub(super) fn leaving(self, left: f64) -> Self {
        Self { left, ..self }
    }

    /// How far to either side sizes are looked at.
    fn reach(&self) -> f64 {
        4.0 * self.spacing / CLOSER_BY
    }

    /// Hunts, what leaves least first.
    pub(super) fn least_first(mut hunts: Vec<Self>) -> Vec<Self> {
        hunts.sort_by(|a, b| a.left.total_cmp(&b.left));
        hunts
    }
}

/// What a probe that jumps leaves of the data at a size, by two simulations; see [`Trial::left_beyond`].
#[derive(Debug, Clone)]
pub(super) struct Look {
    pub(super) size: f64,
    pub(super) left: [White; 2],
}

impl Look {
    /// The squared distance of the data. If the two simulations are different data sets, their noise adds nothing to it on average.
    pub(super) fn square(&self) -> f64 {
        self.left[0].dot(&self.left[1])
    }

    /// What both leave on average.
    pub(super) fn mean(&self) -> White {
        (&self.left[0] + &self.left[1]) * 0.5
    }
}

impl Trial<'_> {
    /// The hypothesis and the effect beside it, at the best of sizes ever closer to that of the hunt.
    pub(super) fn hunted(&self, hunt: &Hunt) -> Option<Hypothesis> {
        self.hunted_for(hunt, CLOSER.len())
    }

    /// The same after so many looks from where the hunt began.
    pub(super) fn hunted_for(&self, hunt: &Hunt, looks: usize) -> Option<Hypothesis> {
        let part = self.hunt_closer(hunt.clone(), &CLOSER[hunt.looks..looks])?;
        Some(hunt.base.hypothesis.with(&Hypothesis::of(part)))
    }

    /// A hunt after one look closer.
    pub(super) fn hunted_once(&self, mut hunt: Hunt) -> Option<Hunt> {
        let sets = CLOSER[hunt.looks];
        let first = self.looks_about(&hunt, sets);
        self.race(&mut hunt, first, sets)?;
        Some(hunt)
    }

    /// A hypothesis whose effects that jump have better sizes beside the others, whose numbers may follow but are left as they
    /// are: a further descent moves them.
    pub(super) fn hunt_again(&self, hypothesis: &Hypothesis, moved: Moved) -> Option<Hypothesis> {
        let (off, levels) = match moved {
            Moved::Far => (0.04, &CLOSER[..]),
            Moved::Little => (0.004, &CLOSER[2..]),
        };
        self.hunt_each(hypothesis, levels, |hunt| {
            hunt.spacing = off * hunt.size;
            hunt.base = self.base(hunt.base.hypothesis.clone());
        })
    }

    /// The same within the errors of these sizes.
    pub(super) fn hunt_about(&self, hypothesis: &Hypothesis) -> Option<Hypothesis> {
        const ERRORS: f64 = 1.5;
        let wider = |hunt: &mut Hunt| hunt.spacing *= ERRORS;
        self.hunt_each(hypothesis, &CLOSER[..1], wider)
    }

    /// A hypothesis whose sizes that jump are those of a parabola over a wider neighbourhood, with errors of it, in units of its own
    /// scatter: how rounding falls on a reading or a speed makes likelihoods rough at a small scale, where one bottom is as good as
    /// the next.
    pub(super) fn smoothed(&self, hypothesis: &Hypothesis) -> Hypothesis {
        let mut smooth = hypothesis.clone();
        if !hypothesis.has_held() {
            return smooth;
        }
        let own = (self.evaluate(hypothesis, self.atlas.enough(FINAL_SETS, 1)))
            .and_then(|evaluated| self.atlas.scatter_of(evaluated.summaries.iter(), 1));
        for i in 0..smooth.parts.len() {
            let Some(mut hunt) = self.atlas.hunt_of(&smooth, i) else {
                continue;
            };
            hunt.base = hunt.base.in_units_of(own.clone());
            let distances = |sizes: &[f64]| {
                const SETS: u64 = 6;
                squares(&self.looks_of(&hunt, sizes, SETS))
            };
            if let Some((size, error)) = smooth_size(distances, hunt.size, hunt.spacing) {
                smooth.parts[i] = Part::held(self.atlas, hunt.probe, size, error);
            }
        }
        smooth
    }

    fn hunt_each(
        &self,
        hypothesis: &Hypothesis,
        levels: &[u64],
        prepare: impl Fn(&mut Hunt),
    ) -> Option<Hypothesis> {
        let mut found = hypothesis.clone();
        for i in 0..found.parts.len() {
            let Some(mut hunt) = self.atlas.hunt_of(&found, i) else {
                continue;
            };
            prepare(&mut hunt);
            found.parts[i] = self.hunt_closer(hunt, levels)?;
        }
        Some(found)
    }

    /// The best of sizes ever closer about a hunt's, with so many data sets from level to level, until they tell the vertex of a parabola.
    fn hunt_closer(&self, mut hunt: Hunt, levels: &[u64]) -> Option<Part> {
        let mut last = Vec::new();
        for &sets in levels {
            let before = hunt.left;
            let first = self.looks_about(&hunt, sets);
            if let Some(vertex) = sharp_vertex(&first, &hunt) {
                return Some(Part::held(self.atlas, hunt.probe, vertex.size, vertex.error));
            }
            last = self.race(&mut hunt, first, sets)?;
            if self.is_in_vain(before, hunt.left) {
                break;
            }
        }
        // Sizes that are no worse than by 4 in squared distance bound the answer.
        let bound = hunt.left + 4.0;
        let as_good = last
            .iter()
            .filter(|found| found.0 < bound)
            .map(|found| (found.1 - hunt.size).abs());
        let error = as_good.fold(hunt.spacing / 2.0, f64::max);
        Some(Part::held(self.atlas, hunt.probe, hunt.size, error))
    }

    /// Whether a look closer that found this much left, and that much before, shows that something else than the size is wrong.
    fn is_in_vain(&self, before: f64, left: f64) -> bool {
        /// What is left, as a multiple of what chance leaves, from which on it may.
        const FAR: f64 = 10.0;
        /// Share of what is left that a look must have gained.
        const SLOW: f64 = 0.1;
        let chance = self.atlas.layout.len() as f64;
        let beyond = left - chance;
        beyond > FAR * chance && before - left < SLOW * beyond
    }

    /// What sizes about a hunt's leave, as a first few of so many data sets tell it.
    fn looks_about(&self, hunt: &Hunt, sets: u64) -> Vec<Look> {
        let sizes: Vec<f64> = (-4..=4)
            .map(|i| hunt.size + hunt.reach() * f64::from(i) / 4.0)
            .collect();
        self.looks_of(hunt, &sizes, sets.div_ceil(FIRST))
    }

    /// Brings a hunt to the best of sizes at which it looked first, with so many data sets at those that may be it; what these leave of
    /// the data. Ever fewer sizes are looked at by ever more data sets (a race, Maron and Moore 1994).
    fn race(&self, hunt: &mut Hunt, first: Vec<Look>, sets: u64) -> Option<Vec<(f64, f64)>> {
        let (mut looks, mut done) = (first, sets.div_ceil(FIRST));
        while done < sets {
            let left: Vec<&White> = looks.iter().map(|look| &look.left[0]).collect();
            let may = may_be_least(&left, 1.0 / done as f64);
            let sizes: Vec<f64> = (looks.iter().zip(may))
                .filter(|(_, may)| *may)
                .map(|(look, _)| look.size)
                .collect();
            done = (2 * done).min(sets);
            looks = self.looks_of(hunt, &sizes, done);
        }
        let found = squares(&looks);
        (hunt.left, hunt.size) = least(&found)?;
        hunt.spacing /= CLOSER_BY;
        hunt.looks += 1;
        Some(found)
    }

    /// What a hunt leaves at some sizes, by so many data sets.
    fn looks_of(&self, hunt: &Hunt, sizes: &[f64], sets: u64) -> Vec<Look> {
        let draws = Draws::Sets(0..sets);
        self.looks(&hunt.base, hunt.probe, sizes, &[draws.clone(), draws])
    }

    /// What a hypothesis with a probe beside it leaves of the data at some sizes; those at which the robot crashes are left out.
    pub(super) fn looks(&self, base: &Base, probe: usize, sizes: &[f64], draws: &[Draws; 2]) -> Vec<Look> {
        self.looks_by(probe, sizes, |further| self.left_twice(base, further, draws))
    }

    /// The same at those sizes alone that may leave least as the first of two draws tell.
    pub(super) fn looks_at_least(
        &self,
        base: &Base,
        probe: usize,
        sizes: &[f64],
        draws: &[Draws; 2],
    ) -> Vec<Look> {
        let left =
            |size: f64, draws| self.left_beside(base, &[self.atlas.probes[probe].setting(size)], draws);
        let first: Vec<(f64, White)> = (sizes.par_iter())
            .filter_map(|&size| Some((size, left(size, &draws[0])?)))
            .collect();
        let runs = self.atlas.layout.laps.iter().map(Vec::len).max();
        let may = may_be_least(
            &first.iter().map(|(_, left)| left).collect::<Vec<_>>(),
            draws[0].error(runs.unwrap_or(1)),
        );
        (first.into_par_iter().zip(may))
            .filter(|(_, may)| *may)
            .filter_map(|((size, first), _)| {
                let left = [first, left(size, &draws[1])?];
                Some(Look { size, left })
            })
            .collect()
    }

    /// What is left beside nothing, at sizes that are asked for whatever the data are.
    pub(super) fn kept_looks(
        &self,
        nothing: &Base,
        probe: usize,
        sizes: &[f64],
        draws: &[Draws; 2],
    ) -> Vec<Look> {
        let before = self.left_beyond(nothing, &self.atlas.null);
        self.looks_by(probe, sizes, |further| {
            twice(draws, |draws| {
                let change = self.kept_change(further, draws)?;
                Some(self.without_silent(&before - change))
            })
        })
    }

    fn looks_by(
        &self,
        probe: usize,
        sizes: &[f64],
        left: impl Fn(&[Setting]) -> Option<[White; 2]> + Sync,
    ) -> Vec<Look> {
        let look = |&size: &f64| {
            let left = left(&[self.atlas.probes[probe].setting(size)])?;
            Some(Look { size, left })
        };
        sizes.par_iter().filter_map(look).collect()
    }
}

impl Atlas {
    /// The hunt that ended with a part of a hypothesis, as far off as its size may be; `None` of other parts.
    fn hunt_of(&self, hypothesis: &Hypothesis, part: usize) -> Option<Hunt> {
        let base = self.at_rest(hypothesis.without(part));
        let part = &hypothesis.parts[part];
        let size = part.values[0][self.probes[part.probe].size_index()];
        Some(Hunt::new(base, part.probe, size, part.held?))
    }
}

/// Which of several may leave least once more is simulated, by what they leave so far, which simulations of such a variance tell: they
/// have the same draws, whose noise is no more than what each leaves otherwise than the least so far.
fn may_be_least(left: &[&White], error: f64) -> Vec<bool> {
    const ERRORS: f64 = 3.0;
    let Some(least) = left
        .iter()
        .min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
    else {
        return Vec::new();
    };
    let lowest = least.norm_squared();
    let noise = (least.len() as f64 * error).sqrt();
    let scale = (lowest / least.len() as f64).sqrt();
    let bound = |left: &White| lowest + ERRORS * 2.0 * scale * noise.min((left - *least).norm());
    left.iter()
        .map(|left| left.norm_squared() <= bound(left))
        .collect()
}

/// Squared distances, each with its size.
fn squares(looks: &[Look]) -> Vec<(f64, f64)> {
    looks.iter().map(|look| (look.square(), look.size)).collect()
}

/// The vertex of a parabola through what sizes about a hunt's leave, if it lies well between them and their roughness costs less than a
/// size one standard error aside does: the lowest of rough distances is lowest by chance.
fn sharp_vertex(looks: &[Look], hunt: &Hunt) -> Option<Vertex> {
    /// Squared distance that the roughness may cost.
    const COST: f64 = 1.0;
    /// Share of the reach within which the vertex lies.
    const WITHIN: f64 = 0.75;
    const SIZES: usize = 9;
    if looks.len() < SIZES {
        return None;
    }
    let vertex = vertex(&squares(looks), hunt.size, hunt.reach())?;
    let is_sharp = vertex.cost < COST && (vertex.size - hunt.size).abs() < WITHIN * hunt.reach();
    is_sharp.then_some(vertex)
}

/// The least of some distances, with its size.
fn least(found: &[(f64, f64)]) -> Option<(f64, f64)> {
    found.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The least of a parabola through squared distances at ever wider spaced sizes, and its standard error, once they rise enough
/// to either side for a parabola to tell. Where it never does so clearly, the least of the first that rise enough, as far off as
/// the parabola's; `None` where none do.
fn smooth_size(distances: impl Fn(&[f64]) -> Vec<(f64, f64)>, size: f64, error: f64) -> Option<(f64, f64)> {
    /// Squared distance by which both ends must rise: five standard errors.
    const RISE: f64 = 25.0;
    /// Times by which they must rise more than distances lie off the parabola, among which chance finds a bottom, to tell clearly.
    const ROUGH: f64 = 10.0;
    /// Share of what the sizes span to either side that the error may be.
    const TELLS: f64 = 0.5;
    /// Times by which the sizes lie wider apart from one look to the next, and looks at most.
    const WIDER: f64 = 4.0;
    const LOOKS: i32 = 6;
    /// Standard errors that fit into half a flat bottom.
    const FLAT: f64 = 3.0;
    let mut unclear = None;
    for look in 0..LOOKS {
        let reach = 2.0 * error * WIDER.powi(look);
        if reach >= size {
            break;
        }
        let at = |i: i32| size + reach * f64::from(i) / 4.0;
        if let [(down, _), (middle, _), (up, _)] = distances(&[at(-4), at(0), at(4)])[..]
            && down.min(up) - middle < RISE
        {
            continue;
        }
        let sizes: Vec<f64> = (-4..=4).map(at).collect();
        let found = distances(&sizes);
        let (lowest, bottom) = least(&found)?;
        if found.len() < sizes.len() {
            continue;
        }
        let rise = found[0].0.min(found[found.len() - 1].0) - lowest;
        let tells = |vertex: &Vertex| rise > RISE && vertex.error < TELLS * reach;
        if let Some(vertex) = vertex(&found, size, reach).filter(tells) {
            // Distances that hardly rose at the spacing before may have a flat bottom as wide.
            let flat = if look > 0 { reach / WIDER / FLAT } else { 0.0 };
            let error = vertex.error.max(flat);
            if rise > ROUGH * vertex.roughness {
                return Some((vertex.size, error));
            }
            unclear = unclear.or(Some((bottom, error.max((bottom - vertex.size).abs()))));
        }
    }
    unclear
}

/// The vertex of a parabola through squared distances.
struct Vertex {
    size: f64,
    /// Standard error: of the likelihood, and for how far the distances lie off the parabola.
    error: f64,
    /// How far they do: the root of their mean square.
    roughness: f64,
    /// By how much, on average, the vertex is off for that, in squared distance.
    cost: f64,
}

/// The vertex of the parabola nearest to squared distances at sizes about a middle; `None` where it bends down.
fn vertex(found: &[(f64, f64)], middle: f64, reach: f64) -> Option<Vertex> {
    let x = |(_, size): &(f64, f64)| (size - middle) / reach;
    let design = DMatrix::from_fn(found.len(), 3, |i, power| x(&found[i]).powi(power as i32));
    let heights = DVector::from_iterator(found.len(), found.iter().map(|found| found.0));
    let covariance = (design.tr_mul(&design)).try_inverse()?;
    let fit = &covariance * design.tr_mul(&heights);
    let (slope, bend) = (fit[1], fit[2]);
    if bend <= 0.0 {
        return None;
    }
    let off = (heights - &design * &fit).norm_squared() / (found.len() as f64 - 3.0);
    let rough = off * covariance[(1, 1)] / (2.0 * bend).powi(2);
    let vertex = (-slope / (2.0 * bend)).clamp(-1.0, 1.0);
    Some(Vertex {
        size: middle + reach * vertex,
        error: reach * (1.0 / bend + rough).sqrt(),
        roughness: off.sqrt(),
        cost: bend * rough,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::testing::atlas;

    #[test]
    fn a_rough_parabola_has_the_vertex_of_the_smooth_one() {
        // A standard error of 0.5 about 30, with bottoms 0.01 apart.
        let rough = |sizes: &[f64]| -> Vec<(f64, f64)> {
            let at = |size: f64| ((size - 30.0) / 0.5).powi(2) + 2.0 * (600.0 * size).sin();
            sizes.iter().map(|&size| (at(size), size)).collect()
        };
        let (size, error) = smooth_size(rough, 30.7, 0.003).unwrap();
        assert!(
            (size - 30.0).abs() < 2.0 * error && (0.45..0.7).contains(&error),
            "{size} {error}"
        );
    }

    #[test]
    fn a_bottom_of_chance_is_passed_over() {
        let mut stream = sim::Streams { seed: 2, run: 0 }.open("rough");
        let mut errors = Vec::new();
        for _ in 0..50 {
            let mut at = |size: f64| ((size - 30.0) / 0.03).powi(2) + 12.0 * stream.normal();
            // Wherever a hunt ended: the least of many distances near the least of the parabola.
            let near = (-20..=20).map(|i| 30.0 + 1e-3 * f64::from(i));
            let bottom = near.min_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap();
            let at = std::cell::RefCell::new(at);
            let rough = |sizes: &[f64]| -> Vec<(f64, f64)> {
                sizes
                    .iter()
                    .map(|&size| ((at.borrow_mut())(size), size))
                    .collect()
            };
            let (size, error) = smooth_size(rough, bottom, 1e-3).unwrap();
            errors.push((size - 30.0).abs() / error);
        }
        let within = errors.iter().filter(|error| **error < 1.96).count();
        assert!(within >= 45, "{errors:?}");
    }

    #[test]
    fn the_best_of_nine_sizes_is_hardly_ever_out_of_a_race() {
        // What each leaves, each with noise of its own; that of the third is what chance leaves, and of the others twenty units more.
        const COUNT: usize = 300;
        let mut stream = sim::Streams { seed: 3, run: 0 }.open("race");
        let mut out = 0;
        for _ in 0..400 {
            let mut left = |size: usize| {
                let off = if size == 2 { 0.0 } else { 40.0_f64.sqrt() };
                let noisy = |i: usize| if i == size { 1.0 + off } else { 1.0 };
                White::from_fn(COUNT, |i, _| noisy(i) + 0.5_f64.sqrt() * stream.normal())
            };
            let left: Vec<White> = (0..9).map(&mut left).collect();
            out += usize::from(!may_be_least(&left.iter().collect::<Vec<_>>(), 0.5)[2]);
        }
        assert!(out <= 4, "{out}");
    }

    #[test]
    fn what_is_far_off_is_out_of_a_race_the_sooner_the_more_alike_the_draws() {
        let left = |first: f64| White::from_fn(300, |i, _| if i == 0 { first } else { 1.0 });
        let is_out = |off: f64| !may_be_least(&[&left(1.0), &left(1.0 + off)], 0.5)[1];
        assert!(!is_out(3.9) && is_out(4.1) && is_out(20.0));
    }

    #[test]
    fn the_vertex_of_a_clear_parabola_ends_a_hunt_and_a_rough_one_does_not() {
        let hunt = Hunt::new(atlas().at_rest(Hypothesis::nothing()), 0, 30.0, 0.3);
        let mut stream = sim::Streams { seed: 4, run: 0 }.open("vertex");
        let mut vertex = |least_at: f64, roughness: f64| {
            let mut look = |i: i32| {
                let size = hunt.size + hunt.reach() * f64::from(i) / 4.0;
                let square = 1000.0 + ((size - least_at) / 0.02).powi(2) + roughness * stream.normal();
                let left = White::from_element(1, square.sqrt());
                Look {
                    size,
                    left: [left.clone(), left],
                }
            };
            sharp_vertex(&(-4..=4).map(&mut look).collect::<Vec<_>>(), &hunt)
        };
        let found = vertex(30.11, 0.0).unwrap();
        assert!((found.size - 30.11).abs() < 1e-9 && (found.error - 0.02).abs() < 1e-9);
        // The ends rise by 400: noise of 20 costs a quarter of a standard error, and of 150 two.
        let found = vertex(30.11, 20.0).unwrap();
        assert!((found.size - 30.11).abs() < 0.02, "{}", found.size);
        assert!(vertex(30.11, 150.0).is_none());
        // The least may lie beyond the ends.
        assert!(vertex(30.35, 0.0).is_none());
    }

    #[test]
    fn a_sharp_size_is_where_its_parabola_is_least() {
        let sharp = |sizes: &[f64]| {
            let at = |size: f64| ((size - 30.0004) / 1e-3).powi(2);
            sizes.iter().map(|&size| (at(size), size)).collect()
        };
        let (size, error) = smooth_size(sharp, 30.0, 3e-3).unwrap();
        assert!((size - 30.0004).abs() < 1e-9 && (error - 1e-3).abs() < 1e-9);
    }

    #[test]
    fn what_hardly_rises_is_left_alone() {
        let flat = |sizes: &[f64]| {
            sizes
                .iter()
                .map(|&size| ((0.1 * (size - 30.0)).powi(2), size))
                .collect()
        };
        assert_eq!(smooth_size(flat, 30.0, 3e-3), None);
    }
}
