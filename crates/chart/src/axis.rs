//! Axes: their ranges, and where a value lands on them.

use crate::error::{AxisName, Error};
use crate::mark::Reach;
use crate::text;
use crate::ticks::{self, Tick};

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// By their logarithm: all values must be positive.
    Log,
}

/// Which ticks an axis has.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Ticks {
    /// At round values: 1, 2 or 5 times a power of ten.
    #[default]
    Auto,
    /// At these values.
    At(Vec<f64>),
    /// Named places 0, 1, 2, ...: from left to right on an x axis, from top to bottom on a y axis.
    Categories(Vec<String>),
    /// None, and no grid.
    Hidden,
}

/// One axis of a panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// What it measures, with the unit.
    pub label: String,
    /// How values are spread along it.
    pub scale: Scale,
    /// The values at its two ends, increasing; taken from the marks, with a small margin, if absent.
    pub range: Option<[f64; 2]>,
    /// Its ticks.
    pub ticks: Ticks,
}

impl Axis {
    /// A linear axis with round ticks over the range of the marks.
    ///
    /// ```
    /// assert_eq!(chart::Axis::linear("x, m").range, None);
    /// ```
    #[must_use]
    pub fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            ..Self::default()
        }
    }

    /// A logarithmic axis with round ticks over the range of the marks.
    #[must_use]
    pub fn log(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            scale: Scale::Log,
            ..Self::default()
        }
    }

    /// An axis of named places 0, 1, 2, ...
    #[must_use]
    pub fn categories<S: Into<String>>(label: impl Into<String>, names: impl IntoIterator<Item = S>) -> Self {
        Self {
            label: label.into(),
            ticks: Ticks::Categories(names.into_iter().map(Into::into).collect()),
            ..Self::default()
        }
    }

    /// The range to show: the one given, that of its categories, or that of the values with a margin.
    pub(crate) fn resolve(
        &self,
        given: Option<[f64; 2]>,
        reach: &Reach,
        panel: usize,
        axis: AxisName,
    ) -> Result<[f64; 2], Error> {
        if self.scale == Scale::Log && reach.low <= 0.0 {
            let value = reach.low;
            return Err(Error::NotPositive { panel, axis, value });
        }
        match (given, &self.ticks) {
            (Some([low, high]), _) => self.checked(low, high, panel, axis),
            (None, Ticks::Categories(names)) if !names.is_empty() => Ok([-0.5, names.len() as f64 - 0.5]),
            _ if reach.is_empty() => Err(Error::NoValues { panel, axis }),
            _ => {
                let [low, high] = self.widened(reach);
                self.checked(low, high, panel, axis)
            }
        }
    }

    fn checked(&self, low: f64, high: f64, panel: usize, axis: AxisName) -> Result<[f64; 2], Error> {
        if !(low.is_finite() && high.is_finite() && (high - low).is_finite() && low < high) {
            Err(Error::BadRange {
                panel,
                axis,
                low,
                high,
            })
        } else if self.scale == Scale::Log && low <= 0.0 {
            let value = low;
            Err(Error::NotPositive { panel, axis, value })
        } else {
            Ok([low, high])
        }
    }

    /// The range of the values and a margin of 4 % at each end, but none beyond an edge.
    fn widened(&self, reach: &Reach) -> [f64; 2] {
        let [low, high] = [reach.low, reach.high].map(|value| self.scale.forward(value));
        if high - low <= 1e-12 * low.abs().max(high.abs()) {
            let half = if self.scale == Scale::Log || low == 0.0 {
                0.5
            } else {
                0.1 * low.abs()
            };
            return [low - half, high + half].map(|value| self.scale.backward(value));
        }
        let margin = 0.04 * (high - low);
        let [at_edge_low, at_edge_high] = reach.ends_on_edge();
        [
            if at_edge_low {
                reach.low
            } else {
                self.scale.backward(low - margin)
            },
            if at_edge_high {
                reach.high
            } else {
                self.scale.backward(high + margin)
            },
        ]
    }

    /// The ticks with labels: round ones divide the range into no more than these parts, fewer if `clash` says so.
    pub(crate) fn labelled(&self, range: [f64; 2], parts: f64, clash: impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
        match &self.ticks {
            Ticks::Hidden => Vec::new(),
            Ticks::Categories(names) => {
                let ticks = names
                    .iter()
                    .enumerate()
                    .map(|(place, name)| Tick::new(place as f64, name.clone()));
                ticks.collect()
            }
            Ticks::At(values) => {
                let shown = values
                    .iter()
                    .filter(|&&value| value >= range[0] && value <= range[1]);
                shown
                    .map(|&value| Tick::new(value, ticks::number(value)))
                    .collect()
            }
            Ticks::Auto => match self.scale {
                Scale::Linear => first_clear(ticks::linear(range, parts), clash),
                Scale::Log => first_clear(ticks::logarithmic(range, parts), clash),
            },
        }
    }
}

