//! The tick without noise at poses that are given: what a filter needs to follow a robot from its log.

use std::sync::Arc;

use track::Vec2;

use crate::apparatus::Apparatus;
use crate::cast::LANES;
use crate::effects::{Chain, Hook, Moment};
use crate::outlook::{Look, Outlook, Places};
use crate::world::World;
use crate::{Error, Machine, Pose, ReadingNoise, Readings, Setting, WheelSpeeds};

/// A 3 x 3 matrix over x (m), y (m) and heading (rad), row by row.
pub type PoseMatrix = [[f64; 3]; 3];

/// Changes of the readings after all effects (rows) with those before (columns).
type Passage = [[f64; LANES]; LANES];

/// Where a control step leads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// The pose after it.
    pub pose: Pose,
    /// The part of the displacement that turns with the heading, m.
    pub turned: Vec2,
    /// Covariance that slip adds to x, y and heading.
    pub covariance: PoseMatrix,
}

/// One run's machine without noise. What remembers (lags, delays) does so from call to call, so each of
/// [`Forecast::readings`] and [`Forecast::motion`] is called once per control step, in order, after [`Forecast::tick`].
#[derive(Debug)]
pub struct Forecast<'w> {
    apparatus: Apparatus<'w>,
    beside: Beside,
    /// What comes through of a small change of the readings; `None` for all of it.
    through: Option<Passage>,
    /// Share of a reading that is the last one's.
    kept: f64,
    now: Moment,
}

/// In what readings differ from those of the same world without the further effects, besides what effects on readings do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beside {
    /// In nothing.
    Nothing,
    /// Walls, or what they send back, differ at places, along the sensors' axes.
    Places,
    /// The same along each of a sensor's rays.
    PlacesOnRays,
    /// Sensors respond otherwise.
    Responses,
    /// Rays go otherwise.
    Rays,
}

impl<'w> Forecast<'w> {
    /// The machine of a world at the run's start.
    ///
    /// # Errors
    /// An effect without values for this run.
    pub fn new(world: &'w World<'w>) -> Result<Self, Error> {
        let mut forecast = Self::beside(world, &[])?;
        (forecast.through, forecast.kept) = forecast.passage()?;
        Ok(forecast)
    }

    /// The machine of a world with further effects, whose displacements of the walls count to first order and, like what
    /// walls send back, along the sensors' axes; to be compared with the world without them
    /// ([`Forecast::readings_beside`]).
    ///
    /// # Errors
    /// A further effect out of range, an effect without values for this run.
    pub fn beside(world: &'w World<'w>, further: &[Setting]) -> Result<Self, Error> {
        further
            .iter()
            .enumerate()
            .try_for_each(|(i, setting)| setting.check(i))?;
        let mut forecast = Self {
            apparatus: Apparatus::new(world, further)?,
            beside: Beside::Nothing,
            through: None,
            kept: 0.0,
            now: Moment {
                time_s: 0.0,
                step_s: world.rules().control_step_s,
                pose: Pose::new(0.0, 0.0, 0.0),
                command: WheelSpeeds::default(),
                gate: 0,
                gate_count: world.circuit().gates.len(),
                arena_middle: world.circuit().middle(),
            },
        };
        forecast.compare(world)?;
        if forecast.beside == Beside::PlacesOnRays {
            forecast.beside = Beside::Places;
        }
        Ok(forecast)
    }

    /// The machine of one world, to be compared with another one's ([`Forecast::readings_beside`]).
    ///
    /// # Errors
    /// An effect without values for this run.
    pub fn compared(world: &'w World<'w>, other: &World<'_>) -> Result<Self, Error> {
        let mut forecast = Self::beside(world, &[])?;
        forecast.compare(other)?;
        Ok(forecast)
    }

    /// Notes in what the readings differ from another world's.
    fn compare(&mut self, other: &World<'_>) -> Result<(), Error> {
        let others = Chain::new(&other.model.effects, other.run)?;
        let (mine, theirs) = (&self.apparatus.machine, &other.machine);
        let rays = self.apparatus.moves()
            || !Arc::ptr_eq(&self.apparatus.geometry, &other.geometry)
            || mine.mounts != theirs.mounts
            || mine.beam != theirs.beam;
        let responses = mine.range_m != theirs.range_m || mine.response != theirs.response;
        let places = self.apparatus.weighs_rays
            || others.has(Hook::RayFactors)
            || !self.apparatus.displacing.is_empty();
        // A look knows one ray of a sensor.
        let several = mine.beam.rays().len() > 1;
        self.beside = match () {
            () if rays || several && responses => Beside::Rays,
            () if responses => Beside::Responses,
            () if places && several => Beside::PlacesOnRays,
            () if places => Beside::Places,
            () => Beside::Nothing,
        };
        Ok(())
    }

