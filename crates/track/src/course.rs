use crate::crossing::{Segment, crossing};
use crate::midline::{Midline, Walls};
use crate::{Error, Gates, Spline, Vec2, Wall, Way};
use serde::{Deserialize, Serialize};
use toml::Spanned;

/// Walls nearer to each other than this leave no corridor.
const CLEARANCE_M: f64 = 1e-3;

/// One of the two walls of a course.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The wall around the corridor.
    Outer,
    /// The wall that the corridor runs around.
    Inner,
}

impl Side {
    /// `"outer"` or `"inner"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Outer => "outer",
            Self::Inner => "inner",
        }
    }
}

/// A way round the course, seen with y up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// With the hands of a clock.
    Clockwise,
    /// Against them.
    CounterClockwise,
}

impl Direction {
    /// The other one.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Clockwise => Self::CounterClockwise,
            Self::CounterClockwise => Self::Clockwise,
        }
    }

    /// `"clockwise"` or `"counter-clockwise"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clockwise => "clockwise",
            Self::CounterClockwise => "counter-clockwise",
        }
    }
}

/// A closed corridor between two walls, checked: [`Course::new`] and [`Course::from_toml`] are the ways to one.
///
/// ```
/// use track::{Course, Direction};
///
/// let course = Course::from_toml(include_str!("../../../worlds/roduit2007/world.toml"))?;
/// assert_eq!(course.direction, Direction::Clockwise);
/// assert!((course.corridor_m().narrowest_m - 0.182).abs() < 1e-3);
/// # Ok::<(), track::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Course {
    /// Name of the world.
    pub name: String,
    /// Width and height; the origin is the lower left corner.
    pub arena_m: [f64; 2],
    /// The driving direction, which is that of the walls' splines.
    pub direction: Direction,
    /// The wall around the corridor.
    pub outer: Wall,
    /// The wall that the corridor runs around.
    pub inner: Wall,
    midline: Midline,
}

/// How wide the corridor is, from wall to wall across its midline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Its smallest width.
    pub narrowest_m: f64,
    /// Its largest width.
    pub widest_m: f64,
    /// The midline's point where it is narrowest.
    pub narrowest_at: Vec2,
}

impl Course {
    /// The course in a world file, a TOML text with `name`, `arena`, `direction` and two `[[wall]]`s.
    ///
    /// # Errors
    /// For what [`Course::new`] and [`Wall::new`] refuse, and for a text of another shape; with the line where it is known.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let file: WorldFile = toml::from_str(text).map_err(|error| {
            let what = Error::Format {
                message: with_nearest_key(error.message()),
            };
            error
                .span()
                .map_or(what.clone(), |span| at_line(text, span.start, what))
        })?;
        let mut walls = [Side::Outer, Side::Inner].map(|side| (side, Vec::new()));
        for wall in &file.wall {
            let name = wall.name.get_ref();
            let (_, found) = walls
                .iter_mut()
                .find(|(side, _)| side.name() == name)
                .ok_or_else(|| {
                    at_line(
                        text,
                        wall.name.span().start,
                        Error::UnknownWall { name: name.clone() },
                    )
                })?;
            found.push(wall.read(text)?);
        }
        let [outer, inner] = walls.map(|(side, mut found)| match found.len() {
            1 => Ok(found.remove(0)),
            count => Err(Error::WallCount {
                name: side.name(),
                count,
            }),
        });
        Self::new(&file.name, file.arena, file.direction, outer?, inner?)
    }

    /// A course of two walls whose splines run in the driving direction.
    ///
    /// # Errors
    /// Where a wall runs the other way round or leaves the arena, where the walls come within 1 mm of each other,
    /// and where the inner wall is not inside the outer one.
    pub fn new(
        name: &str,
        arena_m: [f64; 2],
        direction: Direction,
        outer: Wall,
        inner: Wall,
    ) -> Result<Self, Error> {
        let [width_m, height_m] = arena_m;
        if !(width_m > 0.0 && height_m > 0.0 && width_m.is_finite() && height_m.is_finite()) {
            return Err(Error::Arena { width_m, height_m });
        }
        let chords = [outer.chords(), inner.chords()];
        for (wall, chords) in [&outer, &inner].into_iter().zip(&chords) {
            check_wall(wall, chords, arena_m, direction)?;
        }
        check_corridor(&outer, &chords[0], &chords[1])?;
        let midline = Midline::new(sides(direction, &outer, &inner))?;
        Ok(Self {
            name: name.to_owned(),
            arena_m,
            direction,
            outer,
            inner,
            midline,
        })
    }

    /// The wall on one side of the corridor.
    pub fn wall(&self, side: Side) -> &Wall {
        match side {
            Side::Outer => &self.outer,
            Side::Inner => &self.inner,
        }
    }

    /// The way through the gates when driving round in a direction.
    pub fn way(&self, direction: Direction) -> Way {
        if direction == self.direction {
            Way::Forward
        } else {
            Way::Backward
        }
    }

    /// `count` gates at equal distances along the midline, gate 0 nearest to the outer wall's first joint.
    ///
    /// # Errors
    /// For fewer gates than the bends of the corridor need, and where two gates cross.
    pub fn gates(&self, count: usize) -> Result<Gates, Error> {
        Gates::new(&self.midline, self.walls(), self.outer.point(0.0), count)
    }

    /// The corridor's widths, from wall to wall across the midline, looked at every 2 mm.
    pub fn corridor_m(&self) -> Corridor {
        let mut corridor = Corridor {
            narrowest_m: f64::INFINITY,
            widest_m: 0.0,
            narrowest_at: Vec2::ZERO,
        };
        for station in self.midline.stations() {
            let (left_m, right_m) = self.walls().reach_m(station);
            let width_m = left_m + right_m;
            corridor.widest_m = corridor.widest_m.max(width_m);
            if width_m < corridor.narrowest_m {
                (corridor.narrowest_m, corridor.narrowest_at) = (width_m, station.point);
            }
        }
        corridor
    }

    fn walls(&self) -> Walls<'_> {
        sides(self.direction, &self.outer, &self.inner)
    }
}

