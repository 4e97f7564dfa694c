//! Effects between the command and the motion.

use std::collections::VecDeque;

use track::Vec2;

use super::kept::Kept;
use super::plain::{OnDrift, OnDrive, OnGround, OnMachine, OnYaw};
use super::sense::{decay, rounded};
use super::{AZIMUTH, Effect, Hook, Moment, Param, Spec, Stage};
use crate::WheelSpeeds;

/// The longest delay, s.
const LONGEST_DELAY_S: f64 = 5.0;

/// Commands that act late, by whole physics steps.
pub(super) const COMMAND_DELAY: Spec = Spec {
    name: "command-delay",
    stage: Stage::Act,
    summary: "commands act late, by the nearest whole number of physics steps; the wheels rest until then",
    params: &[Param::new("time_s", "s", 0.0, 0.0, LONGEST_DELAY_S)],
    list: None,
    build: || Box::<CommandDelay>::default(),
};

#[derive(Debug, Default)]
struct CommandDelay {
    /// The commands of the last physics steps, the present one first.
    last: VecDeque<WheelSpeeds>,
    /// The delay and the longest one, in physics steps.
    steps: Kept<2, [usize; 2]>,
}

impl Effect for CommandDelay {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Drive]
    }
    fn drive(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let [late, longest] = self.steps.of([values[0], now.step_s], |[delay_s, step_s]| {
            [delay_s, LONGEST_DELAY_S].map(|time_s| (time_s / step_s).round() as usize)
        });
        // All that the longest delay may ask for is kept, because a delay may grow during a run.
        self.last.truncate(longest);
        self.last.push_front(wheels);
        self.last.get(late).copied().unwrap_or_default()
    }
}

/// Commands too slow to overcome friction.
pub(super) const DEAD_BAND: Spec = Spec {
    name: "dead-band",
    stage: Stage::Act,
    summary: "commands slower than this do not move the wheel",
    params: &[Param::new("speed_m_s", "m/s", 0.0, 0.0, 0.2)],
    list: None,
    build: || {
        Box::new(OnDrive(
            |values, speed| if speed.abs() < values[0] { 0.0 } else { speed },
        ))
    },
};

/// Commands rounded to multiples, as those of a stepper's driver are.
pub(super) const SPEED_STEP: Spec = Spec {
    name: "speed-step",
    stage: Stage::Act,
    summary: "commands rounded to multiples of this speed",
    params: &[Param::new("speed_m_s", "m/s", 0.0, 0.0, 0.2)],
    list: None,
    build: || Box::new(OnDrive(|values, speed| rounded(speed, values[0]))),
};

/// A first-order lag of each wheel, exact at the physics step, starting at rest.
pub(super) const MOTOR_LAG: Spec = Spec {
    name: "motor-lag",
    stage: Stage::Act,
    summary: "wheel speed follows its command with a first-order lag, from rest",
    params: &[Param::new("time_s", "s", 0.0, 0.0, 5.0)],
    list: None,
    build: || Box::<MotorLag>::default(),
};

#[derive(Debug, Default)]
struct MotorLag {
    /// The speeds of the step before.
    before: WheelSpeeds,
    decay: Kept<2, f64>,
}

impl Effect for MotorLag {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Drive]
    }
    fn drive(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let decay = self.decay.of([now.step_s, values[0]], decay);
        self.before = both(wheels, self.before, |target, before| {
            target + decay * (before - target)
        });
        self.before
    }
}

/// A bound on how fast a wheel's speed changes, starting at rest.
pub(super) const ACCELERATION_LIMIT: Spec = Spec {
    name: "acceleration-limit",
    stage: Stage::Act,
    summary: "wheel speed changes at most so fast, from rest",
    params: &[Param::place("m_s2", "m/s^2", 1e-3, 10.0)],
    list: None,
    build: || Box::<AccelerationLimit>::default(),
};

/// The speeds of the step before.
#[derive(Debug, Default)]
struct AccelerationLimit(WheelSpeeds);

impl Effect for AccelerationLimit {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Drive]
    }
    fn drive(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let most = values[0] * now.step_s;
        self.0 = both(wheels, self.0, |target, before| {
            target.clamp(before - most, before + most)
        });
        self.0
    }
}

/// Each wheel's speed in both through the same function.
fn both(a: WheelSpeeds, b: WheelSpeeds, f: impl Fn(f64, f64) -> f64) -> WheelSpeeds {
    WheelSpeeds {
        left_m_s: f(a.left_m_s, b.left_m_s),
        right_m_s: f(a.right_m_s, b.right_m_s),
    }
}

/// The declared slip times a factor.
pub(super) const SLIP_LEVEL: Spec = Spec {
    name: "slip-level",
    stage: Stage::Act,
    summary: "the declared slip times factor",
    params: &[Param::new("factor", "", 1.0, 0.0, 20.0)],
    list: None,
    build: || Box::new(OnMachine(|values, machine| machine.slip_level *= values[0])),
};