    /// The machine's constants as they are now.
    pub fn machine(&self) -> &Machine {
        &self.apparatus.machine
    }

    /// The noise of readings that the model declares, before any effect.
    pub fn declared_noise(&self) -> ReadingNoise {
        self.apparatus.world.declared_noise()
    }

    /// Goes to the control step that begins at `time_s`, seconds since the run began.
    pub fn tick(&mut self, time_s: f64) {
        self.now.time_s = time_s;
        self.apparatus.advance(time_s);
    }

    /// Where the camera sees a pose, before its noise, m.
    pub fn observed(&self, pose: Pose) -> Vec2 {
        if self.sees_plainly() {
            return pose.position;
        }
        let now = Moment { pose, ..self.now };
        self.apparatus.effects.observed(&now, pose.position)
    }

    /// Whether the camera sees every pose where it is, before its noise.
    pub fn sees_plainly(&self) -> bool {
        !self.apparatus.effects.has(Hook::Observed)
    }

    /// Expected readings at a pose with this covariance, to second order in the distance.
    pub fn readings(&mut self, pose: Pose, covariance: &PoseMatrix) -> Outlook {
        let mut outlook = self.apparatus.outlook(pose, covariance);
        self.change_readings(pose, &mut outlook.mean);
        if let Some(through) = &self.through {
            let slope = outlook.slope;
            outlook.slope = through.map(|row| {
                std::array::from_fn(|axis| (0..LANES).map(|lane| row[lane] * slope[lane][axis]).sum())
            });
            for lane in 0..LANES {
                outlook.edge_variance[lane] *= through[lane][lane] * through[lane][lane];
            }
        }
        outlook
    }

    /// Share of a reading that is the last one's, 0 where readings do not lag: what was wrong with that one is wrong with this one
    /// by as much.
    pub fn kept(&self) -> f64 {
        self.kept
    }

    /// Distances along the sensors' axes from a pose, m; infinite where there is no wall.
    pub fn distances_m(&self, pose: Pose) -> [f64; LANES] {
        self.apparatus.distances_m(pose)
    }

    /// What the rays of a look of the same world without further effects met; `None` where they change nothing there.
    pub fn places(&self, look: &Look) -> Option<Places> {
        (self.beside == Beside::Places).then(|| self.apparatus.places_of(look))
    }

    /// Expected readings where the same world without further effects had this look, whose [`Forecast::places`] are those of any
    /// forecast that has them: rays are cast again only where the further effects turn them.
    pub fn readings_beside(
        &mut self,
        pose: Pose,
        covariance: &PoseMatrix,
        look: &Look,
        places: Option<&Places>,
    ) -> Readings {
        let mut readings = match self.beside {
            Beside::Nothing => look.response(),
            Beside::Places => match places {
                Some(places) => self.apparatus.responses_where_met(look, places),
                None => self
                    .apparatus
                    .responses_where_met(look, &self.apparatus.places_of(look)),
            },
            Beside::Responses => self.apparatus.responses_again(look),
            Beside::Rays | Beside::PlacesOnRays => self.apparatus.outlook(pose, covariance).mean,
        };
        self.change_readings(pose, &mut readings);
        readings
    }

    /// What effects make of the readings.
    fn change_readings(&mut self, pose: Pose, readings: &mut Readings) {
        let now = Moment {
            pose,
            step_s: self.apparatus.world.rules().control_step_s,
            ..self.now
        };
        let machine = &self.apparatus.machine;
        self.apparatus.effects.readings(&now, machine, readings);
    }

    /// The motion of one control step without slip, and the covariance that slip adds.
    pub fn motion(&mut self, pose: Pose, command: WheelSpeeds) -> Motion {
        const MOST: usize = 8;
        let mut pushes = [(pose, WheelSpeeds::default()); MOST];
        let mut count = 0;
        let (end, drifted) = self.roll(pose, command, |half, ground| {
            pushes[count.min(MOST - 1)] = (half, ground);
            count += 1;
        });
        // Beyond so many physics steps the last stands for all that follow.
        let step_s = self.apparatus.world.rules().control_step_s / count as f64;
        let covariance = self.slip_covariance(&pushes[..count.min(MOST)], end.position, step_s);
        Motion {
            pose: end,
            turned: end.position - pose.position - drifted,
            covariance,
        }
    }

