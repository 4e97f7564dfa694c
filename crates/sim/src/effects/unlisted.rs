//! A cause without a name: what it acts on, what it depends on, and the coefficients of that dependence.

use track::Vec2;

use super::area::Area;
use super::{Effect, Hook, Moment, Param, Spec, Stage};
use crate::{Machine, Readings, Twist, WheelSpeeds};

const ACTS_ON: [&str; 10] = [
    "yaw rate",
    "wheel speed",
    "left wheel",
    "right wheel",
    "side slip",
    "reading",
    "left-right difference",
    "camera x",
    "camera y",
    "camera scale",
];
const DEPENDS_ON: [&str; 8] = [
    "constant",
    "heading",
    "gate",
    "place",
    "speed",
    "turn",
    "time",
    "wheel angle",
];
const BASES: [&str; 4] = ["polynomial", "harmonics", "settling", Area::BASIS];

/// Values before the coefficients.
const WORDS: usize = UNLISTED.params.len();

/// Radius of the e-puck's wheels, m.
const WHEEL_RADIUS_M: f64 = 0.0205;

/// An effect outside the list: a sum over basis functions of one variable.
///
/// What the sum is: rad/s added to the yaw rate; m/s added to the robot's velocity to its left; a share added to
/// wheel speeds or to all readings; counts added to the difference of the left and the right three readings that
/// controllers look at; m added to what the camera sees; a share added to how far from the arena's middle it sees the robot.
///
/// The variable u is 1 (constant), the heading (rad), the lap's fraction by gates times 2 pi (rad), the mean of the
/// commanded wheel speeds or their difference, right less left (m/s), the time since the run began (s), or the angle by which
/// wheels have turned since then (rad): each wheel's own, for what is no wheel both in the mean. The
/// polynomial is c0 + c1 u + c2 u^2 + ..., the harmonics c0 cos u + c1 sin u + c2 cos 2u + c3 sin 2u + ..., the settling
/// c0 + c1 exp(-u / c2). A place on the floor has two coordinates (x, y) from the arena's middle (m): an [`Area`] does c0 about (c1, c2)
/// with the radius c3 and the softness c4, which is 1 where it is not given, and any other basis stands for the monomials
/// 1, x, y, x^2, xy, y^2, .... No other variable has areas.
///
/// It is not in [`super::EFFECTS`], because it is no candidate by itself; [`super::find`] knows it.
pub static UNLISTED: Spec = Spec {
    name: "unlisted",
    stage: Stage::Act,
    summary: "an effect without a name: coefficients of basis functions of what it depends on",
    params: &[
        Param::choice("acts_on", &ACTS_ON),
        Param::choice("depends_on", &DEPENDS_ON),
        Param::choice("basis", &BASES),
    ],
    list: Some(Param::new("coefficients", "", 0.0, -1e6, 1e6)),
    build: || Box::<Unlisted>::default(),
};

/// The angles by which the wheels have turned.
#[derive(Debug, Default)]
struct Unlisted {
    left_rad: f64,
    right_rad: f64,
}

impl Unlisted {
    fn mean_rad(&self) -> f64 {
        0.5 * (self.left_rad + self.right_rad)
    }
}

/// The word that a value of a choice stands for.
fn word(names: &'static [&'static str], value: f64) -> &'static str {
    names.get(value as usize).copied().unwrap_or_default()
}

/// The sum over the basis, if the effect acts on one of the targets.
fn amount(values: &[f64], now: &Moment, wheel_rad: f64, targets: &[&str]) -> Option<f64> {
    if !targets.contains(&word(&ACTS_ON, values[0])) {
        return None;
    }
    let (coefficients, command) = (&values[WORDS..], now.command);
    let u = match word(&DEPENDS_ON, values[1]) {
        "place" => return Some(unlisted_on_floor(values, now.pose.position - now.arena_middle)),
        "heading" => now.pose.heading_rad(),
        "gate" => std::f64::consts::TAU * now.gate as f64 / now.gate_count as f64,
        "speed" => 0.5 * (command.left_m_s + command.right_m_s),
        "turn" => command.right_m_s - command.left_m_s,
        "time" => now.time_s,
        "wheel angle" => wheel_rad,
        _ => return Some(coefficients.iter().sum()),
    };
    Some(unlisted_at(values, u))
}

/// What an effect without a name does at one value of the variable it depends on, in the units of what it acts on;
/// `values` are those of a setting of [`UNLISTED`]. A place is no single variable: see [`unlisted_on_floor`].
pub fn unlisted_at(values: &[f64], variable: f64) -> f64 {
    let coefficients = &values[WORDS..];
    match word(&BASES, values[2]) {
        "harmonics" => harmonics(coefficients, variable),
        "settling" => settling(coefficients, variable),
        Area::BASIS => 0.0,
        _ => coefficients.iter().rev().fold(0.0, |sum, c| sum * variable + c),
    }
}

