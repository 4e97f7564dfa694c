//! How coarsely to cut walls for a wished number of pieces.

use track::Course;

use crate::Error;

/// The maximal error, m, at which the course's two walls together have `segments` straight pieces, or, where no error
/// gives that number, the one that gives the nearest found. Numbers grow about as one over the error's root.
///
/// ```
/// let course = track::Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
/// let max_error_m = sim::max_error_for(&course, 47)?;
/// assert_eq!(sim::segment_count(&course, max_error_m)?, 47); // as at the paper's 5 mm
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// A number that no maximal error down to 1e-9 m reaches.
pub fn max_error_for(course: &Course, segments: usize) -> Result<f64, Error> {
    const COARSEST_M: f64 = 0.1;
    const FINEST_M: f64 = 1e-9; // what walls can be cut to
    const MOST_HALVINGS: usize = 40;
    let mut fine_m = COARSEST_M;
    loop {
        match segment_count(course, fine_m) {
            Ok(count) if count >= segments => break,
            finest if fine_m == FINEST_M => {
                let (value, high) = (segments as f64, finest? as f64);
                return Err(Error::OutOfRange {
                    key: "segments".into(),
                    value,
                    low: 1.0,
                    high,
                });
            }
            _ => fine_m = (0.25 * fine_m).max(FINEST_M),
        }
    }
    let mut coarse_m = 4.0 * fine_m;
    let mut best = (usize::MAX, fine_m);
    for _ in 0..MOST_HALVINGS {
        let middle_m = (fine_m * coarse_m).sqrt();
        // Walls that cannot be cut that coarsely have fewer than three pieces.
        let count = segment_count(course, middle_m).unwrap_or(0);
        if count.abs_diff(segments) < best.0 {
            best = (count.abs_diff(segments), middle_m);
        }
        if count == segments {
            break;
        }
        if count > segments {
            fine_m = middle_m
        } else {
            coarse_m = middle_m
        }
    }
    Ok(best.1)
}

/// Straight pieces of the course's two walls at a maximal error in m.
///
/// # Errors
/// A maximal error at which the walls cannot be cut.
pub fn segment_count(course: &Course, max_error_m: f64) -> Result<usize, Error> {
    Ok(course.outer.flatten(max_error_m)?.segments().len()
        + course.inner.flatten(max_error_m)?.segments().len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_numbers_are_met() {
        let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml")).unwrap();
        for segments in [15, 33, 47, 105, 1000] {
            let max_error_m = max_error_for(&course, segments).unwrap();
            assert_eq!(
                segment_count(&course, max_error_m).unwrap(),
                segments,
                "at {max_error_m} m"
            );
        }
    }
}
