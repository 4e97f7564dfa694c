//! What is tried on a data set.

use std::ops::Range;

use super::atlas::{Atlas, Simulate, Spent};
use super::expectation::Expectation;

/// The declared model, with whatever effects are added to it, simulated and held against one data set.
#[derive(Clone, Copy)]
pub(super) struct Trial<'a> {
    pub(super) atlas: &'a Atlas,
    pub(super) simulate: &'a Simulate<'a>,
    pub(super) data: &'a Expectation,
    /// Entries that have no say in sizes.
    pub(super) silent: &'a [Range<usize>],
    /// Where simulated data sets are counted.
    pub(super) spent: &'a Spent,
}

impl<'a> Trial<'a> {
    /// A data set of which every entry has a say, counted with what the atlas was asked for.
    pub(super) fn new(atlas: &'a Atlas, simulate: &'a Simulate<'a>, data: &'a Expectation) -> Self {
        Self {
            atlas,
            simulate,
            data,
            silent: &[],
            spent: &atlas.spent,
        }
    }
}
