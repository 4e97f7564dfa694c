//! Effects on single rays: how far, how wide and what they meet.

use super::plain::OnMachine;
use super::world::{WALLS, gaussian, is_wall};
use super::{Effect, Hit, Hook, Param, RayHits, Site, Spec, Stage};
use crate::cast::LANES;
use crate::sensor::power;
use crate::{Beam, Combine, Readings};
use track::Side;

/// Rays of a cone with fewer declared.
const CONE_RAYS: usize = 7;

/// A cone of view instead of the declared beam.
pub(super) const CONE_OF_VIEW: Spec = Spec {
    name: "cone-of-view",
    stage: Stage::Sense,
    summary: "each sensor sees a cone: the mean response over it, weighted towards the axis",
    params: &[Param::new("half_angle_rad", "rad", 0.0, 0.0, 1.5)],
    list: None,
    build: || {
        Box::new(OnMachine(|values, machine| {
            let count = machine.beam.rays().len().max(CONE_RAYS);
            if values[0] > 0.0 {
                machine.beam = Beam::cone(count, values[0], Combine::Responses)
                    .expect("the count is above 0 and the parameter's range is inside the cone's");
            }
        }))
    },
};

/// The response taken at a multiple of the distance.
pub(super) const DISTANCE_SCALE: Spec = Spec {
    name: "distance-scale",
    stage: Stage::Sense,
    summary: "the response is taken at scale times the distance",
    params: &[Param::new("scale", "", 1.0, 0.2, 5.0)],
    list: None,
    build: || {
        Box::new(OnMachine(|values, machine| {
            machine.response = machine.response.at_scaled_distance(values[0]);
        }))
    },
};

/// The response's exponent times a factor; a table of distances and readings has none.
pub(super) const RESPONSE_EXPONENT: Spec = Spec {
    name: "response-exponent",
    stage: Stage::Sense,
    summary: "the exponent of the improved response times scale; the original response has none",
    params: &[Param::new("scale", "", 1.0, 0.2, 5.0)],
    list: None,
    build: || {
        Box::new(OnMachine(|values, machine| {
            machine.response = machine.response.with_scaled_exponent(values[0]);
        }))
    },
};

/// All sensors turned on the spot.
pub(super) const SENSOR_ROTATION: Spec = Spec {
    name: "sensor-rotation",
    stage: Stage::Sense,
    summary: "all ray directions turned, counter-clockwise positive; the sensors' places stay",
    params: &[Param::new("angle_rad", "rad", 0.0, -1.5, 1.5)],
    list: None,
    build: || {
        Box::new(OnMachine(|values, machine| {
            for mount in &mut machine.mounts {
                mount.angle_rad += values[0];
            }
        }))
    },
};

/// How far the sensors see; the limit is on the true distance.
pub(super) const SENSOR_REACH: Spec = Spec {
    name: "sensor-reach",
    stage: Stage::Sense,
    summary: "the distance beyond which a wall is not seen, as a fraction of the declared range",
    params: &[Param::new("fraction", "", 1.0, 0.05, 3.0)],
    list: None,
    build: || Box::new(OnMachine(|values, machine| machine.range_m *= values[0])),
};

/// Lambert's law to a power: a wall seen at an angle sends back less.
pub(super) const INCIDENCE_FALLOFF: Spec = Spec {
    name: "incidence-falloff",
    stage: Stage::Sense,
    summary: "each ray's response times |cos(angle between ray and wall normal)|^exponent",
    params: &[Param::new("exponent", "", 0.0, 0.0, 10.0)],
    list: None,
    build: || Box::new(IncidenceFalloff),
};

#[derive(Debug)]
struct IncidenceFalloff;

impl Effect for IncidenceFalloff {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::RayFactors]
    }
    fn ray_factor(&self, values: &[f64], hit: &Hit) -> f64 {
        power(hit.cos_incidence, values[0])
    }
    fn ray_factors(&self, values: &[f64], hits: &RayHits<'_>, factors: &mut Readings) {
        let exponent = values[0];
        let own = hits.cos_incidence().map(|cos| power(cos, exponent));
        for lane in 0..LANES {
            factors[lane] *= own[lane];
        }
    }
}

/// A factor on the response of rays that hit one of the walls.
#[derive(Debug)]
struct WallReflectance(Side);

impl WallReflectance {
    fn factor(&self, values: &[f64], side: Side) -> f64 {
        if side == self.0 { values[0] } else { 1.0 }
    }
}

impl Effect for WallReflectance {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::RayFactors]
    }
    fn ray_factor(&self, values: &[f64], hit: &Hit) -> f64 {
        self.factor(values, hit.site.place.side)
    }
    fn ray_factors(&self, values: &[f64], hits: &RayHits<'_>, factors: &mut Readings) {
        for lane in hits.lanes() {
            factors[lane] *= self.factor(values, hits.side(lane));
        }
    }
}

/// The response of rays that hit the outer wall.
pub(super) const OUTER_WALL_REFLECTANCE: Spec = Spec {
    name: "outer-wall-reflectance",
    stage: Stage::World,
    summary: "the response of rays that hit the outer wall times factor",
    params: &[Param::new("factor", "", 1.0, 0.0, 10.0)],
    list: None,
    build: || Box::new(WallReflectance(Side::Outer)),
};

/// The response of rays that hit the inner wall.
pub(super) const INNER_WALL_REFLECTANCE: Spec = Spec {
    name: "inner-wall-reflectance",
    stage: Stage::World,
    summary: "the response of rays that hit the inner wall times factor",
    params: &[Param::new("factor", "", 1.0, 0.0, 10.0)],
    list: None,
    build: || Box::new(WallReflectance(Side::Inner)),
};

/// A bright or dark place on a wall: 1 + (factor - 1) times a Gaussian in arc length.
pub(super) const REFLECTANCE_PATCH: Spec = Spec {
    name: "reflectance-patch",
    stage: Stage::World,
    summary: "the response of rays that hit a wall about one place times factor, Gaussian in arc length",
    params: &[
        WALLS,
        Param::place("position", "fraction of the wall", 0.0, 1.0),
        Param::place("length_m", "m", 0.005, 2.0),
        Param::new("factor", "", 1.0, 0.0, 10.0),
    ],
    list: None,
    build: || Box::new(ReflectancePatch),
};

#[derive(Debug)]
struct ReflectancePatch;

impl ReflectancePatch {
    fn factor(values: &[f64], site: &Site) -> f64 {
        /// Deviations beyond which ten times the bell is nothing beside 1.
        const REACH: f64 = 9.0;
        let [position, length_m, factor] = [1, 2, 3].map(|i| values[i]);
        let arc_m = site.arc_m(position);
        if arc_m > REACH * length_m {
            return 1.0;
        }
        1.0 + (factor - 1.0) * gaussian(arc_m, length_m)
    }
}

impl Effect for ReflectancePatch {
    fn hooks(&self) -> &'static [Hook] {
        &[Hook::RayFactors]
    }
    fn ray_factor(&self, values: &[f64], hit: &Hit) -> f64 {
        if is_wall(values[0], hit.site.place.side) {
            Self::factor(values, &hit.site)
        } else {
            1.0
        }
    }
    fn ray_factors(&self, values: &[f64], hits: &RayHits<'_>, factors: &mut Readings) {
        for lane in hits.lanes() {
            if is_wall(values[0], hits.side(lane)) {
                factors[lane] *= Self::factor(values, &hits.site(lane));
            }
        }
    }
}
