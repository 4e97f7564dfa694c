//! Which measured runs begin where their files do.

use anyhow::Result;
use diagnose::{Beginning, Departures, MeanBeginning};
use rayon::prelude::*;
use sim::{Run, Setting, Streams, Vec2};

use super::recording::RunPlace;
use crate::laps::{Measured, SampledRun};
use crate::setup::Setup;

/// What is known of how the runs of a recording begin.
#[derive(Debug)]
pub(crate) struct Beginnings {
    /// How each begins, if that is known; of fewer than two of several it is not worth knowing.
    known: Vec<Option<Beginning>>,
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
        let mut known: Vec<Option<Beginning>> = (found.iter())
            .map(|found| found.filter(|found| !stands(found)))
            .collect();
        if known.iter().flatten().count() < known.len().min(2) {
            known.fill(None);
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
        self.known[run].is_some()
    }

    /// How the runs begin on average, as far as that is known.
    pub(super) fn mean(&self) -> Option<MeanBeginning> {
        let known: Vec<Beginning> = self.known.iter().flatten().copied().collect();
        MeanBeginning::of(&known)
    }

    /// Which runs begin unknown, for a name of what is simulated for them; `None` if none does.
    pub(super) fn unknown(&self) -> Option<String> {
        let known: Vec<bool> = self.known.iter().map(Option::is_some).collect();
        known.contains(&false).then(|| format!("begin {known:?}"))
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

/// How runs of a model with effects begin on average that take the places of some measured runs, in turn.
///
/// # Errors
/// A model that cannot drive.
pub(super) fn simulated_beginning(
    setup: &Setup,
    effects: &[Setting],
    seed: u64,
    places: &[RunPlace<'_>],
) -> Result<Option<MeanBeginning>> {
    const RUNS: u64 = 400;
    /// Long enough for a beginning, s.
    const DRIVEN_S: f64 = 1.5;
    let steps = (DRIVEN_S / setup.model.run.control_step_s).ceil() as usize;
    let mut model = setup.model.clone();
    model.effects.extend_from_slice(effects);
    let drive = |run: u64| -> Result<Option<Beginning>> {
        let place = places[run as usize % places.len()];
        let world = setup.scene.world(&model, place.number)?;
        let mut run = Run::from_start(&world, Streams { seed, run }, place.start)?;
        let path: Vec<(f64, Vec2)> = (0..steps)
            .map(|_| run.step())
            .map(|step| (step.time_s, step.observed))
            .collect();
        Ok(Beginning::of(&path))
    };
    let driven = (0..RUNS).into_par_iter().map(drive).collect::<Result<Vec<_>>>()?;
    let begun: Vec<Beginning> = driven.into_iter().flatten().collect();
    Ok(MeanBeginning::of(&begun))
}

/// What a reader must know where nothing but how runs begin departs from the declared model.
pub(super) fn only_beginnings_depart(numbers: &Departures) -> Option<String> {
    (numbers.departing() == ["start"]).then(|| {
        "All that departs from the declared model is how runs begin: if the files do not begin where the robot does, say \
         from_start = false in dataset.toml."
            .to_owned()
    })
}
