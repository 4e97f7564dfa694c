//! The declared model: every number that a simulation needs beside the course.

use track::{Course, Way};

use crate::effects::Setting;
use crate::sensor::check;
use crate::{Beam, Controller, Error, Mount, ReadingNoise, Response, Robot};

/// What the robot is made of: the constants of one control loop. Effects change these.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Body and drive.
    pub robot: Robot,
    /// The sensors S0 to S7.
    pub mounts: [Mount; 8],
    /// How far the sensors see, m. A wall farther away gives the reading 0 before noise.
    pub range_m: f64,
    /// The largest reading, counts; the smallest is 0.
    pub full_scale_counts: f64,
    /// Reading against distance.
    pub response: Response,
    /// Variation of a reading.
    pub noise: ReadingNoise,
    /// The rays of one sensor.
    pub beam: Beam,
    /// Readings to wheel commands.
    pub controller: Controller,
    /// Slip s: a wheel's speed is its command times 1 + s U, U uniform on [-1, 1].
    pub slip_level: f64,
    /// Standard deviation of the overhead camera in x and in y, m.
    pub camera_noise_m: f64,
}

/// How runs begin, tick and end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunRules {
    /// Along or against the course's direction.
    pub way: Way,
    /// Time between two readings, s.
    pub control_step_s: f64,
    /// Physics steps in a control step.
    pub physics_steps: u32,
    /// Half width of the uniform lateral offset at the start, m.
    pub start_offset_m: f64,
    /// Half width of the uniform heading at the start, rad.
    pub start_heading_rad: f64,
    /// A run that goes this many nominal lap times without crossing gate 0 ends.
    pub patience_laps: f64,
}

impl RunRules {
    /// Time of a physics step, s.
    pub fn physics_step_s(&self) -> f64 {
        self.control_step_s / f64::from(self.physics_steps)
    }
}

/// How exact walls become straight pieces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallRules {
    /// Largest distance of a piece from the exact wall, m.
    pub max_error_m: f64,
    /// Thickness of the boxes that stand for the pieces, m; 0 for lines.
    pub thickness_m: f64,
}

/// The declared model and the effects added to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The robot.
    pub machine: Machine,
    /// Runs.
    pub run: RunRules,
    /// Walls.
    pub wall: WallRules,
    /// What the robot does beyond the declared model.
    pub effects: Vec<Setting>,
}

impl Model {
    /// Nothing, if every number is in the range in which it means something.
    ///
    /// # Errors
    /// The first key of `model.toml` whose value is not, NaN and infinities included.
    pub fn check(&self) -> Result<(), Error> {
        let Machine {
            robot,
            response,
            noise,
            controller,
            ..
        } = &self.machine;
        let positive = f64::MIN_POSITIVE;
        check("wall.max_error_m", self.wall.max_error_m, 1e-9, 1.0)?;
        check("wall.thickness_m", self.wall.thickness_m, 0.0, 0.1)?;
        check("robot.body_radius_m", robot.body_radius_m, positive, 10.0)?;
        check("robot.axle_m", robot.axle_m, 1e-6, 10.0)?;
        check(
            "robot.wheel_speed_limit_m_s",
            robot.wheel_speed_limit_m_s,
            positive,
            100.0,
        )?;
        for (i, mount) in self.machine.mounts.iter().enumerate() {
            check(&format!("sensor.mounts.{i}.x_m"), mount.position.x, -1.0, 1.0)?;
            check(&format!("sensor.mounts.{i}.y_m"), mount.position.y, -1.0, 1.0)?;
            check(
                &format!("sensor.mounts.{i}.angle_rad"),
                mount.angle_rad,
                -7.0,
                7.0,
            )?;
        }
        check("sensor.range_m", self.machine.range_m, 1e-3, 100.0)?;
        check(
            "sensor.full_scale_counts",
            self.machine.full_scale_counts,
            positive,
            1e9,
        )?;
        check_response(response)?;
        let kind = if matches!(response, Response::Table(_)) {
            "original"
        } else {
            "improved"
        };
        check(
            &format!("sensor.{kind}.noise_fraction"),
            noise.fraction,
            0.0,
            10.0,
        )?;
        check(&format!("sensor.{kind}.noise_counts"), noise.counts, 0.0, 1e6)?;
        match *controller {
            Controller::Braitenberg { gain_per_count, .. } => {
                check("controller.gain_per_count", gain_per_count, -1.0, 1.0)?;
            }
            Controller::RuleBased { threshold_counts, .. } => {
                check("controller.threshold_counts", threshold_counts, 0.0, 1e9)?;
            }
        }
        check("controller.speed_m_s", controller.speed_m_s(), 1e-4, 100.0)?;
        check("controller.step_s", self.run.control_step_s, 1e-4, 10.0)?;
        check("slip.level", self.machine.slip_level, 0.0, 1.0)?;
        check("camera.noise_m", self.machine.camera_noise_m, 0.0, 1.0)?;
        check(
            "run.physics_steps",
            f64::from(self.run.physics_steps),
            1.0,
            1000.0,
        )?;
        check("run.start_offset_m", self.run.start_offset_m, 0.0, 1.0)?;
        check("run.start_heading_rad", self.run.start_heading_rad, 0.0, 3.2)?;
        check("run.patience_laps", self.run.patience_laps, 1.0, 1e6)?;
        self.effects
            .iter()
            .enumerate()
            .try_for_each(|(i, setting)| setting.check(i))
    }

    /// Nothing, if the robot fits between the walls of a course.
    ///
    /// # Errors
    /// A corridor that is too narrow, and where.
    pub fn check_fits(&self, course: &Course) -> Result<(), Error> {
        let corridor = course.corridor_m();
        let body_m = 2.0 * self.machine.robot.body_radius_m;
        let narrowest_m = corridor.narrowest_m - self.wall.thickness_m;
        if narrowest_m <= body_m {
            let at = corridor.narrowest_at;
            return Err(Error::TooNarrow {
                narrowest_m,
                x_m: at.x,
                y_m: at.y,
                body_m,
            });
        }
        Ok(())
    }
}

fn check_response(response: &Response) -> Result<(), Error> {
    match response {
        Response::Improved {
            a_counts,
            d0_m,
            exponent,
        } => {
            check("sensor.improved.a_counts", *a_counts, f64::MIN_POSITIVE, 1e9)?;
            check("sensor.improved.d0_m", *d0_m, 1e-9, 100.0)?;
            check("sensor.improved.exponent", *exponent, 1e-3, 100.0)
        }
        Response::Table(rows) => {
            let rising = rows.windows(2).all(|pair| pair[0][0] < pair[1][0]);
            let finite = rows.iter().flatten().all(|x| x.is_finite());
            if rows.len() >= 2 && rising && finite {
                Ok(())
            } else {
                Err(Error::Invalid {
                    key: "sensor.original.table".into(),
                    reason: "needs two or more rows [distance_m, counts] with rising distances".into(),
                })
            }
        }
    }
}
