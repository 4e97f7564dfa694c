//! How large an effect must be to be seen.

use sim::Spec;

/// The smallest sizes of an effect, at one place or sensor, that these data show in 95 of 100 cases.
#[derive(Debug, Clone, PartialEq)]
pub struct Detectable {
    /// The effect.
    pub spec: &'static Spec,
    /// What tells it from others of its name.
    pub label: String,
    /// Name and unit of the parameter that sizes it.
    pub parameter: &'static str,
    /// Unit of that parameter.
    pub unit: &'static str,
    /// The largest size below the neutral one that is seen; `None` if none is, as far as was looked.
    pub below: Option<f64>,
    /// The smallest size above the neutral one that is seen.
    pub above: Option<f64>,
}

/// The quantile of a standard normal variable below which 95 % of it lies.
pub(crate) const QUANTILE_95: f64 = 1.645;
