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
        let nodes = self.nodes(probe);
        let needed = self.needed(p.free.len());
        let side = |sign: f64| {
            let own = nodes.iter().filter(|(s, _)| sign * (s - p.neutral) > 0.0);
            let mut own: Vec<(f64, &White)> = own.map(|(s, w)| ((s - p.neutral).abs(), w)).collect();
            own.sort_by(|a, b| a.0.total_cmp(&b.0));
            let size = if p.quantum.is_some() {
                let seen = own.iter().find(|(_, action)| action.norm() >= needed);
                seen.map(|(size, _)| *size)
            } else if p.odd {
                smallest(&own, needed)
            } else {
                let signal = |size: f64| trial.signal_of(&p.setting(p.neutral + sign * size), directions);
                if p.scanned > 0 {
                    let about = |size: f64| {
                        ABOUT
                            .iter()
                            .map(|times| signal(times * size))
                            .reduce(|a, b| Some(a?.min(b?)))?
                    };
                    bracketed(&own, needed, about).map(|bracket| bracket.high.0)
                } else {
                    bracketed(&own, needed, signal).map(|bracket| bracket.size(needed))
                }
            };
            size.map(|size| p.neutral + sign * size)
        };
        Some(Detectable {
            spec: p.spec,
            label: label(&p.setting(p.neutral)),
            parameter: param.name,
            unit: param.unit,
            below: side(-1.0),
            above: side(1.0),
        })
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

/// A size that is not seen, if any is, and one that is, with their signals.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    low: Option<(f64, f64)>,
    high: (f64, f64),
}

impl Bracket {
    /// Where a signal that goes with a power of the size is as large as needed.
    fn between(&self, needed: f64) -> f64 {
        /// The power where only one size is known: between straight and curved.
        const POWER: f64 = 1.5;
        let Self { low, high } = *self;
        let power = low.map_or(POWER, |low| {
            (high.1 / low.1.max(LEAST * needed)).ln() / (high.0 / low.0).ln()
        });
        let size = high.0 * (needed / high.1).powf(1.0 / power);
        low.map_or(size, |low| size.clamp(low.0, high.0))
    }

    /// The size that is not seen, if next to nothing is seen of it.
    fn shows_nothing_at(&self, needed: f64) -> Option<f64> {
        self.low.filter(|low| low.1 < LEAST * needed).map(|low| low.0)
    }

    /// The smallest size that is seen: where the signal begins all at once, the smallest at which it was there.
    fn size(&self, needed: f64) -> f64 {
        match self.shows_nothing_at(needed) {
            Some(_) => self.high.0,
            None => self.between(needed),
        }
    }
}

/// The least share of what is needed that is told from nothing.
const LEAST: f64 = 0.2;

/// Sizes on both sides of the smallest one along a path that is seen, as simulations of sizes ever closer tell `signal`s; `None` where
/// the path ends before. A signal that begins all at once, as that of a dead band which the slowest command just enters, is looked at
/// more closely.
fn bracketed(path: &Outwards<'_>, needed: f64, signal: impl Fn(f64) -> Option<f64>) -> Option<Bracket> {
    const LOOKS: usize = 2;
    /// The same, at a signal that begins all at once.
    const LOOKS_AT_ONSET: usize = 6;
    /// How close sizes on its two sides may come.
    const CLOSE: f64 = 1.02;
    let seen = path.iter().position(|(_, action)| action.norm() >= needed)?;
    let of = |&(size, action): &(f64, &White)| (size, action.norm());
    let mut bracket = Bracket {
        low: seen.checked_sub(1).map(|before| of(&path[before])),
        high: of(&path[seen]),
    };
    for look in 0..LOOKS_AT_ONSET {
        let onset = bracket.shows_nothing_at(needed);
        if look >= LOOKS && onset.is_none_or(|nothing| bracket.high.0 < CLOSE * nothing) {
            break;
        }
        let size = bracket.between(needed);
        // A robot that crashes is seen.
        match signal(size).unwrap_or(f64::INFINITY) {
            signal if signal < needed => bracket.low = Some((size, signal)),
            signal => bracket.high = (size, signal.min(bracket.high.1)),
        }
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
        let found = |path: &Outwards<'_>, needed: f64, signal: &dyn Fn(f64) -> Option<f64>| {
            bracketed(path, needed, signal).map(|bracket| bracket.size(needed))
        };
        // Twice the square of the size, which reaches 18 at 3 and 2 at 1.
        let square = |size: f64| Some(2.0 * size * size);
        assert!((found(&path, 18.0, &square).unwrap() - 3.0).abs() < 1e-9);
        assert!((found(&path, 2.0, &square).unwrap() - 1.0).abs() < 1e-2);
        assert_eq!(found(&path, 40.0, &square), None);
        let crashes = |size: f64| (size < 1.2).then_some(2.0 * size * size);
        assert!((found(&path, 2.0, &crashes).unwrap() - 1.0).abs() < 0.1);
        // One that begins at 2.3.
        let begins = |size: f64| Some(if size < 2.3 { 0.0 } else { 40.0 });
        let onset = found(&[(2.0, &White::zeros(1)), path[1]], 6.0, &begins).unwrap();
        assert!((2.3..2.4).contains(&onset), "{onset}");
    }
}
