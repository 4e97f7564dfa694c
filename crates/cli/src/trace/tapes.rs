//! Random draws that a trace meets again and again, made once.

use std::sync::OnceLock;

use sim::{Draws, Tape, World};

use super::recording::Seeds;

/// The draws of the data sets that are simulated most often, those of the lowest numbers.
#[derive(Debug)]
pub(super) struct Tapes {
    /// Of each data set, of each run.
    made: Vec<Vec<OnceLock<Tape>>>,
}

impl Tapes {
    /// No draws are kept.
    pub(super) const NONE: Self = Self { made: Vec::new() };

    /// Room for as many data sets, of runs of so many laps, as fit in some memory.
    pub(super) fn new(world: &World<'_>, laps: &[usize], most_bytes: usize) -> Self {
        /// As many as every hypothesis is simulated with that comes to the end; those beyond are met seldom.
        const SETS: usize = 16;
        let bytes: usize = laps.iter().map(|&laps| Tape::bytes(world, laps)).sum();
        let sets = SETS.min(most_bytes / bytes.max(1));
        let runs = || laps.iter().map(|_| OnceLock::new()).collect();
        Self {
            made: (0..sets).map(|_| runs()).collect(),
        }
    }

    /// The draws of one run of a data set.
    pub(super) fn draws(&self, world: &World<'_>, seeds: Seeds, run: usize, laps: usize) -> Draws<'_> {
        let streams = seeds.streams(run);
        let place = (usize::try_from(seeds.set).ok())
            .and_then(|set| self.made.get(set))
            .and_then(|runs| runs.get(run));
        match place.map(|place| place.get_or_init(|| Tape::new(world, streams, laps))) {
            Some(tape) if tape.streams() == streams => tape.into(),
            _ => streams.into(),
        }
    }
}
