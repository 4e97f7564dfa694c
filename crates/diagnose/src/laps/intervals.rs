//! Intervals of numbers of which the likelihood falls far more slowly than the parabola about its top: where no reading is cut at
//! zero any more, or no wheel reaches a limit, a still larger size does nothing further, and laps do not bound it.

use super::hypothesis::Hypothesis;
use super::parabola::{Column, Local};
use super::part::Freedom;
use super::trial::Trial;
use crate::candidate::HALF_WIDTH_95;

/// The fall of the log-likelihood at the ends of a 95 % interval (Wilks 1938).
const FALL: f64 = 0.5 * HALF_WIDTH_95 * HALF_WIDTH_95;
/// Standard errors at which a likelihood is compared with their parabola.
const COMPARED: f64 = 4.0;

/// A number and its 95 % interval.
pub(super) type Interval = (Freedom, [f64; 2]);

impl Trial<'_> {
    /// The intervals of those numbers, of a hypothesis at its top, of which the likelihood falls far more slowly than their standard
    /// errors say, to one side at least: as simulations tell with the other numbers as they are. Numbers of which the scatter of
    /// laps tells more than their means are not looked at, nor those without a range of their own.
    pub(super) fn slow_intervals(
        &self,
        top: &Hypothesis,
        errors: &[(Freedom, f64)],
        local: &Local,
    ) -> Vec<Interval> {
        const HALF: f64 = 0.5;
        const SETS: u64 = 8;
        let misfit = |hypothesis: &Hypothesis| {
            let simulated = self.evaluate(hypothesis, SETS)?;
            let left = self.fit_in(&simulated, &local.scatter).residual;
            Some(0.5 * left.norm_squared())
        };
        let Some(at_top) = misfit(top) else {
            return Vec::new();
        };
        let of = |((freedom, error), column): (&(Freedom, f64), &Column)| {
            let (within, far) = (top.range(freedom, self.atlas)?, top.far(freedom, self.atlas)?);
            if error * error * column.slope.norm_squared() < HALF {
                return None;
            }
            let fall = |moved: f64| {
                let there = misfit(&top.moved(self.atlas, &[(*freedom, moved)]));
                there.map_or(f64::INFINITY, |misfit| misfit - at_top)
            };
            let slow = [-1.0, 1.0].map(|side| slow_reach(|distance| fall(side * distance), *error, far));
            if slow == [None; 2] {
                return None;
            }
            let end = |side: f64, slow: Option<f64>| {
                let reach = slow.unwrap_or_else(|| reach(|distance| fall(side * distance), *error));
                (top.get(freedom) + side * reach).clamp(within.start, within.end)
            };
            Some((*freedom, [end(-1.0, slow[0]), end(1.0, slow[1])]))
        };
        (errors.iter().zip(&local.columns)).filter_map(of).collect()
    }
}

/// The distance from its top at which a log-likelihood has fallen by as much as at the end of a 95 % interval, where it falls far
/// more slowly than the parabola of a standard error; infinite if it does not within another distance, `None` where the
/// parabola holds.
fn slow_reach(fall: impl Fn(f64) -> f64, error: f64, far: f64) -> Option<f64> {
    /// Share of the parabola's fall below which it is slow. The noise of simulations is not so both there and twice as far out.
    const SLOW: f64 = 0.25;
    let slow = |distance: f64| {
        let fallen = fall(distance);
        (fallen < SLOW * 0.5 * (distance / error).powi(2)).then_some(fallen)
    };
    let (mut near, mut fallen) = (COMPARED * error, slow(COMPARED * error)?);
    let mut twice_as_far = Some(slow(2.0 * near)?);
    while near < far {
        let next = 2.0 * near;
        let there = twice_as_far.take().unwrap_or_else(|| fall(next));
        if there > FALL {
            let share = (FALL - fallen) / (there - fallen);
            return Some(near + share.clamp(0.0, 1.0) * (next - near));
        }
        (near, fallen) = (next, there);
    }
    Some(f64::INFINITY)
}

/// The distance from its top at which a log-likelihood has fallen by as much, where that is nearer than twice what it is compared at.
fn reach(fall: impl Fn(f64) -> f64, error: f64) -> f64 {
    const HALVINGS: usize = 5;
    let (mut near, mut next) = (0.0, COMPARED * error);
    if fall(next) < FALL {
        (near, next) = (next, 2.0 * next);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (near + next);
        if fall(middle) > FALL {
            next = middle;
        } else {
            near = middle;
        }
    }
    0.5 * (near + next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_needs_no_interval_of_its_own() {
        for times in [0.6_f64, 1.0, 1.9] {
            let fall = |distance: f64| 0.5 * (distance / (0.3 * times)).powi(2);
            assert_eq!(slow_reach(fall, 0.3, 50.0), None);
        }
    }

    #[test]
    fn a_wider_parabola_has_its_own_end() {
        let reach = slow_reach(|distance| 0.5 * (distance / 3.0).powi(2), 0.3, 50.0).unwrap();
        assert!((reach / (HALF_WIDTH_95 * 3.0) - 1.0).abs() < 0.1, "{reach}");
    }

    #[test]
    fn a_steep_side_ends_near() {
        for deviation in [0.05_f64, 0.3, 0.5, 0.8] {
            let found = reach(|distance| 0.5 * (distance / deviation).powi(2), 0.3);
            assert!((found - HALF_WIDTH_95 * deviation).abs() < 0.03, "{found}");
        }
    }

    #[test]
    fn a_plateau_ends_where_it_falls_off_or_nowhere() {
        let cliff = |distance: f64| if distance < 20.0 { 0.1 } else { f64::INFINITY };
        let reach = slow_reach(cliff, 0.3, 50.0).unwrap();
        assert!((9.0..=20.0).contains(&reach), "{reach}");
        assert_eq!(slow_reach(|_| 0.4, 0.3, 50.0), Some(f64::INFINITY));
    }
}
