//! The robot's body: where it is and how it rolls.

use track::Vec2;

/// Speeds of the two wheels over the ground, or the commands for them, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WheelSpeeds {
    /// Left wheel, m/s.
    pub left_m_s: f64,
    /// Right wheel, m/s.
    pub right_m_s: f64,
}

impl WheelSpeeds {
    /// Both wheels through the same function.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self {
            left_m_s: f(self.left_m_s),
            right_m_s: f(self.right_m_s),
        }
    }
}

/// Forward speed and yaw rate of the robot's centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Forward speed, m/s.
    pub speed_m_s: f64,
    /// Yaw rate, rad/s, counter-clockwise positive.
    pub yaw_rad_s: f64,
}

/// Place and heading of the middle of the wheel axle, which is the centre of the round body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The centre, m.
    pub position: Vec2,
    /// Unit vector straight ahead: (cos, sin) of the heading. Kept instead of the angle because the rays need it at
    /// every step, and a product of rotations costs less than a sine.
    pub heading: Vec2,
}

impl Pose {
    /// The pose at `(x, y)` in metres that looks along `heading_rad`, counter-clockwise from +x.
    pub fn new(x_m: f64, y_m: f64, heading_rad: f64) -> Self {
        Self {
            position: Vec2::new(x_m, y_m),
            heading: Vec2::new(heading_rad.cos(), heading_rad.sin()),
        }
    }

    /// The heading in (-pi, pi], rad.
    pub fn heading_rad(&self) -> f64 {
        self.heading.y.atan2(self.heading.x)
    }

    /// A point of the body frame (x forward, y left) in the world, m.
    #[inline]
    pub fn to_world(&self, body: Vec2) -> Vec2 {
        self.position + self.rotate(body)
    }

    /// A direction of the body frame (x forward, y left) in the world.
    #[inline]
    pub fn rotate(&self, body: Vec2) -> Vec2 {
        turn(self.heading, body.x, body.y)
    }

    /// The pose after `dt_s` along the exact arc of a constant twist.
    ///
    /// ```
    /// use sim::{Pose, Twist};
    /// let pose = Pose::new(0.0, 0.0, 0.0).advance(Twist { speed_m_s: 0.5, yaw_rad_s: 1.0 }, std::f64::consts::PI);
    /// assert!((pose.position.y - 1.0).abs() < 1e-12); // half a circle of radius v / w = 0.5 m
    /// ```
    #[inline]
    pub fn advance(self, twist: Twist, dt_s: f64) -> Self {
        let half = 0.5 * twist.yaw_rad_s * dt_s;
        let (sin, cos, sinc) = sin_cos_sinc(half);
        let chord = twist.speed_m_s * dt_s * sinc;
        let along = turn(self.heading, cos, sin);
        let heading = turn(along, cos, sin);
        // One Newton step towards unit length keeps the rounding of a million steps below 1e-15.
        let heading = heading * (1.5 - 0.5 * heading.length_squared());
        Self {
            position: self.position + along * chord,
            heading,
        }
    }
}

/// The product of two vectors as complex numbers: `heading` turned by (x, y).
#[inline]
fn turn(heading: Vec2, x: f64, y: f64) -> Vec2 {
    Vec2::new(heading.x * x - heading.y * y, heading.x * y + heading.y * x)
}

/// Sine, cosine and sin(x)/x. Below 0.25 rad, where every step of a real drive is, the Taylor series to x^13, whose
/// remainder is under 1e-17, costs a third of the library's call and is the same on every machine.
#[inline]
fn sin_cos_sinc(x: f64) -> (f64, f64, f64) {
    if x.abs() > 0.25 {
        let (sin, cos) = x.sin_cos();
        return (sin, cos, sin / x);
    }
    let q = x * x;
    let (q2, q4) = (q * q, q * q * (q * q));
    let sinc = (1.0 - q * (1.0 / 6.0))
        + q2 * (1.0 / 120.0 - q * (1.0 / 5040.0))
        + q4 * ((1.0 / 362_880.0 - q * (1.0 / 39_916_800.0)) + q2 * (1.0 / 6_227_020_800.0));
    let cos = (1.0 - q * 0.5)
        + q2 * (1.0 / 24.0 - q * (1.0 / 720.0))
        + q4 * ((1.0 / 40_320.0 - q * (1.0 / 3_628_800.0))
            + q2 * (1.0 / 479_001_600.0 - q * (1.0 / 87_178_291_200.0)));
    (x * sinc, cos, sinc)
}

