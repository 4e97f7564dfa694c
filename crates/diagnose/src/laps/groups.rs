//! Causes without a name: groups of basis functions of what a cause may depend on.

use nalgebra::{DMatrix, DVector};
use sim::UNLISTED;

use super::areas::areas;
use super::atlas::White;
use super::hypothesis::Hypothesis;
use super::part::Part;
use super::probe::Probe;
use super::screen::price;
use super::steadiness::{Asked, Settling};
use super::trial::Trial;
use crate::candidate::{WORDS, unlisted_values};

/// Data sets simulated for each coefficient.
const GROUP_SETS: u64 = 2;

/// Groups within this share of the best explained are as good; of those the one with fewest coefficients is best.
const AS_GOOD: f64 = 0.97;

/// Every target with every dependence, as probes that have no path but only numbers to fit.
pub(super) fn groups() -> Vec<Probe> {
    let mut probes = Vec::new();
    for target in TARGETS {
        for (dependence, basis, scales) in DEPENDENCES {
            // A constant has a name of its own: only what varies counts.
            let first = usize::from(basis == "polynomial");
            probes.extend(group(target, [dependence, basis], scales, first));
        }
        probes.extend(group(target, ["time", SETTLING], &[1.0, 1.0], 0));
    }
    probes.extend(areas());
    probes.extend(group(("camera scale", 0.004), TILT, &[1.0, 2.0, 2.0], 1));
    for wheel in ["wheel speed", "left wheel", "right wheel"] {
        probes.extend(group((wheel, 0.02), [WHEEL_ANGLE, "harmonics"], &[1.0], 0));
    }
    probes
}

/// A target with a dependence on a basis whose coefficients, from the first that is free on, have such steps.
fn group(
    (target, step): (&str, f64),
    [dependence, basis]: [&str; 2],
    scales: &[f64],
    first: usize,
) -> Option<Probe> {
    let origin = unlisted_values([target, dependence, basis], scales.len())?;
    let free = (first..scales.len())
        .map(|i| (WORDS + i, step * scales[i]))
        .collect();
    Some(Probe::group(&UNLISTED, origin, free))
}

/// The basis of what settles while a run goes on. Only what was seen to settle is tried with it.
const SETTLING: &str = "settling";

/// The angle of a wheel. Only what was seen to ripple is tried with it.
const WHEEL_ANGLE: &str = "wheel angle";

/// What a camera's scale depends on that looks at the floor at an angle: in its words, two numbers.
const TILT: [&str; 2] = ["place", "polynomial"];

/// What a cause may act on, with a step over which its action is about linear: rad/s, a share, m/s, counts, m.
const TARGETS: [(&str, f64); 7] = [
    ("yaw rate", 0.02),
    ("wheel speed", 0.02),
    ("side slip", 5e-4),
    ("reading", 0.04),
    ("left-right difference", 6.0),
    ("camera x", 8e-4),
    ("camera y", 8e-4),
];

