//! One robot driving: sense, decide, act, move, observe.

use std::convert::Infallible;
use std::ops::ControlFlow;

use track::{Lap, LapTracker, Vec2, Way};

use crate::apparatus::{Apparatus, Sight};
use crate::cast::LANES;
use crate::cones::Cones;
#[cfg(test)]
use crate::effects::Hook;
use crate::effects::Moment;
use crate::sensor::Combine;
use crate::tape::{Draws, Played};
use crate::world::{Geometry, World};
use crate::{Error, Machine, Pose, Readings, WheelSpeeds};

/// What one control step tells: the row of a run's file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Time since the run began, s.
    pub time_s: f64,
    /// The centre as the overhead camera sees it, m.
    pub observed: Vec2,
    /// The readings, counts.
    pub readings: Readings,
    /// The wheel speeds commanded from them, m/s.
    pub command: WheelSpeeds,
}

/// Where a run starts, and what its clock shows then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Number of the gate.
    pub gate: usize,
    /// Time since the run began, s: 0 but where the simulated start is not the run's.
    pub time_s: f64,
}

/// Everything that changes while a robot drives.
#[derive(Debug)]
pub struct Run<'w> {
    apparatus: Apparatus<'w>,
    pose: Pose,
    command: WheelSpeeds,
    start_s: f64,
    steps: u64,
    next_gate: usize,
    stretch: u64,
    contacts: u64,
    slip: Played<'w>,
    sense: Played<'w>,
    camera: Played<'w>,
}

impl<'w> Run<'w> {
    /// A robot at its random start (on a random gate, a little beside its centre, a little turned).
    ///
    /// # Errors
    /// An effect without values for this run.
    pub fn new(world: &'w World<'w>, draws: impl Into<Draws<'w>>) -> Result<Self, Error> {
        Self::from_start(world, draws, None)
    }

    /// A robot that starts on a given gate, if one is given, beside its centre and turned as [`Run::new`] would have it. Each lap
    /// meets the draws that it would meet there.
    ///
    /// # Errors
    /// As [`Run::new`].
    pub fn from_start(
        world: &'w World<'w>,
        draws: impl Into<Draws<'w>>,
        start: Option<Start>,
    ) -> Result<Self, Error> {
        let draws = draws.into();
        let [slip, sense, camera] = draws.of_steps();
        let mut at_start = draws.streams().open("start");
        let gates = &world.circuit().gates;
        let drawn = at_start.index(gates.len());
        let (offset_m, turn_rad) = (
            world.rules().start_offset_m * at_start.symmetric(),
            world.rules().start_heading_rad * at_start.symmetric(),
        );
        let Start { gate, time_s } = start.unwrap_or(Start {
            gate: drawn,
            time_s: 0.0,
        });
        let to_lap = |gate| match world.rules().way {
            Way::Forward => gates.len() - gate,
            Way::Backward => gate,
        };
        let forward = world.forward(gate);
        let center = gates[gate].center + gates[gate].left * offset_m;
        let pose = Pose::new(center.x, center.y, forward.y.atan2(forward.x) + turn_rad);
        let mut run = Self {
            apparatus: Apparatus::new(world, &[])?,
            pose,
            command: WheelSpeeds::default(),
            start_s: time_s,
            steps: 0,
            next_gate: gate,
            stretch: (to_lap(drawn) as u64).wrapping_sub(to_lap(gate) as u64),
            contacts: 0,
            slip,
            sense,
            camera,
        };
        run.pass_gate(pose.position);
        Ok(run)
    }

    /// The robot's true pose.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Physics steps so far in which the body touched a wall.
    pub fn contacts(&self) -> u64 {
        self.contacts
    }

    /// Has every hook of every effect called from now on.
    #[cfg(test)]
    pub(crate) fn call_every_hook(&mut self) {
        self.apparatus.effects.call_every_hook();
        self.apparatus.weighs_rays = self.apparatus.effects.has(Hook::RayFactors);
    }

    /// Has each ray of all sensors cast for itself from now on, however many rays they have.
    #[cfg(test)]
    pub(crate) fn cast_ray_by_ray(&mut self) {
        self.apparatus.cones = None;
    }

    /// Drives for one control step.
    pub fn step(&mut self) -> Step {
        let time_s = self.start_s + self.steps as f64 * self.apparatus.world.rules().control_step_s;
        self.apparatus.advance(time_s);
        let mut now = Moment {
            time_s,
            step_s: self.apparatus.world.rules().control_step_s,
            pose: self.pose,
            command: self.command,
            gate: self.next_gate,
            gate_count: self.apparatus.world.circuit().gates.len(),
            arena_middle: self.apparatus.world.circuit().middle(),
        };
        let observed = self.observe(&now);
        let readings = self.sense(&now);
        now.command = self
            .apparatus
            .machine
            .robot
            .limit(self.apparatus.machine.controller.command(&readings));
        self.command = now.command;
        self.act(now);
        self.steps += 1;
        Step {
            time_s,
            observed,
            readings,
            command: now.command,
        }
    }

