//! The most likely size of an effect that does little, by the likelihood itself.

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

/// Where a parabola through the log-likelihoods of a hypothesis and of a step to either side is highest.
pub(super) struct Likeliest {
    pub(super) moved: f64,
    /// Standard error of the move.
    pub(super) error: f64,
    /// Whether it is within that error.
    pub(super) is_near: bool,
    /// Log-likelihood that the move is hoped to gain.
    pub(super) hoped: f64,
    /// The hypothesis itself, without the price of its numbers.
    pub(super) gain: f64,
    pub(super) fit: Fit,
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
            self.evaluate_more(&there, evaluated.clone(), sets)
        };
        let center = self.fit_with_error(&more(0.0, &local.center)?)?;
        let gained =
            |moved: f64, evaluated: &Evaluated| Some(self.fit(&more(moved, evaluated)?)?.gain - center.gain);
        let top = top((down, gained(down, at_down)?), (up, gained(up, at_up)?))?;
        Some(Likeliest {
            moved: freedom.possible(top.place),
            error: top.error,
            is_near: top.between && top.place.abs() < SETTLED * top.error,
            hoped: top.height,
            gain: center.gain + center.lost_to_doubt,
            fit: center,
        })
    }
}

/// The top of a parabola.
struct Top {
    place: f64,
    /// Its standard error if the heights are log-likelihoods.
    error: f64,
    height: f64,
    /// Whether it lies between the points.
    between: bool,
}

/// The top of a parabola through nothing at 0 and two heights, or how far to go towards one that is not in sight; `None` where
/// the heights are so far down that they tell little of a top.
fn top(down: (f64, f64), up: (f64, f64)) -> Option<Top> {
    /// Times the distance of the points by which a parabola is trusted.
    const MOST: f64 = 2.5;
    let ((a, at_a), (b, at_b)) = (down, up);
    if at_a.abs().max(at_b.abs()) > FAR {
        return None;
    }
    let curvature = (at_b / b - at_a / a) / (b - a);
    let slope = at_b / b - curvature * b;
    if curvature >= 0.0 {
        let (end, height) = if at_b > at_a { (b, at_b) } else { (a, at_a) };
        return Some(Top {
            place: 2.0 * end,
            error: b - a,
            height: height.max(0.0),
            between: false,
        });
    }
    let place = (-0.5 * slope / curvature).clamp(MOST * a, MOST * b);
    Some(Top {
        place,
        error: (-0.5 / curvature).sqrt().min(b - a),
        height: slope * place + curvature * place * place,
        between: (a..=b).contains(&place),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
