//! Which measured runs begin where their files do.

use diagnose::{Beginning, Departures};
use sim::Vec2;

use crate::laps::{Measured, SampledRun};
use crate::setup::Setup;

/// What is known of how the runs of a recording begin.
#[derive(Debug)]
pub(crate) struct Beginnings {
    /// Whether it is known how each begins; of fewer than two of several it is not worth knowing.
    known: Vec<bool>,
    /// Runs in which the robot stands still where the file begins.
    standing: Vec<String>,
}

impl Beginnings {
    pub(super) fn of(measured: &Measured, setup: &Setup) -> Self {
        let (step_s, speed_m_s) = (
            setup.model.run.control_step_s,
            setup.model.machine.controller.speed_m_s(),
        );
        let beginning = |run: usize| {
            let path: Vec<(f64, Vec2)> = measured.seen(run).collect();
            let is_whole = measured.set.from_start && path.first().is_some_and(|row| row.0 < 0.5 * step_s);
            is_whole.then(|| Beginning::of(&path)).flatten()
        };
        let found: Vec<Option<Beginning>> = (0..measured.runs.len()).map(beginning).collect();
        let stands = |found: &Beginning| found.stands(speed_m_s);
        let mut known: Vec<bool> = (found.iter())
            .map(|found| found.is_some_and(|found| !stands(&found)))
            .collect();
        if known.iter().filter(|known| **known).count() < known.len().min(2) {
            known.fill(false);
        }
        let standing = (found.iter().zip(&measured.runs))
            .filter(|(found, _)| found.as_ref().is_some_and(stands))
            .map(|(_, run): (_, &SampledRun)| run.name.clone());
        Self {
            standing: standing.collect(),
            known,
        }
    }

    /// Whether it is known how a run begins.
    pub(super) fn is_known(&self, run: usize) -> bool {
        self.known[run]
    }

    /// Which runs begin unknown, for a name of what is simulated for them; `None` if none does.
    pub(super) fn unknown(&self) -> Option<String> {
        (self.known.contains(&false)).then(|| format!("begin {:?}", self.known))
    }

    /// What a reader must know of them.
    pub(super) fn in_words(&self) -> Option<String> {
        let runs = if self.standing.len() == 1 { "Run" } else { "Runs" };
        (!self.standing.is_empty()).then(|| {
            format!(
                "{runs} {}: the robot still stands where the file begins; how such a run starts is not compared.",
                self.standing.join(", ")
            )
        })
    }
}

/// What a reader must know where nothing but how runs begin departs from the declared model.
pub(super) fn only_beginnings_depart(numbers: &Departures) -> Option<String> {
    (numbers.departing() == ["start"]).then(|| {
        "All that departs from the declared model is how runs begin: if the files do not begin where the robot does, say \
         from_start = false in dataset.toml."
            .to_owned()
    })
}
