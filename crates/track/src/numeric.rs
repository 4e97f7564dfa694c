/// Where a function changes sign between `low` and `high`: Newton steps, halved where they leave the bracket.
/// `value` returns the function and its derivative; its signs at the two ends must differ, or one of them be zero.
pub(crate) fn sign_change(mut low: f64, mut high: f64, value: impl Fn(f64) -> (f64, f64)) -> f64 {
    let rises = value(low).0 < value(high).0;
    let mut x = 0.5 * (low + high);
    for _ in 0..100 {
        let (y, slope) = value(x);
        if (y < 0.0) == rises {
            low = x;
        } else {
            high = x;
        }
        let newton = x - y / slope;
        let next = if newton >= low && newton <= high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - x).abs() <= 1e-15 + 1e-14 * x.abs() {
            return next;
        }
        x = next;
    }
    x
}

/// Calls `visit` with every root of `c0 + c1 u + c2 u^2` in the open interval (0, 1), rising.
fn quadratic_roots(c: [f64; 3], mut visit: impl FnMut(f64)) {
    let discriminant = c[1] * c[1] - 4.0 * c[0] * c[2];
    if discriminant < 0.0 {
        return;
    }
    // the sum of two numbers of one sign loses no digits
    let q = -0.5 * (c[1] + discriminant.sqrt().copysign(c[1]));
    let (x, y) = (q / c[2], c[0] / q);
    for root in [x.min(y), x.max(y)] {
        if root > 0.0 && root < 1.0 {
            visit(root);
        }
    }
}

/// Calls `visit` with every extremum of the cubic in the open interval (0, 1), rising.
pub(crate) fn cubic_extrema(c: [f64; 4], visit: impl FnMut(f64)) {
    quadratic_roots([c[1], 2.0 * c[2], 3.0 * c[3]], visit);
}

/// Calls `visit` with every sign change of the cubic `c0 + c1 u + c2 u^2 + c3 u^3` in [0, 1], rising.
pub(crate) fn cubic_roots(c: [f64; 4], mut visit: impl FnMut(f64)) {
    let end = c[0] + c[1] + c[2] + c[3];
    let hull = [c[0], c[0] + c[1] / 3.0, c[0] + (2.0 * c[1] + c[2]) / 3.0, end];
    if hull.iter().all(|&y| y > 0.0) || hull.iter().all(|&y| y < 0.0) {
        return;
    }
    let value = |u: f64| {
        (
            c[0] + u * (c[1] + u * (c[2] + u * c[3])),
            c[1] + u * (2.0 * c[2] + u * 3.0 * c[3]),
        )
    };
    let mut low = 0.0;
    let mut between = |low: f64, high: f64| {
        if (value(low).0 < 0.0) != (value(high).0 < 0.0) {
            visit(sign_change(low, high, value));
        }
    };
    cubic_extrema(c, |u| {
        between(low, u);
        low = u;
    });
    between(low, 1.0);
}

/// Nodes and weights of the Gauss-Legendre rule with five points on [-1, 1] (Abramowitz and Stegun, table 25.4).
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Integral of a smooth function over a short interval.
pub(crate) fn integral(low: f64, high: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    half * GAUSS
        .iter()
        .map(|(x, weight)| weight * value(middle + half * x))
        .sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roots(c: [f64; 4]) -> Vec<f64> {
        let mut found = Vec::new();
        cubic_roots(c, |u| found.push(u));
        found
    }

    #[test]
    fn cubic_with_three_roots_gives_all_of_them() {
        // (u - 0.2)(u - 0.5)(u - 0.9)
        let found = roots([-0.09, 0.73, -1.6, 1.0]);
        for (found, truth) in found.iter().zip([0.2, 0.5, 0.9]) {
            assert!((found - truth).abs() < 1e-13, "{found} instead of {truth}");
        }
        assert_eq!(found.len(), 3);
    }

    #[test]
    fn lower_degrees_are_cubics_too() {
        assert_eq!(roots([1.0, 0.0, 0.0, 0.0]), []);
        assert_eq!(roots([-0.25, 1.0, 0.0, 0.0]), [0.25]);
        assert_eq!(roots([-0.25, 0.0, 1.0, 0.0]), [0.5]);
        assert_eq!(
            roots([0.25, -1.0, 1.0, 0.0]).len() % 2,
            0,
            "a double root is no crossing"
        );
    }

    #[test]
    fn five_points_integrate_the_ninth_degree_exactly() {
        let found = integral(0.0, 2.0, |x| x.powi(9));
        assert!((found - 102.4).abs() < 1e-12, "{found}");
    }
}
