//! Effects between the command and the motion.

use super::{Effect, Param, Spec, Stage};
use crate::Machine;

/// The declared slip times a factor.
pub(super) const SLIP_LEVEL: Spec = Spec {
    name: "slip-level",
    stage: Stage::Act,
    summary: "the declared slip times a factor",
    params: &[Param::new("factor", "", 1.0, 0.0, 20.0)],
    build: || Box::new(SlipLevel),
};

#[derive(Debug)]
struct SlipLevel;

impl Effect for SlipLevel {
    fn machine(&self, values: &[f64], machine: &mut Machine) {
        machine.slip_level *= values[0];
    }
}
