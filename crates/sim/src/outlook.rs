//! What the sensors should read at a pose that is known up to a covariance.

use crate::apparatus::Apparatus;
use crate::cast::{Hits, LANES, Rays};
use crate::cones::Cones;
use crate::effects::{Hit, RayHits};
use crate::forecast::PoseMatrix;
use crate::{Combine, Pose, Readings, Response};

/// What the sensors should read at an uncertain pose, before noise and cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// Expected readings, counts.
    pub mean: Readings,
    /// Change of each with x, y (counts/m) and heading (counts/rad).
    pub slope: [[f64; 3]; LANES],
    /// Variance of each that the pose's uncertainty makes beyond its slope, at the end of the range, counts^2.
    pub edge_variance: Readings,
    /// What the rays along the sensors' axes met.
    pub look: Look,
}

/// What the rays along the sensors' axes met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Standard deviation of the distance, m; 0 where there is no wall.
    pub deviation_m: [f64; LANES],
    rays: Rays,
    hits: Hits,
    /// What effects made of the rays' responses.
    factor: [f64; LANES],
    /// Responses before effects on readings, counts.
    response: Readings,
}

/// Where eight rays met walls, with their directions along the walls' normals: of a look, what all forecasts of one world that see it
/// need of it.
#[derive(Debug)]
pub struct Places([Option<(Hit, f64)>; LANES]);

impl Places {
    fn of(ray_hits: &RayHits<'_>) -> Self {
        let is_met = |lane: usize| ray_hits.hits.distance_m[lane].is_finite();
        Self(std::array::from_fn(|lane| {
            is_met(lane).then(|| ray_hits.hit_with_direction(lane))
        }))
    }
}

/// Eight rays: how their distances change with x, y and heading, and the standard deviations of these, m.
struct Doubt {
    slope: [[f64; LANES]; 3],
    deviation_m: [f64; LANES],
}

/// Distances along eight rays, m, and what effects make of their responses.
struct Met {
    distance_m: [f64; LANES],
    factor: [f64; LANES],
}

impl Met {
    /// What rays hit, as it is.
    fn plainly(hits: &Hits) -> Self {
        Self {
            distance_m: hits.distance_m,
            factor: [1.0; LANES],
        }
    }

    /// Whether no reading tells them apart: what is far along a wall has tails that never end.
    fn is_as_good_as(&self, other: &Self) -> bool {
        const NOTHING_M: f64 = 1e-9;
        const NOTHING: f64 = 1e-8;
        let alike = |a: &[f64; LANES], b: &[f64; LANES], nothing: f64| {
            // Two that are infinite are equal, and no number apart.
            a.iter().zip(b).all(|(a, b)| a == b || (a - b).abs() < nothing)
        };
        alike(&self.distance_m, &other.distance_m, NOTHING_M) && alike(&self.factor, &other.factor, NOTHING)
    }
}

/// Probabilities that eight uncertain distances are within the range, and their densities there (1/m).
struct InRange {
    seen: [f64; LANES],
    density: [f64; LANES],
}

/// What rays, or all rays of each sensor, add up to: as in [`Outlook`], axis by axis.
#[derive(Default)]
struct Total {
    mean: Readings,
    slope: [[f64; LANES]; 3],
    edge_variance: Readings,
    /// What effects add to a factor of 1, of sensors that average distances.
    factor: [f64; LANES],
}

impl Total {
    /// Adds eight rays, one of each sensor.
    #[inline(always)]
    fn add_each(&mut self, rays: &Self) {
        for lane in 0..LANES {
            self.add((lane, lane), rays);
        }
    }

    /// Adds eight rays of one sensor.
    #[inline]
    fn add_all(&mut self, sensor: usize, rays: &Self) {
        for ray in 0..LANES {
            self.add((ray, sensor), rays);
        }
    }

    #[inline(always)]
    fn add(&mut self, (ray, sensor): (usize, usize), rays: &Self) {
        self.mean[sensor] += rays.mean[ray];
        self.edge_variance[sensor] += rays.edge_variance[ray];
        self.factor[sensor] += rays.factor[ray];
        for (own, further) in self.slope.iter_mut().zip(&rays.slope) {
            own[sensor] += further[ray];
        }
    }
}

/// Standard deviations of a distance beyond which it is surely within the range, or surely not.
const SURE: f64 = 4.0;

/// Responses at eight distances, their derivatives (counts/m) and their second derivatives (counts/m^2).
struct Bends {
    value: Readings,
    rise: Readings,
    curve: Readings,
}

