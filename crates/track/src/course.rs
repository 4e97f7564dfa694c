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
            let message = with_nearest_key(error.message());
            at(
                text,
                error.span().map(|span| span.start),
                Error::Format { message },
            )
        })?;
        let [outer, inner] = file.walls(text)?;
        Self::new(
            &file.name,
            file.arena.get_ref().0,
            *file.direction.get_ref(),
            outer,
            inner,
        )
        .map_err(|what| at(text, file.place_of(&what), what))
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

fn check_wall(wall: &Wall, chords: &[Segment], arena_m: [f64; 2], declared: Direction) -> Result<(), Error> {
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

fn check_corridor(outer: &Wall, outer_chords: &[Segment], inner_chords: &[Segment]) -> Result<(), Error> {
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
    let crossed =
        |(a, b): &&Segment| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) * (b.x - a.x) / (b.y - a.y);
    line.iter().filter(crossed).count() % 2 == 1
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WorldFile {
    name: String,
    arena: Spanned<Pair>,
    direction: Spanned<Direction>,
    wall: Vec<WallEntry>,
}

impl WorldFile {
    /// The outer wall and the inner one.
    fn walls(&self, text: &str) -> Result<[Wall; 2], Error> {
        const SIDES: [Side; 2] = [Side::Outer, Side::Inner];
        let known = |wall: &&WallEntry| SIDES.iter().any(|side| side.name() == wall.name.get_ref());
        if let Some(wall) = self.wall.iter().find(|wall| !known(wall)) {
            let name = wall.name.get_ref().clone();
            return Err(at(
                text,
                Some(wall.name.span().start),
                Error::UnknownWall { name },
            ));
        }
        let [outer, inner] = SIDES.map(|side| {
            let named: Vec<_> = self
                .wall
                .iter()
                .filter(|wall| wall.name.get_ref() == side.name())
                .collect();
            match named[..] {
                [wall] => wall.read(text),
                _ => Err(Error::WallCount {
                    name: side.name(),
                    count: named.len(),
                }),
            }
        });
        Ok([outer?, inner?])
    }

    /// The byte of the file that an error about a whole course is about.
    fn place_of(&self, what: &Error) -> Option<usize> {
        let wall = |name: &str| {
            let named = self.wall.iter().find(|wall| wall.name.get_ref() == name)?;
            Some(named.name.span().start)
        };
        match what {
            Error::Arena { .. } => Some(self.arena.span().start),
            Error::Orientation { .. } => Some(self.direction.span().start),
            Error::OutsideArena { wall: name, .. } => wall(name),
            Error::WallsTouch { .. } | Error::NotInside => wall(Side::Inner.name()),
            _ => None,
        }
    }
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
    control_points: Spanned<Vec<Pair>>,
}

/// Exactly two numbers; an array of two would be read from more.
#[derive(Deserialize)]
#[serde(try_from = "Vec<f64>")]
struct Pair([f64; 2]);

impl TryFrom<Vec<f64>> for Pair {
    type Error = String;

    fn try_from(numbers: Vec<f64>) -> Result<Self, String> {
        let pair = numbers.try_into().map(Self);
        pair.map_err(|numbers: Vec<f64>| format!("{numbers:?} has length {}; 2 is needed", numbers.len()))
    }
}

impl WallEntry {
    fn read(&self, text: &str) -> Result<Wall, Error> {
        let start_of = |entry: &SplineEntry| entry.control_points.span().start;
        let spline = |entry: &SplineEntry| {
            let points = entry.control_points.get_ref().iter();
            Spline::new(points.map(|&Pair([x, y])| Vec2::new(x, y)).collect())
                .map_err(|what| at(text, Some(start_of(entry)), what))
        };
        let splines = self.spline.iter().map(spline).collect::<Result<_, _>>()?;
        Wall::new(self.name.get_ref(), splines).map_err(|what| {
            let entry = what.spline().and_then(|number| self.spline.get(number - 1));
            at(text, Some(entry.map_or(self.name.span().start, start_of)), what)
        })
    }
}

/// The error with the line of the byte that it is about, where that is known.
fn at(text: &str, byte: Option<usize>, what: Error) -> Error {
    let Some(byte) = byte else {
        return what;
    };
    let before = text.as_bytes().iter().take(byte);
    let line = 1 + before.filter(|&&b| b == b'\n').count();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{CIRCUIT, circuit, on_ellipse, ring_through};

    /// What the circuit is refused for after one change of its text.
    fn refusal(old: &str, new: &str) -> String {
        assert!(CIRCUIT.contains(old), "{old}");
        Course::from_toml(&CIRCUIT.replacen(old, new, 1))
            .unwrap_err()
            .to_string()
    }

    fn round(name: &str, radius_m: f64) -> Wall {
        ring_through(name, 4, |index| on_ellipse([radius_m; 2], index as f64 / 20.0))
    }

    fn course(outer: Wall, inner: Wall) -> Result<Course, Error> {
        Course::new("round", [2.0, 2.0], Direction::Clockwise, outer, inner)
    }

    #[test]
    fn circuit_is_as_its_file_says() {
        let course = circuit();
        assert_eq!((course.name.as_str(), course.arena_m), ("roduit2007", [1.4, 1.2]));
        assert_eq!(course.wall(Side::Outer).splines().len(), 4);
        assert_eq!(course.wall(Side::Inner).name(), Side::Inner.name());
        assert_eq!(course.way(Direction::Clockwise), Way::Forward);
        assert_eq!(course.way(Direction::CounterClockwise), Way::Backward);
    }

    #[test]
    fn errors_of_the_file_carry_its_line() {
        let line = |needle: &str| 1 + CIRCUIT[..CIRCUIT.find(needle).unwrap()].matches('\n').count();
        let points = line("[[1.29205");
        let message = refusal("[[1.29205", "[[1.30205");
        let mend = "let spline 2 start at [1.29205, 0.69505]";
        let gap = "outer wall: spline 1 ends 0.010000 m away from where spline 2 starts";
        assert_eq!(message, format!("line {points}: {gap}; {mend}"));
        let message = refusal("[[1.29205, 0.69505]", "[[1.29205, 0.69505, 0.1]");
        let numbers = "[1.29205, 0.69505, 0.1] has length 3; 2 is needed";
        assert_eq!(message, format!("line {points}: {numbers}"));
        let message = refusal("arena = [1.4, 1.2]", "arena = [1.4]");
        let arena = line("arena =");
        assert_eq!(message, format!("line {arena}: [1.4] has length 1; 2 is needed"));
        let message = refusal("[[1.29205", "[[nan");
        assert_eq!(
            message,
            format!("line {points}: x of control point 1 is NaN, not a finite number")
        );
        let message = refusal("name = \"inner\"", "name = \"iner\"");
        let name = line("name = \"inner\"");
        assert_eq!(
            message,
            format!("line {name}: unknown wall `iner`; known: outer, inner")
        );
        let message = refusal("arena =", "arenna =");
        assert!(
            message.starts_with(&format!("line {}: unknown field `arenna`", line("arena ="))),
            "{message}"
        );
        assert!(message.ends_with("nearest: `arena`"), "{message}");
        let message = refusal("\"clockwise\"", "\"clockwse\"");
        assert!(message.ends_with("nearest: `clockwise`"), "{message}");
        let message = refusal("\"clockwise\"", "\"counter-clockwise\"");
        let direction = line("direction =");
        let wrong = "outer wall runs clockwise but direction is counter-clockwise";
        assert!(
            message.starts_with(&format!("line {direction}: {wrong}")),
            "{message}"
        );
    }

    #[test]
    fn errors_without_a_line_say_so() {
        let error = Course::from_toml("name = ").unwrap_err();
        assert_eq!(error.line(), Some(1));
        let without_inner = &CIRCUIT[..CIRCUIT.rfind("[[wall]]").unwrap()];
        let error = Course::from_toml(without_inner).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the world has 0 walls named `inner`, it needs exactly one"
        );
        assert_eq!(error.line(), None);
    }

    #[test]
    fn refuses_arenas_that_do_not_hold_the_walls() {
        assert!(refusal("[1.4, 1.2]", "[1.4, 1.0]").contains("outer wall leaves the arena at"));
        assert!(refusal("[1.4, 1.2]", "[1.4, inf]").contains("needs a width and a height"));
        assert!(refusal("[1.4, 1.2]", "[0, 1.2]").contains("needs a width and a height"));
    }

    #[test]
    fn refuses_walls_without_a_corridor() {
        let crossing = course(
            round("outer", 0.5),
            ring_through("inner", 4, |index| on_ellipse([0.3, 0.6], index as f64 / 20.0)),
        );
        assert!(matches!(crossing, Err(Error::WallsTouch { .. })), "{crossing:?}");
        let touching = course(round("outer", 0.5), round("inner", 0.4995));
        assert!(matches!(touching, Err(Error::WallsTouch { .. })), "{touching:?}");
        let swapped = course(round("outer", 0.3), round("inner", 0.5));
        assert!(matches!(swapped, Err(Error::NotInside)), "{swapped:?}");
    }

    #[test]
    fn counter_clockwise_course_has_its_outer_wall_on_the_right() {
        let against = |name: &str, radius_m: f64| {
            ring_through(name, 4, |index| {
                on_ellipse([radius_m; 2], 1.0 - index as f64 / 20.0)
            })
        };
        let (outer, inner) = (against("outer", 0.5), against("inner", 0.3));
        let course = Course::new("round", [2.0, 2.0], Direction::CounterClockwise, outer, inner).unwrap();
        let gates = course.gates(64).unwrap();
        let inwards = Vec2::ONE - gates[0].center;
        assert!(gates[0].left.dot(inwards) > 0.0, "left is inside");
        assert!(gates[0].forward().dot(gates[1].center - gates[0].center) > 0.0);
        let corridor = course.corridor_m();
        // a ring through 20 points is not quite round: its radius wavers by 3 %
        assert!(
            corridor.narrowest_m > 0.19 && corridor.widest_m < 0.21,
            "{corridor:?}"
        );
    }
}
