//! Which effects are tried, and at what sizes.

use sim::{Pattern, Setting, Spec, find};

use super::groups::groups;
use crate::candidate::{apart, round};

/// One way in which one effect may act: a line through its parameters, from the neutral values outwards.
#[derive(Debug, Clone)]
pub(super) struct Probe {
    pub(super) spec: &'static Spec,
    /// All parameters where the effect does nothing (or would, if it has a size).
    origin: Vec<f64>,
    /// How each parameter changes with the size.
    direction: Vec<f64>,
    /// Sizes that are simulated beforehand, rising; the neutral size is not among them.
    pub(super) sizes: Vec<f64>,
    /// The size at which the effect does nothing.
    pub(super) neutral: f64,
    /// Parameters that a fit may change, each with a step over which its action is about linear.
    pub(super) free: Vec<(usize, f64)>,
    /// Whether one simulated size stands for the opposite one too, mirrored.
    pub(super) odd: bool,
    /// The size comes in whole multiples of this.
    pub(super) quantum: Option<f64>,
    /// Sizes to scan, in a constant ratio, where its action jumps with its size; 0 where it does not.
    pub(super) scanned: u32,
    /// Whether its size is a limit, which does the more the smaller it is and nothing where it is large.
    pub(super) limit: bool,
}

/// Share of a size over which its action is about linear.
const STEP: f64 = 0.15;

impl Probe {
    /// Numbers to fit without a path: a group of basis functions.
    pub(super) fn group(spec: &'static Spec, origin: Vec<f64>, free: Vec<(usize, f64)>) -> Self {
        Self {
            spec,
            direction: vec![0.0; origin.len()],
            origin,
            sizes: Vec::new(),
            neutral: 0.0,
            free,
            odd: false,
            quantum: None,
            scanned: 0,
            limit: false,
        }
    }

    /// The effect with one of its free numbers at its step, all others at the origin.
    pub(super) fn step(&self, number: usize) -> Setting {
        let (parameter, step) = self.free[number];
        let mut values = self.origin.clone();
        values[parameter] += step;
        Setting::constant(self.spec, values)
    }

    /// Whether the effect itself is a change in time.
    pub(super) fn drifts(&self) -> bool {
        self.spec.drifts()
    }

    /// Whether its action jumps with its size.
    pub(super) fn jumps(&self) -> bool {
        self.scanned > 0
    }

    /// Which parameter sizes it; of a vector, the first that does.
    pub(super) fn size_index(&self) -> usize {
        self.free[0].0
    }

    /// Whether a parameter sizes it: one does, and of a vector both.
    pub(super) fn is_size(&self, parameter: usize) -> bool {
        let param = self.spec.params.get(parameter);
        parameter == self.size_index() || self.fits_direction() && param.is_some_and(|p| p.neutral.is_some())
    }

    /// The size of such values, of a vector that along its direction.
    pub(super) fn size_of(&self, values: &[f64]) -> f64 {
        let size = self.size_index();
        if self.direction[size] == 1.0 {
            return values[size];
        }
        let off = values
            .iter()
            .zip(&self.origin)
            .map(|(value, origin)| value - origin);
        self.neutral + off.zip(&self.direction).map(|(off, d)| off * d).sum::<f64>()
    }

    /// How all parameters change where the size changes by so much; of a group of basis functions the first number does.
    pub(super) fn along(&self, change: f64) -> Vec<f64> {
        let mut along: Vec<f64> = self.direction.iter().map(|d| d * change).collect();
        if self.sizes.is_empty() {
            along[self.size_index()] = change;
        }
        along
    }

    /// Whether a parameter changes with the size.
    pub(super) fn moves(&self, parameter: usize) -> bool {
        self.along(1.0)[parameter] != 0.0
    }

    /// The parameter that alone changes with the size; `None` where several do.
    pub(super) fn only_moving(&self) -> Option<usize> {
        let mut moving = (0..self.direction.len()).filter(|&parameter| self.moves(parameter));
        moving.next().filter(|_| moving.next().is_none())
    }

    /// Whether it is the same effect, of a vector in the same direction.
    pub(super) fn acts_like(&self, other: &Self) -> bool {
        self.spec == other.spec && self.direction == other.direction
    }

    /// A step of one of its free numbers over which its action is about linear, at a size.
    pub(super) fn step_at(&self, number: usize, size: f64) -> f64 {
        let step = self.free[number].1;
        if self.limit && number == 0 {
            step.min(STEP * size)
        } else {
            step
        }
    }

