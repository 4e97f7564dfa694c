//! How large an effect is drawn: from just visible in 4 x 20 laps to what a robot may still drive with.

use sim::Stream;
use toml::{Table, Value};

/// What a size is a step of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scale {
    /// The value is e to the power of the size.
    Factor,
    /// The value is the size.
    Sum,
    /// The value is one over the size: a limit, which acts the more the lower it is.
    Limit,
}

/// Which way a size may go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Up,
    Down,
    Both,
}

/// One way to draw an effect.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recipe {
    pub(crate) name: &'static str,
    /// The parameter that is its size.
    size: &'static str,
    scale: Scale,
    way: Way,
    /// The size is log-uniform between these.
    low: f64,
    high: f64,
}

const fn recipe(
    name: &'static str,
    size: &'static str,
    scale: Scale,
    way: Way,
    [low, high]: [f64; 2],
) -> Recipe {
    Recipe {
        name,
        size,
        scale,
        way,
        low,
        high,
    }
}

use Scale::{Factor, Limit, Sum};
use Way::{Both, Down, Up};

/// Every effect of the list.
pub(crate) const RECIPES: &[Recipe] = &[
    recipe("cone-of-view", "half_angle_rad", Sum, Up, [0.12, 0.5]),
    recipe("reading-gain", "gain", Factor, Both, [0.03, 0.35]),
    recipe("distance-scale", "scale", Factor, Both, [0.03, 0.25]),
    recipe("response-exponent", "scale", Factor, Both, [0.02, 0.3]),
    recipe("ambient-offset", "counts", Sum, Both, [10.0, 80.0]),
    recipe("sensor-rotation", "angle_rad", Sum, Both, [0.01, 0.12]),
    recipe("sensor-reach", "fraction", Factor, Down, [0.03, 0.3]),
    recipe("one-sensor-gain", "gain", Factor, Both, [0.1, 0.5]),
    recipe("one-sensor-offset", "counts", Sum, Both, [8.0, 60.0]),
    recipe("directional-light", "counts", Sum, Up, [5.0, 40.0]),
    recipe("crosstalk", "fraction", Sum, Up, [0.02, 0.2]),
    recipe("sensor-lag", "time_s", Sum, Up, [0.04, 0.25]),
    recipe("reading-noise", "factor", Factor, Both, [0.3, 1.2]),
    recipe("reading-step", "counts", Sum, Up, [30.0, 200.0]),
    recipe("reading-drift", "per_s", Sum, Both, [5e-5, 4e-4]),
    recipe("incidence-falloff", "exponent", Sum, Up, [0.3, 2.5]),
    recipe("controller-gain", "factor", Factor, Both, [0.04, 0.35]),
    recipe("controller-speed", "factor", Factor, Both, [0.003, 0.06]),
    recipe("wheel-asymmetry", "ratio", Factor, Both, [0.002, 0.03]),
    recipe("wheel-scale", "factor", Factor, Both, [0.003, 0.06]),
    recipe("axle-length", "factor", Factor, Both, [0.02, 0.16]),
    recipe("motor-lag", "time_s", Sum, Up, [0.05, 0.25]),
    recipe("command-delay", "time_s", Sum, Up, [0.032, 0.256]),
    recipe("dead-band", "speed_m_s", Sum, Up, [0.036, 0.047]),
    recipe("speed-step", "speed_m_s", Sum, Up, [0.004, 0.03]),
    recipe("acceleration-limit", "m_s2", Limit, Up, [2.0, 25.0]),
    recipe("turn-scrub", "fraction", Sum, Up, [0.04, 0.3]),
    recipe("battery-sag", "per_s", Sum, Up, [1e-5, 1.5e-4]),
    recipe("floor-tilt", "speed_m_s", Sum, Up, [2e-4, 1.5e-3]),
    recipe("slip-level", "factor", Factor, Both, [0.3, 1.3]),
    recipe("slip-memory", "correlation", Sum, Up, [0.3, 0.8]),
    recipe("outer-wall-offset", "distance_m", Sum, Both, [1e-3, 0.012]),
    recipe("inner-wall-offset", "distance_m", Sum, Both, [1e-3, 0.012]),
    recipe("wall-bump", "height_m", Sum, Both, [0.006, 0.02]),
    recipe("outer-wall-reflectance", "factor", Factor, Both, [0.03, 0.4]),
    recipe("inner-wall-reflectance", "factor", Factor, Both, [0.03, 0.4]),
    recipe("reflectance-patch", "factor", Factor, Both, [0.15, 0.6]),
    recipe("camera-scale", "factor", Factor, Both, [0.002, 0.015]),
    recipe("camera-offset", "dx_m", Sum, Both, [5e-4, 3e-3]),
    recipe("camera-offset", "dy_m", Sum, Both, [5e-4, 3e-3]),
    recipe("camera-rotation", "angle_rad", Sum, Both, [1e-3, 0.01]),
    recipe("camera-distortion", "k1", Sum, Both, [2e-3, 0.02]),
    recipe("marker-offset", "left_m", Sum, Both, [5e-4, 3e-3]),
    recipe("marker-offset", "forward_m", Sum, Both, [6e-3, 0.02]),
    recipe("camera-noise", "factor", Factor, Both, [0.15, 1.0]),
];

