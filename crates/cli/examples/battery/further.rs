//! Further effects that are in no list, of other sorts than those that fresh batteries hold: what the method was not looked at with.

use std::f64::consts::TAU;

use sim::{Effect, Hit, Machine, Moment, Param, Readings, Site, Spec, Stage, Twist, Vec2, WheelSpeeds};
use track::Side;

use crate::undeclared::{Kind, draw_of, spec};

static SATURATION: Spec = spec(
    "reading-saturation",
    Stage::Sense,
    "high readings are too low: r (1 - share r / 1000)",
    &[Param::new("share", "", 0.0, 0.0, 1.0)],
    || Box::new(Saturation),
);
static DROPOUTS: Spec = spec(
    "reading-dropouts",
    Stage::Sense,
    "single readings are missing at random",
    &[Param::new("probability", "", 0.0, 0.0, 1.0)],
    || Box::new(Dropouts),
);
static SHORT_SIGHT: Spec = spec(
    "short-sighted-sensor",
    Stage::Sense,
    "one sensor sees less far",
    &[
        Param::place("sensor", "", 0.0, 7.0),
        Param::new("reach_m", "m", 1.0, 0.0, 1.0),
    ],
    || Box::new(ShortSight),
);
static BENT: Spec = spec(
    "bent-sensor",
    Stage::Sense,
    "one sensor looks another way",
    &[
        Param::place("sensor", "", 0.0, 7.0),
        Param::new("angle_rad", "rad", 0.0, -1.5, 1.5),
    ],
    || Box::new(Bent),
);
static LATE_DECISIONS: Spec = spec(
    "late-decisions",
    Stage::Decide,
    "a command is missed at random, and the last one kept",
    &[Param::new("probability", "", 0.0, 0.0, 1.0)],
    || Box::<LateDecisions>::default(),
);
static BACKLASH: Spec = spec(
    "backlash",
    Stage::Act,
    "wheels follow their commands with play",
    &[Param::new("half_width_m_s", "m/s", 0.0, 0.0, 0.1)],
    || Box::<Backlash>::default(),
);
static MOTOR_CURVE: Spec = spec(
    "motor-curve",
    Stage::Act,
    "slow wheels are too slow: v (1 + share (v / 60 mm/s - 1))",
    &[Param::new("share", "", 0.0, -1.0, 1.0)],
    || Box::new(MotorCurve),
);
static TETHER: Spec = spec(
    "tether",
    Stage::Act,
    "a cable pulls the robot towards the arena's middle",
    &[Param::new("per_s", "1/s", 0.0, 0.0, 1.0)],
    || Box::new(Tether),
);
static SLOW_TURNS: Spec = spec(
    "slow-turns",
    Stage::Act,
    "the robot is slower ahead in turns",
    &[Param::new("s_per_rad", "s/rad", 0.0, 0.0, 1.0)],
    || Box::new(SlowTurns),
);
static RUN_IN: Spec = spec(
    "run-in",
    Stage::Act,
    "wheels are slower in the beginning",
    &[
        Param::new("share", "", 0.0, 0.0, 1.0),
        Param::place("time_s", "s", 1.0, 1e5),
    ],
    || Box::new(RunIn),
);
static HAIR: Spec = spec(
    "hair",
    Stage::Act,
    "the left wheel is slower from some time on",
    &[
        Param::new("share", "", 0.0, 0.0, 1.0),
        Param::place("from_s", "s", 0.0, 1e5),
    ],
    || Box::new(Hair),
);
static WAVY_WALL: Spec = spec(
    "wavy-wall",
    Stage::World,
    "the outer wall goes to and fro",
    &[
        Param::new("height_m", "m", 0.0, -0.1, 0.1),
        Param::place("waves", "", 1.0, 100.0),
    ],
    || Box::new(WavyWall),
);
static OUTLIERS: Spec = spec(
    "camera-outliers",
    Stage::Observe,
    "positions are 20 mm off at random",
    &[Param::new("probability", "", 0.0, 0.0, 1.0)],
    || Box::new(Outliers),
);
static SHEAR: Spec = spec(
    "camera-shear",
    Stage::Observe,
    "the camera's axes are not at right angles",
    &[Param::new("share", "", 0.0, -0.5, 0.5)],
    || Box::new(Shear),
);

/// The kinds.
pub(crate) static KINDS: [Kind; 14] = [
    (&SATURATION, |draw| vec![draw.size(0.05, 0.3)]),
    (&LATE_DECISIONS, |draw| vec![draw.size(0.05, 0.4)]),
    (&BACKLASH, |draw| vec![draw.size(0.001, 0.006)]),
    (&WAVY_WALL, |draw| {
        let height = draw.sign() * draw.size(0.002, 0.008);
        vec![height, 3.0 + draw.stream.index(7) as f64]
    }),
    (&OUTLIERS, |draw| vec![draw.size(0.002, 0.03)]),
    (&DROPOUTS, |draw| vec![draw.size(0.003, 0.05)]),
    (&TETHER, |draw| vec![draw.size(0.0005, 0.004)]),
    (&SLOW_TURNS, |draw| vec![draw.size(0.01, 0.08)]),
    (&SHEAR, |draw| vec![draw.sign() * draw.size(0.002, 0.02)]),
    (&SHORT_SIGHT, |draw| {
        vec![draw.sensor(), 0.1 * (1.0 - draw.size(0.2, 0.6))]
    }),
    (&RUN_IN, |draw| vec![draw.size(0.01, 0.1), draw.time_s()]),
    (&MOTOR_CURVE, |draw| vec![draw.sign() * draw.size(0.03, 0.3)]),
    (&HAIR, |draw| vec![draw.size(0.003, 0.03), draw.time_s()]),
    (&BENT, |draw| {
        vec![draw.sensor(), draw.sign() * draw.size(0.1, 0.4)]
    }),
];