    /// Of the sizes that are simulated beforehand, or stand for opposite ones, those that do least to either side of nothing.
    pub(super) fn smallest_sizes(&self) -> Vec<f64> {
        let up = self.sizes.iter().copied().find(|size| *size > self.neutral);
        let down = self.sizes.iter().copied().rfind(|size| *size < self.neutral);
        let mirrored = up.filter(|_| self.odd).map(|size| self.times(size, -1.0));
        down.or(mirrored).into_iter().chain(up).collect()
    }

    /// How far one of its free numbers goes among robots of this kind: sizes as far as those that are simulated beforehand, a
    /// place as far as the choice among places leaves it.
    pub(super) fn range_of(&self, number: usize) -> f64 {
        let (parameter, step) = self.free[number];
        if !self.fits_direction() && number > 0 {
            return step / STEP;
        }
        if let Some(turn) = round(&self.spec.params[parameter]) {
            return turn.end - turn.start;
        }
        let nothing = (!self.limit).then_some(self.neutral);
        let sizes = || self.sizes.iter().copied().chain(nothing);
        let largest = sizes().fold(f64::NEG_INFINITY, f64::max);
        let smallest = sizes().fold(f64::INFINITY, f64::min);
        let mirrored = if self.odd { 2.0 } else { 1.0 };
        mirrored * (largest - smallest)
    }

    /// Whether a direction is fitted with its size, which is then no choice among probes.
    pub(super) fn fits_direction(&self) -> bool {
        self.free.len() == 2
    }

    /// Whether it acts at a place of a wall or of the floor; place and length are fitted with the size.
    pub(super) fn has_place(&self) -> bool {
        self.spec.place_of("position").is_some() || self.is_an_area()
    }

    /// Wall, position and length of a place where it acts with such values; `None` without a place.
    fn place(&self, values: &[f64]) -> Option<[f64; 3]> {
        let value = |name: &str| Some(values[self.spec.place_of(name)?]);
        Some([value("wall")?, value("position")?, value("length_m")?])
    }

    /// Whether it is the same effect at another one of the sensors.
    pub(super) fn is_at_other_sensor(&self, other: &Self) -> bool {
        let sensor = |probe: &Self| Some(probe.origin[probe.spec.place_of("sensor")?]);
        self.spec == other.spec && sensor(self) != sensor(other)
    }

    /// Whether it acts on the other wall, near the place where another one acts with such values: a robot between them comes as near to
    /// one as it leaves the other.
    pub(super) fn is_opposite(&self, other: &Self, values: &[f64]) -> bool {
        /// Share of the walls' length.
        const NEAR: f64 = 0.1;
        let (Some([wall, at, _]), Some([facing, position, _])) =
            (self.place(&self.origin), other.place(values))
        else {
            return false;
        };
        let along = self.spec.params.iter().find(|param| param.name == "position");
        wall != facing && apart(at, position, along).abs() <= NEAR
    }

    /// Brings its values to the place where another one acts with such values.
    pub(super) fn move_to_place_of(&self, own: &mut [f64], other: &Self, values: &[f64]) {
        let Some([wall, position, length_m]) = other.place(values) else {
            return;
        };
        for (param, own) in self.spec.params.iter().zip(own) {
            match param.name {
                "wall" => *own = wall,
                "position" => *own = position,
                "length_m" => *own = length_m,
                _ => {}
            }
        }
    }

    /// The values where nothing is done.
    pub(super) fn origin(&self) -> &[f64] {
        &self.origin
    }

    /// The values of all parameters at a size.
    pub(super) fn values(&self, size: f64) -> Vec<f64> {
        self.origin
            .iter()
            .zip(&self.direction)
            .map(|(o, d)| o + d * (size - self.neutral))
            .collect()
    }

    /// A size that does so many times as much as another; of a limit that does nothing where it is infinite, the inverse counts.
    pub(super) fn times(&self, size: f64, multiple: f64) -> f64 {
        if self.limit {
            return (size / multiple.max(f64::MIN_POSITIVE)).min(self.neutral);
        }
        self.neutral + multiple * (size - self.neutral)
    }

    /// The effect at a size.
    pub(super) fn setting(&self, size: f64) -> Setting {
        Setting {
            spec: self.spec,
            pattern: Pattern::Constant(self.values(size)),
        }
    }

