//! What never changes while a robot drives: threads share it.

use std::sync::Arc;

use track::{Chain, Course, Direction, Gates, Side, Vec2, Vertex, Way};

use crate::cast::{Caster, CasterKind, Cells};
use crate::cones::Cones;
use crate::effects::{Active, Site};
use crate::{Error, Machine, Model, ReadingNoise, RunRules, WallPlace, WallRules, Walls};

/// A course with its gates.
#[derive(Debug, Clone)]
pub struct Circuit {
    /// The walls.
    pub course: Course,
    /// Where laps are sampled.
    pub gates: Gates,
}

impl Circuit {
    /// The course with `count` gates across it.
    ///
    /// # Errors
    /// Gates that cross each other, or too few.
    pub fn new(course: Course, count: usize) -> Result<Self, Error> {
        let gates = course.gates(count)?;
        Ok(Self { course, gates })
    }

    /// The middle of the arena, m.
    pub fn middle(&self) -> Vec2 {
        let [width_m, height_m] = self.course.arena_m;
        Vec2::new(0.5 * width_m, 0.5 * height_m)
    }
}

/// Walls cut into pieces, and what is prepared for casting rays at them and for touching them.
#[derive(Debug)]
pub(crate) struct Geometry {
    pub(crate) walls: Walls,
    pub(crate) caster: Caster,
    pub(crate) contact: Cells,
    /// How far the rays go, m.
    pub(crate) range_m: f64,
    /// The walls that the caster and the cells were made for, where they have room for walls that moved.
    made_for: Option<Arc<Walls>>,
}

/// How far walls that drift, and the range, may go before casters are made anew, m.
const ROOM_M: f64 = 0.002;

impl Geometry {
    fn new(walls: Walls, kind: Option<CasterKind>, machine: &Machine) -> Self {
        Self::with_room(walls, kind, machine, 0.0)
    }

    fn with_room(walls: Walls, kind: Option<CasterKind>, machine: &Machine, room_m: f64) -> Self {
        let spread_m = machine
            .mounts
            .iter()
            .map(|mount| mount.position.length())
            .fold(0.0, f64::max);
        let range_m = machine.range_m + room_m;
        let caster = Caster::new(kind, &walls, range_m, spread_m + room_m + 1e-9);
        let contact = Cells::new(&walls, machine.robot.body_radius_m + room_m);
        Self {
            made_for: (room_m > 0.0).then(|| Arc::new(walls.clone())),
            walls,
            caster,
            contact,
            range_m,
        }
    }

    /// The same with walls that moved within its room; `None` where they or the range went farther.
    fn moved(&self, walls: &Walls, machine: &Machine) -> Option<Self> {
        let made_for = self.made_for.as_ref()?;
        if machine.range_m > self.range_m || walls.farthest_moved_m(made_for) > ROOM_M {
            return None;
        }
        Some(Self {
            walls: walls.clone(),
            caster: self.caster.over(walls)?,
            contact: self.contact.clone(),
            range_m: self.range_m,
            made_for: self.made_for.clone(),
        })
    }
}

/// A circuit whose walls are cut: made once, and the ground for every variant of a model.
#[derive(Debug, Clone)]
pub struct Scene {
    circuit: Arc<Circuit>,
    rules: WallRules,
    kind: Option<CasterKind>,
    outer: Chain,
    inner: Chain,
    body_radius_m: f64,
    declared: Arc<Geometry>,
}

impl Scene {
    /// Cuts the circuit's walls as the model says. `caster` forces a way of casting rays.
    ///
    /// # Errors
    /// A model out of range, walls that cannot be cut, a corridor too narrow for the robot.
    pub fn new(circuit: Arc<Circuit>, model: &Model, caster: Option<CasterKind>) -> Result<Self, Error> {
        model.check()?;
        model.check_fits(&circuit.course)?;
        let outer = circuit.course.outer.flatten(model.wall.max_error_m)?;
        let inner = circuit.course.inner.flatten(model.wall.max_error_m)?;
        let walls = Walls::new(&outer, &inner, model.wall.thickness_m);
        let declared = Arc::new(Geometry::new(walls, caster, &model.machine));
        Ok(Self {
            circuit,
            rules: model.wall,
            kind: caster,
            outer,
            inner,
            body_radius_m: model.machine.robot.body_radius_m,
            declared,
        })
    }

