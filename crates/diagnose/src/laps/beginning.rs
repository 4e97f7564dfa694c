//! How a run begins.

use std::ops::{Add, Div};

use track::Vec2;

/// Numbers of a run's beginning.
pub(super) const BEGINNING: usize = 4;

/// Time from one of these numbers to the next, s.
const BIN_S: f64 = 0.064;

/// When a robot drives as fast as it will, s since its run began. Longer, and a robot that knows two commands often turns in it.
const STEADY_S: (f64, f64) = ((BEGINNING as f64 - 0.5) * BIN_S, 1.3);

/// How far a robot is ahead, in the first quarter of a second of its run, of where it would be had it always been as fast as in the second
/// after that.
///
/// Wheels that have to come up to speed and commands that come late leave it behind for good, so that it was ahead at first; sensors that
/// lag do not. Of laps that go on for ever all three make about the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beginning {
    /// At four times a control step apart, mm along its way.
    pub(super) ahead_mm: [f64; BEGINNING],
    /// How far it has come when it should be as fast as it will, m.
    moved_m: f64,
}

impl Beginning {
    /// The beginning of a path of times in s and positions in m, rows in time order, the first of which is the run's start; `None`
    /// where too few of its rows are there.
    pub fn of(path: &[(f64, Vec2)]) -> Option<Self> {
        const FEWEST_STEADY: usize = 12;
        /// Part of the time at a steady speed by the end of which every robot moves, s.
        const MOVES_S: f64 = 0.5;
        let start_s = path.first()?.0;
        let rows: Vec<(f64, Vec2)> = (path.iter())
            .map(|row| (row.0 - start_s, row.1))
            .take_while(|row| row.0 < STEADY_S.1)
            .collect();
        let (early, steady): (Vec<_>, Vec<_>) = rows.into_iter().partition(|row| row.0 < STEADY_S.0);
        if steady.len() < FEWEST_STEADY {
            return None;
        }
        let (first, second) = steady.split_at(steady.len() / 2);
        let along =
            (mean(second.iter().map(|row| row.1))? - mean(first.iter().map(|row| row.1))?).normalize();
        let origin = early.first()?.1;
        let way_m = |row: &(f64, Vec2)| (row.1 - origin).dot(along);
        let (middle_s, middle_m) = (
            mean(steady.iter().map(|row| row.0))?,
            mean(steady.iter().map(way_m))?,
        );
        let off_s = |row: &(f64, Vec2)| row.0 - middle_s;
        let speed_m_s = steady.iter().map(|row| off_s(row) * way_m(row)).sum::<f64>()
            / steady.iter().map(|row| off_s(row).powi(2)).sum::<f64>();
        let ahead_m = |row: &(f64, Vec2)| way_m(row) - middle_m - speed_m_s * off_s(row);
        let mut ahead_mm = [0.0; BEGINNING];
        for (bin, ahead_mm) in ahead_mm.iter_mut().enumerate() {
            let in_bin = early.iter().filter(|row| (row.0 / BIN_S).round() as usize == bin);
            *ahead_mm = 1000.0 * mean(in_bin.map(ahead_m))?;
        }
        let later = steady.iter().filter(|row| row.0 < MOVES_S);
        Some(Self {
            ahead_mm,
            moved_m: mean(later.map(way_m))? - mean(early.iter().take(2).map(way_m))?,
        })
    }

    /// Whether the robot still stands where it began when it should be at its program's speed, as it does in a file that begins before
    /// its run.
    pub fn stands(&self, speed_m_s: f64) -> bool {
        /// Time in which it moves no farther, s.
        const NO_TIME_S: f64 = 0.04;
        self.moved_m < NO_TIME_S * speed_m_s
    }
}

/// How runs begin on average.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanBeginning {
    pub(super) ahead_mm: [f64; BEGINNING],
    /// Of one run's numbers, mm^2, on average over them.
    variance: f64,
    runs: usize,
}

impl MeanBeginning {
    /// The mean of some runs; `None` of none.
    pub fn of(runs: &[Beginning]) -> Option<Self> {
        let count = runs.len() as f64;
        let number = |i: usize| runs.iter().map(move |run| run.ahead_mm[i]);
        let ahead_mm = std::array::from_fn(|i| number(i).sum::<f64>() / count);
        let squares = |i: usize| number(i).map(|mm| (mm - ahead_mm[i]).powi(2)).sum::<f64>();
        let squares = (0..BEGINNING).map(squares).sum::<f64>();
        (!runs.is_empty()).then(|| Self {
            ahead_mm,
            variance: squares / (count - 1.0).max(1.0) / BEGINNING as f64,
            runs: runs.len(),
        })
    }

    /// How far the robot is ahead of steady motion, mm, and when, in s since the start of its run.
    pub fn ahead_mm(&self) -> impl Iterator<Item = (f64, f64)> {
        let ahead_mm = self.ahead_mm.into_iter().enumerate();
        ahead_mm.map(|(bin, mm)| (BIN_S * bin as f64, mm))
    }

