//! What is tried: every effect of the registry that acts on the motion, the readings, the walls or the camera, with the
//! places, sensors and sizes at which its column of derivatives is taken. Not here are effects on the controller, whose
//! commands are recomputed, those on noise, which have no such column, and rounded readings, which show by themselves.

use std::f64::consts::{PI, TAU};

use sim::{EFFECTS, Pattern, Setting, Spec, UNLISTED, WheelSpeeds};

/// How the multiples of a variant's columns become values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    /// One column for each fitted value: value = neutral + multiple * step.
    Linear,
    /// Two columns, along x and y, of an effect with a size and an azimuth.
    Polar,
    /// One column at a place that is given: only the size is a multiple of it.
    Along,
    /// One column at a size that is given.
    Scan,
}

/// One way in which an effect might be there.
#[derive(Debug, Clone)]
pub(crate) struct Variant {
    pub(crate) spec: &'static Spec,
    pub(crate) shape: Shape,
    /// Values at which the columns are taken (the place and the size; for [`Shape::Linear`] the neutral ones).
    pub(crate) values: Vec<f64>,
    /// Which values a refinement fits.
    pub(crate) free: Vec<usize>,
    /// Which values the columns are along.
    pub(crate) sizes: Vec<usize>,
    /// Step of each column.
    pub(crate) steps: Vec<f64>,
}

impl Variant {
    /// A variant at its neutral values, of which some are fitted, each with its step.
    pub(crate) fn linear(spec: &'static Spec, values: &[f64], steps: &[(usize, f64)]) -> Self {
        let free: Vec<usize> = steps.iter().map(|s| s.0).collect();
        let steps = steps.iter().map(|s| s.1).collect();
        Self {
            spec,
            shape: Shape::Linear,
            values: values.to_vec(),
            sizes: free.clone(),
            free,
            steps,
        }
    }

    /// The variant that a setting is one of: of the same effect, and of a cause without a name the one with the same basis.
    pub(crate) fn of<'v>(setting: &Setting, variants: &'v [Self]) -> Option<&'v Self> {
        let same_basis = |variant: &&Self| {
            *setting.spec != UNLISTED
                || matches!(&setting.pattern, Pattern::Constant(values)
                    if values.len() == variant.values.len() && values[..3] == variant.values[..3])
        };
        (variants.iter())
            .filter(|variant| *variant.spec == *setting.spec)
            .find(same_basis)
    }

    /// The settings whose columns are taken.
    pub(crate) fn settings(&self) -> Vec<Setting> {
        let with = |changes: &[(usize, f64)]| {
            let mut values = self.values.clone();
            changes.iter().for_each(|&(i, value)| values[i] = value);
            Setting::constant(self.spec, values)
        };
        match self.shape {
            Shape::Scan => vec![with(&[])],
            Shape::Polar => [0.0, 0.25 * TAU]
                .map(|azimuth| with(&[(0, self.steps[0]), (1, azimuth)]))
                .to_vec(),
            Shape::Linear | Shape::Along => (self.sizes.iter().zip(&self.steps))
                .map(|(&i, step)| with(&[(i, self.values[i] + step)]))
                .collect(),
        }
    }

    /// The values that these multiples of the columns stand for, inside their ranges.
    pub(crate) fn values_at(&self, multiples: &[f64]) -> Vec<f64> {
        let mut values = self.values.clone();
        match self.shape {
            Shape::Scan => {}
            Shape::Polar => {
                values[0] = self.steps[0] * multiples[0].hypot(multiples[1]);
                values[1] = multiples[1].atan2(multiples[0]);
            }
            Shape::Linear | Shape::Along => {
                for ((&i, step), multiple) in self.sizes.iter().zip(&self.steps).zip(multiples) {
                    values[i] += step * multiple;
                }
                if self.spec.name == "directional-light" && values[0] < 0.0 {
                    // Less light from here is about as much from the other side.
                    values[0] = -values[0];
                    values[1] -= PI.copysign(values[1]);
                }
            }
        }
        for (value, param) in values.iter_mut().zip(self.spec.params) {
            *value = value.clamp(param.low, param.high);
        }
        values
    }
}

