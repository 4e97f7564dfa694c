//! Effects that are one function of their values and remember nothing.

use track::Vec2;

use super::{Effect, Hook, Moment};
use crate::{Machine, Readings, Twist, WheelSpeeds};

/// Changes constants of the machine.
#[derive(Debug)]
pub(super) struct OnMachine(pub(super) fn(&[f64], &mut Machine));

impl Effect for OnMachine {
    fn hooks(&self) -> &'static [Hook] {
        &[]
    }
    fn on_machine(&self) -> Option<fn(&[f64], &mut Machine)> {
        Some(self.0)
    }
}

/// Changes the readings before noise.
#[derive(Debug)]
pub(super) struct OnReadings(pub(super) fn(&[f64], &Moment, &mut Readings));

impl Effect for OnReadings {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Readings]
    }
    fn readings(&mut self, values: &[f64], now: &Moment, _machine: &Machine, readings: &mut Readings) {
        (self.0)(values, now, readings);
    }
}

/// Changes the speed that each wheel is driven at.
#[derive(Debug)]
pub(super) struct OnDrive(pub(super) fn(&[f64], f64) -> f64);

impl Effect for OnDrive {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Drive]
    }
    fn drive(&mut self, values: &[f64], _now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        wheels.map(|speed| (self.0)(values, speed))
    }
}

/// Changes the speeds of the wheels over the ground.
#[derive(Debug)]
pub(super) struct OnGround(pub(super) fn(&[f64], &Moment, WheelSpeeds) -> WheelSpeeds);

impl Effect for OnGround {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Ground]
    }
    fn ground(&mut self, values: &[f64], now: &Moment, wheels: WheelSpeeds) -> WheelSpeeds {
        (self.0)(values, now, wheels)
    }
}

/// Changes the yaw rate, rad/s.
#[derive(Debug)]
pub(super) struct OnYaw(pub(super) fn(&[f64], f64) -> f64);

impl Effect for OnYaw {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Twist]
    }
    fn twist(&mut self, values: &[f64], _now: &Moment, twist: Twist) -> Twist {
        let yaw_rad_s = (self.0)(values, twist.yaw_rad_s);
        Twist { yaw_rad_s, ..twist }
    }
}

/// A velocity added to the robot's, m/s.
#[derive(Debug)]
pub(super) struct OnDrift(pub(super) fn(&[f64]) -> Vec2);

impl Effect for OnDrift {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Drift]
    }
    fn drift_m_s(&self, values: &[f64], _now: &Moment) -> Vec2 {
        (self.0)(values)
    }
}

/// By how much the camera sees a position elsewhere, m.
#[derive(Debug)]
pub(super) struct OnCamera(pub(super) fn(&[f64], &Moment, Vec2) -> Vec2);

impl Effect for OnCamera {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::Observed]
    }
    fn observed(&self, values: &[f64], now: &Moment, position: Vec2) -> Vec2 {
        position + (self.0)(values, now, position)
    }
}
