//! What lies far from others of its kind.

/// The value that half of the others are below, the upper one of two; 0 of none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The distance from which on some of these are far: several times as far as all but a few lie, and `least` in any case.
pub fn far(distances: &[f64], least: f64) -> f64 {
    /// Share of the distances that are a few, and how many times as far is far.
    const FEW: f64 = 0.02;
    const TIMES: f64 = 6.0;
    if distances.is_empty() {
        return least;
    }
    let mut sorted = distances.to_vec();
    let rank = (FEW * sorted.len() as f64) as usize;
    let usual = *sorted.select_nth_unstable_by(rank, |a, b| b.total_cmp(a)).1;
    least.max(TIMES * usual)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), 2.0);
        assert_eq!(median([4.0, 1.0, 2.0, 3.0].into_iter()), 3.0);
        assert_eq!(median(std::iter::empty()), 0.0);
    }

    #[test]
    fn a_few_that_are_far_do_not_say_how_far_is_far() {
        let mut distances = vec![0.5; 1000];
        assert_eq!(far(&distances, 1.0), 3.0);
        distances[..20].fill(90.0);
        assert_eq!(far(&distances, 1.0), 3.0);
        distances[20] = 90.0;
        assert_eq!(far(&distances, 1.0), 540.0);
        assert_eq!((far(&[0.1; 9], 1.0), far(&[], 1.0)), (1.0, 1.0));
    }
}