    /// The scene with its walls cut at other corners, for sensors that see as far as the model's.
    pub fn recut(&self, model: &Model, outer: Chain, inner: Chain) -> Self {
        let walls = Walls::new(&outer, &inner, self.rules.thickness_m);
        let declared = Arc::new(Geometry::new(walls, self.kind, &model.machine));
        Self {
            outer,
            inner,
            declared,
            ..self.clone()
        }
    }

    /// The corners at which the walls are cut: the outer wall's and the inner wall's.
    pub fn chains(&self) -> [&Chain; 2] {
        [&self.outer, &self.inner]
    }

    /// The course and its gates.
    pub fn circuit(&self) -> &Circuit {
        &self.circuit
    }

    /// The straight pieces without effects.
    pub fn walls(&self) -> &Walls {
        &self.declared.walls
    }

    /// The way rays are cast here.
    pub fn caster(&self) -> &Caster {
        &self.declared.caster
    }

    /// What run number `run` of a model drives in. The model must have the wall rules that the scene was made for.
    ///
    /// # Errors
    /// A model out of range, other wall rules, an effect without values for this run.
    pub fn world(&self, model: &Model, run: usize) -> Result<World<'_>, Error> {
        model.check()?;
        if model.wall != self.rules || model.machine.robot.body_radius_m > self.body_radius_m {
            return Err(Error::Invalid {
                key: "wall".into(),
                reason: "differs from the walls that the scene was cut for".into(),
            });
        }
        let effects = Active::all(&model.effects, run)?;
        let machine = altered(&model.machine, &effects);
        let geometry = self.geometry(&effects, &machine);
        Ok(World {
            scene: self,
            cones: self.cones(&machine, &geometry),
            model: model.clone(),
            run,
            machine,
            geometry,
        })
    }

    /// The rays of a machine's sensors by sensors, where these have many.
    pub(crate) fn cones(&self, machine: &Machine, geometry: &Geometry) -> Option<Arc<Cones>> {
        Cones::new(machine, geometry, self.kind).map(Arc::new)
    }

    /// The walls as the effects move them.
    pub(crate) fn geometry(&self, effects: &[Active], machine: &Machine) -> Arc<Geometry> {
        match self.walls_moved(effects, machine) {
            Some(walls) => Arc::new(Geometry::new(walls, self.kind, machine)),
            None => Arc::clone(&self.declared),
        }
    }

    /// The walls as effects that drift move them now, from what they were a while before.
    pub(crate) fn geometry_from(
        &self,
        before: &Geometry,
        effects: &[Active],
        machine: &Machine,
    ) -> Arc<Geometry> {
        let Some(walls) = self.walls_moved(effects, machine) else {
            return Arc::clone(&self.declared);
        };
        let moved = before.moved(&walls, machine);
        Arc::new(moved.unwrap_or_else(|| Geometry::with_room(walls, self.kind, machine, ROOM_M)))
    }

    /// The walls where effects move them; `None` where the declared geometry does.
    fn walls_moved(&self, effects: &[Active], machine: &Machine) -> Option<Walls> {
        let outer = self.moved(Side::Outer, effects);
        let inner = self.moved(Side::Inner, effects);
        if outer.is_none() && inner.is_none() && machine.range_m <= self.declared.range_m {
            return None;
        }
        let (outer, inner) = (
            outer.as_ref().unwrap_or(&self.outer),
            inner.as_ref().unwrap_or(&self.inner),
        );
        Some(Walls::new(outer, inner, self.rules.thickness_m))
    }

    /// What there is to know of a place on a wall.
    pub(crate) fn site(&self, place: WallPlace) -> Site {
        let course = &self.circuit.course;
        let outside_is_left = (course.direction == Direction::Clockwise) == (place.side == Side::Outer);
        Site {
            place,
            wall_length_m: course.wall(place.side).length_m(),
            outward: if outside_is_left { 1.0 } else { -1.0 },
        }
    }

    /// One wall's chain with its vertices moved, or `None` where nothing moves it.
    fn moved(&self, side: Side, effects: &[Active]) -> Option<Chain> {
        let wall = self.circuit.course.wall(side);
        let site = |vertex: &Vertex| {
            self.site(WallPlace {
                side,
                fraction: vertex.fraction,
            })
        };
        let displacement_m = |vertex: &Vertex| -> f64 {
            let at = site(vertex);
            effects
                .iter()
                .map(|active| active.effect.displacement_m(&active.values, &at))
                .sum()
        };
        let divides = |a: &Vertex, b: &Vertex| {
            let (from, to) = (site(a), site(b));
            effects
                .iter()
                .any(|active| active.effect.divides(&active.values, &from, &to))
        };
        let chain = if side == Side::Outer {
            &self.outer
        } else {
            &self.inner
        };
        let mut vertices = Vec::with_capacity(chain.vertices.len());
        for (a, b) in chain.segments() {
            vertices.push(*a);
            if divides(a, b) {
                let span = (b.fraction - a.fraction).rem_euclid(1.0);
                vertices.extend((1..PARTS).map(|i| {
                    let share = f64::from(i) / f64::from(PARTS);
                    let fraction = (a.fraction + share * span).rem_euclid(1.0);
                    let position = a.position.lerp(b.position, share);
                    Vertex {
                        position,
                        left_normal: wall.left_normal(fraction),
                        fraction,
                    }
                }));
            }
        }
        let moves: Vec<f64> = vertices.iter().map(displacement_m).collect();
        if moves.iter().all(|&m| m == 0.0) {
            return None;
        }
        for (vertex, m) in vertices.iter_mut().zip(moves) {
            vertex.position += vertex.left_normal * m;
        }
        Some(Chain { vertices })
    }
}