/// What it may depend on, the basis, and the sizes of its terms relative to the step: arena coordinates reach .6 m,
/// differences of commands .1 m/s, runs about 1500 s.
const DEPENDENCES: [(&str, &str, &[f64]); 5] = [
    ("heading", "harmonics", &[1.0, 1.0, 1.0, 1.0]),
    ("gate", "harmonics", &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
    (
        "place",
        "polynomial",
        &[1.0, 2.0, 2.0, 4.0, 4.0, 4.0, 8.0, 8.0, 8.0, 8.0],
    ),
    ("turn", "polynomial", &[1.0, 20.0, 400.0, 8000.0]),
    ("time", "polynomial", &[1.0, 7e-4, 5e-7]),
];

impl Probe {
    /// Whether it is no group that is screened with the others.
    fn is_tried_apart(&self) -> bool {
        self.settles() || self.turns() || self.tilts() || self.is_an_area()
    }

    /// Whether it goes with the heading or the place, on the floor or along the lap.
    fn goes_with_the_pose(&self) -> bool {
        ["heading", "gate", "place"]
            .iter()
            .any(|word| self.is_group_with(1, word))
    }

    /// Whether it is a group of what settles while a run goes on.
    fn settles(&self) -> bool {
        self.is_group_with(2, SETTLING)
    }

    /// Whether it is a group of what turns with a wheel.
    pub(super) fn turns(&self) -> bool {
        self.is_group_with(1, WHEEL_ANGLE)
    }

    /// Whether it is the group of a tilted camera.
    fn tilts(&self) -> bool {
        self.is_group_with(0, "camera scale")
    }

    pub(super) fn is_group_with(&self, choice: usize, word: &str) -> bool {
        *self.spec == UNLISTED && self.spec.params[choice].choices[self.origin()[choice] as usize] == word
    }
}

impl Trial<'_> {
    /// The groups that explain a residual best at the sizes that linear algebra gives them: the best and those that are as
    /// good with fewer coefficients.
    pub(super) fn screen_groups(&self, residual: &White) -> Vec<Hypothesis> {
        const SHARE: f64 = 0.3;
        let all = self.groups(|probe| !probe.is_tried_apart());
        let found = best_first(self.fitted_groups(residual, &all, GROUP_SETS));
        let most = found.iter().map(|f| f.0).fold(0.0, f64::max);
        (found.into_iter().filter(|f| f.0 > SHARE * most))
            .map(|f| f.2)
            .collect()
    }

    /// Those that go with the heading or the place and explain more than a least log-likelihood of a strong signal, in which noise
    /// hides nothing.
    pub(super) fn screen_groups_over_the_floor(&self, residual: &White, least: f64) -> Vec<Hypothesis> {
        let all = self.groups(|probe| !probe.is_tried_apart() && probe.goes_with_the_pose());
        let found = best_first(self.fitted_groups(residual, &all, 1));
        (found.into_iter().filter(|f| f.0 > least)).map(|f| f.2).collect()
    }

    /// The groups of which something holds, by their numbers.
    pub(super) fn groups(&self, are: impl Fn(&Probe) -> bool) -> Vec<usize> {
        (0..self.atlas.probes.len())
            .filter(|&probe| *self.atlas.probes[probe].spec == UNLISTED && are(&self.atlas.probes[probe]))
            .collect()
    }

    /// A camera that looks at the floor at an angle, as far as that explains a residual, with the score that linear algebra gives
    /// it.
    pub(super) fn screen_tilt(&self, residual: &White) -> Option<(f64, Hypothesis)> {
        let tilts = self.groups(Probe::tilts);
        let (score, _, tilt) = self.fitted_groups(residual, &tilts, GROUP_SETS).pop()?;
        Some((score, tilt))
    }

    /// Groups at the sizes that linear algebra gives them by so many data sets for each coefficient.
    fn fitted_groups(&self, residual: &White, groups: &[usize], sets: u64) -> Vec<FittedGroup> {
        let jobs: Vec<(usize, usize)> = (groups.iter())
            .flat_map(|&probe| (0..self.atlas.probes[probe].free.len()).map(move |i| (probe, i)))
            .collect();
        let actions = self.actions(&jobs, sets);
        // A group of which a part stops the robot has no sizes.
        let fitted = |&probe: &usize| {
            let columns = (jobs.iter().zip(&actions))
                .filter(|((p, _), _)| *p == probe)
                .map(|(_, action)| action.as_ref())
                .collect::<Option<Vec<&White>>>()?;
            let (multiples, gain) = solve(&columns, residual);
            let count = columns.len();
            let part = Part::group(&self.atlas.probes[probe], probe, multiples.as_slice());
            let score = gain - price(count, self.atlas.layout.total_laps());
            Some((score, count, Hypothesis::of(part)))
        };
        groups.iter().filter_map(fitted).collect()
    }

    /// What settles like this and explains a residual best at the sizes that linear algebra gives, target by target.
    pub(super) fn screen_settling(&self, residual: &White, settling: &Settling) -> Vec<Hypothesis> {
        const MOST: usize = 2;
        let settling_groups = self.groups(Probe::settles).into_iter();
        let jobs: Vec<(usize, usize)> = settling_groups.map(|number| (number, 0)).collect();
        let actions = self.actions(&jobs, GROUP_SETS);
        let mut found: Vec<(f64, Hypothesis)> = (jobs.iter().zip(&actions))
            .filter_map(|(&(number, _), action)| {
                let (end, gain) = solve(&[action.as_ref()?], residual);
                let multiples = [end[0], settling.more * end[0]];
                let probe = &self.atlas.probes[number];
                let mut part = Part::group(probe, number, &multiples);
                part.values[0].push(settling.time_s);
                // Laps that count and do not show it would move it by chance.
                let part = match settling.asked {
                    Asked::Counted => part,
                    Asked::All => part.with_tied(settling.at_first(probe.free[1].0), probe),
                };
                Some((gain, Hypothesis::of(part)))
            })
            .collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(MOST);
        found.into_iter().map(|f| f.1).collect()
    }
}

/// A group's score, its number of coefficients, and the group at the sizes that linear algebra gives it.
type FittedGroup = (f64, usize, Hypothesis);

/// The best few groups: of those that are as good the shorter, before those that are not.
fn best_first(mut found: Vec<FittedGroup>) -> Vec<FittedGroup> {
    const MOST: usize = 3;
    let most = found.iter().map(|f| f.0).fold(0.0, f64::max);
    found.sort_by(|a, b| {
        let good = |f: &FittedGroup| f.0 < AS_GOOD * most;
        (good(a), if good(a) { 0 } else { a.1 })
            .cmp(&(good(b), if good(b) { 0 } else { b.1 }))
            .then(b.0.total_cmp(&a.0))
    });
    found.truncate(MOST);
    found
}

/// Multiples of columns nearest to a target, and half the squared distance gained.
pub(super) fn solve(columns: &[&White], target: &White) -> (DVector<f64>, f64) {
    let count = columns.len();
    let normal = DMatrix::from_fn(count, count, |i, j| {
        // A little more on the diagonal keeps columns that are alike from having no solution.
        columns[i].dot(columns[j]) * if i == j { 1.0 + 1e-6 } else { 1.0 }
    });
    let right = DVector::from_fn(count, |i, _| columns[i].dot(target));
    let multiples = normal
        .cholesky()
        .map_or_else(|| DVector::zeros(count), |factor| factor.solve(&right));
    let gain = 0.5 * multiples.dot(&right);
    (multiples, gain)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laps::part::Tied;

    #[test]
    fn what_is_tied_to_a_size_follows_it() {
        let probe = groups().into_iter().find(Probe::settles).unwrap();
        let [end, at_first] = [0, 1].map(|i| probe.free[i].0);
        let tied = Tied {
            parameter: at_first,
            multiple: -0.5,
            error: 0.1,
        };
        let mut part = Part::group(&probe, 0, &[1.0, 7.0]).with_tied(tied, &probe);
        assert_eq!(part.values[0][at_first], -0.5 * part.values[0][end]);
        part.values[0][end] = 3.0;
        part.keep_tied(&probe);
        assert_eq!((part.values[0][at_first], part.fitted_otherwise()), (-1.5, 1));
    }
}