#[derive(Debug)]
struct Saturation;

impl Effect for Saturation {
    fn readings(&mut self, values: &[f64], _now: &Moment, _machine: &Machine, readings: &mut Readings) {
        readings
            .iter_mut()
            .for_each(|reading| *reading *= (1.0 - values[0] * *reading / 1000.0).max(0.2));
    }
}

#[derive(Debug)]
struct Dropouts;

impl Effect for Dropouts {
    fn readings(&mut self, values: &[f64], now: &Moment, _machine: &Machine, readings: &mut Readings) {
        for (reading, sensor) in readings.iter_mut().zip(0..) {
            if draw_of(now, 7919 + sensor) < values[0] {
                *reading = 0.0;
            }
        }
    }
}

#[derive(Debug)]
struct ShortSight;

impl Effect for ShortSight {
    fn ray_factor(&self, values: &[f64], hit: &Hit) -> f64 {
        let seen = hit.sensor as f64 != values[0] || hit.distance_m <= values[1];
        if seen { 1.0 } else { 0.0 }
    }
}

#[derive(Debug)]
struct Bent;

impl Effect for Bent {
    fn on_machine(&self) -> Option<fn(&[f64], &mut Machine)> {
        Some(|values, machine| machine.mounts[values[0] as usize].angle_rad += values[1])
    }
}

/// The command that is kept and whether the next step is the second one with the same readings.
#[derive(Debug, Default)]
struct LateDecisions {
    kept: Option<WheelSpeeds>,
    second: bool,
}

impl Effect for LateDecisions {
    fn drive(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let decides = !self.second && (self.kept.is_none() || draw_of(now, 104_729) >= values[0]);
        self.second = !self.second;
        if decides {
            self.kept = Some(wheels);
        }
        self.kept.unwrap_or(wheels)
    }
}

/// The speeds at which the wheels are.
#[derive(Debug, Default)]
struct Backlash(Option<WheelSpeeds>);

impl Effect for Backlash {
    fn drive(&mut self, values: &[f64], _now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let before = self.0.unwrap_or(wheels);
        let follow = |is: f64, wanted: f64| is.clamp(wanted - values[0], wanted + values[0]);
        let after = WheelSpeeds {
            left_m_s: follow(before.left_m_s, wheels.left_m_s),
            right_m_s: follow(before.right_m_s, wheels.right_m_s),
        };
        self.0 = Some(after);
        after
    }
}

#[derive(Debug)]
struct MotorCurve;

impl Effect for MotorCurve {
    fn drive(&mut self, values: &[f64], _now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        wheels.map(|speed| speed * (1.0 + values[0] * (speed / 0.06 - 1.0)))
    }
}

#[derive(Debug)]
struct Tether;

impl Effect for Tether {
    fn drift_m_s(&self, values: &[f64], now: &Moment) -> Vec2 {
        (now.arena_middle - now.pose.position) * values[0]
    }
}

#[derive(Debug)]
struct SlowTurns;

impl Effect for SlowTurns {
    fn twist(&mut self, values: &[f64], _now: &Moment, twist: Twist) -> Twist {
        Twist {
            speed_m_s: twist.speed_m_s * (1.0 - values[0] * twist.yaw_rad_s.abs()),
            ..twist
        }
    }
}

#[derive(Debug)]
struct RunIn;

impl Effect for RunIn {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        wheels.map(|speed| speed * (1.0 - values[0] * (-now.time_s / values[1]).exp()))
    }
}

#[derive(Debug)]
struct Hair;

impl Effect for Hair {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let slower = if now.time_s < values[1] { 0.0 } else { values[0] };
        WheelSpeeds {
            left_m_s: wheels.left_m_s * (1.0 - slower),
            ..wheels
        }
    }
}

#[derive(Debug)]
struct WavyWall;

impl Effect for WavyWall {
    fn displacement_m(&self, values: &[f64], at: &Site) -> f64 {
        if at.place.side == Side::Outer {
            values[0] * (TAU * values[1] * at.place.fraction).sin()
        } else {
            0.0
        }
    }
}

#[derive(Debug)]
struct Outliers;

impl Effect for Outliers {
    fn observed(&self, values: &[f64], now: &Moment, position: Vec2) -> Vec2 {
        if draw_of(now, 15_485_863) >= values[0] {
            return position;
        }
        let (sin, cos) = (TAU * draw_of(now, 32_452_843)).sin_cos();
        position + Vec2::new(cos, sin) * 0.02
    }
}

#[derive(Debug)]
struct Shear;

impl Effect for Shear {
    fn observed(&self, values: &[f64], now: &Moment, position: Vec2) -> Vec2 {
        position + Vec2::new(values[0] * (position.y - now.arena_middle.y), 0.0)
    }
}