impl Apparatus<'_> {
    /// The responses of all sensors, before effects on readings.
    pub(crate) fn outlook(&self, pose: Pose, covariance: &PoseMatrix) -> Outlook {
        let mut look = Look::default();
        let mut total = Total::default();
        let middle = self.sights.len() / 2;
        let in_packs = self.cones.as_deref().map_or(0, Cones::sights);
        if let Some(cones) = &self.cones {
            cones.cast(&self.geometry.walls, pose, |pack, rays, hits| {
                if hits.is_none() {
                    return;
                }
                let met = self.met(&self.ray_hits(rays, hits).of_sensor(pack.sensor));
                let doubt = self.doubt(pose, covariance, rays, hits);
                total.add_all(pack.sensor, &self.shares(&pack.weights, &met, &doubt));
                if let Some(ray) = pack.place_of(middle) {
                    look.take((ray, pack.sensor), rays, hits, &met, &doubt);
                }
            });
        }
        for (number, sight) in self.sights.iter().enumerate().skip(in_packs) {
            let (rays, hits) = self.cast(pose, sight);
            let met = self.met(&self.ray_hits(&rays, &hits));
            let doubt = self.doubt(pose, covariance, &rays, &hits);
            total.add_each(&self.shares(&[sight.weight; LANES], &met, &doubt));
            if number == middle {
                look = Look {
                    deviation_m: doubt.deviation_m,
                    rays,
                    hits,
                    factor: met.factor,
                    ..look
                };
            }
        }
        if self.machine.beam.combine == Combine::Distances {
            self.respond_to_mean_distance(&mut total);
        }
        look.response = total.mean;
        Outlook {
            mean: total.mean,
            slope: std::array::from_fn(|lane| total.slope.map(|of_axis| of_axis[lane])),
            edge_variance: total.edge_variance,
            look,
        }
    }

    /// Distances along the sensors' axes, m; infinite where there is no wall.
    pub(crate) fn distances_m(&self, pose: Pose) -> [f64; LANES] {
        self.cast(pose, &self.sights[self.sights.len() / 2]).1.distance_m
    }

    /// The same responses from the look that the rays along the axes had before in a world whose sensors respond alike.
    pub(crate) fn responses_where_met(&self, look: &Look, places: &Places) -> Readings {
        let met = self.met_at(&look.hits, places);
        let before = Met {
            distance_m: look.hits.distance_m,
            factor: look.factor,
        };
        if met.is_as_good_as(&before) {
            look.response
        } else if self.sights.len() == 1 {
            self.responses_to(&met, look)
        } else {
            let (now, before) = (self.responses_to(&met, look), self.responses_to(&before, look));
            std::array::from_fn(|lane| look.response[lane] + now[lane] - before[lane])
        }
    }

    /// The same responses from a look that one ray a sensor had before.
    pub(crate) fn responses_again(&self, look: &Look) -> Readings {
        self.responses_to(&self.met(&self.ray_hits(&look.rays, &look.hits)), look)
    }

    fn responses_to(&self, met: &Met, look: &Look) -> Readings {
        let Bends { value, curve, .. } = bends(&self.machine.response, &met.distance_m);
        let InRange { seen, .. } = self.in_range(met, &look.deviation_m);
        std::array::from_fn(|lane| {
            if look.hits.distance_m[lane].is_finite() {
                let response = curved(value[lane], curve[lane], look.deviation_m[lane]);
                met.factor[lane] * response * seen[lane]
            } else {
                0.0
            }
        })
    }

    /// What the rays met after what displaces the walls to first order.
    #[inline]
    fn met(&self, ray_hits: &RayHits<'_>) -> Met {
        if !self.displacing.is_empty() {
            return self.met_at(ray_hits.hits, &Places::of(ray_hits));
        }
        let mut met = Met::plainly(ray_hits.hits);
        if self.weighs_rays {
            let factors = self.effects.ray_factors(ray_hits);
            for lane in ray_hits.lanes() {
                met.factor[lane] = factors[lane];
            }
        }
        met
    }

    /// The same where it is known what the rays met.
    fn met_at(&self, hits: &Hits, places: &Places) -> Met {
        let mut met = Met::plainly(hits);
        for (lane, place) in places.0.iter().enumerate() {
            let Some((hit, towards)) = place else { continue };
            let moved_m: f64 = (self.displacing.iter())
                .map(|active| active.effect.displacement_m(&active.values, &hit.site))
                .sum();
            met.distance_m[lane] += moved_m / not_grazing(*towards);
            if self.weighs_rays {
                met.factor[lane] = self.effects.ray_factor(hit);
            }
        }
        met
    }

    /// What the rays of a look met, among walls that are this one's.
    pub(crate) fn places_of(&self, look: &Look) -> Places {
        Places::of(&self.ray_hits(&look.rays, &look.hits))
    }

    /// What eight rays add to what their sensors' rays add up to.
    #[inline]
    fn shares(&self, weights: &[f64; LANES], met: &Met, doubt: &Doubt) -> Total {
        match self.machine.beam.combine {
            Combine::Responses => self.responses(weights, met, doubt),
            Combine::Distances => self.shortfalls(weights, met, doubt),
        }
    }

    /// The shares of eight rays in the readings.
    #[inline]
    fn responses(&self, weights: &[f64; LANES], met: &Met, doubt: &Doubt) -> Total {
        let Bends { value, rise, curve } = bends(&self.machine.response, &met.distance_m);
        let InRange { seen, density } = self.in_range(met, &doubt.deviation_m);
        let mut shares = Total::default();
        for lane in 0..LANES {
            let (value, seen, density) = (value[lane], seen[lane], density[lane]);
            let deviation_m = doubt.deviation_m[lane];
            let share = weights[lane] * met.factor[lane];
            let edge = density * deviation_m;
            let spread = seen * (1.0 - seen) - edge * edge;
            let most = share * value;
            shares.edge_variance[lane] = most * most * spread.max(0.0);
            shares.mean[lane] = share * seen * curved(value, curve[lane], deviation_m);
            let rise = share * (seen * rise[lane] - density * value);
            for axis in 0..3 {
                shares.slope[axis][lane] = rise * doubt.slope[axis][lane];
            }
        }
        shares
    }

    /// The shares of eight rays in the shortfall from the range of sensors that average distances.
    fn shortfalls(&self, weights: &[f64; LANES], met: &Met, doubt: &Doubt) -> Total {
        let mut shares = Total::default();
        for lane in 0..LANES {
            let (weight, short_m) = (weights[lane], self.machine.range_m - met.distance_m[lane]);
            if short_m >= -SURE * doubt.deviation_m[lane] {
                shares.mean[lane] = weight * short_m;
                shares.factor[lane] = weight * (met.factor[lane] - 1.0);
                for axis in 0..3 {
                    shares.slope[axis][lane] = -weight * doubt.slope[axis][lane];
                }
            }
        }
        shares
    }

    /// From the mean shortfall of the distances to the response at the mean distance.
    fn respond_to_mean_distance(&self, total: &mut Total) {
        let distance_m = total.mean.map(|short_m| self.machine.range_m - short_m);
        let Bends { value, rise, .. } = bends(&self.machine.response, &distance_m);
        for lane in 0..LANES {
            let factor = if total.mean[lane] > 1e-12 {
                1.0 + total.factor[lane]
            } else {
                0.0
            };
            total.mean[lane] = factor * value[lane];
            for axis in 0..3 {
                total.slope[axis][lane] *= -factor * rise[lane];
            }
        }
    }

    /// Probabilities that uncertain distances are within the range, and their densities there.
    #[inline]
    fn in_range(&self, met: &Met, deviation_m: &[f64; LANES]) -> InRange {
        let short_m = met.distance_m.map(|distance_m| self.machine.range_m - distance_m);
        let mut in_range = InRange {
            seen: short_m.map(|short_m| if short_m >= 0.0 { 1.0 } else { 0.0 }),
            density: [0.0; LANES],
        };
        for lane in 0..LANES {
            if short_m[lane].abs() < SURE * deviation_m[lane] {
                let z = short_m[lane] / deviation_m[lane];
                in_range.seen[lane] = normal_cdf(z);
                in_range.density[lane] = normal_pdf(z) / deviation_m[lane];
            }
        }
        in_range
    }

    /// How distances change with x, y and heading, while the rays stay on their segments; nothing where there is no wall.
    #[inline]
    fn doubt(&self, pose: Pose, covariance: &PoseMatrix, rays: &Rays, hits: &Hits) -> Doubt {
        let walls = &self.geometry.walls;
        let (normal_x, normal_y) = walls.normals(hits.segment);
        let met = hits.distance_m.map(|d| if d < f64::INFINITY { 1.0 } else { 0.0 });
        let distance_m = hits.distance_m.map(|d| if d < f64::INFINITY { d } else { 0.0 });
        let mut doubt = Doubt {
            slope: [[0.0; LANES]; 3],
            deviation_m: [0.0; LANES],
        };
        for lane in 0..LANES {
            let (x, y) = (rays.direction_x[lane], rays.direction_y[lane]);
            let per_m = -met[lane] / not_grazing(normal_x[lane] * x + normal_y[lane] * y);
            let end_x = rays.origin_x[lane] - pose.position.x + x * distance_m[lane];
            let end_y = rays.origin_y[lane] - pose.position.y + y * distance_m[lane];
            doubt.slope[0][lane] = normal_x[lane] * per_m;
            doubt.slope[1][lane] = normal_y[lane] * per_m;
            doubt.slope[2][lane] = (normal_y[lane] * end_x - normal_x[lane] * end_y) * per_m;
        }
        let [of_x, of_y, of_heading] = &doubt.slope;
        for lane in 0..LANES {
            let slope = [of_x[lane], of_y[lane], of_heading[lane]];
            doubt.deviation_m[lane] = quadratic(covariance, slope).max(0.0).sqrt();
        }
        doubt
    }
}

