//! The two controllers of Table I.

use crate::{Readings, WheelSpeeds};

/// What turns readings into wheel commands, once per control step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Controller {
    /// Controller 1: turn on the spot, away from a wall that is too near; else straight on.
    ///
    /// Departs from the paper: Table I as printed has the second condition with "<" and the same turn as the first.
    /// With that the robot could not follow its own description ("turn in the opposite direction of the obstacle"),
    /// so the description is followed.
    RuleBased {
        /// Speed V, m/s.
        speed_m_s: f64,
        /// Threshold T on the sum of three readings, counts.
        threshold_counts: f64,
    },
    /// Controller 2 (Braitenberg): wheel speeds follow the difference of the two sides.
    Braitenberg {
        /// Speed V, m/s.
        speed_m_s: f64,
        /// Reactivity K, per count.
        gain_per_count: f64,
    },
}

impl Controller {
    /// The wheel commands for eight readings, before the wheel speed limit (Table I; A0 is the right wheel of
    /// controller 2 and A1 its left).
    ///
    /// ```
    /// use sim::Controller;
    /// let wall_on_the_right = [0.0, 400.0, 900.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    /// let braitenberg = Controller::Braitenberg { speed_m_s: 0.05, gain_per_count: 0.0005 };
    /// let command = braitenberg.command(&wall_on_the_right);
    /// assert!(command.right_m_s > command.left_m_s); // turns left, away from it
    /// ```
    #[inline]
    pub fn command(&self, readings: &Readings) -> WheelSpeeds {
        let right = readings[0] + readings[1] + readings[2];
        let left = readings[5] + readings[6] + readings[7];
        match *self {
            Self::RuleBased {
                speed_m_s,
                threshold_counts,
            } => {
                let turn = if right > threshold_counts {
                    (-1.0, 1.0)
                } else if left > threshold_counts {
                    (1.0, -1.0)
                } else {
                    (1.0, 1.0)
                };
                WheelSpeeds {
                    left_m_s: turn.0 * speed_m_s,
                    right_m_s: turn.1 * speed_m_s,
                }
            }
            Self::Braitenberg {
                speed_m_s,
                gain_per_count,
            } => WheelSpeeds {
                left_m_s: speed_m_s * (1.0 + gain_per_count * (left - right)),
                right_m_s: speed_m_s * (1.0 + gain_per_count * (right - left)),
            },
        }
    }

    /// Speed V, m/s.
    pub fn speed_m_s(&self) -> f64 {
        match *self {
            Self::RuleBased { speed_m_s, .. } | Self::Braitenberg { speed_m_s, .. } => speed_m_s,
        }
    }

    /// The controller with its speed V and its own parameter (K or T) times these factors.
    pub fn scaled(&self, speed: f64, parameter: f64) -> Self {
        match *self {
            Self::RuleBased {
                speed_m_s,
                threshold_counts,
            } => Self::RuleBased {
                speed_m_s: speed * speed_m_s,
                threshold_counts: parameter * threshold_counts,
            },
            Self::Braitenberg {
                speed_m_s,
                gain_per_count,
            } => Self::Braitenberg {
                speed_m_s: speed * speed_m_s,
                gain_per_count: parameter * gain_per_count,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BRAITENBERG: Controller = Controller::Braitenberg {
        speed_m_s: 0.05,
        gain_per_count: 0.0005,
    };
    const RULES: Controller = Controller::RuleBased {
        speed_m_s: 0.05,
        threshold_counts: 500.0,
    };

    #[test]
    fn both_turn_away_from_a_wall() {
        let right_wall = [200.0, 300.0, 400.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let left_wall = [0.0, 0.0, 0.0, 0.0, 0.0, 400.0, 300.0, 200.0];
        for controller in [BRAITENBERG, RULES] {
            let from_right = controller.command(&right_wall);
            assert!(
                from_right.right_m_s > from_right.left_m_s,
                "{controller:?} must turn left: {from_right:?}"
            );
            let from_left = controller.command(&left_wall);
            assert!(
                from_left.left_m_s > from_left.right_m_s,
                "{controller:?} must turn right: {from_left:?}"
            );
        }
    }

    #[test]
    fn back_sensors_are_ignored() {
        let behind = [0.0, 0.0, 0.0, 4000.0, 3000.0, 0.0, 0.0, 0.0];
        let straight = WheelSpeeds {
            left_m_s: 0.05,
            right_m_s: 0.05,
        };
        assert_eq!(BRAITENBERG.command(&behind), straight);
        assert_eq!(RULES.command(&behind), straight);
    }

    #[test]
    fn rules_compare_strictly_and_look_right_first() {
        let mut readings = [0.0; 8];
        readings[2] = 500.0;
        assert_eq!(
            RULES.command(&readings),
            WheelSpeeds {
                left_m_s: 0.05,
                right_m_s: 0.05
            }
        );
        (readings[2], readings[5]) = (501.0, 4000.0);
        assert_eq!(
            RULES.command(&readings),
            WheelSpeeds {
                left_m_s: -0.05,
                right_m_s: 0.05
            }
        );
    }

    #[test]
    fn braitenberg_by_hand() {
        let readings = [1.0, 2.0, 3.0, 99.0, 99.0, 10.0, 20.0, 30.0];
        let command = BRAITENBERG.command(&readings);
        assert!((command.left_m_s - 0.05 * (1.0 + 0.0005 * 54.0)).abs() < 1e-15);
        assert!((command.right_m_s - 0.05 * (1.0 - 0.0005 * 54.0)).abs() < 1e-15);
    }
}
