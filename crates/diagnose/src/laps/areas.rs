//! Causes without a name that act on a part of the floor.

use rayon::prelude::*;
use sim::{Area, UNLISTED, Vec2};

use super::atlas::White;
use super::groups::solve;
use super::hypothesis::Hypothesis;
use super::part::Part;
use super::probe::Probe;
use super::rounds::{ROUNDS_FROM_NEAR, ROUNDS_OF_SEVERAL};
use super::screen::price;
use super::search::{Found, Search};
use super::trial::Trial;
use crate::candidate::{OF_A_BELL, WORDS, area_values};

/// What a part of the floor may act on, with such steps.
const TARGETS: [(&str, f64); 5] = [
    ("yaw rate", 0.02),
    ("wheel speed", 0.02),
    ("left wheel", 0.02),
    ("right wheel", 0.02),
    ("reading", 0.04),
];

/// Every target on a part of the floor, as probes that have no path but only numbers to fit: how much, where, how far, and how softly
/// it ends, and the same without the last, as a normal law's bell: a robot that crosses an area on one line hardly tells how far from how
/// softly.
pub(super) fn areas() -> impl Iterator<Item = Probe> {
    const STEP_M: f64 = 0.03;
    const STEP_OF_SOFTNESS: f64 = 0.15;
    let of = |(target, step): (&str, f64)| {
        let origin = area_values(target)?;
        let steps = [step, STEP_M, STEP_M, STEP_M, STEP_OF_SOFTNESS];
        let with = |numbers: usize| {
            let free = (WORDS..).zip(steps).take(numbers).collect();
            Probe::group(&UNLISTED, origin.clone(), free)
        };
        Some([with(steps.len()), with(BELL)])
    };
    TARGETS.into_iter().filter_map(of).flatten()
}

/// Numbers of a bell: how much, where and how far.
const BELL: usize = 4;

impl Probe {
    /// Whether it acts on a part of the floor.
    pub(super) fn is_an_area(&self) -> bool {
        self.is_group_with(2, Area::BASIS)
    }

    /// Whether it does so as a normal law's bell.
    fn is_a_bell(&self) -> bool {
        self.is_an_area() && self.free.len() == BELL
    }
}

impl Trial<'_> {
    /// What acts on a part of the floor about one of these places and explains a residual best at the size that linear algebra gives
    /// it: the best of each target, best first, with its score.
    fn screen_areas(&self, residual: &White, places: &[Vec2]) -> Vec<(f64, Hypothesis)> {
        /// Steps of a target at which it is simulated.
        const STEPS: f64 = 3.0;
        let probes = &self.atlas.probes;
        let price = price(BELL + 1, self.atlas.layout.total_laps()) + (places.len() as f64).ln();
        let at = |probe: usize, place: Vec2, steps: f64| {
            let per_m = 1.0 / probes[probe].free[1].1;
            let part = Part::group(&probes[probe], probe, &[steps, place.x * per_m, place.y * per_m]);
            Hypothesis::of(Part { stride: 1.0, ..part })
        };
        let best_of_target = |probe: usize| {
            let about = |place: &Vec2| {
                let simulated = at(probe, *place, STEPS).settings(self.atlas);
                let action = self.kept_action(&simulated, 0)?;
                let (multiple, gain) = solve(&[&action], residual);
                Some((gain - price, at(probe, *place, STEPS * multiple[0])))
            };
            let about_each: Vec<_> = places.par_iter().filter_map(about).collect();
            about_each.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let areas = self
            .groups(|probe| probe.is_an_area() && !probe.is_a_bell())
            .into_iter();
        let mut found: Vec<(f64, Hypothesis)> = areas.filter_map(best_of_target).collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found
    }
}

impl Search<'_> {
    /// Causes without a name that act on a part of the floor and explain much about a place that is not the best yet, tried to the end.
    pub(super) fn areas(&self) -> Vec<Found> {
        /// Share of the signal that is much: where there was an area it was .55 to 1, elsewhere at most .25.
        const MUCH: f64 = 0.4;
        /// Share of what the best explains that another target must.
        const RIVAL: f64 = 0.7;
        self.tell(format_args!("parts of the floor"));
        let screened = self.trial.screen_areas(self.residual, self.places);
        let best = screened.first().map_or(0.0, |(score, _)| *score);
        let least = (RIVAL * best).max(MUCH * self.signal());
        let starts = screened.iter().filter(|(score, _)| *score >= least);
        let mut found = self.try_rounds(starts.map(|(_, start)| start), &ROUNDS_OF_SEVERAL);
        if let Some(best) = found.first_mut()
            && let Some(bell) = self.as_a_bell(&best.hypothesis)
        {
            let bells = self.try_rounds(std::iter::once(&bell), &ROUNDS_FROM_NEAR);
            let better = |bell: &Found| bell.explanation.score > best.explanation.score;
            if let Some(bell) = bells.into_iter().next().filter(better) {
                *best = bell;
            }
        }
        found
    }

    /// An area as a normal law's bell; `None` of one that ends far more sharply.
    fn as_a_bell(&self, area: &Hypothesis) -> Option<Hypothesis> {
        const SOFT: f64 = 0.5;
        let [part] = area.parts.as_slice() else {
            return None;
        };
        let acts_on = |values: &[f64]| values[0];
        let is_it = |&bell: &usize| acts_on(self.atlas().probes[bell].origin()) == acts_on(&part.values[0]);
        let probe = self.trial.groups(Probe::is_a_bell).into_iter().find(is_it)?;
        let mut part = Part {
            probe,
            ..part.clone()
        };
        let softness = std::mem::replace(&mut part.values[0][WORDS + BELL], OF_A_BELL);
        (softness > SOFT).then(|| Hypothesis::of(part))
    }
}