impl Default for Look {
    /// No wall anywhere.
    fn default() -> Self {
        Self {
            deviation_m: [0.0; LANES],
            rays: Rays::new([(track::Vec2::ZERO, track::Vec2::X); LANES]),
            hits: Hits::NONE,
            factor: [1.0; LANES],
            response: [0.0; LANES],
        }
    }
}

impl Look {
    /// Takes a ray among others, as that along its sensor's axis.
    fn take(&mut self, (ray, sensor): (usize, usize), rays: &Rays, hits: &Hits, met: &Met, doubt: &Doubt) {
        self.rays.set(sensor, rays, ray);
        self.hits.distance_m[sensor] = hits.distance_m[ray];
        self.hits.segment[sensor] = hits.segment[ray];
        self.factor[sensor] = met.factor[ray];
        self.deviation_m[sensor] = doubt.deviation_m[ray];
    }

    /// Distance along each sensor's axis, m; infinite where there is no wall.
    pub fn distance_m(&self) -> &[f64; LANES] {
        &self.hits.distance_m
    }

    /// Responses before effects on readings, counts.
    pub(crate) fn response(&self) -> Readings {
        self.response
    }
}

/// A ray that grazes a wall has no useful slope.
#[inline(always)]
fn not_grazing(towards: f64) -> f64 {
    const GRAZING: f64 = 0.05;
    if towards.abs() < GRAZING {
        GRAZING.copysign(towards)
    } else {
        towards
    }
}

