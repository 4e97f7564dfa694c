//! How large an effect must be to be seen.

use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, PATH_SETS, Simulate, White};
use super::diagnosis::ALARM_SCORE;
use super::screen::price;
use super::trial::Trial;
use crate::candidate::label;
use crate::detectable::{Detectable, QUANTILE_95};

/// Multiples of a size that jumps at all of which it has to be seen: what one rounding does, one a little larger may not.
const ABOUT: [f64; 3] = [1.0, 1.04, 1.09];

/// Sizes and what they do, from nothing outwards.
type Outwards<'a> = [(f64, &'a White)];

impl Atlas {
    /// The smallest sizes of all effects that these data show, probe by probe; vectors along their axes.
    pub fn detectable(&self, simulate: &Simulate<'_>) -> Vec<Detectable> {
        let trial = Trial::new(self, simulate, &self.null);
        let nodes = (0..self.probes.len()).flat_map(|probe| self.nodes(probe));
        let directions: Vec<White> = nodes
            .filter_map(|(_, action)| action.try_normalize(f64::MIN_POSITIVE))
            .collect();
        (0..self.probes.len())
            .into_par_iter()
            .filter(|&probe| !self.probes[probe].sizes.is_empty())
            .filter_map(|probe| self.detectable_of(probe, &trial, &directions))
            .collect()
    }

    fn detectable_of(&self, probe: usize, trial: &Trial<'_>, directions: &[White]) -> Option<Detectable> {
        let p = &self.probes[probe];
        let param = &p.spec.params[p.only_moving()?];
        let seen = |sign: f64| self.smallest_seen(probe, sign, trial, directions);
        let above = seen(1.0);
        let below = if p.odd { above } else { seen(-1.0) };
        Some(Detectable {
            spec: p.spec,
            label: label(&p.setting(p.neutral)),
            parameter: param.name,
            unit: param.unit,
            below: below.map(|distance| p.neutral - distance),
            above: above.map(|distance| p.neutral + distance),
        })
    }

    /// How far from nothing, to one side of it, an effect is seen; `None` if it is not, as far as was looked.
    fn smallest_seen(&self, probe: usize, sign: f64, trial: &Trial<'_>, directions: &[White]) -> Option<f64> {
        let p = &self.probes[probe];
        let nodes = self.nodes(probe);
        let outwards = nodes.iter().filter(|(size, _)| sign * (size - p.neutral) > 0.0);
        let mut path: Vec<(f64, &White)> = outwards.map(|(s, w)| ((s - p.neutral).abs(), w)).collect();
        path.sort_by(|a, b| a.0.total_cmp(&b.0));
        let needed = self.needed(p.free.len());
        if p.quantum.is_some() {
            let seen = path.iter().find(|(_, action)| action.norm() >= needed);
            return seen.map(|(size, _)| *size);
        }
        let jumps = p.scanned > 0;
        let multiples: &[f64] = if jumps { &ABOUT } else { &[1.0] };
        let signal = |size: f64| {
            let at = |times: &f64| trial.signal_of(&p.setting(p.neutral + sign * times * size), directions);
            multiples.iter().map(at).reduce(|a, b| Some(a?.min(b?)))?
        };
        let bracket = bracketed(&path, needed, signal)?;
        // What jumps, and what a limit does, goes with no power of the size.
        if jumps || p.limit {
            bracket.high.map(|(size, _)| size)
        } else {
            bracket.size(needed)
        }
    }

    /// Standard deviations of a signal that raises the alarm in 95 of 100 cases.
    fn needed(&self, numbers: usize) -> f64 {
        (2.0 * (ALARM_SCORE + price(numbers, self.layout.total_laps()))).sqrt() + QUANTILE_95
    }
}

impl Trial<'_> {
    /// How far an effect brings laps from the declared model along the direction that shows it best, in standard deviations; `None`
    /// where the robot crashes. What one data set shows best is measured by another: the largest of hundreds of directions is
    /// otherwise one of chance.
    fn signal_of(&self, effect: &Setting, directions: &[White]) -> Option<f64> {
        let effect = std::slice::from_ref(effect);
        // No path was simulated by these.
        let one = self.kept_action(effect, PATH_SETS)?;
        let other = self.kept_action(effect, PATH_SETS + 1)?;
        let along = |shown_best_by: &White, action: &White| {
            let best = directions
                .iter()
                .max_by(|a, b| a.dot(shown_best_by).total_cmp(&b.dot(shown_best_by)));
            best.map_or(0.0, |best| best.dot(action))
        };
        Some((0.5 * (along(&one, &other) + along(&other, &one))).max(0.0))
    }
}

/// The largest size that was looked at and not seen, and the smallest that was seen, each with its signal.
#[derive(Debug, Clone, Copy, Default)]
struct Bracket {
    low: Option<(f64, f64)>,
    high: Option<(f64, f64)>,
}

