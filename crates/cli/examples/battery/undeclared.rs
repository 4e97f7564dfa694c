//! Effects that are in no list: written here, known to the diagnosis only by what they do to the laps.

use sim::{
    Circuit, Effect, Machine, Moment, Param, Readings, Setting, Spec, Stage, Stream, Vec2, WheelSpeeds,
};

use crate::labels::Truth;
use crate::recipes::{log_uniform, rounded};

/// What the program must know to drive a robot with an effect.
pub(crate) const fn spec(
    name: &'static str,
    stage: Stage,
    summary: &'static str,
    params: &'static [Param],
    build: fn() -> Box<dyn Effect>,
) -> Spec {
    Spec {
        name,
        stage,
        summary,
        params,
        list: None,
        build,
    }
}

/// A part of the floor on which both wheels slip: speeds times 1 + share * a Gaussian of 0.15 m about a place.
static SLIPPERY_AREA: Spec = spec(
    "slippery-area",
    Stage::Act,
    "wheels slower on one part of the floor",
    &[
        Param::new("share", "", 0.0, -0.9, 0.9),
        Param::place("x_m", "m", -10.0, 10.0),
        Param::place("y_m", "m", -10.0, 10.0),
    ],
    || Box::new(SlipperyArea),
);

/// A wheel out of round: its speed times 1 + share * cos of its own angle.
static WHEEL_ECCENTRICITY: Spec = spec(
    "wheel-eccentricity",
    Stage::Act,
    "the left wheel's speed depends on its angle",
    &[Param::new("share", "", 0.0, -0.9, 0.9)],
    || Box::<Wheel>::default(),
);

/// Each wheel stands still for a physics step with this probability.
static STALLS: Spec = spec(
    "stalls",
    Stage::Act,
    "wheels miss steps at random",
    &[Param::new("probability", "", 0.0, 0.0, 1.0)],
    || Box::new(Stalls),
);

/// A camera that looks at the floor at an angle: positions from the arena's middle times 1 + c . position.
static CAMERA_PERSPECTIVE: Spec = spec(
    "camera-perspective",
    Stage::Observe,
    "positions shifted by a quadratic form",
    &[
        Param::new("cx_per_m", "1/m", 0.0, -1.0, 1.0),
        Param::new("cy_per_m", "1/m", 0.0, -1.0, 1.0),
    ],
    || Box::new(CameraPerspective),
);

/// Sensors that warm up: readings times 1 + share * (1 - exp(-t / time)).
static SENSOR_TEMPERATURE: Spec = spec(
    "sensor-temperature",
    Stage::Sense,
    "the sensors' gain settles after the start",
    &[
        Param::new("share", "", 0.0, -0.9, 0.9),
        Param::place("time_s", "s", 1.0, 1e5),
    ],
    || Box::new(SensorTemperature),
);

/// A way to draw an effect of no list.
pub(crate) type Kind = (&'static Spec, fn(&mut Draw<'_>) -> Vec<f64>);

/// The kinds that fresh batteries hold.
pub(crate) static KINDS: [Kind; 5] = [
    (&SLIPPERY_AREA, |draw| {
        let share = -draw.size(0.06, 0.25);
        let place = draw.place();
        vec![share, place.x, place.y]
    }),
    (&WHEEL_ECCENTRICITY, |draw| vec![draw.size(0.05, 0.2)]),
    (&STALLS, |draw| vec![draw.size(0.01, 0.08)]),
    (&CAMERA_PERSPECTIVE, |draw| {
        let length = draw.size(0.01, 0.05);
        let (sin, cos) = (std::f64::consts::PI * draw.stream.symmetric()).sin_cos();
        vec![length * cos, length * sin]
    }),
    (&SENSOR_TEMPERATURE, |draw| {
        let share = draw.size(0.06, 0.25);
        vec![draw.sign() * share, draw.time_s()]
    }),
];

/// What values are drawn with.
pub(crate) struct Draw<'a> {
    pub(crate) circuit: &'a Circuit,
    pub(crate) stream: &'a mut Stream,
    /// A factor on sizes.
    pub(crate) shrink: f64,
}

impl Draw<'_> {
    /// A size, log-uniform.
    pub(crate) fn size(&mut self, low: f64, high: f64) -> f64 {
        self.shrink * log_uniform(self.stream, low, high)
    }

    /// 1 or -1.
    pub(crate) fn sign(&mut self) -> f64 {
        if self.stream.symmetric() > 0.0 { 1.0 } else { -1.0 }
    }

    /// Some minutes, s.
    pub(crate) fn time_s(&mut self) -> f64 {
        log_uniform(self.stream, 60.0, 300.0)
    }

    /// One of the sensors that look ahead to a side or aside.
    pub(crate) fn sensor(&mut self) -> f64 {
        [1.0, 2.0, 5.0, 6.0][self.stream.index(4)]
    }

    /// The middle of one of the gates, m.
    fn place(&mut self) -> Vec2 {
        self.circuit.gates[self.stream.index(self.circuit.gates.len())].center
    }
}

