//! Lines on the page: cut to the frame, thinned to what can be seen.

/// A rectangle on the page, px, y downwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) right: f64,
    pub(crate) bottom: f64,
}

/// A point on the page, px.
pub(crate) type Px = [f64; 2];

/// How far a thinned line of this many points may be from the full one, px: a tenth of a line's width; a long line is
/// dense with noise, where more passes unseen.
pub(crate) fn tolerance_px(points: usize) -> f64 {
    if points > 4000 { 0.35 } else { 0.12 }
}

impl Frame {
    pub(crate) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// Whether the point is inside, or on the frame up to rounding.
    pub(crate) fn holds(&self, [x, y]: Px) -> bool {
        const SLACK_PX: f64 = 1e-6;
        x >= self.left - SLACK_PX
            && x <= self.right + SLACK_PX
            && y >= self.top - SLACK_PX
            && y <= self.bottom + SLACK_PX
    }

    pub(crate) fn clamp(&self, [x, y]: Px) -> Px {
        [x.clamp(self.left, self.right), y.clamp(self.top, self.bottom)]
    }

    /// The part of a segment inside (Liang and Barsky 1984), if there is one.
    pub(crate) fn cut(&self, [from, to]: [Px; 2]) -> Option<[Px; 2]> {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for (step, room) in [
            (-dx, from[0] - self.left),
            (dx, self.right - from[0]),
            (-dy, from[1] - self.top),
            (dy, self.bottom - from[1]),
        ] {
            if step == 0.0 && room < 0.0 {
                return None;
            }
            if step < 0.0 {
                enter = enter.max(room / step);
            } else if step > 0.0 {
                leave = leave.min(room / step);
            }
        }
        let at = |share: f64| match share {
            0.0 => from,
            1.0 => to,
            _ => self.clamp([from[0] + share * dx, from[1] + share * dy]),
        };
        (enter <= leave).then(|| [at(enter), at(leave)])
    }

    /// The parts of a line inside; points that are not finite break it.
    pub(crate) fn cut_line(&self, points: impl IntoIterator<Item = Px>) -> Vec<Vec<Px>> {
        let mut runs: Vec<Vec<Px>> = Vec::new();
        let mut before: Option<Px> = None;
        for point in points {
            let now = (point[0].is_finite() && point[1].is_finite()).then_some(point);
            if let Some([from, to]) = before.zip(now).and_then(|(from, to)| self.cut([from, to])) {
                match runs.last_mut() {
                    Some(run) if run.last() == Some(&from) && Some(from) == before => run.push(to),
                    _ => runs.push(vec![from, to]),
                }
            }
            before = now;
        }
        runs
    }

    /// The part of an area inside (Sutherland and Hodgman 1974).
    pub(crate) fn cut_area(&self, points: Vec<Px>) -> Vec<Px> {
        let sides: [(usize, f64, f64); 4] = [
            (0, self.left, 1.0),
            (0, self.right, -1.0),
            (1, self.top, 1.0),
            (1, self.bottom, -1.0),
        ];
        sides.into_iter().fold(points, |points, (axis, limit, sign)| {
            cut_side(&points, |point| sign * (point[axis] - limit))
        })
    }
}

/// The part of an area where `inside` is not negative; `inside` is linear.
fn cut_side(points: &[Px], inside: impl Fn(Px) -> f64) -> Vec<Px> {
    let mut kept = Vec::with_capacity(points.len() + 4);
    for (index, &to) in points.iter().enumerate() {
        let from = points[(index + points.len() - 1) % points.len()];
        let (a, b) = (inside(from), inside(to));
        if (a < 0.0) != (b < 0.0) {
            let share = a / (a - b);
            kept.push([
                from[0] + share * (to[0] - from[0]),
                from[1] + share * (to[1] - from[1]),
            ]);
        }
        if b >= 0.0 {
            kept.push(to);
        }
    }
    kept
}

