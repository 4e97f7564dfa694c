//! Effects on the controller: constants that were set otherwise than declared.

use super::plain::OnMachine;
use super::{Param, Spec, Stage};

/// A factor on the controller's own parameter.
pub(super) const CONTROLLER_GAIN: Spec = Spec {
    name: "controller-gain",
    stage: Stage::Decide,
    summary: "the reactivity K (Braitenberg) or the threshold T (rule-based) times factor",
    params: &[Param::new("factor", "", 1.0, 0.05, 20.0)],
    list: None,
    build: || {
        Box::new(OnMachine(|values, machine| {
            machine.controller = machine.controller.scaled(1.0, values[0]);
        }))
    },
};

/// A factor on the controller's speed.
pub(super) const CONTROLLER_SPEED: Spec = Spec {
    name: "controller-speed",
    stage: Stage::Decide,
    summary: "the speed V times factor",
    params: &[Param::new("factor", "", 1.0, 0.1, 5.0)],
    list: None,
    build: || {
        Box::new(OnMachine(|values, machine| {
            machine.controller = machine.controller.scaled(values[0], 1.0);
        }))
    },
};