/// The densest candidate whose labels do not clash; after a few tries, clashing or not.
fn first_clear(candidates: impl Iterator<Item = Vec<Tick>>, clash: impl Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let mut last = Vec::new();
    for ticks in candidates.take(8) {
        if ticks.len() < 2 && last.len() >= 2 {
            break;
        }
        last = ticks;
        if !clash(&last) {
            break;
        }
    }
    last
}

impl Scale {
    pub(crate) fn forward(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => value.log10(),
        }
    }

    fn backward(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => 10_f64.powf(value),
        }
    }
}

/// Where values land: an axis's range on a stretch of px.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mapping {
    scale: Scale,
    low: f64,
    from_px: f64,
    px_per_unit: f64,
}

impl Mapping {
    /// The mapping that takes the ends of the range to the two px.
    pub(crate) fn new(scale: Scale, range: [f64; 2], [from_px, to_px]: [f64; 2]) -> Self {
        let [low, high] = range.map(|value| scale.forward(value));
        Self {
            scale,
            low,
            from_px,
            px_per_unit: (to_px - from_px) / (high - low),
        }
    }

    pub(crate) fn px(&self, value: f64) -> f64 {
        self.from_px + (self.scale.forward(value) - self.low) * self.px_per_unit
    }
}

/// Whether neighbouring labels along x come closer than a letter.
pub(crate) fn crowded(ticks: &[Tick], mapping: &Mapping, size_px: f64) -> bool {
    ticks.windows(2).any(|pair| {
        let room = (mapping.px(pair[1].at) - mapping.px(pair[0].at)).abs();
        let [left, right] = [&pair[0], &pair[1]].map(|tick| text::widest_px(&tick.lines, size_px));
        (left + right) / 2.0 + 0.8 * size_px > room
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach(values: &[f64]) -> Reach {
        let mut reach = Reach::NONE;
        values.iter().for_each(|&value| reach.add(value));
        reach
    }

    #[test]
    fn values_get_a_margin() {
        let range = Axis::default()
            .resolve(None, &reach(&[0.0, 10.0]), 1, AxisName::X)
            .unwrap();
        assert!(
            (range[0] + 0.4).abs() < 1e-12 && (range[1] - 10.4).abs() < 1e-12,
            "{range:?}"
        );
    }

    #[test]
    fn a_single_value_still_has_a_range() {
        assert_eq!(
            Axis::default()
                .resolve(None, &reach(&[0.0]), 1, AxisName::X)
                .unwrap(),
            [-0.5, 0.5]
        );
        let [low, high] = Axis::log("")
            .resolve(None, &reach(&[5.0]), 1, AxisName::X)
            .unwrap();
        assert!(low < 5.0 && 5.0 < high);
    }

    #[test]
    fn log_axes_refuse_what_has_no_logarithm() {
        let error = Axis::log("")
            .resolve(None, &reach(&[-1.0, 2.0]), 3, AxisName::Y)
            .unwrap_err();
        assert_eq!(
            error.to_string(),
            "panel 3: the logarithmic y axis cannot show -1; values must be positive"
        );
        let given = Axis {
            range: Some([0.0, 1.0]),
            ..Axis::log("")
        };
        assert!(matches!(
            given.resolve(given.range, &reach(&[1.0]), 1, AxisName::X),
            Err(Error::NotPositive { .. })
        ));
    }

    #[test]
    fn ranges_must_increase() {
        for range in [[1.0, 1.0], [2.0, 1.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
            let axis = Axis {
                range: Some(range),
                ..Axis::default()
            };
            assert!(
                matches!(
                    axis.resolve(axis.range, &Reach::NONE, 1, AxisName::X),
                    Err(Error::BadRange { .. })
                ),
                "{range:?}"
            );
        }
        let error = Axis::default()
            .resolve(None, &Reach::NONE, 1, AxisName::X)
            .unwrap_err();
        assert_eq!(
            error,
            Error::NoValues {
                panel: 1,
                axis: AxisName::X
            }
        );
    }

    #[test]
    fn the_ends_of_the_range_land_on_the_ends_of_the_stretch() {
        let log = Mapping::new(Scale::Log, [1.0, 100.0], [0.0, 200.0]);
        assert!((log.px(10.0) - 100.0).abs() < 1e-9);
        let linear = Mapping::new(Scale::Linear, [-1.0, 1.0], [300.0, 100.0]);
        assert!((linear.px(0.0) - 200.0).abs() < 1e-9);
    }
}
