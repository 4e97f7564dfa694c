//! Numbers that say whether, and in what, a data set departs from what was expected.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::atlas::{NULL_SETS, White};
use super::beginning::BEGINNING;
use super::layout::Layout;
use super::summary::SECOND;

/// Omnibus probability below which a data set counts as departing from the declared model.
pub(super) const ALARM_P: f64 = 0.002;
/// Probability of what is left below which it is significant.
pub(crate) const SIGNIFICANT_P: f64 = 0.001;
/// Probability of what is left below which nothing short of another effect helps.
pub(super) const HOPELESS_P: f64 = 1e-12;

/// A sum of squares with its probability under the expectation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadratic {
    /// Sum of squares, in units in which each has expectation 1.
    pub q: f64,
    /// Number of squares.
    pub freedom: usize,
    /// Probability of such a sum or a larger one.
    pub p: f64,
}

impl Quadratic {
    pub(crate) fn new(q: f64, freedom: usize) -> Self {
        let p = match ChiSquared::new(freedom as f64) {
            Ok(chi2) => chi2.sf(q),
            // No squares, no evidence.
            Err(_) => 1.0,
        };
        Self { q, freedom, p }
    }

    /// A sum over recordings, of so many squares each in units of a covariance that was estimated from [`NULL_SETS`] data sets and
    /// enlarged so that the sum's expectation is its number. Of one it is Hotelling's T^2, which has heavier tails than chi^2; of
    /// several it is taken for F with the mean and the variance of their sum.
    fn of_estimated(q: f64, recordings: usize, each: usize) -> Self {
        // Beyond this the tail is 0, and its continued fraction has no value.
        const ENORMOUS: f64 = 1e12;
        let freedom = recordings * each;
        if freedom == 0 {
            return Self { q, freedom, p: 1.0 };
        }
        let (p, total) = (each as f64, freedom as f64);
        let of_one = NULL_SETS as f64 - p;
        // Variance beyond that of chi^2.
        let wider = (p + of_one - 2.0) / (of_one - 4.0);
        let of_all = (total - 2.0 + 4.0 * wider) / (wider - 1.0);
        let f = q / total * of_all / (of_all - 2.0);
        let tail = FisherSnedecor::new(total, of_all).map_or(1.0, |law| law.sf(f.min(ENORMOUS)));
        Self { q, freedom, p: tail }
    }

    /// What exceeds the expectation.
    pub fn excess(&self) -> f64 {
        self.q - self.freedom as f64
    }
}

/// Where a data set departs from what was expected: in its mean lap, from run to run, drifting within the runs, in how its laps scatter, or
/// in how its runs begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departures {
    /// The mean lap.
    pub mean: Quadratic,
    /// The runs' means among each other.
    pub runs: Quadratic,
    /// The change within the runs.
    pub trend: Quadratic,
    /// The scatter of the laps.
    pub noise: Quadratic,
    /// How runs begin; without freedom where that is not known.
    pub start: Quadratic,
}

impl Departures {
    /// Of a residual in white.
    pub(super) fn new(residual: &White, layout: &Layout) -> Self {
        let squares = |range: std::ops::Range<usize>| residual.rows(range.start, range.len()).norm_squared();
        let recordings = layout.laps.len();
        let (mut all, mut means) = (0.0, 0.0);
        for (recording, laps) in layout.laps.iter().enumerate() {
            let total: usize = laps.iter().sum();
            let mut mean = White::zeros(layout.lap);
            for (run, (_, place)) in layout.places().enumerate().filter(|(_, at)| at.0 == recording) {
                let range = layout.run(run);
                let share = (laps[place] as f64 / total as f64).sqrt();
                mean.axpy(share, &residual.rows(range.start, range.len()), 1.0);
                all += squares(range);
            }
            means += mean.norm_squared();
        }
        let each = |range: &dyn Fn(usize) -> std::ops::Range<usize>| {
            (0..recordings).map(|g| squares(range(g))).sum::<f64>()
        };
        Self {
            mean: Quadratic::new(means, recordings * layout.lap),
            runs: Quadratic::new(all - means, (layout.runs() - recordings) * layout.lap),
            trend: Quadratic::new(each(&|g| layout.trend(g)), recordings * layout.lap),
            noise: Quadratic::of_estimated(each(&|g| layout.noise(g)), recordings, SECOND),
            start: Quadratic::of_estimated(
                each(&|g| layout.beginning(g)),
                (0..recordings).filter(|&g| layout.is_begun(g)).count(),
                BEGINNING,
            ),
        }
    }

