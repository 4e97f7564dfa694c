//! How small changes of the model show in the whitened innovations.

use sim::{Error, Forecast, Places, Setting, Stage, World};

use super::filter::{Instant, MEASURED, Trace, difference};
use super::moments::cut;
use super::normal::{Normal, Products, Sums};
use crate::candidate::stage_of;

/// Models that are followed side by side.
pub(super) const ABREAST: usize = 8;

/// A number of each of them.
pub(super) type Numbers = [f64; ABREAST];

/// Their changes of each whitened innovation of a control step, 0 where it does not count.
pub(super) type Changes = [Numbers; MEASURED];

pub(super) const NO_CHANGES: Changes = [[0.0; ABREAST]; MEASURED];

/// Another model than that of a trace, which differs from it in one stage.
pub(super) type Other<'w> = (Forecast<'w>, Stage);

/// Columns of other models, lot by lot, while the model of a trace goes through it: of the change of each whitened innovation between that
/// model and these, to first order. The other models are asked at the poses of the trace.
pub(super) struct Columns<'w>(Vec<(Vec<Others<'w>>, Sums)>);

impl<'w> Columns<'w> {
    pub(super) fn new(lots: Vec<(Vec<Other<'w>>, Products)>) -> Self {
        let begun = |(lot, wanted): (Vec<Other<'w>>, Products)| {
            let sums = Sums::new(lot.len(), wanted);
            (abreast(lot), sums)
        };
        Self(lots.into_iter().map(begun).collect())
    }

    /// The next control step.
    pub(super) fn add(&mut self, instant: &Instant, step_counts: f64) {
        for (others, sums) in &mut self.0 {
            others
                .iter_mut()
                .for_each(|others| others.step(instant, step_counts));
            let changes = others.iter().map(|others| &others.changes);
            sums.add(instant.time_s, &instant.innovation, changes);
        }
    }

    /// The normal equations of each lot.
    pub(super) fn normals(self) -> impl Iterator<Item = Normal> + use<'w> {
        self.0.into_iter().map(|(_, sums)| sums.into())
    }
}

/// The normal equations of the columns of other models, lot by lot. A trace is long: it is gone through once for all lots.
pub(super) fn normals(lots: Vec<(Vec<Other<'_>>, Products)>, trace: &Trace) -> Vec<Normal> {
    let mut columns = Columns::new(lots);
    for instant in &trace.instants {
        columns.add(instant, trace.step_counts);
    }
    columns.normals().collect()
}

/// The normal equations of the columns of other models, all with each other.
pub(super) fn normal(others: Vec<Other<'_>>, trace: &Trace) -> Normal {
    normals(vec![(others, Products::All)], trace).swap_remove(0)
}

/// Those models of settings that are added, each alone, to the model of a trace.
///
/// # Errors
/// A setting out of range.
pub(super) fn each_beside<'w>(
    settings: impl IntoIterator<Item = Setting>,
    world: &'w World<'w>,
) -> Result<Vec<Other<'w>>, Error> {
    let other = |setting: Setting| {
        let forecast = Forecast::beside(world, std::slice::from_ref(&setting))?;
        Ok((forecast, stage_of(&setting)))
    };
    settings.into_iter().map(other).collect()
}

/// Some of the models of a lot, and what they do to the innovations.
struct Others<'w> {
    models: Vec<Other<'w>>,
    /// By how much the pose of each is off there, m and rad.
    off: [Numbers; 3],
    changes: Changes,
}

/// A lot as models side by side, in its order.
fn abreast(mut lot: Vec<Other<'_>>) -> Vec<Others<'_>> {
    let mut all = Vec::new();
    while !lot.is_empty() {
        let rest = lot.split_off(lot.len().min(ABREAST));
        all.push(Others {
            models: std::mem::replace(&mut lot, rest),
            off: [[0.0; ABREAST]; 3],
            changes: NO_CHANGES,
        });
    }
    all
}

impl Others<'_> {
    fn step(&mut self, instant: &Instant, step_counts: f64) {
        /// Difference of a pose, m and rad, that shows in nothing.
        const NOTHING: f64 = 1e-9;
        let mut shift = NO_CHANGES;
        let places = (self.models.iter()).find_map(|(forecast, _)| forecast.places(&instant.look));
        for (k, (forecast, stage)) in self.models.iter_mut().enumerate() {
            forecast.tick(instant.time_s);
            let own = shifted(forecast, *stage, (instant, places.as_ref()), step_counts);
            if own != [0.0; MEASURED] {
                (0..MEASURED).for_each(|m| shift[m][k] = own[m]);
            } else if self.off.iter().all(|off| off[k].abs() < NOTHING) {
                self.off.iter_mut().for_each(|off| off[k] = 0.0);
            }
        }
        if shift == NO_CHANGES && self.off == [[0.0; ABREAST]; 3] {
            self.changes = shift;
        } else {
            self.follow(instant, &shift);
        }
        for (k, (forecast, stage)) in self.models.iter_mut().enumerate() {
            if *stage == Stage::Act {
                let moved = difference(
                    forecast.lead(instant.moved_from, instant.command),
                    instant.moved_to,
                );
                (0..3).for_each(|axis| self.off[axis][k] += moved[axis]);
            }
        }
    }

    /// What becomes of the innovations, and of the poses, where the models expect numbers that differ by `shift` from the trace's.
    fn follow(&mut self, instant: &Instant, shift: &Changes) {
        let mut off = self.off;
        for m in 0..MEASURED {
            let (slope, gain) = (&instant.slope[m], &instant.gain[m]);
            let missed: Numbers = std::array::from_fn(|k| {
                -(shift[m][k] + slope[0] * off[0][k] + slope[1] * off[1][k] + slope[2] * off[2][k])
            });
            for axis in 0..3 {
                (0..ABREAST).for_each(|k| off[axis][k] += gain[axis] * missed[k]);
            }
            let counts = instant.used >> m & 1 == 1;
            let scale = if counts { instant.per_scale[m] } else { 0.0 };
            self.changes[m] = missed.map(|missed| missed * scale);
        }
        for k in 0..ABREAST {
            off[0][k] -= instant.turned.y * off[2][k];
            off[1][k] += instant.turned.x * off[2][k];
        }
        self.off = off;
    }
}

/// By how much another model that differs from that of a trace in one stage expects other numbers at the pose of an instant.
fn shifted(
    forecast: &mut Forecast<'_>,
    stage: Stage,
    (instant, places): (&Instant, Option<&Places>),
    step_counts: f64,
) -> [f64; MEASURED] {
    let mut shift = [0.0; MEASURED];
    match stage {
        Stage::Observe => {
            let seen = forecast.observed(instant.seen_from) - instant.seen;
            (shift[0], shift[1]) = (seen.x, seen.y);
        }
        Stage::Sense | Stage::World => {
            let read =
                forecast.readings_beside(instant.sensed_from, &instant.covariance, &instant.look, places);
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
        Stage::Decide | Stage::Act => {}
    }
    shift
}
