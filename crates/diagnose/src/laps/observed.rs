//! Runs and laps as a diagnosis takes them.

use track::{Gates, Lap, LapTracker, Vec2, Way, moving_mean};

use super::beginning::Beginning;

/// A run as the gates saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedRun {
    /// Its closed laps that count.
    pub laps: Vec<ObservedLap>,
    /// How it began, if that is known.
    pub beginning: Option<Beginning>,
    /// By the moving mean what comes before these laps, if that is known: the way to gate 0 and the first whole lap, NaN where
    /// the robot was not seen and in the first quarter of a lap, in which it forgets where it began.
    pub before: Vec<Lap>,
}

impl ObservedRun {
    /// A run of which nothing but its laps is known, seen without noise.
    #[cfg(test)]
    pub(super) fn exact(laps: impl IntoIterator<Item = Lap>) -> Self {
        Self {
            laps: laps.into_iter().map(ObservedLap::exact).collect(),
            beginning: None,
            before: Vec::new(),
        }
    }

    /// A run of laps that the gates saw on its whole path of times in s and positions in m (rows in time order), with those of its
    /// moving mean, for a robot whose program's speed is `speed_m_s`. A lap that its moving mean does not complete is taken as it
    /// was seen.
    pub fn on_path(seen: Vec<Lap>, path: &[(f64, Vec2)], gates: &Gates, way: Way, speed_m_s: f64) -> Self {
        /// Part of a lap in which a robot forgets where it began: 17 s; after 15 s the shipped robots' positions scatter as ever.
        const FORGOTTEN: f64 = 0.25;
        let spacing_s = gates.spacing_m() / speed_m_s;
        let mut tracker = LapTracker::new(gates, way);
        let smooth: Vec<Lap> = moving_mean(path, 0.5 * spacing_s)
            .into_iter()
            .filter_map(|(time_s, position)| tracker.push(time_s, position))
            .collect();
        let comes_before = |lap: &&Lap| {
            seen.first()
                .is_some_and(|seen| lap.end_s < seen.start_s + spacing_s)
        };
        let from_s = path.first().map_or(f64::NAN, |row| row.0) + FORGOTTEN * gates.len() as f64 * spacing_s;
        let before = (std::iter::once(tracker.run_up()).chain(smooth.first().filter(comes_before)))
            .map(|lap| seen_in_part(lap, path, from_s, spacing_s))
            .collect();
        let whole: Vec<&Lap> = smooth.iter().filter(|lap| lap.missed.is_empty()).collect();
        let observed = |seen: Lap| {
            let off_s = |lap: &Lap| (lap.start_s - seen.start_s).abs();
            let same = whole.iter().min_by(|a, b| off_s(a).total_cmp(&off_s(b)));
            let same = same.filter(|lap| off_s(lap) < spacing_s);
            ObservedLap {
                smooth: same.map_or_else(|| seen.clone(), |lap| (*lap).clone()),
                seen,
            }
        };
        Self {
            laps: seen.into_iter().map(observed).collect(),
            beginning: Beginning::of(path),
            before,
        }
    }
}

/// A lap as the gates saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedLap {
    /// By the positions as they were observed.
    pub seen: Lap,
    /// By their moving mean over the distance between two gates. On that way a camera sees a robot about ten times: the mean
    /// has a third of one position's noise, and is as much off in a bend for every robot.
    pub smooth: Lap,
}

impl ObservedLap {
    /// A lap that was seen without noise.
    #[cfg(test)]
    pub(super) fn exact(lap: Lap) -> Self {
        Self {
            smooth: lap.clone(),
            seen: lap,
        }
    }
}