/// Driving clockwise, the outer wall is on the left.
fn sides<'w>(direction: Direction, outer: &'w Wall, inner: &'w Wall) -> Walls<'w> {
    match direction {
        Direction::Clockwise => Walls {
            left: outer,
            right: inner,
        },
        Direction::CounterClockwise => Walls {
            left: inner,
            right: outer,
        },
    }
}

fn check_wall(
    wall: &Wall,
    chords: &[Segment],
    arena_m: [f64; 2],
    declared: Direction,
) -> Result<(), Error> {
    let inside = |p: Vec2| (0.0..=arena_m[0]).contains(&p.x) && (0.0..=arena_m[1]).contains(&p.y);
    if let Some(&(at_m, _)) = chords.iter().find(|(p, _)| !inside(*p)) {
        return Err(Error::OutsideArena {
            wall: wall.name().to_owned(),
            at_m,
        });
    }
    let area: f64 = chords.iter().map(|(a, b)| a.perp_dot(*b)).sum();
    let actual = if area > 0.0 {
        Direction::CounterClockwise
    } else {
        Direction::Clockwise
    };
    if actual != declared {
        return Err(Error::Orientation {
            wall: wall.name().to_owned(),
            declared,
        });
    }
    Ok(())
}

fn check_corridor(
    outer: &Wall,
    outer_chords: &[Segment],
    inner_chords: &[Segment],
) -> Result<(), Error> {
    let of_outer = outer_chords.len();
    let both = [outer_chords, inner_chords].concat();
    if let Some((_, _, at_m)) = crossing(&both, |i, j| i < of_outer && j >= of_outer) {
        return Err(Error::WallsTouch { at_m });
    }
    let too_near = |p: &Vec2| outer.foot(*p).distance_sq < CLEARANCE_M * CLEARANCE_M;
    if let Some(at_m) = inner_chords.iter().map(|chord| chord.0).find(too_near) {
        return Err(Error::WallsTouch { at_m });
    }
    if !encloses(outer_chords, inner_chords[0].0) {
        return Err(Error::NotInside);
    }
    Ok(())
}

/// Whether a ray from `p` along +x crosses the closed line an odd number of times.
fn encloses(line: &[Segment], p: Vec2) -> bool {
    let crossed = |(a, b): &&Segment| {
        (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y)
    };
    line.iter().filter(crossed).count() % 2 == 1
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WorldFile {
    name: String,
    arena: [f64; 2],
    direction: Direction,
    wall: Vec<WallEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WallEntry {
    name: Spanned<String>,
    spline: Vec<SplineEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SplineEntry {
    control_points: Spanned<Vec<[f64; 2]>>,
}

impl WallEntry {
    fn read(&self, text: &str) -> Result<Wall, Error> {
        let start_of = |entry: &SplineEntry| entry.control_points.span().start;
        let spline = |entry: &SplineEntry| {
            let points = entry.control_points.get_ref().iter();
            Spline::new(points.map(|&[x, y]| Vec2::new(x, y)).collect())
                .map_err(|what| at_line(text, start_of(entry), what))
        };
        let splines = self.spline.iter().map(spline).collect::<Result<_, _>>()?;
        Wall::new(self.name.get_ref(), splines).map_err(|what| {
            let entry = what.spline().and_then(|number| self.spline.get(number - 1));
            at_line(text, entry.map_or(self.name.span().start, start_of), what)
        })
    }
}

fn at_line(text: &str, byte: usize, what: Error) -> Error {
    let line = 1 + text
        .as_bytes()
        .iter()
        .take(byte)
        .filter(|&&b| b == b'\n')
        .count();
    Error::At {
        line,
        what: Box::new(what),
    }
}

/// The reader's message; where it names an unknown key and the known ones, with the nearest of these.
fn with_nearest_key(message: &str) -> String {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let nearest = message.starts_with("unknown").then(|| {
        let unknown = quoted.next()?;
        let closeness = |known: &str| strsim::jaro_winkler(unknown, known);
        quoted.max_by(|a, b| closeness(a).total_cmp(&closeness(b)))
    });
    match nearest.flatten() {
        Some(known) => format!("{message}; nearest: `{known}`"),
        None => message.to_owned(),
    }
}
