//! What the sensors should read at a pose that is known up to a covariance.

use crate::apparatus::Apparatus;
use crate::cast::{Hits, LANES, Rays};
use crate::effects::Hit;
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
    /// Distance, m; infinite where there is no wall.
    pub distance_m: [f64; LANES],
    /// Standard deviation of that distance, m.
    pub deviation_m: [f64; LANES],
    rays: Rays,
    hits: Hits,
    /// What effects made of the rays' responses.
    factor: [f64; LANES],
    /// Responses before effects on readings, counts.
    response: Readings,
}

/// Where the rays of a look met walls: what all forecasts of one world that see this look need of it.
#[derive(Debug)]
pub struct Places([Option<(Hit, f64)>; LANES]);

/// One ray of one sensor: its distance, how that changes with the pose, its standard deviation, and what effects make
/// of its response.
#[derive(Clone, Copy)]
struct Glance {
    distance_m: f64,
    slope: [f64; 3],
    deviation_m: f64,
    factor: f64,
    bend: Bend,
}

/// Distances along eight rays, m, and what effects make of their responses.
struct Met {
    distance_m: [f64; LANES],
    factor: [f64; LANES],
}

impl Met {
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

/// A response at a distance, its derivative (counts/m) and its second derivative (counts/m^2).
#[derive(Clone, Copy)]
struct Bend {
    value: f64,
    rise: f64,
    curve: f64,
}

impl Apparatus<'_> {
    /// The responses of all sensors, before effects on readings.
    pub(crate) fn outlook(&self, pose: Pose, covariance: &PoseMatrix) -> Outlook {
        let mut outlook = Outlook {
            mean: [0.0; LANES],
            slope: [[0.0; 3]; LANES],
            edge_variance: [0.0; LANES],
            look: Look {
                distance_m: [f64::INFINITY; LANES],
                deviation_m: [0.0; LANES],
                rays: self.sights[0].rays.placed(pose),
                hits: Hits::NONE,
                factor: [1.0; LANES],
                response: [0.0; LANES],
            },
        };
        let middle = self.sights.len() / 2;
        for (number, sight) in self.sights.iter().enumerate() {
            let (rays, hits) = self.cast(pose, sight);
            let met = self.met(&rays, &hits);
            if number == middle {
                (outlook.look.rays, outlook.look.hits) = (rays, hits);
                (outlook.look.distance_m, outlook.look.factor) = (hits.distance_m, met.factor);
            }
            let bends = bends(&self.machine.response, &met.distance_m);
            for lane in (0..LANES).filter(|&lane| hits.distance_m[lane].is_finite()) {
                let slope = self.distance_slope(pose, &rays, &hits, lane);
                let deviation_m = quadratic(covariance, slope).max(0.0).sqrt();
                if number == middle {
                    outlook.look.deviation_m[lane] = deviation_m;
                }
                let glance = Glance {
                    distance_m: met.distance_m[lane],
                    slope,
                    deviation_m,
                    factor: met.factor[lane],
                    bend: bends[lane],
                };
                self.add_ray(&mut outlook, lane, sight.weight, glance);
            }
        }
        if self.machine.beam.combine == Combine::Distances {
            self.respond_to_mean_distance(&mut outlook);
        }
        outlook.look.response = outlook.mean;
        outlook
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
        self.responses_to(&self.met(&look.rays, &look.hits), look)
    }

    fn responses_to(&self, met: &Met, look: &Look) -> Readings {
        let bends = bends(&self.machine.response, &met.distance_m);
        std::array::from_fn(|lane| {
            if !look.hits.distance_m[lane].is_finite() {
                return 0.0;
            }
            let (deviation_m, short_m) = (
                look.deviation_m[lane],
                self.machine.range_m - met.distance_m[lane],
            );
            let Bend { value, curve, .. } = bends[lane];
            met.factor[lane] * curved(value, curve, deviation_m) * seen_within(short_m, deviation_m).0
        })
    }

    /// What the rays met after what displaces the walls to first order.
    #[inline]
    fn met(&self, rays: &Rays, hits: &Hits) -> Met {
        if self.weighs_rays || !self.displacing.is_empty() {
            return self.met_at(hits, &self.places(rays, hits));
        }
        Met {
            distance_m: hits.distance_m,
            factor: [1.0; LANES],
        }
    }

