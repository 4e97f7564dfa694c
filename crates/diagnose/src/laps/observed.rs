//! Runs and laps as a diagnosis takes them.

use track::{Gates, Lap, Vec2, Way, laps, moving_mean};

use super::beginning::Beginning;

/// A run as the gates saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedRun {
    /// Its closed laps that count.
    pub laps: Vec<ObservedLap>,
    /// How it began, if that is known.
    pub beginning: Option<Beginning>,
}

impl ObservedRun {
    /// A run of which nothing but its laps is known, seen without noise.
    #[cfg(test)]
    pub(super) fn exact(laps: impl IntoIterator<Item = Lap>) -> Self {
        Self {
            laps: laps.into_iter().map(ObservedLap::exact).collect(),
            beginning: None,
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

    /// Laps that the gates saw on a path of times in s and positions in m (rows in time order), with those of its moving mean,
    /// for a robot whose program's speed is `speed_m_s`. A lap that its moving mean does not complete is taken as it was seen.
    pub fn on_path(
        seen: Vec<Lap>,
        path: &[(f64, Vec2)],
        gates: &Gates,
        way: Way,
        speed_m_s: f64,
    ) -> Vec<Self> {
        let spacing_s = gates.spacing_m() / speed_m_s;
        let smooth = laps(gates, way, &moving_mean(path, 0.5 * spacing_s));
        let whole: Vec<Lap> = smooth.into_iter().filter(|lap| lap.missed.is_empty()).collect();
        let observed = |seen: Lap| {
            let apart_s = |lap: &Lap| (lap.start_s - seen.start_s).abs();
            let same = whole.iter().min_by(|a, b| apart_s(a).total_cmp(&apart_s(b)));
            let same = same.filter(|lap| apart_s(lap) < spacing_s);
            Self {
                smooth: same.unwrap_or(&seen).clone(),
                seen,
            }
        };
        seen.into_iter().map(observed).collect()
    }
}

#[cfg(test)]
mod tests {
    use track::Course;

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
            ObservedLap::on_path(seen, &path, &gates, Way::Forward, speed_m_s)
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
    fn a_lap_that_the_mean_does_not_complete_is_taken_as_it_was_seen() {
        let course = Course::from_toml(include_str!("../../../../worlds/roduit2007/world.toml")).unwrap();
        let gates = course.gates(100).unwrap();
        let path = path(&gates, 2, 0.0);
        let seen = laps(&gates, Way::Forward, &path);
        let observed = ObservedLap::on_path(seen.clone(), &path[..1000], &gates, Way::Forward, 0.05);
        assert_eq!(observed[1].smooth, seen[1]);
    }
}
