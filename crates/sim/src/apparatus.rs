//! What one run drives with as its effects make it: the machine, its rays, its walls.

use std::sync::Arc;

use track::Vec2;

use crate::cast::{Hits, Rays};
use crate::cones::Cones;
use crate::effects::{Active, Chain, Hook, RayHits, Stage};
use crate::world::{Geometry, World, altered};
use crate::{Error, Machine, Pose, Readings, Setting};

/// The rays that one ray of the beam makes on all eight sensors, in the body frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    pub(crate) rays: Rays,
    pub(crate) weight: f64,
}

/// A run's machine, rays, walls and effects at one time.
#[derive(Debug)]
pub(crate) struct Apparatus<'w> {
    pub(crate) world: &'w World<'w>,
    pub(crate) effects: Chain,
    pub(crate) machine: Machine,
    pub(crate) sights: Vec<Sight>,
    /// Most of the same rays by sensors, where these have many and hold still among walls that do.
    pub(crate) cones: Option<Arc<Cones>>,
    pub(crate) geometry: Arc<Geometry>,
    /// Whether an effect must be asked for every ray.
    pub(crate) weighs_rays: bool,
    /// Effects whose displacement of the walls is not in the geometry.
    pub(crate) displacing: Vec<Active>,
    /// Those whose displacement is.
    cutting: Vec<Active>,
    /// Whether any value changes in time, and whether one that the machine is made of does.
    drifting: bool,
    remade: bool,
    steps: u64,
}

impl<'w> Apparatus<'w> {
    /// A world's at the start of its run, with further effects, which leave its walls where they are.
    pub(crate) fn new(world: &'w World<'w>, further: &[Setting]) -> Result<Self, Error> {
        let own = &world.model.effects;
        let settings: Vec<Setting> = own.iter().chain(further).cloned().collect();
        let effects = Chain::new(&settings, world.run)?;
        let all = effects.all();
        let machine = altered(&world.model.machine, all);
        let mut apparatus = Self {
            world,
            geometry: Arc::clone(&world.geometry),
            sights: sights(&machine),
            cones: None,
            displacing: on_walls(further, world.run)?,
            cutting: on_walls(own, world.run)?,
            drifting: all.iter().any(Active::drifts),
            remade: (all.iter()).any(|active| active.drifts() && active.effect.on_machine().is_some()),
            machine,
            weighs_rays: effects.has(Hook::RayFactors),
            effects,
            steps: 0,
        };
        if !apparatus.moves() {
            apparatus.cones = apparatus.rays_by_sensors();
        }
        Ok(apparatus)
    }

    /// The rays of sensors by sensors, where these have many.
    fn rays_by_sensors(&self) -> Option<Arc<Cones>> {
        let (own, worlds) = (&self.machine, &self.world.machine);
        if own.beam == worlds.beam && own.mounts == worlds.mounts {
            return self.world.cones.clone();
        }
        self.world.scene.cones(own, &self.geometry)
    }

    /// Whether walls or sensors may move in time.
    pub(crate) fn moves(&self) -> bool {
        self.remade || self.walls_drift()
    }

    fn walls_drift(&self) -> bool {
        self.cutting.iter().any(Active::drifts)
    }

    /// Goes to the next control step, which begins at `time_s` since the run began.
    #[inline]
    pub(crate) fn advance(&mut self, time_s: f64) {
        if self.drifting {
            self.drift(time_s);
        }
    }

    fn drift(&mut self, time_s: f64) {
        for active in (self.effects.all_mut().iter_mut()).chain(&mut self.displacing) {
            active.advance(time_s);
        }
        if self.remade {
            let machine = altered(&self.world.model.machine, self.effects.all());
            if machine.beam != self.machine.beam || machine.mounts != self.machine.mounts {
                self.sights = sights(&machine);
            }
            self.machine = machine;
        }
        // Walls are cut anew only a few times in a lap: they move by micrometres in that time.
        const STEPS_BETWEEN_CUTS: u64 = 64;
        if self.steps.is_multiple_of(STEPS_BETWEEN_CUTS) {
            self.cut(time_s);
        }
        self.steps += 1;
    }

    /// Brings the walls up to date, where they move or rays go farther than they were prepared for.
    fn cut(&mut self, time_s: f64) {
        if self.walls_drift() || self.machine.range_m > self.geometry.range_m {
            self.cutting.iter_mut().for_each(|active| active.advance(time_s));
            let scene = self.world.scene;
            self.geometry = scene.geometry_from(&self.geometry, &self.cutting, &self.machine);
        }
    }

    /// The rays of a sight from a pose and what they hit.
    #[inline]
    pub(crate) fn cast(&self, pose: Pose, sight: &Sight) -> (Rays, Hits) {
        let rays = sight.rays.placed(pose);
        let Geometry { caster, walls, .. } = &*self.geometry;
        let hits = caster.cast(walls, pose.position, &rays);
        (rays, hits)
    }

    /// Most rays of sensors that have many, pack by pack, as long as nothing but their distances matters.
    #[inline]
    pub(crate) fn cones_of_distances(&self) -> Option<&Cones> {
        self.cones.as_deref().filter(|_| !self.weighs_rays)
    }

    /// What the effects make of the responses of the rays; anything of one that met no wall.
    #[inline]
    pub(crate) fn ray_factors(&self, rays: &Rays, hits: &Hits) -> Readings {
        self.effects.ray_factors(&self.ray_hits(rays, hits))
    }

    /// What rays met, as effects see it.
    #[inline]
    pub(crate) fn ray_hits<'a>(&'a self, rays: &'a Rays, hits: &'a Hits) -> RayHits<'a> {
        RayHits {
            scene: self.world.scene,
            walls: &self.geometry.walls,
            rays,
            hits,
            of_one: None,
        }
    }
}

/// The effects of one run that may move walls.
fn on_walls(settings: &[Setting], run: usize) -> Result<Vec<Active>, Error> {
    let walls = settings
        .iter()
        .filter(|setting| setting.spec.stage == Stage::World);
    Active::all(&walls.cloned().collect::<Vec<_>>(), run)
}

/// The beam of all sensors, ray by ray.
fn sights(machine: &Machine) -> Vec<Sight> {
    let axes = machine.mounts.map(|mount| mount.axis());
    let sight = |&(turn, weight): &(Vec2, f64)| Sight {
        rays: Rays::new(std::array::from_fn(|i| {
            (machine.mounts[i].position, axes[i].rotate(turn))
        })),
        weight,
    };
    machine.beam.rays().iter().map(sight).collect()
}
