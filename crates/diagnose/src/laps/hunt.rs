//! The size of an effect whose action jumps with it.

use rayon::prelude::*;

use super::atlas::{Atlas, Simulate};
use super::expectation::Expectation;
use super::hypothesis::{Hypothesis, Part, Shape};
use super::refine::Descent;

impl Atlas {
    /// The size of an effect that jumps, by trying many: all over the probe's range, then ever closer about the best. `None`
    /// where no size explains a fair share.
    pub(super) fn hunt(&self, simulate: &Simulate<'_>, data: &Expectation, probe: usize) -> Option<Descent> {
        const COARSE: usize = 60;
        const COARSE_SETS: u64 = 1;
        const CLOSER: [u64; 3] = [4, 8, 12];
        const FAIR_SHARE: f64 = 0.25;
        let p = &self.probes[probe];
        let (low, high) = (p.sizes[0], p.sizes[p.sizes.len() - 1]);
        // Sizes in a constant ratio: what matters is how many steps fit into a speed or a reading.
        let ratio = (high / low).powf(1.0 / (COARSE - 1) as f64);
        let sizes: Vec<f64> = (0..COARSE).map(|i| low * ratio.powi(i as i32)).collect();
        let (left, mut best) = least(&self.distances(simulate, data, probe, &sizes, COARSE_SETS))?;
        if left > (1.0 - FAIR_SHARE) * self.white(data, &self.null).norm_squared() {
            return None;
        }
        let mut spacing = best * (ratio - 1.0);
        let mut last = Vec::new();
        for sets in CLOSER {
            let sizes: Vec<f64> = (-4..=4).map(|i| best + spacing * f64::from(i) / 3.0).collect();
            last = self.distances(simulate, data, probe, &sizes, sets);
            best = least(&last)?.1;
            spacing /= 3.0;
        }
        // Sizes that are no worse than by 4 in squared distance bound the answer.
        let bound = least(&last)?.0 + 4.0;
        let as_good = last
            .iter()
            .filter(|found| found.0 < bound)
            .map(|found| (found.1 - best).abs());
        let error = as_good.fold(spacing / 2.0, f64::max);
        let hypothesis = Hypothesis {
            parts: vec![Part::screened(self, probe, Shape::Constant, &[best])],
        };
        Some(Descent::found(self, &hypothesis, error))
    }

    /// Squared distances of the data from a probe at some sizes, each with its size; sizes at which the robot crashes are
    /// left out.
    fn distances(
        &self,
        simulate: &Simulate<'_>,
        data: &Expectation,
        probe: usize,
        sizes: &[f64],
        sets: u64,
    ) -> Vec<(f64, f64)> {
        let same_draws = Expectation::mean(&self.samples[..sets as usize], true);
        let distance = |&size: &f64| {
            let settings = [self.probes[probe].setting(size)];
            let found = self.simulated_plainly(simulate, &settings, sets)?;
            let expected = found.moved(1.0, &same_draws, &self.null);
            Some((self.white(data, &expected).norm_squared(), size))
        };
        sizes.par_iter().filter_map(distance).collect()
    }
}

/// The least of some distances, with its size.
fn least(found: &[(f64, f64)]) -> Option<(f64, f64)> {
    found.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))
}