    /// Values brought into their parameters' ranges.
    pub(super) fn clamped(&self, values: &[f64]) -> Vec<f64> {
        values
            .iter()
            .zip(self.spec.params)
            .map(|(v, p)| v.clamp(p.low, p.high))
            .collect()
    }

    /// What tells this probe from others of the same effect, for a reader.
    pub(super) fn label(&self) -> String {
        let moving = |i: usize| self.direction[i] != 0.0;
        let fixed: Vec<String> = (self.spec.params.iter().zip(&self.origin).enumerate())
            .filter(|(i, (param, _))| !moving(*i) && param.neutral.is_none())
            .map(|(_, (param, value))| match param.choices.get(*value as usize) {
                Some(choice) => format!("{} {choice}", param.name),
                None => format!("{} {value:.3}", param.name),
            })
            .collect();
        if fixed.is_empty() {
            self.spec.name.to_owned()
        } else {
            format!("{} ({})", self.spec.name, fixed.join(", "))
        }
    }
}

/// Effects whose action jumps with their size, and the number of sizes to scan: a speed or a threshold of a dozen steps is rounded
/// otherwise where a step is half a per cent larger; bands of interest are few.
const JUMPS: [(&str, u32); 3] = [("speed-step", 240), ("dead-band", 60), ("reading-step", 240)];

/// Sizes of the first parameter of an effect.
fn line(name: &str, sizes: &[f64]) -> Vec<Probe> {
    probe(name, &[], sizes, &[])
}

/// Sizes of an effect's first numeric parameter that has a neutral value; `fixed` sets others by name; `free` names further
/// parameters that a fit may change, with their steps.
fn probe(name: &str, fixed: &[(&str, f64)], sizes: &[f64], free: &[(&str, f64)]) -> Vec<Probe> {
    let Ok(spec) = find(name) else { return Vec::new() };
    let index = |key: &str| spec.place_of(key).expect("probes name parameters");
    let size_index = spec
        .params
        .iter()
        .position(|p| p.choices.is_empty() && !fixed.iter().any(|(key, _)| *key == p.name))
        .expect("every probe has a size");
    let mut origin: Vec<f64> = spec.params.iter().map(|p| p.neutral.unwrap_or(0.0)).collect();
    for (key, value) in fixed {
        origin[index(key)] = *value;
    }
    let largest = sizes.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
    let neutral = spec.params[size_index].neutral;
    let limit = neutral.is_none();
    let neutral = neutral.unwrap_or(2.5 * largest);
    origin[size_index] = neutral;
    let mut direction = vec![0.0; spec.params.len()];
    direction[size_index] = 1.0;
    let reach = sizes.iter().map(|s| (s - neutral).abs()).fold(0.0, f64::max);
    let steps = [(size_index, STEP * reach)];
    let free = steps
        .into_iter()
        .chain(free.iter().map(|(key, step)| (index(key), *step)))
        .collect();
    let jumping = JUMPS.iter().find(|jumping| jumping.0 == name);
    vec![Probe {
        spec,
        origin,
        direction,
        sizes: sizes.to_vec(),
        neutral,
        free,
        odd: false,
        quantum: None,
        scanned: jumping.map_or(0, |jumping| jumping.1),
        limit,
    }]
}

/// A vector of two parameters, in four directions; both are fitted.
fn vector(name: &str, keys: [&str; 2], sizes: &[f64]) -> Vec<Probe> {
    let h = std::f64::consts::FRAC_1_SQRT_2;
    let mut probes = Vec::new();
    for (a, b) in [(1.0, 0.0), (h, h), (0.0, 1.0), (-h, h)] {
        for mut probe in probe(name, &[], sizes, &[]) {
            let index = |key: &str| probe.spec.place_of(key).expect("probes name parameters");
            let (i, j) = (index(keys[0]), index(keys[1]));
            probe.direction.fill(0.0);
            (probe.direction[i], probe.direction[j]) = (a, b);
            let step = STEP * sizes.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            probe.free = vec![(i, step), (j, step)];
            probes.push(probe);
        }
    }
    probes
}

/// Probes of which one size stands for the opposite one too.
fn mirrored(probes: Vec<Probe>) -> Vec<Probe> {
    probes.into_iter().map(|p| Probe { odd: true, ..p }).collect()
}

