use std::sync::Arc;

use proptest::prelude::*;
use track::{Side, Vec2};

use super::super::testing::{active, declared, scene, silent, with};
use super::super::{Active, Pattern, Setting, Site, find};
use crate::{CasterKind, Forecast, Pose, Run, Scene, Step, Streams, WallPlace, Walls, segment_distance_m};

/// The walls as one effect moves them.
fn moved(name: &str, values: &[f64]) -> Walls {
    scene()
        .world(&with(&silent(), name, values), 0)
        .unwrap()
        .walls()
        .clone()
}

fn side_of(walls: &Walls, segment: usize) -> Side {
    walls.place(segment, walls.vertex(segment)).side
}

/// From each gate's centre to the wall on the left and on the right, m.
fn clearances_m(walls: &Walls) -> Vec<[f64; 2]> {
    let clearance = |origin: Vec2, direction: Vec2| {
        walls
            .segments()
            .map(|(_, a, b)| segment_distance_m(origin, direction, a, b))
            .fold(f64::INFINITY, f64::min)
    };
    let of = |gate: &track::Gate| [gate.left, -gate.left].map(|way| clearance(gate.center, way));
    scene().circuit().gates.iter().map(of).collect()
}

/// Vertices end exactly that far from the exact wall. Across a gate, which is not quite across the wall's straight
/// pieces, the corridor is wider by about as much.
#[test]
fn offsets_widen_the_corridor() {
    let declared = clearances_m(scene().walls());
    for (name, side, on_left) in [
        ("outer-wall-offset", Side::Outer, true),
        ("inner-wall-offset", Side::Inner, false),
    ] {
        let walls = moved(name, &[0.0045]);
        assert_eq!(walls.len(), scene().walls().len());
        for (i, a, _) in walls.segments() {
            let own = side_of(&walls, i);
            let away_m = scene().circuit().course.wall(own).nearest(a).distance_m;
            let expected_m = if own == side { 0.0045 } else { 0.0 };
            assert!(
                (away_m - expected_m).abs() < 1e-9,
                "{name}: vertex {i} is {away_m} m away"
            );
        }
        let mut mean_m = 0.0;
        for (wide, plain) in clearances_m(&walls).iter().zip(&declared) {
            let [left_m, right_m] = [0, 1].map(|i| wide[i] - plain[i]);
            let (moved_m, other_m) = if on_left {
                (left_m, right_m)
            } else {
                (right_m, left_m)
            };
            assert!(
                (moved_m - 0.0045).abs() < 1e-3 && other_m.abs() < 1e-12,
                "{name}: {moved_m} {other_m}"
            );
            mean_m += moved_m / declared.len() as f64;
        }
        assert!((mean_m - 0.0045).abs() < 2e-4, "{name}: {mean_m}");
    }
}

fn site(side: Side, fraction: f64) -> Site {
    Site {
        place: WallPlace { side, fraction },
        wall_length_m: 4.0,
        outward: 1.0,
    }
}

#[test]
fn bump_is_a_gaussian_in_arc_length() {
    let bump = active("wall-bump", &[0.0, 0.02, 0.01, 0.1]);
    for (fraction, distance_m) in [
        (0.02, 0.0_f64),
        (0.045, 0.1),
        (0.995, 0.1),
        (0.07, 0.2),
        (0.52, 2.0),
    ] {
        let height_m = bump
            .effect
            .displacement_m(&bump.values, &site(Side::Outer, fraction));
        let expected_m = 0.01 * (-0.5 * (distance_m / 0.1).powi(2)).exp();
        assert!((height_m - expected_m).abs() < 1e-14, "{fraction}: {height_m}");
        assert_eq!(
            bump.effect
                .displacement_m(&bump.values, &site(Side::Inner, fraction)),
            0.0
        );
    }
}

#[test]
fn bump_divides_the_pieces_that_it_reaches() {
    let bump = active("wall-bump", &[0.0, 0.5, 0.01, 0.1]); // reaches 0.425 to 0.575
    let divides = |side, from, to| {
        bump.effect
            .divides(&bump.values, &site(side, from), &site(side, to))
    };
    assert!(divides(Side::Outer, 0.3, 0.7), "the bump is inside the piece");
    assert!(divides(Side::Outer, 0.57, 0.9) && divides(Side::Outer, 0.1, 0.43));
    assert!(!divides(Side::Outer, 0.58, 0.9) && !divides(Side::Outer, 0.9, 0.42));
    assert!(!divides(Side::Inner, 0.3, 0.7));
    let (plain, walls) = (scene().walls(), moved("wall-bump", &[0.0, 0.5, 0.01, 0.1]));
    let more = walls.len() - plain.len();
    assert!(more > 0 && more.is_multiple_of(7), "{more} pieces more");
}