/// Expectation of a response that bends, over the distance's uncertainty; where it bends more than a parabola can
/// follow, no more than half of itself.
#[inline(always)]
fn curved(value: f64, bend: f64, deviation_m: f64) -> f64 {
    let most = 0.5 * value.abs();
    value + (0.5 * bend * deviation_m * deviation_m).max(-most).min(most)
}

/// s^T M s.
#[inline(always)]
fn quadratic(m: &PoseMatrix, s: [f64; 3]) -> f64 {
    let row = |i: usize| s[i] * (m[i][0] * s[0] + m[i][1] * s[1] + m[i][2] * s[2]);
    row(0) + row(1) + row(2)
}

/// A response at eight distances; meaningless where one is infinite.
#[inline]
fn bends(response: &Response, distance_m: &[f64; LANES]) -> Bends {
    let value = response.readings(distance_m);
    let mut bends = Bends {
        value,
        rise: [0.0; LANES],
        curve: [0.0; LANES],
    };
    let has_formula = |lane: usize| matches!(response, Response::Improved { .. }) && distance_m[lane] > 0.0;
    if let Response::Improved {
        a_counts, exponent, ..
    } = *response
    {
        for lane in 0..LANES {
            let share = 1.0 - value[lane] / a_counts;
            let rate = exponent / distance_m[lane];
            bends.rise[lane] = -rate * value[lane] * share;
            bends.curve[lane] =
                rate / distance_m[lane] * value[lane] * share * (1.0 + exponent * (2.0 * share - 1.0));
        }
    }
    for lane in (0..LANES).filter(|&lane| !has_formula(lane)) {
        const H_M: f64 = 1e-4;
        let [low, high] = [-H_M, H_M].map(|h| response.reading((distance_m[lane] + h).max(0.0)));
        (bends.rise[lane], bends.curve[lane]) = ((high - low) / (2.0 * H_M), 0.0);
    }
    bends
}

fn normal_pdf(z: f64) -> f64 {
    (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt()
}

/// The normal distribution function by Zelen and Severo's formula 26.2.17 (Abramowitz and Stegun), within 7.5e-8.
fn normal_cdf(z: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.231_641_9 * z.abs());
    let tail = t
        * (0.319_381_530
            + t * (-0.356_563_782 + t * (1.781_477_937 + t * (-1.821_255_978 + t * 1.330_274_429))));
    let upper = normal_pdf(z) * tail;
    if z >= 0.0 { 1.0 - upper } else { upper }
}