/// A size with a direction, in eight of them; both are fitted.
fn directed(name: &str, sizes: &[f64]) -> Vec<Probe> {
    let azimuths = (0..8).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4 - std::f64::consts::PI);
    azimuths
        .flat_map(|azimuth| probe(name, &[("azimuth_rad", azimuth)], sizes, &[("azimuth_rad", 0.15)]))
        .collect()
}

/// One of the six sensors that the controllers use.
fn sensors(name: &str, sizes: &[f64]) -> Vec<Probe> {
    [0.0, 1.0, 2.0, 5.0, 6.0, 7.0]
        .into_iter()
        .flat_map(|s| probe(name, &[("sensor", s)], sizes, &[]))
        .collect()
}

/// A place on one of the walls; place, length and size are fitted.
fn places(name: &str, length_m: f64, size: f64) -> Vec<Probe> {
    const PLACES: u32 = 24;
    let mut probes = Vec::new();
    for wall in [0.0, 1.0] {
        for k in 0..PLACES {
            let position = (f64::from(k) + 0.5) / f64::from(PLACES);
            let fixed = [("wall", wall), ("position", position), ("length_m", length_m)];
            let free = [("position", 0.008), ("length_m", 0.015)];
            probes.extend(mirrored(probe(name, &fixed, &[size], &free)));
        }
    }
    probes
}

/// The probe of another effect that is nearest to the place, on the same wall, where one acts with such values.
pub(super) fn other_at_place(probes: &[Probe], one: usize, values: &[f64]) -> Option<usize> {
    let [wall, position, _] = probes[one].place(values)?;
    let off = |other: &Probe| {
        let [on, at, _] = other.place(other.origin())?;
        (on == wall && other.spec != probes[one].spec).then_some((at - position).abs())
    };
    let nearest = (probes.iter().enumerate()).filter_map(|(number, other)| Some((off(other)?, number)));
    nearest
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, number)| number)
}

