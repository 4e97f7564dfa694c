//! How large an effect must be to be seen.

use rayon::prelude::*;
use sim::Setting;

use super::atlas::{Atlas, PATH_SETS, Simulate, White};
use super::diagnosis::ALARM_SCORE;
use super::probe::Probe;
use super::screen::price;
use super::trial::Trial;
use crate::candidate::label;
use crate::detectable::{Detectable, QUANTILE_95};

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
            } else if p.odd || self.has_others_like(p) {
                smallest(&own, needed)
            } else {
                let signal = |size: f64| trial.signal_of(&p.setting(p.neutral + sign * size), directions);
                smallest_simulated(&own, needed, signal)
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

    /// Whether the same effect acts at other sensors, places or in other directions: these paths are about straight.
    fn has_others_like(&self, probe: &Probe) -> bool {
        self.probes.iter().filter(|other| other.acts_like(probe)).count() > 1
    }

    /// Standard deviations of a signal that raises the alarm in 95 of 100 cases.
    fn needed(&self, numbers: usize) -> f64 {
        (2.0 * (ALARM_SCORE + price(numbers, self.layout.total_laps()))).sqrt() + QUANTILE_95
    }
}

impl Trial<'_> {
    /// How far an effect brings laps from the declared model along the direction that shows it best, in standard deviations; `None`
    /// where the robot crashes.
    fn signal_of(&self, effect: &Setting, directions: &[White]) -> Option<f64> {
        /// Data sets by which no path was simulated.
        const SETS: [u64; 2] = [PATH_SETS, PATH_SETS + 1];
        let effect = std::slice::from_ref(effect);
        let mut action = White::zeros(self.atlas.layout.len());
        for set in SETS {
            action += self.kept_action(effect, set)? / SETS.len() as f64;
        }
        Some(
            directions
                .iter()
                .map(|along| along.dot(&action))
                .fold(0.0, f64::max),
        )
    }
}

/// The smallest size along a path that need not be straight, as [`smallest`], where simulations of sizes ever closer tell `signal`s.
fn smallest_simulated(path: &Outwards<'_>, needed: f64, signal: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    const LOOKS: usize = 2;
    let seen = path.iter().position(|(_, action)| action.norm() >= needed)?;
    let of = |&(size, action): &(f64, &White)| (size, action.norm());
    let mut low = seen.checked_sub(1).map(|before| of(&path[before]));
    let mut high = of(&path[seen]);
    for _ in 0..LOOKS {
        let size = between(low, high, needed);
        // A robot that crashes is seen.
        match signal(size).unwrap_or(f64::INFINITY) {
            signal if signal < needed => low = Some((size, signal)),
            signal => high = (size, signal.min(high.1)),
        }
    }
    Some(between(low, high, needed))
}

/// The size of a signal between two of which one is smaller, if there is such, and one is not, where it goes with a power of the size.
fn between(low: Option<(f64, f64)>, high: (f64, f64), needed: f64) -> f64 {
    /// What it is where only one is known: between straight and curved.
    const POWER: f64 = 1.5;
    /// The least share of what is needed that is told from nothing.
    const LEAST: f64 = 0.2;
    let power = low.map_or(POWER, |low| {
        (high.1 / low.1.max(LEAST * needed)).ln() / (high.0 / low.0).ln()
    });
    let size = high.0 * (needed / high.1).powf(1.0 / power);
    low.map_or(size, |low| size.clamp(low.0, high.0))
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
        // Twice the square of the size, which reaches 18 at 3 and 2 at 1.
        let square = |size: f64| Some(2.0 * size * size);
        assert!((smallest_simulated(&path, 18.0, square).unwrap() - 3.0).abs() < 1e-9);
        assert!((smallest_simulated(&path, 2.0, square).unwrap() - 1.0).abs() < 1e-2);
        assert_eq!(smallest_simulated(&path, 40.0, square), None);
        let crashes = |size: f64| (size < 1.2).then_some(2.0 * size * size);
        assert!((smallest_simulated(&path, 2.0, crashes).unwrap() - 1.0).abs() < 0.1);
    }
}