/// The tops of a bump to the left on the outer and on the inner wall stand where the exact wall's normal points.
#[test]
fn bump_moves_the_wall_to_the_left() {
    for (wall, side) in [(0.0, Side::Outer), (1.0, Side::Inner)] {
        let walls = moved("wall-bump", &[wall, 0.3, 0.01, 0.15]);
        let exact = scene().circuit().course.wall(side);
        let top = exact.point(0.3) + exact.left_normal(0.3) * 0.01;
        let segments = walls.segments().filter(|(i, ..)| side_of(&walls, *i) == side);
        let away_m = segments
            .map(|(_, a, b)| (top - crate::walls::nearest_on_segment(a, b, top)).length())
            .fold(f64::INFINITY, f64::min);
        assert!(
            away_m < 0.0055,
            "{side:?}: {away_m} m from the top; chords are within 5 mm"
        );
    }
}

/// A smooth change must move the vertices smoothly: twice the height, twice the way.
#[test]
fn vertices_move_in_proportion() {
    let [flat, once, twice] =
        [1e-9, 0.01, 0.02].map(|height_m| moved("wall-bump", &[1.0, 0.99, height_m, 0.2]));
    for (i, a, _) in flat.segments() {
        let ways = [&once, &twice].map(|walls| walls.vertex(i) - a);
        assert!((ways[0] * 2.0 - ways[1]).length() < 1e-8, "vertex {i}: {ways:?}");
    }
}

/// The outer wall moving from 1 mm on, outwards where positive.
fn moving_wall(m_per_s: f64) -> Setting {
    Setting {
        spec: find("outer-wall-offset").unwrap(),
        pattern: Pattern::ByTime {
            start: vec![0.001],
            per_s: vec![m_per_s],
        },
    }
}

#[test]
fn walls_move_with_time() {
    let mut effects = Active::all(&[moving_wall(1e-5)], 0).unwrap();
    effects.iter_mut().for_each(|active| active.advance(300.0));
    let walls = scene().geometry(&effects, &declared().machine).walls.clone();
    for ((i, a, _), (_, b, _)) in walls.segments().zip(scene().walls().segments()) {
        let expected_m = if side_of(&walls, i) == Side::Outer {
            0.004
        } else {
            0.0
        };
        assert!(((a - b).length() - expected_m).abs() < 1e-12, "vertex {i}");
    }
}

/// The lists of what is near are kept for walls that move a little and made anew for those that move more: every ray
/// must meet what it meets without lists.
#[test]
fn casters_agree_while_walls_move() {
    let circuit = Arc::new(scene().circuit().clone());
    for (max_error_m, m_per_s) in [(0.005, 2e-4), (0.005, -3e-3), (2e-5, -3e-3)] {
        let mut model = declared();
        model.wall.max_error_m = max_error_m;
        model.effects.push(moving_wall(m_per_s));
        let drive = |kind| {
            let scene = Scene::new(Arc::clone(&circuit), &model, Some(kind)).unwrap();
            let world = scene.world(&model, 0).unwrap();
            let mut run = Run::new(&world, Streams { seed: 3, run: 0 }).unwrap();
            (0..400).map(|_| run.step()).collect::<Vec<Step>>()
        };
        let plain = drive(CasterKind::Brute);
        for kind in [CasterKind::Cells, CasterKind::Tree] {
            assert!(drive(kind) == plain, "{kind:?} at {m_per_s} m/s");
        }
    }
}

/// A wall that moves beside a world is seen where it is at the time, not twice as far.
#[test]
fn a_wall_that_moves_beside_a_world_moves_once() {
    let model = silent();
    let world = scene().world(&model, 0).unwrap();
    let still = Setting::constant(find("outer-wall-offset").unwrap(), [0.003]);
    let mut plain = Forecast::new(&world).unwrap();
    let forecasts = [moving_wall(1e-5), still].map(|setting| Forecast::beside(&world, &[setting]));
    let [mut moving, mut still] = forecasts.map(Result::unwrap);
    let gate = scene().circuit().gates[10];
    let forward = gate.forward();
    let pose = Pose::new(gate.center.x, gate.center.y, forward.y.atan2(forward.x));
    let exact = [[0.0; 3]; 3];
    plain.tick(200.0);
    let look = plain.readings(pose, &exact).look;
    let expected = still.readings_beside(pose, &exact, &look, None);
    moving.tick(200.0);
    for (reading, expected) in moving
        .readings_beside(pose, &exact, &look, None)
        .iter()
        .zip(expected)
    {
        assert!((reading - expected).abs() < 1e-9, "{reading} for {expected}");
    }
    assert!(expected != plain.readings(pose, &exact).mean);
}

proptest! {
    #[test]
    fn arc_is_the_shorter_way_round(a in 0.0..1.0, b in 0.0..1.0) {
        let (there, back) = (site(Side::Outer, a).arc_m(b), site(Side::Outer, b).arc_m(a));
        prop_assert!((there - back).abs() < 1e-12 && (0.0..=2.0).contains(&there));
    }
}