/// Pieces that a local displacement reaches are first divided into this many.
const PARTS: u32 = 8;

/// The machine with the effects' constants.
pub(crate) fn altered(machine: &Machine, effects: &[Active]) -> Machine {
    let mut machine = machine.clone();
    for active in effects {
        if let Some(change) = active.effect.on_machine() {
            change(&active.values, &mut machine);
        }
    }
    machine
}

/// What one run drives in.
#[derive(Debug)]
pub struct World<'s> {
    pub(crate) scene: &'s Scene,
    pub(crate) model: Model,
    pub(crate) run: usize,
    /// The machine at the run's start.
    pub(crate) machine: Machine,
    pub(crate) geometry: Arc<Geometry>,
    /// The rays of its sensors, if these have many.
    pub(crate) cones: Option<Arc<Cones>>,
}

impl World<'_> {
    /// The course and its gates.
    pub fn circuit(&self) -> &Circuit {
        self.scene.circuit()
    }

    /// Which run of the data set this is, from 0.
    pub fn run(&self) -> usize {
        self.run
    }

    /// How runs begin, tick and end.
    pub fn rules(&self) -> &RunRules {
        &self.model.run
    }

    /// The noise of readings that the model declares, before any effect.
    pub fn declared_noise(&self) -> ReadingNoise {
        self.model.machine.noise
    }

    /// The straight pieces that rays hit.
    pub fn walls(&self) -> &Walls {
        &self.geometry.walls
    }

    /// The way rays are cast here.
    pub fn caster(&self) -> &Caster {
        &self.geometry.caster
    }

    /// Time of a lap along the midline at the controller's speed, s.
    pub fn nominal_lap_s(&self) -> f64 {
        self.circuit().gates.midline_length_m() / self.machine.controller.speed_m_s()
    }

    /// Unit vector in which this run crosses a gate.
    pub(crate) fn forward(&self, gate: usize) -> Vec2 {
        let forward = self.circuit().gates[gate].forward();
        if self.model.run.way == Way::Forward {
            forward
        } else {
            -forward
        }
    }
}