    fn all(&self) -> [Quadratic; 5] {
        [self.mean, self.runs, self.trend, self.noise, self.start]
    }

    /// Whether laps that depart so from a model with effects speak against these, where they depart from the declared model as they did
    /// `before`: more than chance allows is left, and not little of what they showed.
    pub fn contradict(&self, before: &Self) -> bool {
        /// Probability below which laps contradict.
        const CONTRADICTS_P: f64 = 1e-5;
        /// Share of the excess that may be left all the same.
        const LITTLE: f64 = 0.2;
        self.omnibus_p() < CONTRADICTS_P && self.excess() >= LITTLE * before.excess()
    }

    /// What exceeds the expectation in all together.
    pub fn excess(&self) -> f64 {
        self.all().iter().map(Quadratic::excess).sum()
    }

    /// All together.
    fn together(&self) -> Quadratic {
        let q = self.all().iter().map(|number| number.q).sum();
        let freedom = self.all().iter().map(|number| number.freedom).sum();
        Quadratic::new(q, freedom)
    }

    /// Those that are known with their names in files.
    pub fn named(&self) -> Vec<(&'static str, Quadratic)> {
        let names = ["mean", "runs", "trend", "noise", "start"];
        let all = names.into_iter().zip(self.all());
        // Of one run nothing is expected from run to run, and that is known.
        all.filter(|(name, number)| *name != "start" || number.freedom > 0)
            .collect()
    }

    /// The names of those that depart from what is expected.
    pub fn departing(&self) -> Vec<&'static str> {
        let departing = self.named().into_iter().filter(|(_, number)| number.p < ALARM_P);
        departing.map(|(name, _)| name).collect()
    }

    /// Whether chance alone often makes as much of all together.
    pub(crate) fn excess_is_chance(&self) -> bool {
        const OFTEN_P: f64 = 0.05;
        self.together().p > OFTEN_P
    }

    /// All together as a multiple of what chance makes of them.
    pub(crate) fn times_chance(&self) -> f64 {
        let Quadratic { q, freedom, .. } = self.together();
        q / freedom as f64
    }

    /// Probability that the smallest of them is as small as it is: that times their number (Bonferroni).
    pub fn omnibus_p(&self) -> f64 {
        let all = self.named();
        let least = all.iter().map(|(_, number)| number.p).fold(1.0, f64::min);
        (all.len() as f64 * least).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use sim::Streams;

    use super::*;

    #[test]
    fn enormous_sums_are_no_chance() {
        for q in [1e3, 1e9, 1e20, 1e300, f64::INFINITY] {
            let found = Quadratic::of_estimated(q, 1, SECOND);
            assert!(found.p < 1e-9, "{found:?}");
        }
        let usual = Quadratic::of_estimated(SECOND as f64, 1, SECOND).p;
        assert!((0.3..0.7).contains(&usual), "{usual}");
    }

    #[test]
    fn one_recording_has_hotellings_law() {
        let (n, p) = (NULL_SETS as f64 - 1.0, SECOND as f64);
        for q in [10.0, 21.0, 40.0, 60.0] {
            // With the mean p.
            let t2 = q * n / (n - p - 1.0);
            let law = FisherSnedecor::new(p, n - p + 1.0).unwrap();
            let exact = law.sf(t2 * (n - p + 1.0) / (n * p));
            let found = Quadratic::of_estimated(q, 1, SECOND).p;
            assert!((found / exact - 1.0).abs() < 1e-9, "{q}: {found} {exact}");
        }
    }

    #[test]
    fn sums_over_recordings_are_as_often_large_as_they_should_be() {
        const DRAWS: usize = 4000;
        let mut stream = Streams { seed: 7, run: 0 }.open("noise");
        let mut square = |count: usize| (0..count).map(|_| stream.normal().powi(2)).sum::<f64>();
        let below = NULL_SETS as usize - SECOND;
        for recordings in [2, 10] {
            let of_one =
                |square: &mut dyn FnMut(usize) -> f64| square(SECOND) / square(below) * (below as f64 - 2.0);
            let rare = (0..DRAWS).filter(|_| {
                let q = (0..recordings).map(|_| of_one(&mut square)).sum();
                Quadratic::of_estimated(q, recordings, SECOND).p < 0.01
            });
            let rare = rare.count();
            // Forty, with a standard deviation of six.
            assert!((22..=58).contains(&rare), "{recordings}: {rare}");
        }
    }
}