#[cfg(test)]
mod tests {
    use super::Apparatus;
    use crate::effects::testing::{scene, silent, steps, with};
    use crate::{Beam, Combine, Forecast, Model, Setting};

    fn seeing(model: &Model, rays: usize, combine: Combine) -> Model {
        let mut model = model.clone();
        model.machine.beam = Beam::cone(rays, 0.2, combine).unwrap();
        model
    }

    #[test]
    fn at_a_pose_that_is_known_a_robot_without_noise_reads_what_is_expected() {
        let plain = silent();
        let models = [
            with(&plain, "outer-wall-reflectance", &[0.7]),
            with(&plain, "incidence-falloff", &[0.8]),
            plain,
        ];
        for (model, rays) in models.iter().flat_map(|model| [(model, 1), (model, 5)]) {
            for combine in [Combine::Responses, Combine::Distances] {
                let model = seeing(model, rays, combine);
                let world = scene().world(&model, 0).unwrap();
                let mut forecast = Forecast::new(&world).unwrap();
                let mut seen = 0;
                for (pose, step) in steps(&model, 0, 3, 400) {
                    let expected = forecast.readings(pose, &[[0.0; 3]; 3]).mean;
                    for (expected, read) in expected.iter().zip(step.readings) {
                        let read_too = expected.min(model.machine.full_scale_counts);
                        assert!(
                            (read_too - read).abs() < 1e-9 * (1.0 + read),
                            "{combine:?} {rays}: {read_too} {read}"
                        );
                        seen += usize::from(read > 0.0);
                    }
                }
                assert!(seen > 1000);
            }
        }
    }

    #[test]
    fn rays_by_sensors_tell_what_they_tell_one_by_one() {
        let known = [[4e-6, 1e-6, 0.0], [1e-6, 4e-6, 0.0], [0.0, 0.0, 1e-3]];
        let models = [silent(), with(&silent(), "outer-wall-reflectance", &[0.7])];
        let beside = Setting::constant(crate::find("sensor-rotation").unwrap(), [0.1]);
        for (model, rays) in models
            .iter()
            .flat_map(|model| [5, 7, 10, 21].map(|rays| (model, rays)))
        {
            for combine in [Combine::Responses, Combine::Distances] {
                let model = seeing(model, rays, combine);
                let world = scene().world(&model, 0).unwrap();
                for further in [None, Some(beside.clone())] {
                    let further = further.as_slice();
                    let by_sensors = Apparatus::new(&world, further).unwrap();
                    let mut by_rays = Apparatus::new(&world, further).unwrap();
                    assert!(by_rays.cones.take().is_some());
                    for (pose, _) in steps(&model, 0, 5, 200) {
                        let [one, other] =
                            [&by_sensors, &by_rays].map(|apparatus| apparatus.outlook(pose, &known));
                        assert_eq!(
                            (one.mean, one.slope, one.edge_variance),
                            (other.mean, other.slope, other.edge_variance)
                        );
                        assert_eq!(one.look.distance_m(), other.look.distance_m());
                        assert_eq!(one.look.deviation_m, other.look.deviation_m);
                        let met = [&one, &other].map(|outlook| by_rays.responses_again(&outlook.look));
                        assert_eq!(met[0], met[1]);
                    }
                }
            }
        }
    }

    #[test]
    fn expected_readings_change_with_the_pose_as_their_slopes_say() {
        const H: f64 = 1e-7;
        let model = with(&silent(), "inner-wall-reflectance", &[0.8]);
        for (rays, combine) in [
            (1, Combine::Responses),
            (5, Combine::Responses),
            (5, Combine::Distances),
        ] {
            let model = seeing(&model, rays, combine);
            let world = scene().world(&model, 0).unwrap();
            let mut forecast = Forecast::new(&world).unwrap();
            let mut readings = |pose| forecast.readings(pose, &[[0.0; 3]; 3]);
            let (mut told, mut kinks) = (0, 0);
            for (pose, _) in steps(&model, 0, 4, 400).into_iter().step_by(7) {
                let here = readings(pose);
                let mut ahead = pose;
                ahead.position.x += H;
                let there = readings(ahead).mean;
                for lane in 0..8 {
                    let change = (there[lane] - here.mean[lane]) / H;
                    // A ray that leaves its segment in between, or the range, jumps.
                    let close = (change - here.slope[lane][0]).abs() < 1e-3 * (1.0 + change.abs());
                    told += usize::from(close && change != 0.0);
                    kinks += usize::from(!close);
                }
            }
            assert!(told > 100 && kinks * 50 < told, "{told} {kinks}");
        }
    }
}