/// A lap at the gates that were crossed after some time, s, and not while the robot was out of sight for longer than `unseen_s`;
/// NaN at all others.
fn seen_in_part(lap: &Lap, path: &[(f64, Vec2)], from_s: f64, unseen_s: f64) -> Lap {
    let is_seen = |time_s: f64| {
        let next = path.partition_point(|row| row.0 < time_s);
        let rows = path.get(next.wrapping_sub(1)).zip(path.get(next));
        rows.is_some_and(|(last, next)| next.0 - last.0 < unseen_s)
    };
    let mut part = lap.clone();
    for (time_s, offset_m) in part.times_s.iter_mut().zip(&mut part.offsets_m) {
        if !(*time_s > from_s && is_seen(*time_s)) {
            (*time_s, *offset_m) = (f64::NAN, f64::NAN);
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use track::{Course, laps};

    use super::*;

    /// Rounds along the middles of the gates, one gate every ten steps, seen with an error that alternates.
    fn path(gates: &Gates, rounds: usize, error_m: f64) -> Vec<(f64, Vec2)> {
        let count = gates.len();
        let position = |step: usize| {
            let (gate, share) = (step / 10, (step % 10) as f64 / 10.0 + 0.01);
            let middle = gates[gate % count]
                .center
                .lerp(gates[(gate + 1) % count].center, share);
            let sign = if step.is_multiple_of(2) { 1.0 } else { -1.0 };
            middle + gates[gate % count].left * (sign * error_m)
        };
        (950..950 + rounds * count * 10 + 100)
            .map(|step| (0.064 * step as f64, position(step)))
            .collect()
    }

    #[test]
    fn a_moving_mean_takes_the_noise_off_and_keeps_the_laps() {
        let course = Course::from_toml(include_str!("../../../../worlds/roduit2007/world.toml")).unwrap();
        let gates = course.gates(100).unwrap();
        let speed_m_s = gates.spacing_m() / 0.64;
        let observed = |error_m: f64| {
            let path = path(&gates, 3, error_m);
            let seen = laps(&gates, Way::Forward, &path);
            ObservedRun::on_path(seen, &path, &gates, Way::Forward, speed_m_s).laps
        };
        let (noisy, exact) = (observed(0.001), observed(0.0));
        assert_eq!((noisy.len(), exact.len()), (3, 3));
        let off_m = |noisy: &Lap, exact: &Lap| {
            let squares = (noisy.offsets_m.iter().zip(&exact.offsets_m)).map(|(a, b)| (a - b).powi(2));
            (squares.sum::<f64>() / gates.len() as f64).sqrt()
        };
        for (noisy, exact) in noisy.iter().zip(&exact) {
            assert!((noisy.smooth.duration_s() - 64.0).abs() < 1e-6);
            // Eleven rows that alternate leave one eleventh.
            let (seen_m, smooth_m) = (
                off_m(&noisy.seen, &exact.seen),
                off_m(&noisy.smooth, &exact.smooth),
            );
            assert!(seen_m > 0.0007 && smooth_m < 0.0001, "{seen_m} {smooth_m}");
        }
    }

    #[test]
    fn before_the_laps_that_count_is_known_what_does_not_depend_on_the_start() {
        let course = Course::from_toml(include_str!("../../../../worlds/roduit2007/world.toml")).unwrap();
        let gates = course.gates(100).unwrap();
        let speed_m_s = gates.spacing_m() / 0.64;
        let whole = path(&gates, 4, 0.0);
        // It begins at gate 35, and 25 gates later that is forgotten; gates 80 and 81 are passed out of sight.
        let mut path = whole[400..].to_vec();
        path.retain(|row| !(0.064 * 1795.0..0.064 * 1815.0).contains(&row.0));
        let seen = laps(&gates, Way::Forward, &path).split_off(1);
        let run = ObservedRun::on_path(seen, &path, &gates, Way::Forward, speed_m_s);
        assert_eq!((run.laps.len(), run.before.len()), (2, 2));
        let known = |lap: &Lap| -> Vec<usize> {
            let is_known = |&gate: &usize| lap.times_s[gate].is_finite() && lap.offsets_m[gate].is_finite();
            (0..100).filter(is_known).collect()
        };
        assert_eq!(known(&run.before[0]), (61..80).chain(82..100).collect::<Vec<_>>());
        assert_eq!(known(&run.before[1]), (0..100).collect::<Vec<_>>());
        assert_eq!(run.before[1].end_s, run.laps[0].smooth.start_s);
        // One that begins just before gate 0 has not forgotten it in the first quarter of its first lap.
        let seen = laps(&gates, Way::Forward, &whole).split_off(1);
        let run = ObservedRun::on_path(seen, &whole, &gates, Way::Forward, speed_m_s);
        assert_eq!(known(&run.before[0]), Vec::new());
        assert_eq!(known(&run.before[1]), (21..100).collect::<Vec<_>>());
    }

    #[test]
    fn a_lap_that_the_mean_does_not_complete_is_taken_as_it_was_seen() {
        let course = Course::from_toml(include_str!("../../../../worlds/roduit2007/world.toml")).unwrap();
        let gates = course.gates(100).unwrap();
        let path = path(&gates, 2, 0.0);
        let seen = laps(&gates, Way::Forward, &path);
        let observed = ObservedRun::on_path(seen.clone(), &path[..1000], &gates, Way::Forward, 0.05);
        assert_eq!(observed.laps[1].smooth, seen[1]);
    }
}
