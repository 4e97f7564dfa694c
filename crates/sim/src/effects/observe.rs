//! Effects between the robot and the positions that the overhead camera gives: first where the marker is on the
//! robot, then the lens, then the map from the picture to the floor (scale, rotation, offset), then noise.

use track::Vec2;

use super::plain::{OnCamera, OnMachine};
use super::{Param, Spec, Stage};

/// A marker that is not on the middle of the axle.
pub(super) const MARKER_OFFSET: Spec = Spec {
    name: "marker-offset",
    stage: Stage::Observe,
    summary: "what is tracked is not on the axle's middle, or is turned; the turn shows only where headings are measured",
    params: &[
        Param::new("forward_m", "m", 0.0, -0.1, 0.1),
        Param::new("left_m", "m", 0.0, -0.1, 0.1),
        Param::new(
            "angle_rad",
            "rad",
            0.0,
            -std::f64::consts::PI,
            std::f64::consts::PI,
        ),
    ],
    list: None,
    build: || {
        Box::new(OnCamera(|values, now, _| {
            now.pose.rotate(Vec2::new(values[0], values[1]))
        }))
    },
};

/// The square of the radius at which a lens distorts by `k1`, m^2: about that of the arena's corners.
const LENS_RADIUS2_M2: f64 = 0.85;

/// A lens that is not corrected: r becomes r (1 + k1 r^2 / 0.85 m^2).
pub(super) const CAMERA_DISTORTION: Spec = Spec {
    name: "camera-distortion",
    stage: Stage::Observe,
    summary: "radial about the arena's middle: r times 1 + k1 * r^2 / (0.85 m^2)",
    params: &[Param::new("k1", "", 0.0, -0.5, 0.5)],
    list: None,
    build: || {
        Box::new(OnCamera(|values, now, position| {
            let arm = position - now.arena_middle;
            arm * (values[0] * arm.length_squared() / LENS_RADIUS2_M2)
        }))
    },
};

/// Positions that are too far from the arena's middle, or too near.
pub(super) const CAMERA_SCALE: Spec = Spec {
    name: "camera-scale",
    stage: Stage::Observe,
    summary: "positions scaled about the arena's middle",
    params: &[Param::new("factor", "", 1.0, 0.5, 2.0)],
    list: None,
    build: || {
        Box::new(OnCamera(|values, now, position| {
            (position - now.arena_middle) * (values[0] - 1.0)
        }))
    },
};

/// Positions turned about the arena's middle.
pub(super) const CAMERA_ROTATION: Spec = Spec {
    name: "camera-rotation",
    stage: Stage::Observe,
    summary: "positions turned about the arena's middle, counter-clockwise positive",
    params: &[Param::new("angle_rad", "rad", 0.0, -1.0, 1.0)],
    list: None,
    build: || {
        Box::new(OnCamera(|values, now, position| {
            let arm = position - now.arena_middle;
            // cos a - 1 = -2 sin^2(a/2), which keeps its digits at small angles
            arm * (-2.0 * (0.5 * values[0]).sin().powi(2)) + arm.perp() * values[0].sin()
        }))
    },
};

/// Positions that are beside the true ones.
pub(super) const CAMERA_OFFSET: Spec = Spec {
    name: "camera-offset",
    stage: Stage::Observe,
    summary: "positions moved by a constant",
    params: &[
        Param::new("dx_m", "m", 0.0, -0.5, 0.5),
        Param::new("dy_m", "m", 0.0, -0.5, 0.5),
    ],
    list: None,
    build: || Box::new(OnCamera(|values, _, _| Vec2::new(values[0], values[1]))),
};

/// A factor on the camera's declared noise.
pub(super) const CAMERA_NOISE: Spec = Spec {
    name: "camera-noise",
    stage: Stage::Observe,
    summary: "the standard deviation of the camera's noise times factor",
    params: &[Param::new("factor", "", 1.0, 0.0, 50.0)],
    list: None,
    build: || Box::new(OnMachine(|values, machine| machine.camera_noise_m *= values[0])),
};
