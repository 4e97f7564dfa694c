use crate::Vec2;

pub(crate) type Segment = (Vec2, Vec2);

/// Where the straight lines between the ends of two segments meet, if they do within both.
fn meeting(a: Segment, b: Segment) -> Option<Vec2> {
    let (along_a, along_b) = (a.1 - a.0, b.1 - b.0);
    let area = along_a.perp_dot(along_b);
    let (s, t) = (
        (b.0 - a.0).perp_dot(along_b) / area,
        (b.0 - a.0).perp_dot(along_a) / area,
    );
    let within = 0.0..=1.0; // parallel lines give infinities or NaN, which are not within
    (within.contains(&s) && within.contains(&t)).then(|| a.0 + s * along_a)
}

/// A pair of segments that cross (lower index first) and where, among the pairs that `counts` admits.
pub(crate) fn crossing(
    segments: &[Segment],
    counts: impl Fn(usize, usize) -> bool,
) -> Option<(usize, usize, Vec2)> {
    let mut order: Vec<usize> = (0..segments.len()).collect();
    let left = |i: usize| segments[i].0.x.min(segments[i].1.x);
    let right = |i: usize| segments[i].0.x.max(segments[i].1.x);
    order.sort_by(|&i, &j| left(i).total_cmp(&left(j)).then(i.cmp(&j)));
    for (rank, &i) in order.iter().enumerate() {
        let beside = order[rank + 1..].iter().take_while(|&&j| left(j) <= right(i));
        for &j in beside {
            let (first, second) = (i.min(j), i.max(j));
            if counts(first, second)
                && let Some(at) = meeting(segments[first], segments[second])
            {
                return Some((first, second, at));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_pair_and_the_place() {
        let v = Vec2::new;
        let segments = [
            (v(0.0, 0.0), v(1.0, 1.0)),
            (v(2.0, 0.0), v(2.0, 1.0)),
            (v(0.0, 1.0), v(1.0, 0.0)),
            (v(0.0, 5.0), v(3.0, 5.0)),
        ];
        assert_eq!(crossing(&segments, |_, _| true), Some((0, 2, v(0.5, 0.5))));
        assert_eq!(crossing(&segments, |i, _| i != 0), None);
        let side_by_side = [segments[0], (v(0.0, 0.1), v(1.0, 1.1))];
        assert_eq!(crossing(&side_by_side, |_, _| true), None);
    }
}
