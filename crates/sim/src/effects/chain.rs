//! The effects of one run, asked hook by hook.

use track::Vec2;

use super::{Active, Effect, Hit, Hook, Moment, RayHits};
use crate::cast::LANES;
use crate::{Error, Machine, Readings, Setting, Twist, WheelSpeeds};

/// Effects in the order in which they act. Of each only the hooks that it has are called: a call that does nothing costs a
/// tenth of a control step, because what the processor has at hand must be put aside for it.
#[derive(Debug)]
pub(crate) struct Chain {
    all: Vec<Active>,
    /// Which effects have each hook.
    having: [Vec<usize>; Hook::ALL.len()],
}

impl Chain {
    /// The effects of one run.
    ///
    /// # Errors
    /// An effect without values for it.
    pub(crate) fn new(settings: &[Setting], run: usize) -> Result<Self, Error> {
        let all = Active::all(settings, run)?;
        let having = Hook::ALL.map(|hook| {
            let has = |&i: &usize| all[i].effect.hooks().contains(&hook);
            (0..all.len()).filter(has).collect()
        });
        Ok(Self { all, having })
    }

    /// Has every hook of every effect called from now on.
    #[cfg(test)]
    pub(crate) fn call_every_hook(&mut self) {
        self.having = Hook::ALL.map(|_| (0..self.all.len()).collect());
    }

    pub(crate) fn all(&self) -> &[Active] {
        &self.all
    }

    pub(crate) fn all_mut(&mut self) -> &mut [Active] {
        &mut self.all
    }

    /// Whether any effect has that hook.
    pub(crate) fn has(&self, hook: Hook) -> bool {
        !self.having[hook as usize].is_empty()
    }

    /// Goes through the effects that have a hook.
    #[inline]
    fn each<T>(&self, hook: Hook, start: T, mut next: impl FnMut(&dyn Effect, &[f64], T) -> T) -> T {
        let mut value = start;
        for &i in &self.having[hook as usize] {
            let Active { effect, values, .. } = &self.all[i];
            value = next(&**effect, values, value);
        }
        value
    }

    /// The same of hooks that may change an effect's state.
    #[inline]
    fn each_mut<T>(
        &mut self,
        hook: Hook,
        start: T,
        mut next: impl FnMut(&mut dyn Effect, &[f64], T) -> T,
    ) -> T {
        let mut value = start;
        for &i in &self.having[hook as usize] {
            let Active { effect, values, .. } = &mut self.all[i];
            value = next(&mut **effect, values, value);
        }
        value
    }

    /// Where the camera sees a position, before its noise, m.
    #[inline]
    pub(crate) fn observed(&self, now: &Moment, position: Vec2) -> Vec2 {
        self.each(Hook::Observed, position, |effect, values, position| {
            effect.observed(values, now, position)
        })
    }

    /// Factor on the response to a hit.
    #[inline]
    pub(crate) fn ray_factor(&self, hit: &Hit) -> f64 {
        self.each(Hook::RayFactors, 1.0, |effect, values, factor| {
            factor * effect.ray_factor(values, hit)
        })
    }

    /// Factors on the responses of eight rays; anything of a ray that met no wall.
    #[inline]
    pub(crate) fn ray_factors(&self, hits: &RayHits<'_>) -> Readings {
        self.each(Hook::RayFactors, [1.0; LANES], |effect, values, mut factors| {
            effect.ray_factors(values, hits, &mut factors);
            factors
        })
    }

    /// Changes the readings before noise.
    #[inline]
    pub(crate) fn readings(&mut self, now: &Moment, machine: &Machine, readings: &mut Readings) {
        self.each_mut(Hook::Readings, (), |effect, values, ()| {
            effect.readings(values, now, machine, readings);
        });
    }

    /// Changes the readings after noise.
    #[inline]
    pub(crate) fn noisy_readings(&mut self, readings: &mut Readings) {
        self.each_mut(Hook::NoisyReadings, (), |effect, values, ()| {
            effect.noisy_readings(values, readings);
        });
    }

    /// The speeds that the wheels are driven at.
    #[inline]
    pub(crate) fn drive(&mut self, now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        self.each_mut(Hook::Drive, wheels, |effect, values, wheels| {
            effect.drive(values, now, wheels)
        })
    }

    /// The slip draws of both wheels.
    #[inline]
    pub(crate) fn slip(&mut self, draws: (f64, f64)) -> (f64, f64) {
        self.each_mut(Hook::Slip, draws, |effect, values, draws| {
            effect.slip(values, draws)
        })
    }

    /// The speeds of the wheels over the ground.
    #[inline]
    pub(crate) fn ground(&mut self, now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        self.each_mut(Hook::Ground, wheels, |effect, values, wheels| {
            effect.ground(values, now, wheels)
        })
    }

    /// The motion of the body.
    #[inline]
    pub(crate) fn twist(&mut self, now: &Moment, twist: Twist) -> Twist {
        self.each_mut(Hook::Twist, twist, |effect, values, twist| {
            effect.twist(values, now, twist)
        })
    }

    /// A position after the velocities that are added to the robot's have acted for `step_s`.
    #[inline]
    pub(crate) fn drifted(&self, now: &Moment, position: Vec2, step_s: f64) -> Vec2 {
        self.each(Hook::Drift, position, |effect, values, position| {
            position + effect.drift_m_s(values, now) * step_s
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::effects::testing::{declared, scene};
    use crate::{EFFECTS, Param, Run, Setting, Streams};

    #[test]
    fn effects_name_every_hook_that_they_have() {
        const STEPS: usize = 2000;
        for spec in EFFECTS {
            let value = |param: &Param| match param.neutral {
                Some(neutral) => (neutral + 0.1 * (param.high - neutral)).min(param.high),
                None if param.whole => param.high,
                None => 0.5 * (param.low + param.high),
            };
            let mut model = declared();
            let values: Vec<f64> = spec.params.iter().map(value).collect();
            model.effects.push(Setting::constant(spec, values));
            let world = scene().world(&model, 0).unwrap();
            let mut run = Run::new(&world, Streams { seed: 2, run: 0 }).unwrap();
            let mut asked = Run::new(&world, Streams { seed: 2, run: 0 }).unwrap();
            asked.call_every_hook();
            for step in 0..STEPS {
                assert_eq!(run.step(), asked.step(), "{} at step {step}", spec.name);
            }
        }
    }
}