/// What gains and speeds that go by run are drawn from: the largest size.
pub(crate) const BY_RUN: [Recipe; 2] = [
    recipe("reading-gain", "gain", Factor, Both, [0.0, 0.22]),
    recipe("wheel-scale", "factor", Factor, Both, [0.0, 0.03]),
];

impl Recipe {
    /// The effect's table, its size times `shrink`.
    pub(crate) fn draw(&self, stream: &mut Stream, shrink: f64) -> Table {
        let mut table = Table::new();
        table.insert("kind".into(), self.name.into());
        let magnitude = log_uniform(stream, self.low, self.high) * shrink;
        let up = match self.way {
            Way::Up => true,
            Way::Down => false,
            Way::Both => stream.symmetric() > 0.0,
        };
        let value = self.value(if up { magnitude } else { -magnitude });
        table.insert(self.size.into(), value.into());
        self.places(stream, &mut table);
        table
    }

    /// The effect's table with a size for each run.
    pub(crate) fn draw_by_run(&self, stream: &mut Stream, runs: usize) -> Table {
        let sizes: Vec<Value> = (0..runs)
            .map(|_| self.value(self.high * stream.symmetric()).into())
            .collect();
        let mut table = Table::new();
        table.insert("kind".into(), self.name.into());
        table.insert("by".into(), "run".into());
        table.insert(self.size.into(), Value::Array(sizes));
        table
    }

    fn value(&self, size: f64) -> f64 {
        /// Delays are whole physics steps.
        const PHYSICS_STEP_S: f64 = 0.032;
        let value = match self.scale {
            Scale::Factor => size.exp(),
            Scale::Sum => size,
            Scale::Limit => size.recip(),
        };
        if self.name == "command-delay" {
            return rounded((value / PHYSICS_STEP_S).round().max(1.0) * PHYSICS_STEP_S);
        }
        rounded(value)
    }

    /// Draws which sensor, which way and where.
    fn places(&self, stream: &mut Stream, table: &mut Table) {
        /// The sensors that the controllers use.
        const SENSORS: [i64; 6] = [0, 1, 2, 5, 6, 7];
        match self.name {
            "one-sensor-gain" | "one-sensor-offset" => {
                table.insert("sensor".into(), SENSORS[stream.index(SENSORS.len())].into());
            }
            "directional-light" | "floor-tilt" => {
                let azimuth_rad = rounded(std::f64::consts::PI * stream.symmetric());
                table.insert("azimuth_rad".into(), azimuth_rad.into());
            }
            "wall-bump" | "reflectance-patch" => {
                table.insert("wall".into(), ["outer", "inner"][stream.index(2)].into());
                let position = rounded(0.5 + 0.5 * stream.symmetric());
                table.insert("position".into(), position.into());
                table.insert("length_m".into(), rounded(log_uniform(stream, 0.05, 0.13)).into());
            }
            _ => {}
        }
    }
}

/// A draw whose logarithm is uniform.
pub(crate) fn log_uniform(stream: &mut Stream, low: f64, high: f64) -> f64 {
    low * (high / low).powf(0.5 + 0.5 * stream.symmetric())
}

/// To six digits, as labels have them.
pub(crate) fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use sim::Streams;

    use super::*;

    #[test]
    fn every_effect_of_the_list_is_drawn_within_its_range() {
        let drawn: BTreeSet<&str> = RECIPES.iter().map(|recipe| recipe.name).collect();
        let listed: BTreeSet<&str> = sim::EFFECTS.iter().map(|spec| spec.name).collect();
        assert_eq!(drawn, listed);
        let mut stream = Streams { seed: 1, run: 0 }.open("test");
        for recipe in RECIPES {
            let spec = sim::find(recipe.name).unwrap();
            for _ in 0..20 {
                let table = recipe.draw(&mut stream, 1.0);
                for (key, value) in table.iter().filter(|(key, _)| *key != "kind") {
                    let param = spec.params.iter().find(|param| param.name == key).unwrap();
                    let Some(value) = value.as_float() else { continue };
                    assert!(
                        value >= param.low && value <= param.high,
                        "{} {key} {value}",
                        recipe.name
                    );
                    assert_ne!(Some(value), param.neutral, "{} {key}", recipe.name);
                }
            }
        }
    }
}
