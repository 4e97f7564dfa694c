//! How a small change of the model shows in the whitened innovations.

use sim::{Forecast, Stage};

use super::filter::{MEASURED, Trace, difference};
use super::moments::cut;

/// The change of each whitened innovation (steps x 10, 0 where it does not count) between the model of the trace and
/// another one that differs in one stage, to first order: the other model is asked at the poses of the trace.
pub(crate) fn column(forecast: &mut Forecast<'_>, stage: Stage, trace: &Trace) -> Vec<f32> {
    let mut change = vec![0.0; trace.instants.len() * MEASURED];
    /// Difference of a pose, m and rad, that shows in nothing.
    const NOTHING: f64 = 1e-9;
    let mut dx = [0.0_f64; 3];
    for (instant, change) in trace.instants.iter().zip(change.chunks_exact_mut(MEASURED)) {
        forecast.tick(instant.time_s);
        let mut shift = [0.0; MEASURED];
        if stage == Stage::Observe {
            let seen = forecast.observed(instant.seen_from) - instant.seen;
            (shift[0], shift[1]) = (seen.x, seen.y);
        }
        if matches!(stage, Stage::Sense | Stage::World) {
            let read = forecast.readings_beside(instant.sensed_from, &instant.covariance, &instant.look);
            for lane in (0..8).filter(|&lane| read[lane] != instant.uncut[lane]) {
                shift[lane + 2] =
                    cut(read[lane], instant.deviation[lane], trace.step_counts).mean - instant.expected[lane];
            }
        }
        if shift == [0.0; MEASURED] && dx.iter().all(|d| d.abs() < NOTHING) {
            dx = [0.0; 3];
        } else {
            for m in 0..MEASURED {
                let slope = &instant.slope[m];
                let missed = -(shift[m] + slope[0] * dx[0] + slope[1] * dx[1] + slope[2] * dx[2]);
                let gain = &instant.gain[m];
                for axis in 0..3 {
                    dx[axis] += gain[axis] * missed;
                }
                if instant.used >> m & 1 == 1 {
                    change[m] = (missed * instant.per_scale[m]) as f32;
                }
            }
            dx = [
                dx[0] - instant.turned.y * dx[2],
                dx[1] + instant.turned.x * dx[2],
                dx[2],
            ];
        }
        if stage == Stage::Act {
            let moved = difference(
                forecast.lead(instant.moved_from, instant.command),
                instant.moved_to,
            );
            (0..3).for_each(|axis| dx[axis] += moved[axis]);
        }
    }
    change
}
