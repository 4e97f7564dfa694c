//! Random streams: every purpose has its own, and each starts afresh at every gate.

use rand::rngs::ChaCha8Rng;
use rand::{Rng, SeedableRng};

/// The random streams of one run, all of them functions of the seed, the run's number and a purpose.
///
/// A new purpose never shifts another's draws, so two simulations that differ by one effect see the same noise. For
/// the same reason a stream starts afresh at each gate ([`Stream::enter`]): a robot that is a step late at one gate
/// meets the same draws again at the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Streams {
    /// Seed of the whole simulation.
    pub seed: u64,
    /// Number of the run, from 0.
    pub run: u64,
}

impl Streams {
    /// The stream of one purpose, at its first stretch.
    pub fn open(&self, purpose: &str) -> Stream {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&self.seed.to_le_bytes());
        key[8..16].copy_from_slice(&self.run.to_le_bytes());
        key[16..24].copy_from_slice(&fnv1a(purpose).to_le_bytes());
        Stream(ChaCha8Rng::from_seed(key))
    }
}

/// FNV-1a, 64 bit (Fowler, Noll, Vo): tells purposes apart in a generator's key.
fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// One purpose's draws.
#[derive(Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// Starts the draws of the given stretch of the run (gates passed since it began).
    pub fn enter(&mut self, stretch: u64) {
        self.0.set_stream(stretch);
        self.0.set_word_pos(0);
    }

    /// A draw from the standard normal distribution.
    #[inline(always)]
    pub fn normal(&mut self) -> f64 {
        rand_distr::Distribution::sample(&rand_distr::StandardNormal, &mut self.0)
    }

    /// A draw from the uniform distribution on [-1, 1).
    #[inline]
    pub fn symmetric(&mut self) -> f64 {
        // 53 random bits, the width of an f64's fraction.
        (self.0.next_u64() >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
    }

    /// A draw from 0..count, each with the same probability (within 2^-64 of it).
    pub fn index(&mut self, count: usize) -> usize {
        ((u128::from(self.0.next_u64()) * count as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_stability() {
        let mut stream = Streams { seed: 1, run: 0 }.open("slip");
        let first: Vec<f64> = (0..3).map(|_| stream.symmetric()).collect();
        stream.enter(7);
        let second = stream.symmetric();
        stream.enter(0);
        assert_eq!(stream.symmetric(), first[0], "a stretch can be entered again");
        assert_ne!(second, first[0]);
        assert_eq!(first.len(), 3);
    }

    #[test]
    fn purposes_runs_and_seeds_differ() {
        let draw = |seed, run, purpose: &str| Streams { seed, run }.open(purpose).symmetric();
        let all = [
            draw(1, 0, "slip"),
            draw(1, 0, "camera"),
            draw(1, 1, "slip"),
            draw(2, 0, "slip"),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|b| a != b), "{all:?}");
        }
    }

    #[test]
    fn moments_of_the_draws() {
        let mut stream = Streams { seed: 3, run: 0 }.open("test");
        let n = 200_000;
        let (mut mean, mut square) = (0.0, 0.0);
        for _ in 0..n {
            let u = stream.symmetric();
            mean += u / n as f64;
            square += u * u / n as f64;
        }
        // Four standard errors: a false alarm in 1 of 16 000 seeds.
        assert!(mean.abs() < 4.0 * (1.0 / 3.0 / n as f64).sqrt(), "mean {mean}");
        assert!(
            (square - 1.0 / 3.0).abs() < 4.0 * (4.0 / 45.0 / n as f64).sqrt(),
            "mean square {square}"
        );
    }
}
