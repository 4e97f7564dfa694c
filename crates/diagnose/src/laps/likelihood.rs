//! How likely data are under a simulated hypothesis.

use rayon::prelude::*;

use super::atlas::{Atlas, White, white};
use super::expectation::{Expectation, Scatter};
use super::simulated::Evaluated;
use super::summary::Summary;
use super::trial::Trial;

/// How far the expectation of a simulated hypothesis may be off.
#[derive(Debug, Clone, Copy)]
pub(super) struct Doubt {
    /// Variance in units of one data set's own.
    pub(super) error: f64,
    /// Whether all runs were taken to be alike, so that they share one error.
    pub(super) alike: bool,
}

/// What a simulated hypothesis leaves of the data.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    /// In units of the hypothesis' own scatter and of the simulation's error.
    pub(super) residual: White,
    /// Log-likelihood gained over the declared model.
    pub(super) gain: f64,
    /// What the simulation's own error is expected to take of it.
    pub(super) lost_to_doubt: f64,
    /// Standard deviation of the gain for the simulation's own error.
    pub(super) gain_error: f64,
    /// The part of that which is due to the error of the simulated mean laps.
    error_of_mean: f64,
}

impl Fit {
    /// The gain with what the simulation's own error is expected to take of it: rounds simulate more or less often.
    pub(super) fn fair_gain(&self) -> f64 {
        self.gain + self.lost_to_doubt
    }
}

impl Trial<'_> {
    /// How well a simulated hypothesis explains the data; `None` if it was simulated too seldom to know its scatter.
    pub(super) fn fit(&self, simulated: &Evaluated) -> Option<Fit> {
        let scatter = self.atlas.scatter_of(simulated.summaries.iter(), 1)?;
        Some(self.fit_in(simulated, &scatter))
    }

    /// As [`Trial::fit`], with an error of the gain as its data sets tell it: laps with heavy tails differ more from one to the
    /// next than their covariance says.
    pub(super) fn fit_with_error(&self, simulated: &Evaluated) -> Option<Fit> {
        let fit = self.fit(simulated)?;
        let gain_error = fit
            .gain_error
            .max(self.jackknife_error(simulated, |part| self.fit(part)));
        Some(Fit { gain_error, ..fit })
    }

    /// How well simulated hypotheses that explain data about as well do so: they are told apart by what they do to the mean, and by
    /// their scatter only as far as theirs differ by more than chance. The errors of their gains are those that they do not share: of
    /// their means, and by a jackknife as much larger as those of all of them are.
    pub(super) fn fits_of_rivals(&self, rivals: &[&Evaluated]) -> Option<Vec<Fit>> {
        let scatters = self.atlas.scatters_of(rivals)?;
        if let ([only], [scatter]) = (rivals, scatters.as_slice()) {
            return Some(vec![self.fit_in(only, scatter)]);
        }
        let fit = |(rival, scatter): (&&Evaluated, &Vec<Scatter>)| {
            let fit = self.fit_in(rival, scatter);
            let by_jackknife = self.jackknife_error(rival, |part| Some(self.fit_in(part, scatter)));
            (fit, by_jackknife)
        };
        let found: Vec<(Fit, f64)> = rivals.par_iter().zip(&scatters).map(fit).collect();
        let sum = |square: fn(&(Fit, f64)) -> f64| found.iter().map(square).sum::<f64>();
        let larger = sum(|found| found.1.powi(2)) / sum(|found| found.0.error_of_mean.powi(2));
        let larger = larger.sqrt().max(1.0);
        let with_own_error = |(fit, _): (Fit, f64)| Fit {
            gain_error: fit.error_of_mean * larger,
            ..fit
        };
        Some(found.into_iter().map(with_own_error).collect())
    }

    /// The standard deviation of the gain by a jackknife that leaves out a part of the data sets after the other; none if they
    /// are too few.
    fn jackknife_error(&self, simulated: &Evaluated, fit: impl Fn(&Evaluated) -> Option<Fit>) -> f64 {
        const PARTS: usize = 4;
        let gain_without = |part: usize| {
            let kept = |&(set, _): &(usize, &Summary)| set % PARTS != part;
            let kept = simulated.summaries.iter().enumerate().filter(kept);
            let (sets, summaries): (Vec<usize>, Vec<Summary>) =
                kept.map(|(set, summary)| (set, summary.clone())).unzip();
            let declared: Vec<&Expectation> = sets.iter().map(|&set| &self.atlas.samples[set]).collect();
            let fit = fit(&self.atlas.evaluated(summaries, &declared, simulated.doubt.alike))?;
            Some(fit.fair_gain())
        };
        let gains: Vec<f64> = (0..PARTS).filter_map(gain_without).collect();
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let squares: f64 = gains.iter().map(|gain| (gain - mean).powi(2)).sum();
        if gains.len() == PARTS {
            ((count - 1.0) / count * squares).sqrt()
        } else {
            0.0
        }
    }

    /// How well a simulated hypothesis with a known scatter explains the data.
    pub(super) fn fit_in(&self, simulated: &Evaluated, scatter: &[Scatter]) -> Fit {
        let residual = white(scatter, &self.atlas.layout, self.data, &simulated.expectation);
        self.fit_of(residual, scatter, simulated.doubt)
    }

    /// The fit that leaves a residual in units of the hypothesis' own scatter.
    pub(super) fn fit_of(&self, mut residual: White, scatter: &[Scatter], doubt: Doubt) -> Fit {
        let before = self.atlas.white(self.data, &self.atlas.null).norm_squared();
        let (widened, doubtful) = self.atlas.allow_for(&mut residual, doubt);
        let of_mean = doubtful * doubt.error;
        let (mut wider, mut variance) = (widened, of_mean);
        for (g, (own, declared)) in scatter.iter().zip(&self.atlas.scatter).enumerate() {
            // Every run's mean lap and the trend are each a draw of one lap's covariance.
            let draws = (self.atlas.layout.laps[g].len() + 1) as f64;
            wider +=
                draws * (own.log_det - declared.log_det) + own.log_det_second() - declared.log_det_second();
            // A quadratic form in an estimated covariance, and its determinant (Wishart).
            let size = self.atlas.layout.lap as f64;
            variance += 0.5 * draws * size * (size + draws) / own.freedom;
        }
        Fit {
            gain: 0.5 * (before - residual.norm_squared() - wider),
            lost_to_doubt: 0.5 * widened,
            gain_error: variance.sqrt(),
            error_of_mean: of_mean.sqrt(),
            residual,
        }
    }
}

