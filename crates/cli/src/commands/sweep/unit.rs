//! The laps of one grid point with one seed, and the file they rest in until the sweep is whole.

use serde::{Deserialize, Serialize};

use crate::laps::SampledRun;
use crate::output::sha256;

/// The runs of one grid point with one seed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unit {
    pub(super) runs: Vec<UnitRun>,
    /// Positions at the gates of the kept laps of all runs, run after run, m.
    pub(super) offsets_m: Vec<Vec<f64>>,
}

/// What there is to know of a run beside its laps.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct UnitRun {
    pub(super) run: String,
    /// Laps kept.
    pub(super) laps: usize,
    pub(super) timed_out: bool,
    /// What a user must know of laps that are not there.
    pub(super) remarks: Vec<String>,
}

/// The first line of a unit's file; after it come the positions, 8 bytes each, little-endian.
#[derive(Debug, Serialize, Deserialize)]
struct Head {
    runs: Vec<UnitRun>,
    sha256: String,
}

impl Unit {
    pub(super) fn new(runs: Vec<SampledRun>) -> Self {
        let offsets_m = runs.iter().flat_map(SampledRun::offsets_m).collect();
        let run = |run: SampledRun| UnitRun {
            laps: run.laps.len(),
            timed_out: run.timed_out,
            remarks: run.remarks(),
            run: run.run,
        };
        Self {
            runs: runs.into_iter().map(run).collect(),
            offsets_m,
        }
    }

    /// Runs that ended because gate 0 was not crossed for too long.
    pub(super) fn timed_out(&self) -> usize {
        self.runs.iter().filter(|run| run.timed_out).count()
    }

    /// The unit's file, which gives back the same bits.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let body: Vec<u8> = self
            .offsets_m
            .iter()
            .flatten()
            .flat_map(|offset| offset.to_le_bytes())
            .collect();
        let head = Head {
            runs: self.runs.clone(),
            sha256: sha256(&body),
        };
        let mut bytes = serde_json::to_vec(&head).expect("numbers and strings have a form in JSON");
        bytes.push(b'\n');
        bytes.extend(body);
        bytes
    }

    /// The unit of so many runs with so many gates in a file; none where that is not whole.
    pub(super) fn from_bytes(bytes: &[u8], runs: usize, gates: usize) -> Option<Self> {
        let end = bytes.iter().position(|&byte| byte == b'\n')?;
        let (head, body) = (&bytes[..end], &bytes[end + 1..]);
        let head: Head = serde_json::from_slice(head).ok()?;
        let (numbers, rest) = body.as_chunks::<8>();
        let laps: usize = head.runs.iter().map(|run| run.laps).sum();
        let whole = rest.is_empty() && numbers.len() == laps * gates && head.sha256 == sha256(body);
        if head.runs.len() != runs || !whole {
            return None;
        }
        let lap = |lap: &[[u8; 8]]| lap.iter().map(|&number| f64::from_le_bytes(number)).collect();
        Some(Self {
            runs: head.runs,
            offsets_m: numbers.chunks(gates).map(lap).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit() -> Unit {
        let run = |run: &str, laps| UnitRun {
            run: run.into(),
            laps,
            timed_out: laps == 0,
            remarks: vec!["a\nb".into()],
        };
        let offsets_m = vec![vec![0.1, -1.0 / 3.0, 1e-300], vec![f64::MIN_POSITIVE, -0.0, 5.0]];
        Unit {
            runs: vec![run("a", 2), run("b", 0)],
            offsets_m,
        }
    }

    #[test]
    fn a_unit_comes_back_bit_by_bit() {
        let back = Unit::from_bytes(&unit().to_bytes(), 2, 3).unwrap();
        assert_eq!(back, unit());
        assert!(back.offsets_m[1][1].is_sign_negative());
        assert_eq!(back.timed_out(), 1);
        let none = Unit {
            runs: unit().runs[1..].to_vec(),
            offsets_m: Vec::new(),
        };
        assert_eq!(Unit::from_bytes(&none.to_bytes(), 1, 3), Some(none));
    }

    #[test]
    fn what_is_not_whole_is_nothing() {
        let bytes = unit().to_bytes();
        for length in 0..bytes.len() {
            assert_eq!(Unit::from_bytes(&bytes[..length], 2, 3), None, "{length} bytes");
        }
        let mut flipped = bytes.clone();
        *flipped.last_mut().unwrap() ^= 1;
        assert_eq!(Unit::from_bytes(&flipped, 2, 3), None);
        assert_eq!(Unit::from_bytes(&bytes, 1, 3), None);
        assert_eq!(Unit::from_bytes(&bytes, 2, 2), None);
    }
}