    /// Where the camera sees the robot.
    #[inline]
    fn observe(&mut self, now: &Moment) -> Vec2 {
        let seen = self.apparatus.effects.observed(now, now.pose.position);
        let noise_m = self.apparatus.machine.camera_noise_m;
        let [x, y] = self.camera.normals();
        seen + Vec2::new(x, y) * noise_m
    }

    /// The eight readings.
    #[inline]
    fn sense(&mut self, now: &Moment) -> Readings {
        // Drawn first: the processor casts the rays meanwhile.
        let normals: Readings = self.sense.normals();
        let mut readings = self.responses();
        let machine = &self.apparatus.machine;
        self.apparatus.effects.readings(now, machine, &mut readings);
        let (noise, full_scale) = (machine.noise, machine.full_scale_counts);
        for (reading, normal) in readings.iter_mut().zip(normals) {
            *reading += noise.deviation(*reading) * normal;
        }
        self.apparatus.effects.noisy_readings(&mut readings);
        readings.map(|reading| reading.clamp(0.0, full_scale))
    }

    /// The response of each sensor to what its rays meet.
    #[inline]
    fn responses(&self) -> Readings {
        match self.apparatus.machine.beam.combine {
            Combine::Responses => self.mean_response(),
            Combine::Distances => self.response_of_mean_distance(),
        }
    }

    /// The share of the rays that are cast by sensors in what each sensor's rays add up to, and the sights that are left.
    #[inline(always)]
    fn after_cones(&self, share: fn(&Self, &Cones) -> [f64; LANES]) -> ([f64; LANES], &[Sight]) {
        let sights = &self.apparatus.sights;
        match self.apparatus.cones_of_distances() {
            Some(cones) => (share(self, cones), &sights[cones.sights()..]),
            None => ([0.0; LANES], sights),
        }
    }

    /// Weighted mean of the responses of each sensor's rays.
    #[inline]
    fn mean_response(&self) -> Readings {
        let Machine {
            range_m, response, ..
        } = &self.apparatus.machine;
        let (mut total, rest) = self.after_cones(Self::mean_response_of);
        for sight in rest {
            let (rays, hits) = self.apparatus.cast(self.pose, sight);
            let mut values = response.readings(&hits.distance_m);
            for (value, distance_m) in values.iter_mut().zip(hits.distance_m) {
                *value = if distance_m <= *range_m { *value } else { 0.0 };
            }
            if self.apparatus.weighs_rays {
                let factors = self.apparatus.ray_factors(&rays, &hits);
                for lane in 0..LANES {
                    values[lane] *= factors[lane];
                }
            }
            for lane in 0..LANES {
                total[lane] += sight.weight * values[lane];
            }
        }
        total
    }

    /// The share in that of the rays that are cast by sensors.
    #[inline(never)]
    fn mean_response_of(&self, cones: &Cones) -> Readings {
        let Machine {
            range_m, response, ..
        } = &self.apparatus.machine;
        let mut total = [0.0; LANES];
        cones.cast(&self.apparatus.geometry.walls, self.pose, |pack, _, hits| {
            let distances_m = &hits.distance_m;
            if distances_m.iter().any(|distance_m| distance_m <= range_m) {
                let values = response.readings(distances_m);
                for ray in 0..LANES {
                    let seen = distances_m[ray] <= *range_m;
                    total[pack.sensor] += pack.weights[ray] * if seen { values[ray] } else { 0.0 };
                }
            }
        });
        total
    }

    /// Response of the weighted mean of each sensor's distances, times the mean of what effects make of its rays.
    #[inline]
    fn response_of_mean_distance(&self) -> Readings {
        let Machine {
            range_m, response, ..
        } = &self.apparatus.machine;
        let (mut mean, rest) = self.after_cones(Self::mean_distance_of);
        let mut factor = [1.0; LANES];
        for sight in rest {
            let (rays, hits) = self.apparatus.cast(self.pose, sight);
            for (mean, d) in mean.iter_mut().zip(hits.distance_m) {
                *mean += sight.weight * d.min(*range_m);
            }
            if self.apparatus.weighs_rays {
                let factors = self.apparatus.ray_factors(&rays, &hits);
                for lane in (0..LANES).filter(|&lane| hits.distance_m[lane] <= *range_m) {
                    factor[lane] += sight.weight * (factors[lane] - 1.0);
                }
            }
        }
        // A mean that is as far as the range is of rays that all see nothing.
        let seen = |d: f64| d < range_m * (1.0 - 1e-12);
        let values = response.readings(&mean);
        std::array::from_fn(|i| if seen(mean[i]) { factor[i] * values[i] } else { 0.0 })
    }