impl Atlas {
    /// Brings a residual to unit variance where the expectation is in doubt. Returns the logarithm of the determinant by which
    /// that widens the law, and the square of what lay where the doubt is.
    pub(super) fn allow_for(&self, residual: &mut White, doubt: Doubt) -> (f64, f64) {
        let Doubt { error, alike } = doubt;
        let (mut widened, mut doubtful) = (0.0, 0.0);
        let mut run = 0;
        for (g, laps) in self.layout.laps.iter().enumerate() {
            let runs: Vec<_> = (run..run + laps.len()).map(|r| self.layout.run(r)).collect();
            run += laps.len();
            let mut own = vec![self.layout.trend(g), self.layout.second(g)];
            if alike {
                let (length, shares) = shared_error(laps);
                let mut along = White::zeros(self.layout.lap);
                for (range, share) in runs.iter().zip(&shares) {
                    along.axpy(*share, &residual.rows(range.start, range.len()), 1.0);
                }
                let variance = 1.0 + error * length;
                for (range, share) in runs.iter().zip(&shares) {
                    residual.rows_mut(range.start, range.len()).axpy(
                        share * (variance.sqrt().recip() - 1.0),
                        &along,
                        1.0,
                    );
                }
                widened += self.layout.lap as f64 * variance.ln();
                doubtful += length * along.norm_squared();
            } else {
                own.extend(runs);
            }
            for range in own {
                let mut part = residual.rows_mut(range.start, range.len());
                doubtful += part.norm_squared();
                part /= (1.0 + error).sqrt();
                widened += range.len() as f64 * (1.0 + error).ln();
            }
        }
        (widened, doubtful)
    }

