//! The most likely size of an effect that does little, by the likelihood itself.

use nalgebra::{Matrix2, Vector2};

use super::hypothesis::Hypothesis;
use super::likelihood::Fit;
use super::parabola::{Local, Sides};
use super::part::Freedom;
use super::refine::SETTLED;
use super::simulated::Evaluated;
use super::trial::Trial;

/// Log-likelihood by which the ends of a step may differ from its middle for a parabola through the three to tell more than one
/// through means, and that by which it is clear with few data sets that they differ by more.
const FAR: f64 = 200.0;
const VERY_FAR: f64 = 400.0;

/// Standard errors that are as good as none where the noise of the simulations is as large.
const NOISY: f64 = 1.5;

/// Where a parabola through the log-likelihoods of a hypothesis and of a step to either side, and those of looks before, is highest.
pub(super) struct Likeliest {
    pub(super) moved: f64,
    /// Standard error of the move.
    pub(super) error: f64,
    /// Whether it is within that error, or within what noise makes of it.
    pub(super) is_near: bool,
    /// Log-likelihood that the move is hoped to gain.
    pub(super) hoped: f64,
    /// The hypothesis itself, without the price of its numbers.
    pub(super) gain: f64,
    pub(super) fit: Fit,
    /// The hypothesis simulated.
    pub(super) center: Evaluated,
    /// What this look told, and those before.
    pub(super) rises: Rises,
}

/// How much more likely one number is at some places than at others, as looks about several of these told.
#[derive(Debug, Clone, Default)]
pub(super) struct Rises(Vec<Rise>);

/// How much more likely a number is at one place than at another; places are from where it is now.
#[derive(Debug, Clone, Copy)]
struct Rise {
    from: f64,
    to: f64,
    more: f64,
    /// Standard deviation of that for the simulation's own error.
    error: f64,
}

impl Trial<'_> {
    /// Where the likelihood itself is highest near a hypothesis of one number; `None` of more, at the end of its range, and where its
    /// step spans so many errors that a parabola through means tells more. An effect on noise does more to the scatter than to
    /// the means, whose parabolas then are mostly noise.
    pub(super) fn likeliest(
        &self,
        hypothesis: &Hypothesis,
        freedoms: &[Freedom],
        local: &Local,
        sets: u64,
        before: &Rises,
    ) -> Option<Likeliest> {
        let [freedom] = freedoms else {
            return None;
        };
        let [Sides { down, up, .. }] = local.sides.as_slice() else {
            return None;
        };
        let ((at_down, &[down]), (at_up, &[up])) = (
            (&down.simulated, down.by.as_slice()),
            (&up.simulated, up.by.as_slice()),
        ) else {
            return None;
        };
        if down == 0.0 || up == 0.0 {
            return None;
        }
        let rough = self.fit(&local.center)?.gain;
        let far = |side: &Evaluated| {
            self.fit(side)
                .is_none_or(|fit| (fit.gain - rough).abs() > VERY_FAR)
        };
        if far(at_down) || far(at_up) {
            return None;
        }
        let more = |moved: f64, evaluated: &Evaluated| {
            let there = hypothesis.moved(self.atlas, &[(*freedom, moved)]);
            self.evaluate_more(&there, evaluated, sets)
        };
        let simulated = more(0.0, &local.center)?;
        let center = self.fit_with_error(&simulated)?;
        let gained =
            |moved: f64, evaluated: &Evaluated| Some(self.fit(&more(moved, evaluated)?)?.gain - center.gain);
        let (down, up) = ((down, gained(down, at_down)?), (up, gained(up, at_up)?));
        let rises = before.with([down, up], center.gain_error);
        let top = rises.top(down, up)?;
        let moved = freedom.possible(top.place);
        let there = hypothesis.moved(self.atlas, &[(*freedom, moved)]);
        Some(Likeliest {
            moved,
            error: top.error,
            is_near: top.between
                && top.place.abs() < (SETTLED * top.error).max(top.noise.min(NOISY * top.error)),
            hoped: top.height,
            gain: center.fair_gain(),
            fit: center,
            center: simulated,
            rises: rises.from(there.apart(hypothesis, freedom, self.atlas)),
        })
    }
}

/// The top of a parabola.
struct Top {
    place: f64,
    /// Its standard error if the heights are log-likelihoods.
    error: f64,
    /// Its standard deviation for the simulation's own error.
    noise: f64,
    height: f64,
    /// Whether it lies between the points.
    between: bool,
}

impl Rises {
    /// The same with what a look told of places about the one where the number is now.
    fn with(&self, heights: [(f64, f64); 2], error: f64) -> Self {
        let seen = heights.map(|(to, more)| Rise {
            from: 0.0,
            to,
            more,
            error,
        });
        Self(self.0.iter().copied().chain(seen).collect())
    }

    /// The same once the number has moved.
    fn from(mut self, moved: f64) -> Self {
        for rise in &mut self.0 {
            rise.from -= moved;
            rise.to -= moved;
        }
        self
    }

