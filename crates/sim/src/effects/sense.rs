//! Effects on readings: gains, offsets, crosstalk, lag, noise and rounding.

use track::Vec2;

use super::kept::Kept;
use super::plain::{OnMachine, OnReadings};
use super::{AZIMUTH, Effect, Hook, Moment, Param, Spec, Stage};
use crate::cast::LANES;
use crate::{Machine, Mount, Readings};

/// Which of S0 to S7.
const SENSOR: Param = Param::number_of("sensor", 8);

/// Every reading times a factor, before noise.
pub(super) const READING_GAIN: Spec = Spec {
    name: "reading-gain",
    stage: Stage::Sense,
    summary: "every reading times gain, before noise",
    params: &[Param::new("gain", "", 1.0, 0.05, 20.0)],
    list: None,
    build: || {
        Box::new(OnReadings(|values, _, readings| {
            readings.iter_mut().for_each(|reading| *reading *= values[0]);
        }))
    },
};

/// One sensor's reading times a factor, before noise.
pub(super) const ONE_SENSOR_GAIN: Spec = Spec {
    name: "one-sensor-gain",
    stage: Stage::Sense,
    summary: "the reading of one of S0 to S7 times gain, before noise",
    params: &[SENSOR, Param::new("gain", "", 1.0, 0.0, 20.0)],
    list: None,
    build: || {
        Box::new(OnReadings(|values, _, readings| {
            readings[values[0] as usize] *= values[1]
        }))
    },
};

/// Every reading times 1 + per_s t, before noise.
pub(super) const READING_DRIFT: Spec = Spec {
    name: "reading-drift",
    stage: Stage::Sense,
    summary: "every reading times 1 + per_s * (time since the run began), before noise",
    params: &[Param::new("per_s", "1/s", 0.0, -0.01, 0.01)],
    list: None,
    build: || {
        Box::new(OnReadings(|values, now, readings| {
            let gain = (1.0 + values[0] * now.time_s).max(0.0);
            readings.iter_mut().for_each(|reading| *reading *= gain);
        }))
    },
};

/// Counts added to every reading, before noise.
pub(super) const AMBIENT_OFFSET: Spec = Spec {
    name: "ambient-offset",
    stage: Stage::Sense,
    summary: "counts added to every reading, before noise",
    params: &[Param::new("counts", "counts", 0.0, -2000.0, 2000.0)],
    list: None,
    build: || {
        Box::new(OnReadings(|values, _, readings| {
            readings.iter_mut().for_each(|reading| *reading += values[0]);
        }))
    },
};

/// Counts added to one sensor's reading, before noise.
pub(super) const ONE_SENSOR_OFFSET: Spec = Spec {
    name: "one-sensor-offset",
    stage: Stage::Sense,
    summary: "counts added to the reading of one of S0 to S7, before noise",
    params: &[SENSOR, Param::new("counts", "counts", 0.0, -4000.0, 4000.0)],
    list: None,
    build: || {
        Box::new(OnReadings(|values, _, readings| {
            readings[values[0] as usize] += values[1]
        }))
    },
};

/// A lamp or the sun: counts for the sensors that look at it.
pub(super) const DIRECTIONAL_LIGHT: Spec = Spec {
    name: "directional-light",
    stage: Stage::Sense,
    summary: "light from far away: adds counts * max(0, cos(ray direction - azimuth)), before noise",
    params: &[Param::new("counts", "counts", 0.0, 0.0, 4000.0), AZIMUTH],
    list: None,
    build: || Box::new(DirectionalLight::default()),
};

/// Remembers where the sensors look, in the body frame: they stay where they are, while the light turns about the robot.
#[derive(Debug, Default)]
struct DirectionalLight {
    mounts: Option<[Mount; LANES]>,
    axes: [Vec2; LANES],
}