/// What an effect without a name that depends on the place does at a place, seen from the arena's middle, m.
pub fn unlisted_on_floor(values: &[f64], from_middle: Vec2) -> f64 {
    let coefficients = &values[WORDS..];
    match word(&BASES, values[2]) {
        Area::BASIS => Area::of(coefficients).map_or(0.0, |area| area.at(from_middle)),
        _ => monomials(coefficients, from_middle),
    }
}

/// The area of the floor that values of a setting of [`UNLISTED`] stand for, if they do.
pub fn unlisted_area(values: &[f64]) -> Option<Area> {
    let (words, coefficients) = values.split_at_checked(WORDS)?;
    let is_area = word(&DEPENDS_ON, words[1]) == "place" && word(&BASES, words[2]) == Area::BASIS;
    Area::of(coefficients).filter(|_| is_area)
}

pub(super) fn unlisted_depends_on_time(values: &[f64]) -> bool {
    word(&DEPENDS_ON, values[1]) == "time"
}

fn harmonics(coefficients: &[f64], u: f64) -> f64 {
    let term = |(k, pair): (usize, &[f64])| {
        let (sin, cos) = ((k + 1) as f64 * u).sin_cos();
        pair[0] * cos + pair.get(1).map_or(0.0, |c| c * sin)
    };
    coefficients.chunks(2).enumerate().map(term).sum()
}

/// Nothing but the first coefficient where the third, the scale of the decay, is missing or not positive.
fn settling(coefficients: &[f64], u: f64) -> f64 {
    match *coefficients {
        [end, more, scale, ..] if scale > 0.0 => end + more * (-u / scale).exp(),
        [end, ..] => end,
        [] => 0.0,
    }
}

/// Monomials by rising degree, and in each degree by falling power of x.
fn monomials(coefficients: &[f64], at: Vec2) -> f64 {
    let powers = (0..).flat_map(|degree: i32| (0..=degree).map(move |y| (degree - y, y)));
    coefficients
        .iter()
        .zip(powers)
        .map(|(c, (i, j))| c * at.x.powi(i) * at.y.powi(j))
        .sum()
}

impl Effect for Unlisted {
    fn hooks(&self) -> &'static [Hook] {
        &[
            Hook::Readings,
            Hook::Ground,
            Hook::Twist,
            Hook::Drift,
            Hook::Observed,
        ]
    }
    fn readings(&mut self, values: &[f64], now: &Moment, _machine: &Machine, readings: &mut Readings) {
        if let Some(share) = amount(values, now, self.mean_rad(), &["reading"]) {
            readings.iter_mut().for_each(|reading| *reading *= 1.0 + share);
        }
        if let Some(counts) = amount(values, now, self.mean_rad(), &["left-right difference"]) {
            for (left, right) in [(5, 2), (6, 1), (7, 0)] {
                readings[left] += counts / 6.0;
                readings[right] -= counts / 6.0;
            }
        }
    }

    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        let factor =
            |wheel_rad, wheel| 1.0 + amount(values, now, wheel_rad, &["wheel speed", wheel]).unwrap_or(0.0);
        let ground = WheelSpeeds {
            left_m_s: wheels.left_m_s * factor(self.left_rad, "left wheel"),
            right_m_s: wheels.right_m_s * factor(self.right_rad, "right wheel"),
        };
        self.left_rad += wheels.left_m_s * now.step_s / WHEEL_RADIUS_M;
        self.right_rad += wheels.right_m_s * now.step_s / WHEEL_RADIUS_M;
        ground
    }

    fn twist(&mut self, values: &[f64], now: &Moment, twist: Twist) -> Twist {
        let more_rad_s = amount(values, now, self.mean_rad(), &["yaw rate"]).unwrap_or(0.0);
        Twist {
            yaw_rad_s: twist.yaw_rad_s + more_rad_s,
            ..twist
        }
    }

    fn drift_m_s(&self, values: &[f64], now: &Moment) -> Vec2 {
        let left_m_s = amount(values, now, self.mean_rad(), &["side slip"]).unwrap_or(0.0);
        now.pose.heading.perp() * left_m_s
    }

    fn observed(&self, values: &[f64], now: &Moment, position: Vec2) -> Vec2 {
        let along = |axis| amount(values, now, self.mean_rad(), &[axis]).unwrap_or(0.0);
        let farther = along("camera scale");
        position + Vec2::new(along("camera x"), along("camera y")) + (position - now.arena_middle) * farther
    }
}
