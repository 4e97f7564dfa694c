//! How white the innovations of a filtered log are.

use sim::World;

use super::filter::{MEASURED, Trace};

/// How white the filter's innovations of one measured number are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// Innovations that count; of readings only those that are far from being cut.
    pub count: usize,
    /// Their mean square, 1 under the model.
    pub mean_square: f64,
    /// Fourth moment over squared second moment, 3 for normal ones.
    pub kurtosis: f64,
    /// Pairs of control steps, one right after the other, in which both count.
    pub pairs: usize,
    /// Mean product of such pairs over the mean square, 0 under the model.
    pub correlation: f64,
}

impl Channel {
    /// What a first-order autoregression gains in log-likelihood over white innovations: -n/2 log(1 - r^2).
    pub(super) fn gain_of_memory(&self) -> f64 {
        -0.5 * self.pairs as f64 * (-self.correlation.powi(2)).ln_1p()
    }

    /// What a mean that makes innovations too wide may gain at most in log-likelihood.
    pub(super) fn gain_of_width(&self) -> f64 {
        0.5 * self.count as f64 * (self.mean_square - 1.0).max(0.0)
    }
}

/// Moments of the innovations.
pub(super) fn channels(traces: &[(World<'_>, Trace)]) -> [Channel; MEASURED] {
    std::array::from_fn(|m| {
        let (mut count, mut pairs, mut sums) = (0_usize, 0_usize, [0.0; 3]);
        for (_, trace) in traces {
            let mut before: Option<f64> = None;
            for instant in &trace.instants {
                let is_near_cut = m >= 2 && instant.uncut[m - 2] < 4.0 * instant.deviation[m - 2];
                if instant.used >> m & 1 == 0 || is_near_cut {
                    before = None;
                    continue;
                }
                let e = instant.innovation[m];
                count += 1;
                sums[0] += e * e;
                sums[1] += e.powi(4);
                if let Some(before) = before {
                    pairs += 1;
                    sums[2] += e * before;
                }
                before = Some(e);
            }
        }
        let n = count.max(1) as f64;
        let mean_square = sums[0] / n;
        let scale = mean_square.max(1e-12);
        Channel {
            count,
            mean_square,
            kurtosis: sums[1] / n / (scale * scale),
            pairs,
            correlation: sums[2] / pairs.max(1) as f64 / scale,
        }
    })
}