    /// The same where it is known what the rays met.
    fn met_at(&self, hits: &Hits, places: &Places) -> Met {
        let mut met = Met {
            distance_m: hits.distance_m,
            factor: [1.0; LANES],
        };
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

    fn places(&self, rays: &Rays, hits: &Hits) -> Places {
        Places(std::array::from_fn(|lane| {
            hits.distance_m[lane]
                .is_finite()
                .then(|| self.hit(rays, hits, lane))
        }))
    }

    /// What the rays of a look met, among walls that are this one's.
    pub(crate) fn places_of(&self, look: &Look) -> Places {
        self.places(&look.rays, &look.hits)
    }

    /// Adds one ray's share: of the reading, or of the shortfall from the range where a sensor averages distances.
    #[inline]
    fn add_ray(&self, outlook: &mut Outlook, lane: usize, weight: f64, glance: Glance) {
        let Glance {
            distance_m,
            slope,
            deviation_m,
            factor,
            bend,
        } = glance;
        let short_m = self.machine.range_m - distance_m;
        if short_m < -4.0 * deviation_m {
            return;
        }
        if self.machine.beam.combine == Combine::Distances {
            outlook.mean[lane] += weight * short_m;
            (0..3).for_each(|axis| outlook.slope[lane][axis] -= weight * slope[axis]);
            return;
        }
        let Bend { value, rise, curve } = bend;
        let (seen, edge) = seen_within(short_m, deviation_m);
        let spread = seen * (1.0 - seen) - (edge * deviation_m).powi(2);
        outlook.edge_variance[lane] += (weight * factor * value).powi(2) * spread.max(0.0);
        outlook.mean[lane] += weight * factor * seen * curved(value, curve, deviation_m);
        for axis in 0..3 {
            outlook.slope[lane][axis] += weight * factor * (seen * rise - edge * value) * slope[axis];
        }
    }

    /// From the mean shortfall of the distances to the response at the mean distance.
    fn respond_to_mean_distance(&self, outlook: &mut Outlook) {
        for lane in 0..LANES {
            let short_m = outlook.mean[lane];
            let Bend { value, rise, .. } = bend(&self.machine.response, self.machine.range_m - short_m);
            let seen = if short_m > 1e-12 { 1.0 } else { 0.0 };
            outlook.mean[lane] = seen * value;
            outlook.slope[lane] = outlook.slope[lane].map(|slope| -seen * rise * slope);
        }
    }

    /// Change of a ray's distance with x, y and heading, while it stays on its segment.
    #[inline]
    fn distance_slope(&self, pose: Pose, rays: &Rays, hits: &Hits, lane: usize) -> [f64; 3] {
        let direction = rays.direction(lane);
        let normal = self.geometry.walls.normal(hits.segment[lane] as usize);
        let towards = not_grazing(normal.dot(direction));
        let swept = (rays.origin(lane) - pose.position).perp() + direction.perp() * hits.distance_m[lane];
        [
            -normal.x / towards,
            -normal.y / towards,
            -normal.dot(swept) / towards,
        ]
    }
}

impl Default for Look {
    /// No wall anywhere.
    fn default() -> Self {
        let rays = Rays::new([(track::Vec2::ZERO, track::Vec2::X); LANES]);
        let distance_m = [f64::INFINITY; LANES];
        Self {
            distance_m,
            deviation_m: [0.0; LANES],
            rays,
            hits: Hits::NONE,
            factor: [1.0; LANES],
            response: [0.0; LANES],
        }
    }
}

impl Look {
    /// Responses before effects on readings, counts.
    pub(crate) fn response(&self) -> Readings {
        self.response
    }
}

/// A ray that grazes a wall has no useful slope.
#[inline]
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
#[inline]
fn curved(value: f64, bend: f64, deviation_m: f64) -> f64 {
    let most = 0.5 * value.abs();
    value + (0.5 * bend * deviation_m * deviation_m).clamp(-most, most)
}

/// Probability that an uncertain distance is within the range, and its density there (1/m).
#[inline]
fn seen_within(short_m: f64, deviation_m: f64) -> (f64, f64) {
    if short_m.abs() >= 4.0 * deviation_m {
        return (if short_m >= 0.0 { 1.0 } else { 0.0 }, 0.0);
    }
    let z = short_m / deviation_m;
    (normal_cdf(z), normal_pdf(z) / deviation_m)
}

/// s^T M s.
#[inline]
fn quadratic(m: &PoseMatrix, s: [f64; 3]) -> f64 {
    (0..3)
        .map(|i| s[i] * (m[i][0] * s[0] + m[i][1] * s[1] + m[i][2] * s[2]))
        .sum()
}

/// A response at eight distances, computed together; meaningless where a distance is infinite.
#[inline]
fn bends(response: &Response, distance_m: &[f64; LANES]) -> [Bend; LANES] {
    let values = response.readings(distance_m);
    std::array::from_fn(|lane| bend_at(response, distance_m[lane], values[lane]))
}

#[inline]
fn bend(response: &Response, distance_m: f64) -> Bend {
    bend_at(response, distance_m, response.reading(distance_m))
}

/// A response at a distance where it has this value.
#[inline(always)]
fn bend_at(response: &Response, distance_m: f64, value: f64) -> Bend {
    match *response {
        Response::Improved {
            a_counts, exponent, ..
        } if distance_m > 0.0 => {
            let share = 1.0 - value / a_counts;
            let rate = exponent / distance_m;
            Bend {
                value,
                rise: -rate * value * share,
                curve: rate / distance_m * value * share * (1.0 + exponent * (2.0 * share - 1.0)),
            }
        }
        _ => {
            const H_M: f64 = 1e-4;
            let [low, high] = [-H_M, H_M].map(|h| response.reading((distance_m + h).max(0.0)));
            Bend {
                value,
                rise: (high - low) / (2.0 * H_M),
                curve: 0.0,
            }
        }
    }
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