/// First-order autoregressive slip: u' = c u + sqrt(1 - c^2) draw, from one physics step to the next.
pub(super) const SLIP_MEMORY: Spec = Spec {
    name: "slip-memory",
    stage: Stage::Act,
    summary: "first-order autoregressive slip at the physics step, its variance kept",
    params: &[Param::new("correlation", "", 0.0, -0.999, 0.999)],
    list: None,
    build: || Box::<SlipMemory>::default(),
};

#[derive(Debug, Default)]
struct SlipMemory {
    /// The slips of the step before.
    before: Option<(f64, f64)>,
    fresh: Kept<1, f64>,
}

impl Effect for SlipMemory {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Slip]
    }
    fn slip(&mut self, values: &[f64], draws: (f64, f64)) -> (f64, f64) {
        let correlation = values[0];
        let fresh = self.fresh.of([correlation], |[c]| (1.0 - c * c).sqrt());
        let next = |before: f64, draw: f64| correlation * before + fresh * draw;
        let slips = (self.before).map_or(draws, |(left, right)| (next(left, draws.0), next(right, draws.1)));
        self.before = Some(slips);
        slips
    }
}

/// A left wheel larger than the right one (E_d of Borenstein and Feng 1996).
pub(super) const WHEEL_ASYMMETRY: Spec = Spec {
    name: "wheel-asymmetry",
    stage: Stage::Act,
    summary: "the left wheel's speed times ratio",
    params: &[Param::new("ratio", "", 1.0, 0.5, 2.0)],
    list: None,
    build: || {
        Box::new(OnGround(|values, _, wheels| WheelSpeeds {
            left_m_s: wheels.left_m_s * values[0],
            ..wheels
        }))
    },
};

/// Both wheels larger than declared.
pub(super) const WHEEL_SCALE: Spec = Spec {
    name: "wheel-scale",
    stage: Stage::Act,
    summary: "both wheels' speed times factor",
    params: &[Param::new("factor", "", 1.0, 0.1, 5.0)],
    list: None,
    build: || {
        Box::new(OnGround(|values, _, wheels| {
            wheels.map(|speed| speed * values[0])
        }))
    },
};

/// A battery that runs down: wheel speeds times 1 - per_s t, which ends at rest.
pub(super) const BATTERY_SAG: Spec = Spec {
    name: "battery-sag",
    stage: Stage::Act,
    summary: "wheel speeds times 1 - per_s * (time since the run began)",
    params: &[Param::new("per_s", "1/s", 0.0, -0.001, 0.001)],
    list: None,
    build: || {
        Box::new(OnGround(|values, now, wheels| {
            let rest = (1.0 - values[0] * now.time_s).max(0.0);
            wheels.map(|speed| speed * rest)
        }))
    },
};

/// A distance between the wheels' points of contact other than declared (E_b of Borenstein and Feng 1996).
pub(super) const AXLE_LENGTH: Spec = Spec {
    name: "axle-length",
    stage: Stage::Act,
    summary: "the distance between the wheels times factor",
    params: &[Param::new("factor", "", 1.0, 0.2, 5.0)],
    list: None,
    build: || Box::new(OnMachine(|values, machine| machine.robot.axle_m *= values[0])),
};

/// The yaw rate at which half of [`TURN_SCRUB`]'s fraction is lost, rad/s: about that of a robot which turns on the
/// spot at half the declared speed.
const SCRUB_RAD_S: f64 = 1.0;

/// Tyres that are dragged sideways in turns: the yaw rate w becomes w (1 - fraction |w| / (|w| + 1 rad/s)).
///
/// Slip is commonly identified as a polynomial of the yaw rate (Rogers-Marcovitz and Kelly, ISER 2010); for slow turns
/// this is its term fraction w |w|, and for fast ones, where friction no longer grows, the share lost stays below
/// `fraction`.
pub(super) const TURN_SCRUB: Spec = Spec {
    name: "turn-scrub",
    stage: Stage::Act,
    summary: "yaw rate w times 1 - fraction * |w| / (|w| + 1 rad/s): lost in turns, more in fast ones",
    params: &[Param::new("fraction", "", 0.0, -0.9, 0.9)],
    list: None,
    build: || {
        Box::new(OnYaw(|values, yaw_rad_s| {
            let share = yaw_rad_s.abs() / (yaw_rad_s.abs() + SCRUB_RAD_S);
            yaw_rad_s * (1.0 - values[0] * share)
        }))
    },
};

/// A floor that is not level, or a draught.
pub(super) const FLOOR_TILT: Spec = Spec {
    name: "floor-tilt",
    stage: Stage::Act,
    summary: "a constant velocity added to the robot's",
    params: &[Param::new("speed_m_s", "m/s", 0.0, 0.0, 0.1), AZIMUTH],
    list: None,
    build: || {
        Box::new(OnDrift(|values| {
            Vec2::new(values[1].cos(), values[1].sin()) * values[0]
        }))
    },
};