/// All variants. `wall_lengths_m` are those of the outer and the inner wall, `dead_bands_m_s` the speeds that are tried
/// as dead bands ([`slow_speeds`]).
pub(crate) fn variants(wall_lengths_m: [f64; 2], dead_bands_m_s: &[f64]) -> Vec<Variant> {
    (EFFECTS.iter())
        .flat_map(|spec| of(spec, wall_lengths_m, dead_bands_m_s))
        .collect()
}

/// Speeds below which ever larger shares of the commands to the wheels are, m/s, rising: a dead band that is a little too large
/// swallows more commands than the right one, so that where the commands are decides which sizes are near each other.
pub(crate) fn slow_speeds(commands: impl Iterator<Item = WheelSpeeds>) -> Vec<f64> {
    const SHARES: [f64; 9] = [5e-4, 2e-3, 6e-3, 0.015, 0.03, 0.06, 0.12, 0.24, 0.48];
    let mut speeds: Vec<f64> = commands
        .flat_map(|command| [command.left_m_s.abs(), command.right_m_s.abs()])
        .filter(|speed| *speed > 0.0)
        .collect();
    speeds.sort_by(f64::total_cmp);
    let above = |share: &f64| {
        let below = *speeds.get((share * speeds.len() as f64) as usize)?;
        let next = speeds[speeds.partition_point(|speed| *speed <= below)..].first()?;
        Some(0.5 * (below + next))
    };
    let mut sizes: Vec<f64> = SHARES.iter().filter_map(above).collect();
    sizes.dedup();
    sizes
}

/// An effect at several sizes.
fn scan(spec: &'static Spec, sizes: impl Iterator<Item = f64>) -> Vec<Variant> {
    let at = |size: f64| Variant {
        spec,
        shape: Shape::Scan,
        values: vec![size],
        free: vec![0],
        sizes: vec![0],
        steps: vec![size],
    };
    sizes.map(at).collect()
}

/// Roundings of speeds to multiples of 1 to 30 mm/s, so far apart.
fn speed_steps(spec: &'static Spec, apart_m_s: f64) -> Vec<Variant> {
    let count = |speed_m_s: f64| (speed_m_s / apart_m_s).round() as usize;
    scan(spec, (count(0.001)..count(0.03)).map(|i| apart_m_s * i as f64))
}

/// The sizes of an effect that jumps which are worth a look where it is the matter: a rounding of speeds whose last but one multiple
/// is the most common speed is nothing like one whose last is.
pub(crate) fn leaps(spec: &'static Spec, variants: Vec<Variant>) -> Vec<Variant> {
    /// Narrower than the likelihood's tops.
    const APART_M_S: f64 = 1e-4;
    match spec.name {
        "speed-step" => speed_steps(spec, APART_M_S),
        _ => (variants.into_iter())
            .filter(|variant| *variant.spec == *spec)
            .collect(),
    }
}