/// The fewest points, of those given, that keep within the tolerance of the line (Douglas and Peucker 1973).
pub(crate) fn thin(points: &[Px], tolerance_px: f64) -> Vec<Px> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut kept = vec![false; points.len()];
    kept[0] = true;
    kept[points.len() - 1] = true;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        if let Some(far) = farthest(points, first, last, tolerance_px) {
            kept[far] = true;
            open.push((first, far));
            open.push((far, last));
        }
    }
    points
        .iter()
        .zip(kept)
        .filter_map(|(&point, keep)| keep.then_some(point))
        .collect()
}

/// The point between two others that is farthest from their chord, if it is farther than the tolerance.
fn farthest(points: &[Px], first: usize, last: usize, tolerance_px: f64) -> Option<usize> {
    let (mut far, mut most) = (None, tolerance_px * tolerance_px);
    for index in first + 1..last {
        let distance = squared_distance(points[index], points[first], points[last]);
        if distance > most {
            (far, most) = (Some(index), distance);
        }
    }
    far
}

/// The squared distance from a point to a segment.
fn squared_distance(point: Px, from: Px, to: Px) -> f64 {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let (px, py) = (point[0] - from[0], point[1] - from[1]);
    let length = dx * dx + dy * dy;
    let share = if length > 0.0 {
        ((px * dx + py * dy) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let (ex, ey) = (px - share * dx, py - share * dy);
    ex * ex + ey * ey
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FRAME: Frame = Frame {
        left: 0.0,
        top: 0.0,
        right: 10.0,
        bottom: 10.0,
    };

    #[test]
    fn a_segment_is_cut_at_the_frame() {
        assert_eq!(
            FRAME.cut([[-5.0, 5.0], [15.0, 5.0]]),
            Some([[0.0, 5.0], [10.0, 5.0]])
        );
        assert_eq!(
            FRAME.cut([[1.0, 1.0], [2.0, 2.0]]),
            Some([[1.0, 1.0], [2.0, 2.0]])
        );
        assert_eq!(FRAME.cut([[-1.0, 1.0], [-1.0, 9.0]]), None);
    }

    #[test]
    fn a_line_breaks_at_gaps_and_outside() {
        let line = [
            [1.0, 1.0],
            [2.0, 1.0],
            [f64::NAN, 0.0],
            [3.0, 1.0],
            [20.0, 1.0],
            [20.0, 2.0],
            [3.0, 2.0],
        ];
        let runs = FRAME.cut_line(line);
        let expected: Vec<Vec<Px>> = vec![
            vec![[1.0, 1.0], [2.0, 1.0]],
            vec![[3.0, 1.0], [10.0, 1.0]],
            vec![[10.0, 2.0], [3.0, 2.0]],
        ];
        assert_eq!(runs, expected);
    }

    #[test]
    fn an_area_around_the_frame_becomes_the_frame() {
        let area = FRAME.cut_area(vec![[-5.0, -5.0], [15.0, -5.0], [15.0, 15.0], [-5.0, 15.0]]);
        assert_eq!(area.len(), 4);
        assert!(area.iter().all(|&point| FRAME.holds(point)), "{area:?}");
    }

    #[test]
    fn points_on_a_straight_line_vanish() {
        let line: Vec<Px> = (0..100).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(thin(&line, 0.1), [line[0], line[99]]);
    }

    proptest! {
        #[test]
        fn thinned_lines_stay_within_the_tolerance(
            line in proptest::collection::vec([0.0..100.0_f64, 0.0..100.0_f64], 2..60),
            tolerance_px in 0.01..20.0_f64,
        ) {
            let thinned = thin(&line, tolerance_px);
            for &point in &line {
                let nearest = thinned
                    .windows(2)
                    .map(|pair| squared_distance(point, pair[0], pair[1]).sqrt())
                    .fold(f64::INFINITY, f64::min);
                prop_assert!(nearest <= tolerance_px + 1e-9, "{nearest} px away, {tolerance_px} px allowed");
            }
        }

        #[test]
        fn cut_lines_stay_inside(line in proptest::collection::vec([-30.0..30.0_f64, -30.0..30.0_f64], 0..40)) {
            for run in FRAME.cut_line(line.iter().copied()) {
                prop_assert!(run.iter().all(|&point| FRAME.holds(point)), "{run:?}");
            }
            prop_assert!(FRAME.cut_area(line).iter().all(|&point| FRAME.holds(point)));
        }
    }
}