    /// The top of the parabola nearest to all that was seen, the last look at two places, or how far to go towards one that is not in
    /// sight; `None` where these are so far down that they tell little of a top.
    fn top(&self, down: (f64, f64), up: (f64, f64)) -> Option<Top> {
        /// Times the distance of the points by which a parabola is trusted.
        const MOST: f64 = 2.5;
        let ((a, at_a), (b, at_b)) = (down, up);
        if at_a.abs().max(at_b.abs()) > FAR {
            return None;
        }
        let (slope, curvature, covariance) = self.parabola()?;
        if curvature >= 0.0 {
            let (end, height) = if at_b > at_a { (b, at_b) } else { (a, at_a) };
            let is_noise = self.0.last().is_some_and(|last| height < last.error);
            let (place, height) = if is_noise { (0.0, 0.0) } else { (2.0 * end, height) };
            return Some(Top {
                place,
                error: b - a,
                noise: b - a,
                height,
                between: false,
            });
        }
        let top = -0.5 * slope / curvature;
        let place = top.clamp(MOST * a, MOST * b);
        let change = Vector2::new(-0.5 / curvature, -top / curvature);
        Some(Top {
            place,
            error: (-0.5 / curvature).sqrt().min(b - a),
            noise: change.dot(&(covariance * change)).sqrt(),
            height: slope * place + curvature * place * place,
            between: (a..=b).contains(&place),
        })
    }

    /// Slope and curvature of a parabola by least squares, and their covariance; of two places that through both.
    fn parabola(&self) -> Option<(f64, f64, Matrix2<f64>)> {
        /// Share of a height by which the likelihood is no parabola.
        const FAULT: f64 = 0.2;
        let unit = self
            .0
            .iter()
            .map(|seen| (seen.to - seen.from).abs())
            .fold(0.0, f64::max);
        let (mut normal, mut products) = (Matrix2::zeros(), Vector2::zeros());
        for Rise {
            from,
            to,
            more,
            error,
        } in &self.0
        {
            let (from, to) = (from / unit, to / unit);
            let terms = Vector2::new(to - from, to * to - from * from);
            let weight = (error * error + (FAULT * more).powi(2)).recip();
            normal += terms * terms.transpose() * weight;
            products += terms * (more * weight);
        }
        let units = Matrix2::from_diagonal(&Vector2::new(unit.recip(), unit.powi(-2)));
        let covariance = normal.try_inverse()?;
        let found = units * covariance * products;
        Some((found.x, found.y, units * covariance * units))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ERROR: f64 = 0.3;

    fn top(down: (f64, f64), up: (f64, f64)) -> Option<Top> {
        Rises::default().with([down, up], ERROR).top(down, up)
    }

    #[test]
    fn a_normal_likelihood_is_highest_at_its_mean() {
        let (mean, deviation) = (0.7, 0.4);
        let at = |x: f64| -0.5 * (((x - mean) / deviation).powi(2) - (mean / deviation).powi(2));
        let found = top((-0.5, at(-0.5)), (0.6, at(0.6))).unwrap();
        assert!((found.place - mean).abs() < 1e-12 && (found.error - deviation).abs() < 1e-12);
        assert!((found.height - at(mean)).abs() < 1e-12);
        assert!(!found.between && top((-0.5, at(-0.5)), (0.8, at(0.8))).unwrap().between);
    }

    #[test]
    fn a_likelihood_without_a_top_in_sight_is_climbed() {
        // Convex, and rising to a top far outside.
        for (down, up, place) in [(0.5, 2.0, 2.0), (2.0, 0.5, -2.0), (-1.0, 0.99, 2.5)] {
            let found = top((-1.0, down), (1.0, up)).unwrap();
            assert!(found.place == place && !found.between, "{}", found.place);
        }
        // The points are so far apart that means tell more.
        assert!(top((-1.0, -1.1 * FAR), (1.0, -1.2 * FAR)).is_none());
    }

    #[test]
    fn what_rises_by_noise_is_not_climbed() {
        let found = top((-1.0, 0.9 * ERROR), (1.0, 0.5 * ERROR)).unwrap();
        assert!(found.place == 0.0 && found.height == 0.0 && !found.between);
    }

    /// A look far out tells the curvature that noise hides near the top.
    #[test]
    fn looks_before_count_by_their_errors() {
        let (mean, noise) = (0.5, 3.0);
        let at = |x: f64| -0.5 * (x - mean).powi(2);
        let far = [-8.0, 8.0].map(|x| (x, at(x) - at(0.0)));
        let before = Rises::default().with(far, noise).from(0.0);
        let near = [(-1.5, 2.0), (1.5, 1.0)];
        let found = before.with(near, noise).top(near[0], near[1]).unwrap();
        assert!((found.place - mean).abs() < 1.0 && (found.error - 1.0).abs() < 0.2);
        // From another place the top is where it was.
        let moved = before.with(near, noise).from(0.3);
        let again = moved.top(near[0], near[1]).unwrap();
        assert!((again.place + 0.3 - found.place).abs() < 1e-9 && (again.error - found.error).abs() < 1e-9);
    }

    #[test]
    fn noise_of_the_top_is_that_of_two_heights() {
        // At three deviations to either side heights are off by noise: half their difference, over three.
        let found = top((-3.0, -4.5), (3.0, -4.5)).unwrap();
        let own = (ERROR * ERROR + (0.2 * 4.5_f64).powi(2)).sqrt();
        assert!(
            (found.noise - own / 2.0_f64.sqrt() / 3.0).abs() < 1e-9,
            "{}",
            found.noise
        );
    }
}