/// Dimensions of the body and its drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot {
    /// Radius of the round body, m.
    pub body_radius_m: f64,
    /// Distance between the wheels, m.
    pub axle_m: f64,
    /// The fastest a wheel can be told to turn, m/s over the ground.
    pub wheel_speed_limit_m_s: f64,
}

impl Robot {
    /// Forward speed and yaw rate for two wheel speeds.
    #[inline]
    pub fn twist(&self, wheels: WheelSpeeds) -> Twist {
        Twist {
            speed_m_s: 0.5 * (wheels.left_m_s + wheels.right_m_s),
            yaw_rad_s: (wheels.right_m_s - wheels.left_m_s) / self.axle_m,
        }
    }

    /// The pose after `dt_s` with constant wheel speeds.
    #[inline]
    pub fn roll(&self, pose: Pose, wheels: WheelSpeeds, dt_s: f64) -> Pose {
        pose.advance(self.twist(wheels), dt_s)
    }

    /// A command cut to what the wheels can do.
    #[inline]
    pub fn limit(&self, command: WheelSpeeds) -> WheelSpeeds {
        command.map(|speed| speed.clamp(-self.wheel_speed_limit_m_s, self.wheel_speed_limit_m_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const E_PUCK: Robot = Robot {
        body_radius_m: 0.037,
        axle_m: 0.053,
        wheel_speed_limit_m_s: 0.1288,
    };

    #[test]
    fn constant_wheel_speeds_close_a_circle() {
        let wheels = WheelSpeeds {
            left_m_s: 0.04,
            right_m_s: 0.06,
        };
        let start = Pose::new(0.3, -0.2, 0.7);
        let period_s = std::f64::consts::TAU / E_PUCK.twist(wheels).yaw_rad_s;
        let end = (0..1000).fold(start, |pose, _| E_PUCK.roll(pose, wheels, period_s / 1000.0));
        assert!((end.position - start.position).length() < 1e-12, "{end:?}");
        assert!((end.heading - start.heading).length() < 1e-12, "{end:?}");
    }

    #[test]
    fn one_arc_is_two_half_arcs() {
        for (left, right) in [
            (0.05, 0.05),
            (-0.05, 0.05),
            (0.1288, -0.02),
            (0.01, 0.010_000_001),
        ] {
            let wheels = WheelSpeeds {
                left_m_s: left,
                right_m_s: right,
            };
            let start = Pose::new(0.0, 0.0, 1.0);
            let whole = E_PUCK.roll(start, wheels, 0.064);
            let halves = E_PUCK.roll(E_PUCK.roll(start, wheels, 0.032), wheels, 0.032);
            assert!((whole.position - halves.position).length() < 1e-16);
            assert!((whole.heading - halves.heading).length() < 1e-15);
        }
    }

    #[test]
    fn the_series_joins_the_library() {
        for i in -1000..=1000 {
            let x = f64::from(i) * 0.000_25;
            let (sin, cos, sinc) = sin_cos_sinc(x);
            assert!(
                (sin - x.sin()).abs() < 2e-16 && (cos - x.cos()).abs() < 2e-16,
                "{x}"
            );
            assert!(x == 0.0 || (sinc - x.sin() / x).abs() < 3e-16, "{x}");
        }
    }

    #[test]
    fn the_right_wheel_turns_the_robot_left() {
        let pose = E_PUCK.roll(
            Pose::new(0.0, 0.0, 0.0),
            WheelSpeeds {
                left_m_s: 0.04,
                right_m_s: 0.06,
            },
            0.064,
        );
        assert!(pose.heading_rad() > 0.0 && pose.position.y > 0.0, "{pose:?}");
    }

    #[test]
    fn the_heading_stays_a_unit_vector() {
        let wheels = WheelSpeeds {
            left_m_s: 0.031,
            right_m_s: 0.064,
        };
        let end = (0..1_000_000).fold(Pose::new(0.0, 0.0, 0.0), |pose, _| {
            E_PUCK.roll(pose, wheels, 0.032)
        });
        assert!(
            (end.heading.length() - 1.0).abs() < 1e-15,
            "{}",
            end.heading.length()
        );
    }
}