    /// The share in the mean distances of the rays that are cast by sensors.
    #[inline(never)]
    fn mean_distance_of(&self, cones: &Cones) -> [f64; LANES] {
        let range_m = self.apparatus.machine.range_m;
        let mut mean = [0.0; LANES];
        cones.cast(&self.apparatus.geometry.walls, self.pose, |pack, _, hits| {
            for ray in 0..LANES {
                mean[pack.sensor] += pack.weights[ray] * hits.distance_m[ray].min(range_m);
            }
        });
        mean
    }

    /// The physics steps of one control step.
    #[inline]
    fn act(&mut self, mut now: Moment) {
        let rules = self.apparatus.world.rules();
        let step_s = rules.physics_step_s();
        let start_s = now.time_s;
        now.step_s = step_s;
        // In registers: what is stored in one width and loaded in another the processor waits for.
        let mut pose = self.pose;
        for k in 0..rules.physics_steps {
            now.time_s = start_s + f64::from(k) * step_s;
            now.pose = pose;
            let ground = self.ground(&now);
            let rolling = self.apparatus.machine.robot.twist(ground);
            let twist = self.apparatus.effects.twist(&now, rolling);
            pose = pose.advance(twist, step_s);
            pose.position = (self.apparatus.effects).drifted(&now, pose.position, step_s);
            pose.position = self.off_walls(pose);
            self.pass_gate(pose.position);
        }
        self.pose = pose;
    }

    /// Speeds of the wheels over the ground.
    #[inline]
    fn ground(&mut self, now: &Moment) -> WheelSpeeds {
        let effects = &mut self.apparatus.effects;
        let wheels = effects.drive(now, now.command);
        let (left, right) = effects.slip(self.slip.symmetrics().into());
        let level = self.apparatus.machine.slip_level;
        let slipping = WheelSpeeds {
            left_m_s: wheels.left_m_s * (1.0 + level * left),
            right_m_s: wheels.right_m_s * (1.0 + level * right),
        };
        effects.ground(now, slipping)
    }

    /// The centre moved away from walls that the body overlaps at a pose; the heading stays.
    #[inline]
    fn off_walls(&mut self, pose: Pose) -> Vec2 {
        // Two walls at an acute corner push in turn; a body that fits is free after a few.
        const MOST_PUSHES: usize = 32;
        let radius_m = self.apparatus.machine.robot.body_radius_m;
        let Geometry { contact, walls, .. } = &*self.apparatus.geometry;
        let mut center = pose.position;
        for push in 0..MOST_PUSHES {
            let Some(point) = contact.nearest_within(walls, center, radius_m) else {
                break;
            };
            self.contacts += u64::from(push == 0);
            let away = (center - point).try_normalize().unwrap_or(-pose.heading);
            // A hair more than the radius, so that rounding does not make it overlap again.
            center = point + away * (radius_m * (1.0 + 1e-12));
        }
        center
    }

    /// Starts the random streams afresh when the true position passes the next gate.
    #[inline]
    fn pass_gate(&mut self, position: Vec2) {
        let gates = &self.apparatus.world.circuit().gates;
        let gate = &gates[self.next_gate];
        let way = position - gate.center;
        if way.dot(self.apparatus.world.forward(self.next_gate)) < 0.0 || way.length_squared() > 0.04 {
            return;
        }
        let count = gates.len();
        self.next_gate = match self.apparatus.world.rules().way {
            Way::Forward => (self.next_gate + 1) % count,
            Way::Backward => (self.next_gate + count - 1) % count,
        };
        self.stretch = self.stretch.wrapping_add(1);
        self.slip.enter(self.stretch);
        self.sense.enter(self.stretch);
        self.camera.enter(self.stretch);
    }
}

/// The laps of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Whole laps after the first, in order; fewer than asked for if the run timed out.
    pub laps: Vec<Lap>,
    /// Physics steps in which the body touched a wall.
    pub contacts: u64,
    /// Whether the run ended because gate 0 was not crossed for too long.
    pub timed_out: bool,
    /// Control steps driven.
    pub steps: u64,
}

