//! A million poses on random walls: do all ways of casting rays see the same?
//!
//! `cargo run --release -p sim --example ray_exactness -- [poses] [seed]` ends with status 1 if not. The plain loop is
//! the reference: ours must give its bits, parry2d's bounding volume hierarchy its distance to 1e-9 m where a ray meets a wall at more
//! than a degree, away from the segment's ends and from the range.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::process::ExitCode;

use sim::{Caster, CasterKind, Hits, LANES, Rays, Streams, Walls, segment_distance_m};

#[path = "../src/cast/cases.rs"]
mod cases;

use cases::{RANGE_M, SPREAD_M, Uniform};

/// Poses on the walls of one draw.
const POSES_A_SCENE: usize = 2000;

/// What was seen.
#[derive(Debug, Default)]
struct Counts {
    rays: usize,
    hits: usize,
    shared_ends: usize,
    wrong: [usize; 2],
    compared: usize,
    farthest_m: f64,
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse().ok());
    let poses: u64 = arguments.next().flatten().unwrap_or(1_000_000);
    let seed = arguments.next().flatten().unwrap_or(1);
    let mut stream = Streams { seed, run: 0 }.open("rays");
    let mut uniform = Uniform(move || 0.5 + 0.5 * stream.symmetric());
    let mut counts = Counts::default();
    for _ in 0..(poses as usize).div_ceil(POSES_A_SCENE) {
        scene(&mut uniform, &mut counts);
    }
    let Counts {
        rays,
        hits,
        shared_ends,
        wrong,
        compared,
        farthest_m,
    } = counts;
    println!("{rays} rays from {} poses, {hits} hits", rays / LANES);
    println!(
        "cells, tree: {wrong:?} rays differ in a bit; {shared_ends} hit another segment at a shared point"
    );
    println!("parry2d: {compared} plain rays compared, farthest apart {farthest_m:.1e} m");
    if wrong == [0; 2] && farthest_m <= 1e-9 {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    }
}

fn scene(uniform: &mut Uniform<impl FnMut() -> f64>, counts: &mut Counts) {
    let outlines = uniform.outlines();
    let walls = Walls::from_outlines(&outlines);
    let caster = |kind| Caster::new(Some(kind), &walls, RANGE_M, SPREAD_M);
    let brute = caster(CasterKind::Brute);
    let ours = [CasterKind::Cells, CasterKind::Tree].map(caster);
    let bvh = caster(CasterKind::Bvh);
    for _ in 0..POSES_A_SCENE {
        let (center, rays) = uniform.pose(&outlines);
        let rays = Rays::new(rays);
        let reference = brute.cast(&walls, center, &rays);
        let found = [0, 1].map(|k| ours[k].cast(&walls, center, &rays));
        let theirs = bvh.cast(&walls, center, &rays);
        for i in 0..LANES {
            counts.rays += 1;
            counts.hits += usize::from(reference.distance_m[i].is_finite());
            for (k, hits) in found.iter().enumerate() {
                let same = hits.distance_m[i].to_bits() == reference.distance_m[i].to_bits();
                let other =
                    same && reference.distance_m[i].is_finite() && hits.segment[i] != reference.segment[i];
                let shared = !other || distance_m(&walls, &rays, hits, i) == reference.distance_m[i];
                counts.shared_ends += usize::from(other);
                counts.wrong[k] += usize::from(!same || !shared);
            }
            if is_plain(&walls, &rays, &reference, i) && is_plain(&walls, &rays, &theirs, i) {
                let (a, b) = (reference.distance_m[i], theirs.distance_m[i]);
                counts.compared += 1;
                counts.farthest_m = counts.farthest_m.max(if a == b { 0.0 } else { (a - b).abs() });
            }
        }
    }
}

/// Distance of the segment that was hit.
fn distance_m(walls: &Walls, rays: &Rays, hits: &Hits, i: usize) -> f64 {
    let segment = hits.segment[i] as usize;
    segment_distance_m(
        rays.origin(i),
        rays.direction(i),
        walls.vertex(segment),
        walls.vertex(segment + 1),
    )
}

/// Whether a ray meets nothing, or a segment at more than a degree, off its ends and off the range.
fn is_plain(walls: &Walls, rays: &Rays, hits: &Hits, i: usize) -> bool {
    if hits.distance_m[i].is_infinite() {
        return true;
    }
    let segment = hits.segment[i] as usize;
    let point = rays.origin(i) + rays.direction(i) * hits.distance_m[i];
    let to_end_m = point
        .distance(walls.vertex(segment))
        .min(point.distance(walls.vertex(segment + 1)));
    let steep = walls.normal(segment).dot(rays.direction(i)).abs() > 0.0175;
    steep && to_end_m > 1e-9 && (RANGE_M - hits.distance_m[i]).abs() > 1e-9 && hits.distance_m[i] > 1e-9
}
