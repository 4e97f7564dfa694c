//! Which measured runs begin where their files do.

use diagnose::Beginning;
use sim::Vec2;

use crate::laps::Measured;
use crate::session::Session;
use crate::setup::Setup;

/// Whether it is known how each measured run begins; of fewer than two of several it is not worth knowing.
pub(super) fn begins(session: &Session, measured: &Measured, setup: &Setup) -> Vec<bool> {
    let (step_s, speed_m_s) = (
        setup.model.run.control_step_s,
        setup.model.machine.controller.speed_m_s(),
    );
    let beginning = |run: usize| {
        let path: Vec<(f64, Vec2)> = measured.seen(run).collect();
        let from_its_start = path.first().is_some_and(|row| row.0 < 0.5 * step_s);
        from_its_start.then(|| Beginning::of(&path)).flatten()
    };
    let found: Vec<Option<Beginning>> = (0..measured.runs.len()).map(beginning).collect();
    let stand = |found: &Option<Beginning>| found.is_some_and(|beginning| beginning.stands(speed_m_s));
    let standing: Vec<&str> = (measured.runs.iter().zip(&found))
        .filter(|(_, found)| stand(found))
        .map(|(run, _)| run.name.as_str())
        .collect();
    if !standing.is_empty() {
        session.remark(&format!(
            "{}: {} {} still where the file begins: how such a run starts is not compared",
            measured.set.name,
            standing.join(", "),
            if standing.len() == 1 { "stands" } else { "stand" },
        ));
    }
    let is_a_start =
        |found: &Option<Beginning>| found.is_some_and(|beginning| beginning.is_a_start(speed_m_s));
    let begins: Vec<bool> = found.iter().map(is_a_start).collect();
    let known = begins.iter().filter(|begins| **begins).count();
    if known < begins.len().min(2) {
        return vec![false; begins.len()];
    }
    begins
}