    /// The scatter of each of several simulated hypotheses that explain data about as well: the same for all but for what
    /// chance does not explain. `None` if they were simulated too seldom.
    fn scatters_of(&self, rivals: &[&Evaluated]) -> Option<Vec<Vec<Scatter>>> {
        let Some(sets) = rivals.iter().map(|rival| rival.summaries.len()).min() else {
            return Some(Vec::new());
        };
        let all = rivals.iter().flat_map(|rival| &rival.summaries[..sets]);
        let common = self.scatter_of(all, rivals.len())?;
        let of = |rival: &&Evaluated| {
            let own = |(g, common): (usize, &Scatter)| {
                common.unless_apart(rival.summaries.iter().map(move |summary| &summary.0[g]))
            };
            common.iter().enumerate().map(own).collect()
        };
        rivals.par_iter().map(of).collect()
    }

    /// The scatter of simulated data sets, recording by recording; of each there are so many copies, simulated with the same
    /// draws.
    pub(super) fn scatter_of<'a>(
        &self,
        summaries: impl Iterator<Item = &'a Summary> + Clone,
        copies: usize,
    ) -> Option<Vec<Scatter>> {
        let of = |(g, declared): (usize, &Scatter)| {
            Scatter::near(
                summaries.clone().map(move |summary| &summary.0[g]),
                copies,
                declared,
            )
        };
        self.scatter.iter().enumerate().map(of).collect()
    }
}

/// An error that the runs of a recording share, the unweighted mean of theirs: its squared length where each run counts by the
/// root of its laps, and its direction.
fn shared_error(laps: &[usize]) -> (f64, Vec<f64>) {
    let runs = laps.len() as f64;
    let total: f64 = laps.iter().map(|&n| n as f64).sum();
    let of_mean: f64 = laps.iter().map(|&n| 1.0 / n as f64).sum::<f64>() / (runs * runs);
    let shares = laps.iter().map(|&n| (n as f64 / total).sqrt()).collect();
    (total * of_mean, shares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::atlas::Extent;
    use crate::laps::testing::{aside, atlas, simulated};

    #[test]
    fn rivals_are_told_apart_by_their_means_and_not_by_how_their_scatters_are_off() {
        let atlas = atlas();
        let runs = simulated(&aside(100.0), 1000, Extent::Whole).unwrap();
        let data = atlas.observed(&runs).unwrap();
        let trial = Trial::new(&atlas, &simulated, &data);
        // These two are simulated with different draws.
        let [one, other] =
            [99.9, 100.1].map(|mm| atlas.simulated(&simulated, &aside(mm), 32, &atlas.spent).unwrap());
        // Of laps that scatter by 1 mm about 100 mm, by the difference of their squared distances.
        let laps = runs.iter().flat_map(|run| &run.laps);
        let off_mm = laps.flat_map(|lap| lap.smooth.offsets_m.iter().map(|m| 1000.0 * m - 100.0));
        let exact = -0.2 * off_mm.sum::<f64>();
        let apart = |fits: &[Fit]| fits[0].fair_gain() - fits[1].fair_gain();
        let error = |fits: &[Fit]| fits[0].gain_error.hypot(fits[1].gain_error);
        let together = trial.fits_of_rivals(&[&one, &other]).unwrap();
        let alone = [&one, &other].map(|rival| trial.fit_with_error(rival).unwrap());
        let off = (apart(&together) - exact).abs();
        assert!(off < error(&together), "{off} +- {}", error(&together));
        assert!(error(&together) < 0.7 * error(&alone), "{}", error(&alone));
    }

    #[test]
    fn runs_of_equal_length_share_the_whole_error() {
        let (length, shares) = shared_error(&[20; 4]);
        assert!((length - 1.0).abs() < 1e-12);
        assert!(shares.iter().all(|share| (share - 0.5).abs() < 1e-12));
    }

    #[test]
    fn the_direction_of_a_shared_error_has_length_one() {
        let (length, shares) = shared_error(&[3, 5, 20]);
        let square: f64 = shares.iter().map(|s| s * s).sum();
        assert!((square - 1.0).abs() < 1e-12);
        // Variance 1/9 (1/3 + 1/5 + 1/20) of the mean of the means, times 28 laps.
        assert!((length - 28.0 / 9.0 * (1.0 / 3.0 + 0.2 + 0.05)).abs() < 1e-12);
    }
}