impl Bracket {
    /// Where a signal that goes with a power of the size is as large as needed; `None` before the first look.
    fn between(&self, needed: f64) -> Option<f64> {
        /// The power where only a size is known that is seen: between straight and curved.
        const POWER: f64 = 1.5;
        let nearest = self.high.or(self.low)?;
        let power = match (self.low, self.high) {
            (Some(low), Some(high)) => (high.1 / low.1.max(LEAST * needed)).ln() / (high.0 / low.0).ln(),
            (None, _) => POWER,
            (_, None) => 1.0,
        };
        let size = nearest.0 * (needed / nearest.1.max(LEAST * needed)).powf(1.0 / power);
        let low = self.low.map_or(0.0, |low| low.0);
        let high = self.high.map_or(f64::INFINITY, |high| high.0);
        Some(size.clamp(low, high))
    }

    /// Whether the smallest size that is seen is known well enough.
    fn is_close(&self, needed: f64) -> bool {
        /// By how much a signal may exceed the one that is needed to tell the size.
        const NEAR: f64 = 1.25;
        /// How far apart sizes may be between which a signal begins all at once.
        const CLOSE: f64 = 1.02;
        self.high
            .is_some_and(|high| high.1 < NEAR * needed || self.low.is_some_and(|low| high.0 < CLOSE * low.0))
    }

    /// The smallest size that is seen: where the signal begins all at once, the smallest at which it was there.
    fn size(&self, needed: f64) -> Option<f64> {
        match (self.low, self.high) {
            (Some(low), Some(high)) if low.1 < LEAST * needed => Some(high.0),
            _ => self.between(needed),
        }
    }
}

/// The least share of what is needed that is told from nothing.
const LEAST: f64 = 0.2;

/// Sizes about the smallest one along a path that is seen, as simulations of sizes ever closer tell `signal`s; `None` where the path
/// ends before. The path itself, which is straight between its sizes and is longer for the noise of its simulation, tells where to begin.
fn bracketed(path: &Outwards<'_>, needed: f64, signal: impl Fn(f64) -> Option<f64>) -> Option<Bracket> {
    const LOOKS: usize = 6;
    let (end, _) = *path.last()?;
    let mut size = smallest(path, needed)?;
    let mut bracket = Bracket::default();
    for _ in 0..LOOKS {
        // A robot that crashes is seen, by how far nobody knows.
        let looked = (size, signal(size).unwrap_or(2.0 * needed));
        if looked.1 >= needed {
            bracket.high = Some(looked);
        } else if size < end {
            bracket.low = Some(looked);
        } else {
            return None;
        }
        if bracket.is_close(needed) {
            break;
        }
        size = bracket.between(needed)?.min(end);
    }
    Some(bracket)
}

/// The smallest size along a path, from nothing outwards, at which its action is as long as needed. The action is seen along the
/// outermost one's direction, where the noise of its simulation hardly counts.
fn smallest(path: &Outwards<'_>, needed: f64) -> Option<f64> {
    let (_, last) = path.last()?;
    let length = last.norm();
    let (mut from, mut signal_from) = (0.0, 0.0);
    for (size, action) in path {
        let signal = action.dot(last) / length;
        if signal >= needed {
            return Some(from + (size - from) * (needed - signal_from) / (signal - signal_from));
        }
        (from, signal_from) = (*size, signal.max(signal_from));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_path_is_seen_where_its_length_suffices() {
        let (near, far) = (White::from_vec(vec![3.0, 0.0]), White::from_vec(vec![9.0, 0.0]));
        let path = [(1.0, &near), (3.0, &far)];
        assert!((smallest(&path, 6.0).unwrap() - 2.0).abs() < 1e-12);
        assert!((smallest(&path, 1.5).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(smallest(&path, 10.0), None);
    }

    #[test]
    fn a_curved_path_is_seen_where_simulations_say() {
        let (near, far) = (White::from_vec(vec![8.0]), White::from_vec(vec![32.0]));
        let path = [(2.0, &near), (4.0, &far)];
        let found = |needed: f64, signal: &dyn Fn(f64) -> Option<f64>| {
            bracketed(&path, needed, signal).and_then(|bracket| bracket.size(needed))
        };
        // Twice the square of the size, which reaches 18 at 3 and 2 at 1; within 4 %, as the last signal is up to 1.25 times that needed.
        let square = |size: f64| Some(2.0 * size * size);
        assert!((found(18.0, &square).unwrap() - 3.0).abs() < 0.12);
        assert!((found(2.0, &square).unwrap() - 1.0).abs() < 0.04);
        assert_eq!(found(40.0, &square), None);
        // What the path promises and simulations do not bear out.
        assert_eq!(found(30.0, &|size| Some(size)), None);
        let crashes = |size: f64| (size < 1.2).then_some(2.0 * size * size);
        assert!((found(2.0, &crashes).unwrap() - 1.0).abs() < 0.1);
        // One that begins at 2.3.
        let begins = |size: f64| Some(if size < 2.3 { 0.0 } else { 40.0 });
        let onset = found(6.0, &begins).unwrap();
        assert!((2.3..2.4).contains(&onset), "{onset}");
    }
}