    /// How far the robot is from where it is in others at the same time since the start: root mean square over four times, mm.
    pub fn distance_mm(&self, other: &Self) -> f64 {
        let pairs = self.ahead_mm.iter().zip(&other.ahead_mm);
        let squares: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        (squares / BEGINNING as f64).sqrt()
    }

    /// What that distance is to the mean of as many runs as others are, if these are runs of the same robot, mm.
    pub fn chance_mm(&self, others: &Self) -> f64 {
        (self.variance / others.runs as f64).sqrt()
    }
}

/// The mean of some values; `None` of none.
fn mean<T: Add<Output = T> + Div<f64, Output = T>>(values: impl Iterator<Item = T>) -> Option<T> {
    let (sum, count) = (values.map(|value| (value, 1.0))).reduce(|a, b| (a.0 + b.0, a.1 + b.1))?;
    Some(sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEED_M_S: f64 = 0.05;

    /// A straight way with a distance gone after each time.
    fn path(start_s: f64, gone_m: impl Fn(f64) -> f64) -> Vec<(f64, Vec2)> {
        let (origin, along) = (Vec2::new(0.3, 0.9), Vec2::new(0.6, -0.8));
        (0..40)
            .map(|step| 0.064 * f64::from(step))
            .map(|time_s| (start_s + time_s, origin + along * gone_m(time_s)))
            .collect()
    }

    #[test]
    fn a_robot_that_starts_at_once_is_never_ahead() {
        for start_s in [0.0, 51_234.5] {
            let found = Beginning::of(&path(start_s, |time_s| SPEED_M_S * time_s)).unwrap();
            assert!(found.ahead_mm.iter().all(|mm| mm.abs() < 1e-6), "{found:?}");
            assert!(!found.stands(SPEED_M_S), "{found:?}");
        }
    }

    #[test]
    fn commands_that_come_late_and_wheels_that_come_up_to_speed_leave_it_behind() {
        // Late by 0.1 s: 5 mm, of which 3.2 mm and then all are made up for by not moving.
        let late = path(0.0, |time_s| SPEED_M_S * (time_s - 0.1).max(0.0));
        let late = Beginning::of(&late).unwrap();
        for (found, truth) in late.ahead_mm.into_iter().zip([5.0, 1.8, 0.0, 0.0]) {
            assert!((found - truth).abs() < 1e-6, "{late:?}");
        }
        // A lag of 0.02 s is over when it is looked at again.
        let lag = path(0.0, |time_s| {
            SPEED_M_S * (time_s - 0.02 * (1.0 - (-time_s / 0.02).exp()))
        });
        let lag = Beginning::of(&lag).unwrap();
        assert!(
            (lag.ahead_mm[0] - 1.0).abs() < 1e-4 && lag.ahead_mm[3].abs() < 1e-3,
            "{lag:?}"
        );
        assert!(!late.stands(SPEED_M_S) && !lag.stands(SPEED_M_S));
    }

    #[test]
    fn in_files_that_begin_before_their_run_the_robot_stands() {
        for waits_s in [0.6, 1.1] {
            let gone_m = |time_s: f64| SPEED_M_S * (time_s - waits_s).max(0.0);
            let found = Beginning::of(&path(0.0, gone_m)).unwrap();
            assert!(found.stands(SPEED_M_S), "{waits_s}: {found:?}");
        }
    }

    #[test]
    fn mean_beginnings_are_apart_by_the_root_of_their_mean_square() {
        let run = |ahead_mm: f64| Beginning {
            ahead_mm: [ahead_mm, 0.0, 0.0, 0.0],
            moved_m: 0.015,
        };
        let (near, far) = (
            MeanBeginning::of(&[run(1.0), run(3.0)]),
            MeanBeginning::of(&[run(8.0)]),
        );
        let (near, far) = (near.unwrap(), far.unwrap());
        assert_eq!(near.distance_mm(&far), 3.0);
        let ahead_mm: Vec<(f64, f64)> = near.ahead_mm().take(2).collect();
        assert_eq!(ahead_mm, [(0.0, 2.0), (0.064, 0.0)]);
        // A variance of 2 in one number of four.
        assert!((near.chance_mm(&far) - 0.5_f64.sqrt()).abs() < 1e-12);
        assert_eq!(MeanBeginning::of(&[]), None);
    }

    #[test]
    fn rows_that_are_missing_are_not_made_up() {
        let whole = path(0.0, |time_s| SPEED_M_S * time_s);
        for missing in [1..2, 3..4, 5..11, 0..40] {
            let mut rows = whole.clone();
            rows.drain(missing.clone());
            let found = Beginning::of(&rows);
            assert!(found.is_none(), "{missing:?}: {found:?}");
        }
        // One of the later rows more or less is no matter.
        let mut rows = whole;
        rows.remove(9);
        assert!(Beginning::of(&rows).is_some());
    }
}
