//! Effects between the wall and the reading.

use super::{Effect, Moment, Param, Spec, Stage};
use crate::Readings;

/// Every reading times a factor, before noise.
pub(super) const READING_GAIN: Spec = Spec {
    name: "reading-gain",
    stage: Stage::Sense,
    summary: "every reading times gain, before noise",
    params: &[Param::new("gain", "", 1.0, 0.05, 20.0)],
    build: || Box::new(ReadingGain),
};

#[derive(Debug)]
struct ReadingGain;

impl Effect for ReadingGain {
    fn readings(&mut self, values: &[f64], _now: &Moment, readings: &mut Readings) {
        readings.iter_mut().for_each(|reading| *reading *= values[0]);
    }
}

/// Counts added to every reading, before noise.
pub(super) const AMBIENT_OFFSET: Spec = Spec {
    name: "ambient-offset",
    stage: Stage::Sense,
    summary: "counts added to every reading, before noise",
    params: &[Param::new("counts", "counts", 0.0, -2000.0, 2000.0)],
    build: || Box::new(AmbientOffset),
};

#[derive(Debug)]
struct AmbientOffset;

impl Effect for AmbientOffset {
    fn readings(&mut self, values: &[f64], _now: &Moment, readings: &mut Readings) {
        readings.iter_mut().for_each(|reading| *reading += values[0]);
    }
}