#[derive(Debug)]
struct SlipperyArea;

impl Effect for SlipperyArea {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        const LENGTH_M: f64 = 0.15;
        let away_m2 = (now.pose.position - Vec2::new(values[1], values[2])).length_squared();
        let factor = 1.0 + values[0] * (-0.5 * away_m2 / LENGTH_M.powi(2)).exp();
        wheels.map(|speed| speed * factor)
    }
}

/// The left wheel's angle, rad.
#[derive(Debug, Default)]
struct Wheel(f64);

impl Effect for Wheel {
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        const RADIUS_M: f64 = 0.0205;
        let left_m_s = wheels.left_m_s * (1.0 + values[0] * self.0.cos());
        self.0 += wheels.left_m_s * now.step_s / RADIUS_M;
        WheelSpeeds { left_m_s, ..wheels }
    }
}

#[derive(Debug)]
struct Stalls;

impl Effect for Stalls {
    fn drive(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let kept = |wheel, speed| {
            if draw_of(now, wheel) < values[0] {
                0.0
            } else {
                speed
            }
        };
        WheelSpeeds {
            left_m_s: kept(1, wheels.left_m_s),
            right_m_s: kept(2, wheels.right_m_s),
        }
    }
}

/// A number in [0, 1) that is another one at every moment: where the robot is to the last bit, and when, is as good as a draw.
pub(crate) fn draw_of(now: &Moment, nth: u64) -> f64 {
    let place = now.pose.position.x.to_bits() ^ now.pose.position.y.to_bits().rotate_left(32);
    mixed(place ^ now.time_s.to_bits().rotate_left(16) ^ nth)
}

/// A number in [0, 1) that depends on every bit (the finisher of splitmix64).
fn mixed(bits: u64) -> f64 {
    let mut x = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

#[derive(Debug)]
struct CameraPerspective;

impl Effect for CameraPerspective {
    fn observed(&self, values: &[f64], now: &Moment, position: Vec2) -> Vec2 {
        let arm = position - now.arena_middle;
        position + arm * (values[0] * arm.x + values[1] * arm.y)
    }
}

#[derive(Debug)]
struct SensorTemperature;

impl Effect for SensorTemperature {
    fn readings(&mut self, values: &[f64], now: &Moment, _machine: &Machine, readings: &mut Readings) {
        let factor = 1.0 + values[0] * (1.0 - (-now.time_s / values[1]).exp());
        readings.iter_mut().for_each(|reading| *reading *= factor);
    }
}

/// An effect of no list with its size.
#[derive(Debug)]
pub(crate) struct Cause {
    pub(crate) setting: Setting,
    values: Vec<f64>,
}

impl Cause {
    /// One of a kind.
    pub(crate) fn draw((spec, values): &Kind, mut draw: Draw<'_>) -> Self {
        let values: Vec<f64> = values(&mut draw).into_iter().map(rounded).collect();
        Self {
            setting: Setting::constant(spec, values.clone()),
            values,
        }
    }

    /// Names and values, for the label.
    pub(crate) fn parameters(&self) -> Vec<(String, Truth)> {
        let names = self.setting.spec.params.iter().map(|param| param.name.to_owned());
        names
            .zip(self.values.iter().map(|&value| Truth::Number(value)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use sim::{Streams, drive};

    use super::*;
    use crate::further;
    use crate::labels::Controller;
    use crate::robot::{declared, scene};

    #[test]
    fn no_list_has_them_and_each_does_something() {
        let (scene, model) = (scene().unwrap(), declared(Controller::Braitenberg).unwrap());
        let mut stream = Streams { seed: 1, run: 0 }.open("test");
        let seen = |effects: Vec<Setting>| {
            let mut model = model.clone();
            model.effects = effects;
            let world = scene.world(&model, 0).unwrap();
            let mut steps = Vec::new();
            let record = |step: &sim::Step| steps.push(step.observed);
            drive(&world, Streams { seed: 1, run: 0 }, 5, record).unwrap();
            steps
        };
        let without = seen(Vec::new());
        for kind in KINDS.iter().chain(&further::KINDS) {
            let draw = Draw {
                circuit: scene.circuit(),
                stream: &mut stream,
                shrink: 1.0,
            };
            let setting = Cause::draw(kind, draw).setting;
            assert!(sim::find(setting.spec.name).is_err(), "{}", setting.spec.name);
            setting.check(0).unwrap();
            assert_ne!(seen(vec![setting]), without);
        }
    }
}