    /// Where one control step leads without slip.
    pub fn lead(&mut self, pose: Pose, command: WheelSpeeds) -> Pose {
        self.roll(pose, command, |_, _| ()).0
    }

    /// The physics steps of one control step: the pose after them and what drift added. `each` gets the middle of every
    /// step and the speeds of the wheels.
    #[inline]
    fn roll(
        &mut self,
        pose: Pose,
        command: WheelSpeeds,
        mut each: impl FnMut(Pose, WheelSpeeds),
    ) -> (Pose, Vec2) {
        let rules = self.apparatus.world.rules();
        let step_s = rules.physics_step_s();
        let start_s = self.now.time_s;
        let mut now = Moment {
            pose,
            command,
            step_s,
            ..self.now
        };
        let (mut at, mut drifted) = (pose, Vec2::ZERO);
        for k in 0..rules.physics_steps {
            now.time_s = start_s + f64::from(k) * step_s;
            now.pose = at;
            let ground = self.ground(&now);
            let rolling = self.apparatus.machine.robot.twist(ground);
            let twist = self.apparatus.effects.twist(&now, rolling);
            let next = at.advance(twist, step_s);
            each(
                Pose {
                    position: at.position.midpoint(next.position),
                    heading: (at.heading + next.heading) * 0.5,
                },
                ground,
            );
            let drift = self.apparatus.effects.drifted(&now, Vec2::ZERO, step_s);
            at = Pose {
                position: next.position + drift,
                ..next
            };
            drifted += drift;
        }
        (at, drifted)
    }

    /// Speeds of the wheels over the ground without slip.
    fn ground(&mut self, now: &Moment) -> WheelSpeeds {
        let effects = &mut self.apparatus.effects;
        let wheels = effects.drive(now, now.command);
        effects.ground(now, wheels)
    }

    /// What uniform slip of each wheel in each physics step adds up to at the step's end.
    fn slip_covariance(&self, pushes: &[(Pose, WheelSpeeds)], end: Vec2, step_s: f64) -> PoseMatrix {
        let level = self.apparatus.machine.slip_level;
        let mut covariance = [[0.0; 3]; 3];
        for (half, ground) in pushes {
            let arm = (end - half.position).perp();
            for (speed_m_s, sign) in [(ground.left_m_s, -1.0), (ground.right_m_s, 1.0)] {
                let yaw = sign * step_s / self.apparatus.machine.robot.axle_m;
                let way = half.heading * (0.5 * step_s) + arm * yaw;
                let push = [way.x, way.y, yaw];
                let variance = (level * speed_m_s).powi(2) / 3.0;
                for i in 0..3 {
                    for j in 0..3 {
                        covariance[i][j] += variance * push[i] * push[j];
                    }
                }
            }
        }
        covariance
    }

    /// What comes through of a small change of each reading, and the share of a reading that is the last one's: the effects on
    /// readings are straight lines in them, so one difference from a second chain of effects, at its second reading, is exact.
    fn passage(&self) -> Result<(Option<Passage>, f64), Error> {
        let second = |raised: Option<(usize, usize)>| -> Result<Readings, Error> {
            let world = self.apparatus.world;
            let mut effects = Chain::new(&world.model.effects, world.run)?;
            let mut readings = [100.0; LANES];
            for step in 0..2 {
                readings = [100.0; LANES];
                if let Some((_, lane)) = raised.filter(|(when, _)| *when == step) {
                    readings[lane] += 1.0;
                }
                effects.readings(&self.now, &self.apparatus.machine, &mut readings);
            }
            Ok(readings)
        };
        let plain = second(None)?;
        let mut through = [[0.0; LANES]; LANES];
        for lane in 0..LANES {
            let raised = second(Some((1, lane)))?;
            for (row, (a, b)) in raised.iter().zip(plain).enumerate() {
                through[row][lane] = a - b;
            }
        }
        let before = second(Some((0, 0)))?[0] - plain[0];
        let kept = if before == 0.0 {
            0.0
        } else {
            before / (before + through[0][0])
        };
        let unchanged = (0..LANES)
            .all(|i| (0..LANES).all(|j| (through[i][j] - if i == j { 1.0 } else { 0.0 }).abs() < 1e-9));
        Ok((if unchanged { None } else { Some(through) }, kept))
    }
}