impl Effect for DirectionalLight {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Readings]
    }
    fn readings(&mut self, values: &[f64], now: &Moment, machine: &Machine, readings: &mut Readings) {
        if self.mounts != Some(machine.mounts) {
            self.mounts = Some(machine.mounts);
            self.axes = machine.mounts.map(|mount| mount.axis());
        }
        let (light, heading) = (Vec2::from_angle(values[1]), now.pose.heading);
        let light = Vec2::new(heading.dot(light), heading.perp_dot(light)); // in the body frame
        for (reading, axis) in readings.iter_mut().zip(self.axes) {
            *reading += values[0] * axis.dot(light).max(0.0);
        }
    }
}

/// Light of the neighbours' diodes.
pub(super) const CROSSTALK: Spec = Spec {
    name: "crosstalk",
    stage: Stage::Sense,
    summary: "each reading also gets fraction times the mean of its two neighbours on the ring, before noise",
    params: &[Param::new("fraction", "", 0.0, 0.0, 1.0)],
    list: None,
    build: || {
        Box::new(OnReadings(|values, _, readings| {
            let alone = *readings;
            let count = alone.len();
            for (i, reading) in readings.iter_mut().enumerate() {
                let neighbours = alone[(i + 1) % count] + alone[(i + count - 1) % count];
                *reading += values[0] * 0.5 * neighbours;
            }
        }))
    },
};

/// A first-order low-pass of each reading, before noise.
pub(super) const SENSOR_LAG: Spec = Spec {
    name: "sensor-lag",
    stage: Stage::Sense,
    summary: "first-order low-pass of each reading, before noise, from the first reading on",
    params: &[Param::new("time_s", "s", 0.0, 0.0, 5.0)],
    list: None,
    build: || Box::<SensorLag>::default(),
};

#[derive(Debug, Default)]
struct SensorLag {
    past: Option<Readings>,
    decay: Kept<2, f64>,
}

impl Effect for SensorLag {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Readings]
    }
    fn readings(&mut self, values: &[f64], now: &Moment, _machine: &Machine, readings: &mut Readings) {
        let decay = self.decay.of([now.step_s, values[0]], decay);
        let past = self.past.unwrap_or(*readings);
        for (reading, before) in readings.iter_mut().zip(past) {
            *reading += decay * (before - *reading);
        }
        self.past = Some(*readings);
    }
}

/// What is left of a difference after one step of a first-order lag: exp(-step / time), 0 without a lag.
pub(super) fn decay([step_s, time_s]: [f64; 2]) -> f64 {
    if time_s > 0.0 {
        (-step_s / time_s).exp()
    } else {
        0.0
    }
}

/// A factor on the standard deviation of the reading's noise.
pub(super) const READING_NOISE: Spec = Spec {
    name: "reading-noise",
    stage: Stage::Sense,
    summary: "the standard deviation of the readings' noise times factor",
    params: &[Param::new("factor", "", 1.0, 0.0, 20.0)],
    list: None,
    build: || {
        Box::new(OnMachine(|values, machine| {
            machine.noise.fraction *= values[0];
            machine.noise.counts *= values[0];
        }))
    },
};

/// Readings rounded to multiples, after noise.
pub(super) const READING_STEP: Spec = Spec {
    name: "reading-step",
    stage: Stage::Sense,
    summary: "noisy readings rounded to multiples of counts",
    params: &[Param::new("counts", "counts", 0.0, 0.0, 2000.0)],
    list: None,
    build: || Box::new(ReadingStep),
};

#[derive(Debug)]
struct ReadingStep;

impl Effect for ReadingStep {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::NoisyReadings]
    }
    fn noisy_readings(&mut self, values: &[f64], readings: &mut Readings) {
        readings
            .iter_mut()
            .for_each(|reading| *reading = rounded(*reading, values[0]));
    }
}

/// The multiple of `step` that is nearest to a value; the value itself without a step.
pub(super) fn rounded(value: f64, step: f64) -> f64 {
    if step > 0.0 {
        (value / step).round() * step
    } else {
        value
    }
}
