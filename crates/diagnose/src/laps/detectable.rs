//! How large an effect must be to be seen.

use super::atlas::{Atlas, White};
use super::diagnosis::ALARM_SCORE;
use super::screen::price;
use crate::candidate::label;
use crate::detectable::{Detectable, QUANTILE_95};

impl Atlas {
    /// The smallest sizes of all effects that these data show, probe by probe; vectors along their axes.
    pub fn detectable(&self) -> Vec<Detectable> {
        (0..self.probes.len())
            .filter(|&probe| !self.probes[probe].sizes.is_empty())
            .filter_map(|probe| self.detectable_of(probe))
            .collect()
    }

    fn detectable_of(&self, probe: usize) -> Option<Detectable> {
        let p = &self.probes[probe];
        let param = &p.spec.params[p.only_moving()?];
        let nodes = self.nodes(probe);
        let needed = self.needed(p.free.len());
        let side = |sign: f64| {
            let own: Vec<&(f64, White)> =
                (nodes.iter().filter(|(s, _)| sign * (s - p.neutral) > 0.0)).collect();
            let mut own: Vec<(f64, &White)> = own.iter().map(|(s, w)| ((s - p.neutral).abs(), w)).collect();
            own.sort_by(|a, b| a.0.total_cmp(&b.0));
            smallest(&own, needed).map(|size| p.neutral + sign * size)
        };
        Some(Detectable {
            spec: p.spec,
            label: label(&p.setting(p.neutral)),
            parameter: param.name,
            unit: param.unit,
            below: side(-1.0),
            above: side(1.0),
        })
    }

    /// Standard deviations of a signal that raises the alarm in 95 of 100 cases.
    fn needed(&self, numbers: usize) -> f64 {
        (2.0 * (ALARM_SCORE + price(numbers, self.layout.total_laps()))).sqrt() + QUANTILE_95
    }
}

/// The smallest size along a path, from nothing outwards, at which its action is as long as needed. The action is seen along the
/// outermost one's direction, where the noise of its simulation hardly counts.
fn smallest(path: &[(f64, &White)], needed: f64) -> Option<f64> {
    let (_, last) = path.last()?;
    let length = last.norm();
    let (mut from, mut signal_from) = (0.0, 0.0);
    for (size, action) in path {
        let signal = action.dot(last) / length;
        if signal >= needed {
            return Some(from + (size - from) * (needed - signal_from) / (signal - signal_from));
        }
        (from, signal_from) = (*size, signal.max(signal_from));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_path_is_seen_where_its_length_suffices() {
        let (near, far) = (White::from_vec(vec![3.0, 0.0]), White::from_vec(vec![9.0, 0.0]));
        let path = [(1.0, &near), (3.0, &far)];
        assert!((smallest(&path, 6.0).unwrap() - 2.0).abs() < 1e-12);
        assert!((smallest(&path, 1.5).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(smallest(&path, 10.0), None);
    }
}
