//! Hard cases for ray casters, made from a source of uniform numbers: shared by the tests and by the long run in
//! `examples/ray_exactness.rs`.

use track::Vec2;

/// What the casters are made for: exact in binary, so that a wall can be exactly this far away.
pub(super) const RANGE_M: f64 = 0.125;

/// How far from the robot's centre rays start, m.
pub(super) const SPREAD_M: f64 = 0.0625;

/// Uniform numbers in [0, 1).
pub(super) struct Uniform<F>(pub(super) F);

impl<F: FnMut() -> f64> Uniform<F> {
    fn index(&mut self, count: usize) -> usize {
        ((self.0)() * count as f64) as usize
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0)()
    }

    /// A direction and, to the fourth power of a uniform number, how far along it: mostly short.
    fn offset(&mut self, most_m: f64) -> Vec2 {
        let length_m = most_m * (self.0)().powi(4);
        self.direction() * length_m
    }

    fn direction(&mut self) -> Vec2 {
        let angle = self.between(0.0, std::f64::consts::TAU);
        Vec2::new(angle.cos(), angle.sin())
    }

    /// Closed outlines: a circuit, a walk of segments from 0.1 mm to 1 m, overlapping boxes, or squares on a grid.
    pub(super) fn outlines(&mut self) -> Vec<Vec<Vec2>> {
        match self.index(4) {
            0 => self.circuit(),
            1 => vec![self.walk()],
            2 => (0..5 + self.index(20)).map(|_| self.thin_box()).collect(),
            _ => (0..3 + self.index(20)).map(|_| self.square()).collect(),
        }
    }

    fn circuit(&mut self) -> Vec<Vec<Vec2>> {
        let count = [7, 47, 105, 900][self.index(4)];
        let (waves, height, width_m) = (
            self.index(5) as f64,
            self.between(0.0, 0.2),
            self.between(0.08, 0.2),
        );
        let ring = |inset_m: f64| {
            let at = |i: usize| {
                let angle = std::f64::consts::TAU * i as f64 / count as f64;
                Vec2::new(angle.cos(), angle.sin()) * (0.5 + height * (waves * angle).cos() - inset_m)
            };
            (0..count).map(at).collect()
        };
        vec![ring(0.0), ring(width_m)]
    }

    fn walk(&mut self) -> Vec<Vec2> {
        let mut at = Vec2::ZERO;
        let step = |_| {
            let length_m = 1e-4 * 1e4_f64.powf((self.0)());
            at += self.direction() * length_m;
            at
        };
        (0..40).map(step).collect()
    }

    fn thin_box(&mut self) -> Vec<Vec2> {
        let corner = Vec2::new(self.between(-0.3, 0.3), self.between(-0.3, 0.3));
        let along = self.direction() * self.between(0.02, 0.5);
        let across = along.normalize().perp() * self.between(0.001, 0.02);
        vec![corner, corner + along, corner + along + across, corner + across]
    }

    fn square(&mut self) -> Vec<Vec2> {
        let mut grid = || (self.index(65) as f64 - 32.0) / 64.0;
        let (x, y, size) = (grid(), grid(), grid().abs() + 1.0 / 64.0);
        vec![
            Vec2::new(x, y),
            Vec2::new(x + size, y),
            Vec2::new(x + size, y + size),
            Vec2::new(x, y + size),
        ]
    }

    /// A robot's centre near a wall and eight rays about it: at random, through joints, along segments or grazing them
    /// at less than a degree, and along the axes from a point of the grid.
    pub(super) fn pose(&mut self, outlines: &[Vec<Vec2>]) -> (Vec2, [(Vec2, Vec2); 8]) {
        let outline = &outlines[self.index(outlines.len())];
        let number = self.index(outline.len());
        let share = (self.0)();
        let near = outline[number].lerp(outline[(number + 1) % outline.len()], share);
        let center = near + self.offset(1.2 * RANGE_M);
        let ray = |_| {
            let i = (number + self.index(3)) % outline.len();
            let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
            let along = (b - a).normalize();
            let origin = center + self.offset(0.99 * SPREAD_M);
            match self.index(6) {
                0 => (origin, self.direction()),
                1 => (origin, (a - origin).try_normalize().unwrap_or(Vec2::X)),
                2 => (origin, along.rotate(turned(self.between(-0.0175, 0.0175)))),
                3 => (origin, along.rotate(turned(self.offset(1e-3).x))),
                4 if near.distance(a) < SPREAD_M && center.distance(a) < SPREAD_M => (a, along),
                _ => {
                    let snapped = (center * 64.0).round() / 64.0;
                    let axis = [Vec2::X, Vec2::Y, -Vec2::X, -Vec2::Y][self.index(4)];
                    (snapped, axis)
                }
            }
        };
        (center, [0; 8].map(ray))
    }
}

fn turned(angle_rad: f64) -> Vec2 {
    Vec2::new(angle_rad.cos(), angle_rad.sin())
}