/// The variants of one effect; none of those that are judged otherwise.
fn of(spec: &'static Spec, wall_lengths_m: [f64; 2], dead_bands_m_s: &[f64]) -> Vec<Variant> {
    let one = |neutral: f64, step: f64| vec![Variant::linear(spec, &[neutral], &[(0, step)])];
    let scan = |sizes: &[f64]| scan(spec, sizes.iter().copied());
    let sensors = |neutral: f64, step: f64| {
        (0..8)
            .map(|sensor| Variant::linear(spec, &[f64::from(sensor), neutral], &[(1, step)]))
            .collect()
    };
    match spec.name {
        "reading-gain" | "distance-scale" | "response-exponent" => one(1.0, 0.01),
        "outer-wall-reflectance" | "inner-wall-reflectance" => one(1.0, 0.01),
        "wheel-asymmetry" | "wheel-scale" | "axle-length" | "camera-scale" => one(1.0, 0.002),
        "ambient-offset" => one(0.0, 0.5),
        "sensor-rotation" => one(0.0, 0.003),
        "crosstalk" | "incidence-falloff" | "turn-scrub" => one(0.0, 0.01),
        "reading-drift" | "battery-sag" => one(0.0, 1e-5),
        "outer-wall-offset" | "inner-wall-offset" => one(0.0, 1e-4),
        "camera-rotation" => one(0.0, 1e-3),
        "camera-distortion" => one(0.0, 2e-3),
        "marker-offset" => vec![Variant::linear(spec, &[0.0; 3], &[(0, 5e-4), (1, 5e-4)])],
        "camera-offset" => vec![Variant::linear(spec, &[0.0; 2], &[(0, 2e-4), (1, 2e-4)])],
        "one-sensor-gain" => sensors(1.0, 0.02),
        "one-sensor-offset" => sensors(0.0, 1.0),
        "cone-of-view" => scan(&[0.08, 0.15, 0.25, 0.4, 0.6]),
        "sensor-reach" => scan(&[0.5, 0.65, 0.75, 0.85, 0.92, 0.96, 1.04, 1.1, 1.2]),
        "sensor-lag" => scan(&[0.04, 0.08, 0.15, 0.3, 0.6]),
        "motor-lag" => scan(&[0.01, 0.03, 0.08, 0.15, 0.3, 0.6]),
        "command-delay" => scan(&[0.032, 0.064, 0.096, 0.128, 0.192, 0.256, 0.32, 0.416, 0.512]),
        "dead-band" => scan(dead_bands_m_s),
        "acceleration-limit" => scan(&[0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.4]),
        "speed-step" => speed_steps(spec, 5e-4),
        "floor-tilt" => vec![Variant {
            spec,
            shape: Shape::Polar,
            values: vec![0.0, 0.0],
            free: vec![0, 1],
            sizes: vec![0, 1],
            steps: vec![1e-4, 1e-4],
        }],
        "directional-light" => (0..12)
            .map(|i| along(spec, &[0.0, TAU / 12.0 * f64::from(i)], (0, 1.0), &[0, 1]))
            .collect(),
        "wall-bump" => places(wall_lengths_m, 0.11)
            .map(|(wall, position)| along(spec, &[wall, position, 0.0, 0.08], (2, 5e-4), &[1, 2, 3]))
            .collect(),
        "reflectance-patch" => places(wall_lengths_m, 0.13)
            .map(|(wall, position)| along(spec, &[wall, position, 0.1, 1.0], (3, 0.02), &[1, 2, 3]))
            .collect(),
        _ => Vec::new(),
    }
}

fn along(spec: &'static Spec, values: &[f64], (size, step): (usize, f64), free: &[usize]) -> Variant {
    Variant {
        spec,
        shape: Shape::Along,
        values: values.to_vec(),
        free: free.to_vec(),
        sizes: vec![size],
        steps: vec![step],
    }
}

/// Places along both walls, about `spacing_m` apart.
fn places(wall_lengths_m: [f64; 2], spacing_m: f64) -> impl Iterator<Item = (f64, f64)> {
    wall_lengths_m
        .into_iter()
        .enumerate()
        .flat_map(move |(wall, length_m)| {
            let count = (length_m / spacing_m).ceil() as usize;
            (0..count).map(move |i| (wall as f64, i as f64 / count as f64))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    const JUDGED_OTHERWISE: [&str; 7] = [
        "controller-gain",
        "controller-speed",
        "reading-noise",
        "reading-step",
        "slip-level",
        "slip-memory",
        "camera-noise",
    ];

    #[test]
    fn every_effect_is_tried_or_judged_otherwise() {
        for spec in EFFECTS {
            let is_tried = !of(spec, [3.0, 2.0], &[0.01]).is_empty();
            assert_ne!(is_tried, JUDGED_OTHERWISE.contains(&spec.name), "{}", spec.name);
        }
    }

    #[test]
    fn dead_bands_lie_between_the_commands_that_are_given() {
        let command = |left_m_s: f64, right_m_s: f64| WheelSpeeds { left_m_s, right_m_s };
        // Of three speeds, half of the commands are at the slowest; a band below it or above the fastest tells nothing.
        let few = [command(0.02, 0.04), command(-0.02, 0.06)];
        assert_eq!(slow_speeds(few.into_iter()), [0.03]);
        // Of a thousand speeds an ever larger share is slower.
        let many = (1..=1000).map(|i| command(f64::from(i) * 1e-4, 0.0));
        let sizes = slow_speeds(many);
        assert!(sizes.windows(2).all(|pair| pair[0] < pair[1]), "{sizes:?}");
        assert!(
            (sizes[3] - 0.0016).abs() < 1e-4 && sizes.last().unwrap() > &0.04,
            "{sizes:?}"
        );
        assert!(slow_speeds(std::iter::empty()).is_empty());
    }
}
