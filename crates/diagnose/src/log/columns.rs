//! How a small change of the model shows in the whitened innovations.

use sim::{Error, Forecast, Setting, Stage, World};

use super::filter::{Instant, MEASURED, Trace, difference};
use super::moments::cut;
use crate::candidate::stage_of;

/// Another model than that of a trace, which differs from it in one stage, and what it does to the innovations.
struct Other<'w> {
    forecast: Forecast<'w>,
    stage: Stage,
    /// By how much its pose is off there, m and rad.
    off: [f64; 3],
    change: Vec<f32>,
}

/// The change of each whitened innovation (steps x 10, 0 where it does not count) between the model of the trace and
/// others that differ from it in one stage each, to first order: the other models are asked at the poses of the trace.
///
/// A trace is long: it is gone through once for all of them.
pub(crate) fn columns(others: Vec<(Forecast<'_>, Stage)>, trace: &Trace) -> Vec<Vec<f32>> {
    let length = trace.instants.len() * MEASURED;
    let mut others: Vec<Other<'_>> = (others.into_iter())
        .map(|(forecast, stage)| Other {
            forecast,
            stage,
            off: [0.0; 3],
            change: vec![0.0; length],
        })
        .collect();
    for (step, instant) in trace.instants.iter().enumerate() {
        for other in &mut others {
            other.step(step, instant, trace.step_counts);
        }
    }
    others.into_iter().map(|other| other.change).collect()
}

/// The columns of settings that are added, each alone, to the model of the trace.
///
/// # Errors
/// A setting out of range.
pub(crate) fn columns_of<'s>(
    settings: impl Iterator<Item = &'s Setting>,
    world: &World<'_>,
    trace: &Trace,
) -> Result<Vec<Vec<f32>>, Error> {
    let others = settings.map(|setting| {
        let forecast = Forecast::beside(world, std::slice::from_ref(setting))?;
        Ok((forecast, stage_of(setting)))
    });
    Ok(columns(others.collect::<Result<_, Error>>()?, trace))
}

impl Other<'_> {
    fn step(&mut self, step: usize, instant: &Instant, step_counts: f64) {
        /// Difference of a pose, m and rad, that shows in nothing.
        const NOTHING: f64 = 1e-9;
        let Self {
            forecast,
            stage,
            off,
            change,
        } = self;
        let change = &mut change[step * MEASURED..(step + 1) * MEASURED];
        forecast.tick(instant.time_s);
        let mut shift = [0.0; MEASURED];
        if *stage == Stage::Observe {
            let seen = forecast.observed(instant.seen_from) - instant.seen;
            (shift[0], shift[1]) = (seen.x, seen.y);
        }
        if matches!(stage, Stage::Sense | Stage::World) {
            let read = forecast.readings_beside(instant.sensed_from, &instant.covariance, &instant.look);
            for lane in (0..8).filter(|&lane| read[lane] != instant.uncut[lane]) {
                shift[lane + 2] = cut(
                    read[lane] + instant.remembered[lane],
                    instant.deviation[lane],
                    step_counts,
                    instant.deviation[lane],
                )
                .mean
                    - instant.expected[lane];
            }
        }
        if shift == [0.0; MEASURED] && off.iter().all(|d| d.abs() < NOTHING) {
            *off = [0.0; 3];
        } else {
            for m in 0..MEASURED {
                let slope = &instant.slope[m];
                let missed = -(shift[m] + slope[0] * off[0] + slope[1] * off[1] + slope[2] * off[2]);
                let gain = &instant.gain[m];
                for axis in 0..3 {
                    off[axis] += gain[axis] * missed;
                }
                if instant.used >> m & 1 == 1 {
                    change[m] = (missed * instant.per_scale[m]) as f32;
                }
            }
            *off = [
                off[0] - instant.turned.y * off[2],
                off[1] + instant.turned.x * off[2],
                off[2],
            ];
        }
        if *stage == Stage::Act {
            let moved = difference(
                forecast.lead(instant.moved_from, instant.command),
                instant.moved_to,
            );
            (0..3).for_each(|axis| off[axis] += moved[axis]);
        }
    }
}
