//! A path with less of the camera's noise.

use crate::Vec2;

/// The moving mean of a path of times in s and positions in m, rows in time order: each row becomes the mean time and position of the
/// rows within `half_width_s` of it, fewer towards the ends, where the window stays centred.
///
/// Time and position are averaged alike, so a path at constant speed stays on itself whatever rows it lacks.
///
/// ```
/// use track::{Vec2, moving_mean};
///
/// let path: Vec<(f64, Vec2)> = [0.0, 1.0, 5.0, 3.0, 4.0]
///     .iter()
///     .enumerate()
///     .map(|(t, &x)| (t as f64, Vec2::new(x, 0.0)))
///     .collect();
/// let smooth = moving_mean(&path, 1.0);
/// assert_eq!((smooth[0], smooth[2].0), (path[0], 2.0));
/// assert!((smooth[2].1.x - 3.0).abs() < 1e-12);
/// ```
pub fn moving_mean(path: &[(f64, Vec2)], half_width_s: f64) -> Vec<(f64, Vec2)> {
    let (Some(first), Some(last)) = (path.first(), path.last()) else {
        return Vec::new();
    };
    // The rows of the window, whose ends only ever move on, and their sums.
    let (mut from, mut to) = (0, 0);
    let (mut time_s, mut position) = (0.0, Vec2::ZERO);
    let mut means = Vec::with_capacity(path.len());
    for row in path {
        // A billionth more, as times are sums of steps.
        let half_s = half_width_s.min(row.0 - first.0).min(last.0 - row.0) + 1e-9;
        while let Some(next) = path.get(to).filter(|next| next.0 - row.0 <= half_s) {
            time_s += next.0;
            position += next.1;
            to += 1;
        }
        while row.0 - path[from].0 > half_s {
            time_s -= path[from].0;
            position -= path[from].1;
            from += 1;
        }
        let share = 1.0 / (to - from) as f64;
        means.push((time_s * share, position * share));
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(times_s: impl Iterator<Item = f64>) -> Vec<(f64, Vec2)> {
        times_s.map(|t| (t, Vec2::new(0.1 * t, 1.0 - 0.2 * t))).collect()
    }

    #[test]
    fn a_straight_path_at_constant_speed_stays_on_itself_with_gaps_too() {
        let seen = |k: &u32| ![7, 8, 20, 21, 22, 40].contains(k);
        let path = line((0..60).filter(seen).map(|k| 0.064 * f64::from(k)));
        let smooth = moving_mean(&path, 0.32);
        assert_eq!(smooth.len(), path.len());
        for (time_s, position) in smooth {
            let off = position - line(std::iter::once(time_s))[0].1;
            assert!(off.length() < 1e-12, "{time_s}: {off}");
        }
    }

    #[test]
    fn windows_hold_the_rows_that_they_should() {
        // A single row that is off shows where it counts, and by how much.
        let mut path = line((0..40).map(|k| 0.064 * f64::from(k)));
        path[20].1.x += 11.0;
        let smooth = moving_mean(&path, 0.33);
        for (k, (time_s, position)) in smooth.iter().enumerate() {
            let off = position.x - 0.1 * time_s;
            let expected = if k.abs_diff(20) <= 5 { 1.0 } else { 0.0 };
            assert!((off - expected).abs() < 1e-9, "{k}: {off}");
        }
        path[1].1.x += 3.0;
        let smooth = moving_mean(&path, 0.33);
        assert_eq!(smooth[0], path[0]);
        assert!((smooth[1].1.x - 0.1 * smooth[1].0 - 1.0).abs() < 1e-9);
        assert!((smooth[2].1.x - 0.1 * smooth[2].0 - 0.6).abs() < 1e-9);
    }

    #[test]
    fn an_empty_path_stays_empty() {
        assert!(moving_mean(&[], 1.0).is_empty());
    }
}