/// Everything that is tried. A list of sizes spans what robots of this kind do; fits may leave it.
///
/// `controller-speed` is not among them, because laps cannot tell it from `wheel-scale`. Delays come in physics steps.
pub(super) fn probes(physics_step_s: f64) -> Vec<Probe> {
    let delay = |p: Probe| Probe {
        quantum: Some(physics_step_s),
        ..p
    };
    let steps: Vec<f64> = (1..=15).map(|k| 0.002 * f64::from(k)).collect();
    let delays: Vec<f64> = (1..=10).map(|k| physics_step_s * f64::from(k)).collect();
    [
        line("cone-of-view", &[0.1, 0.2, 0.3, 0.45, 0.6]),
        line("reading-gain", &[0.7, 0.83, 0.93, 1.07, 1.2, 1.4]),
        line("distance-scale", &[0.8, 0.9, 0.96, 1.04, 1.1, 1.25]),
        line("response-exponent", &[0.75, 0.87, 0.95, 1.05, 1.13, 1.3]),
        line("ambient-offset", &[-90.0, -40.0, -15.0, 15.0, 40.0, 90.0]),
        line("sensor-rotation", &[-0.12, -0.06, -0.02, 0.02, 0.06, 0.12]),
        line("sensor-reach", &[0.7, 0.8, 0.88, 0.95, 1.06, 1.2]),
        sensors("one-sensor-gain", &[0.65, 0.86, 1.16, 1.5]),
        sensors("one-sensor-offset", &[-60.0, -20.0, 20.0, 60.0]),
        directed("directional-light", &[8.0, 25.0]),
        line("crosstalk", &[0.02, 0.06, 0.12, 0.2]),
        line("sensor-lag", &[0.06, 0.12, 0.2, 0.3]),
        line("reading-noise", &[0.3, 0.6, 1.5, 2.2, 3.5]),
        line(
            "reading-step",
            &[20.0, 45.0, 70.0, 95.0, 120.0, 145.0, 170.0, 200.0],
        ),
        line("reading-drift", &[-4e-4, -1.5e-4, 1.5e-4, 4e-4]),
        line("incidence-falloff", &[0.3, 0.8, 1.6, 2.6]),
        line("controller-gain", &[0.7, 0.83, 0.93, 1.07, 1.2, 1.4]),
        line("wheel-asymmetry", &[0.97, 0.988, 1.012, 1.03]),
        line("wheel-scale", &[0.93, 0.975, 1.025, 1.07]),
        line("axle-length", &[0.85, 0.92, 0.97, 1.03, 1.08, 1.16]),
        line("motor-lag", &[0.05, 0.1, 0.17, 0.25]),
        probe("command-delay", &[], &delays, &[])
            .into_iter()
            .map(delay)
            .collect(),
        line("dead-band", &[0.034, 0.037, 0.04, 0.043, 0.046]),
        line("speed-step", &steps),
        line(
            "acceleration-limit",
            &[0.04, 0.08, 0.15, 0.18, 0.22, 0.3, 0.6, 1.5],
        ),
        line("turn-scrub", &[0.05, 0.12, 0.22, 0.35]),
        line("battery-sag", &[-6e-5, 3e-5, 8e-5, 1.6e-4]),
        directed("floor-tilt", &[4e-4, 1.2e-3]),
        line("slip-level", &[0.2, 0.6, 1.5, 2.2, 3.5, 6.0]),
        line("slip-memory", &[0.25, 0.45, 0.65, 0.85]),
        line(
            "outer-wall-offset",
            &[-0.012, -0.005, -0.0015, 0.0015, 0.005, 0.012],
        ),
        line(
            "inner-wall-offset",
            &[-0.012, -0.005, -0.0015, 0.0015, 0.005, 0.012],
        ),
        places("wall-bump", 0.06, 0.012),
        line("outer-wall-reflectance", &[0.65, 0.85, 1.15, 1.45]),
        line("inner-wall-reflectance", &[0.65, 0.85, 1.15, 1.45]),
        places("reflectance-patch", 0.09, 1.5),
        mirrored(line("camera-scale", &[1.008])),
        mirrored(vector("camera-offset", ["dx_m", "dy_m"], &[0.002])),
        mirrored(line("camera-rotation", &[0.008])),
        mirrored(line("camera-distortion", &[0.01])),
        // The farther ahead a marker, the more it cuts corners: no mirror image of one behind.
        vector(
            "marker-offset",
            ["forward_m", "left_m"],
            &[-0.012, -0.003, 0.003, 0.012],
        ),
        line("camera-noise", &[0.4, 0.75, 1.4, 2.0, 3.0]),
        groups(),
    ]
    .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_span_the_sizes_on_both_sides_of_nothing() {
        let range = |name: &str, number: usize| {
            let probes = probes(0.032);
            let found = probes.iter().find(|probe| probe.spec.name == name);
            found.map(|probe| probe.range_of(number))
        };
        let is = |name: &str, number: usize, expected: f64| {
            let found = range(name, number).expect("the effect is tried");
            assert!((found - expected).abs() < 1e-12, "{name} {number}: {found}");
        };
        is("reading-gain", 0, 0.7);
        is("crosstalk", 0, 0.2);
        is("ambient-offset", 0, 180.0);
        is("acceleration-limit", 0, 1.46);
        // Mirror images are not simulated; the middle of a factor is one.
        is("camera-scale", 0, 0.016);
        is("camera-offset", 0, 0.004);
        is("camera-offset", 1, 0.004);
        is("marker-offset", 1, 0.024);
        is("directional-light", 0, 25.0);
        is("directional-light", 1, std::f64::consts::TAU);
        // Twenty-four places a wall, chosen before.
        is("wall-bump", 1, 0.008 / STEP);
        is("wall-bump", 0, 0.024);
    }

    #[test]
    fn opposite_a_bump_near_the_walls_end_are_places_to_either_side_of_it() {
        let probes = probes(0.032);
        let named = |name: &str| probes.iter().find(|probe| probe.spec.name == name);
        let bump = named("wall-bump").expect("the effect is tried");
        let mut values = bump.values(-0.01);
        let mut place = |name: &str, value: f64| values[bump.spec.place_of(name).expect("a place")] = value;
        place("wall", 0.0);
        place("position", 0.99);
        let opposite: Vec<[f64; 3]> = (probes.iter())
            .filter(|probe| probe.is_opposite(bump, &values))
            .filter_map(|probe| probe.place(&probe.origin))
            .collect();
        assert!(opposite.iter().all(|place| place[0] == 1.0));
        // Of 24 places a wall those within a tenth, for bumps and for patches.
        let near = |place: &&[f64; 3]| !(0.09..0.89).contains(&place[1]);
        assert_eq!(opposite.iter().filter(near).count(), opposite.len());
        assert_eq!(opposite.len(), 2 * 5);
        assert!(!bump.is_opposite(named("reading-gain").expect("the effect is tried"), &[1.0]));
    }

    #[test]
    fn a_vector_is_as_large_as_it_reaches_along_its_direction() {
        let probes = probes(0.032);
        let offsets: Vec<&Probe> = (probes.iter())
            .filter(|probe| probe.spec.name == "camera-offset")
            .collect();
        assert_eq!(offsets.len(), 4);
        for probe in &offsets {
            assert!((probe.size_of(&probe.values(0.0015)) - 0.0015).abs() < 1e-15);
        }
        let only: Vec<Option<usize>> = offsets.iter().map(|probe| probe.only_moving()).collect();
        assert_eq!(only, [Some(0), None, Some(1), None]);
        // 3 mm to the left and 1 mm back, in a direction half back and half left.
        let size = offsets[3].size_of(&[-0.001, 0.003]);
        assert!((size - 0.004 * std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-15);
        let along = offsets[2].along(1e-5);
        assert_eq!(along, [0.0, 1e-5]);
        assert!(offsets[2].is_size(0) && offsets[2].is_size(1));
        let light = probes.iter().find(|probe| probe.spec.name == "directional-light");
        let sizes: Vec<bool> = light.map_or(Vec::new(), |light| vec![light.is_size(0), light.is_size(1)]);
        assert_eq!(sizes.iter().filter(|is_size| **is_size).count(), 1);
    }

    #[test]
    fn twice_a_lag_is_twice_its_time_and_twice_a_limit_is_half_of_it() {
        let twice = |name: &str, size: f64| {
            let probes = probes(0.032);
            let found = probes.iter().find(|probe| probe.spec.name == name);
            found.expect("the effect is tried").times(size, 2.0)
        };
        assert_eq!(twice("motor-lag", 0.1), 0.2);
        assert!((twice("reading-gain", 1.1) - 1.2).abs() < 1e-12);
        assert_eq!(twice("acceleration-limit", 0.3), 0.15);
    }

    #[test]
    fn smallest_sizes_do_least_to_either_side() {
        let smallest = |name: &str| {
            let probes = probes(0.032);
            let found = probes.iter().find(|probe| probe.spec.name == name);
            found.expect("the effect is tried").smallest_sizes()
        };
        assert_eq!(smallest("reading-gain"), [0.93, 1.07]);
        assert_eq!(smallest("sensor-lag"), [0.06]);
        assert_eq!(smallest("acceleration-limit"), [1.5]);
        // Its opposite is not simulated beforehand.
        assert_eq!(smallest("wall-bump"), [-0.012, 0.012]);
    }

    #[test]
    fn at_the_place_of_a_bump_may_be_a_patch_on_the_same_wall_and_a_sensor_may_be_another() {
        let probes = probes(0.032);
        let number = |name: &str| {
            probes
                .iter()
                .position(|probe| probe.spec.name == name)
                .expect("tried")
        };
        let bump = number("wall-bump");
        let place = |values: &[f64]| probes[bump].place(values).expect("a bump has a place");
        let mut values = probes[bump].values(0.01);
        for (param, value) in probes[bump].spec.params.iter().zip(&mut values) {
            match param.name {
                "wall" => *value = 1.0,
                "position" => *value = 0.734,
                "length_m" => *value = 0.11,
                _ => {}
            }
        }
        assert_eq!(place(&values), [1.0, 0.734, 0.11]);
        let patch = &probes[other_at_place(&probes, bump, &values).expect("a patch has one too")];
        assert_eq!(patch.spec.name, "reflectance-patch");
        let [wall, position, _] = patch.place(patch.origin()).expect("a place");
        assert!(wall == 1.0 && (position - 0.734).abs() <= 0.5 / 24.0);
        let mut moved = patch.values(1.5);
        patch.move_to_place_of(&mut moved, &probes[bump], &values);
        assert_eq!(patch.place(&moved), Some([1.0, 0.734, 0.11]));
        assert!(moved.contains(&1.5));
        let gain = number("reading-gain");
        let at_sensor = number("one-sensor-gain");
        let others = probes
            .iter()
            .filter(|probe| probe.is_at_other_sensor(&probes[at_sensor]));
        assert_eq!(others.count(), 5);
        assert!(!probes.iter().any(|probe| probe.is_at_other_sensor(&probes[gain])));
        assert_eq!(other_at_place(&probes, gain, &probes[gain].values(1.1)), None);
    }
}
