//! The two kinds of slip, a higher level and a memory, that take wheels as far off: over more than a few physics steps a first-order
//! autoregression c adds up to (1 + c) / (1 - c) times the variance of white noise of as much.

/// The factor on the level of slip that does as a memory.
pub(crate) fn level_of(correlation: f64) -> f64 {
    ((1.0 + correlation) / (1.0 - correlation)).sqrt()
}

/// The memory that does as a factor on the level of slip; below zero for less slip.
pub(crate) fn memory_of(level: f64) -> f64 {
    (level.powi(2) - 1.0) / (level.powi(2) + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_memory_of_six_tenths_scatters_as_twice_the_level() {
        assert!((level_of(0.6) - 2.0).abs() < 1e-12 && (memory_of(2.0) - 0.6).abs() < 1e-12);
        assert_eq!(memory_of(1.0), 0.0);
    }
}