/// Drives until `laps` whole laps after the first are complete, or until the model's patience ends; `record` gets every
/// step and, after the last lap, a few more.
///
/// # Errors
/// An effect without values for this run.
pub fn drive<'w>(
    world: &'w World<'w>,
    draws: impl Into<Draws<'w>>,
    laps: usize,
    record: impl FnMut(&Step),
) -> Result<Drive, Error> {
    drive_from(world, draws, None, laps, record)
}

/// [`drive`] from a given start, if one is given.
///
/// # Errors
/// As [`drive`].
pub fn drive_from<'w>(
    world: &'w World<'w>,
    draws: impl Into<Draws<'w>>,
    start: Option<Start>,
    laps: usize,
    mut record: impl FnMut(&Step),
) -> Result<Drive, Error> {
    let driven = drive_until(world, draws, start, laps, |step| {
        record(step);
        ControlFlow::<Infallible>::Continue(())
    });
    let ControlFlow::Continue(drive) = driven?;
    Ok(drive)
}

/// [`drive_from`] that ends at once where `record` breaks off, with what that said.
///
/// # Errors
/// As [`drive`].
pub fn drive_until<'w, B>(
    world: &'w World<'w>,
    draws: impl Into<Draws<'w>>,
    start: Option<Start>,
    laps: usize,
    mut record: impl FnMut(&Step) -> ControlFlow<B>,
) -> Result<ControlFlow<B, Drive>, Error> {
    let mut run = Run::from_start(world, draws, start)?;
    let mut tracker = LapTracker::new(&world.circuit().gates, world.rules().way);
    let mut done: Vec<Lap> = Vec::new();
    let patience_s = world.rules().patience_laps * world.nominal_lap_s();
    let mut latest_s = run.start_s;
    let timed_out = loop {
        let step = run.step();
        if let ControlFlow::Break(reason) = record(&step) {
            return Ok(ControlFlow::Break(reason));
        }
        if let Some(lap) = tracker.push(step.time_s, step.observed) {
            latest_s = step.time_s;
            done.push(lap);
            if done.len() > laps {
                break false;
            }
        }
        if step.time_s - latest_s > patience_s {
            break true;
        }
    };
    // "As the first lap was much influenced by the initial position of the robot, it was always removed."
    let kept = done.split_off(done.len().min(1));
    let (contacts, steps) = (run.contacts, run.steps);
    if !timed_out {
        let spare = (0..SPARE_STEPS).try_for_each(|_| record(&run.step()));
        if let ControlFlow::Break(reason) = spare {
            return Ok(ControlFlow::Break(reason));
        }
    }
    Ok(ControlFlow::Continue(Drive {
        laps: kept,
        contacts,
        timed_out,
        steps,
    }))
}

/// Steps recorded after the last lap has closed, so that it also closes in a file whose positions are rounded.
const SPARE_STEPS: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Streams;
    use crate::effects::testing::{declared, scene};

    const LAPS: usize = 3;

    #[test]
    fn a_run_from_the_gate_that_it_would_draw_is_the_same() {
        let world = scene().world(&declared(), 0).unwrap();
        let streams = Streams { seed: 4, run: 2 };
        let gate = streams.open("start").index(world.circuit().gates.len());
        let start = Some(Start { gate, time_s: 0.0 });
        let drawn = drive(&world, streams, LAPS, |_| {}).unwrap();
        assert_eq!(drive_from(&world, streams, start, LAPS, |_| {}).unwrap(), drawn);
    }

    #[test]
    fn a_drive_ends_where_its_record_breaks_off() {
        let world = scene().world(&declared(), 0).unwrap();
        let streams = Streams { seed: 4, run: 2 };
        let mut steps = 0;
        let driven = drive_until(&world, streams, None, 10_000, |step| {
            steps += 1;
            if step.time_s < 100.0 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break("enough")
            }
        });
        assert_eq!(driven.unwrap(), ControlFlow::Break("enough"));
        let step_s = world.rules().control_step_s;
        assert_eq!(steps, (100.0 / step_s).ceil() as u64 + 1);
    }

    #[test]
    fn runs_start_where_and_when_they_are_told() {
        for way in [Way::Forward, Way::Backward] {
            let mut model = declared();
            model.run.way = way;
            let world = scene().world(&model, 0).unwrap();
            for gate in [20, 70] {
                let start = Some(Start { gate, time_s: 1000.0 });
                let streams = Streams { seed: 4, run: 0 };
                let lap = &drive_from(&world, streams, start, 1, |_| {}).unwrap().laps[0];
                // The way to gate 0 and the dropped lap.
                let until_s = lap.end_s - lap.times_s[gate] + lap.duration_s();
                assert!((lap.start_s - 1000.0 - until_s).abs() < 1.0, "{way:?} {gate}");
            }
        }
    }
}
