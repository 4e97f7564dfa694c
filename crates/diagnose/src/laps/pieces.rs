//! Straight pieces of the paths that were simulated beforehand, as the declared model scatters.

use nalgebra::DMatrix;

use super::atlas::{Atlas, White};
use super::path::{Node, Path};

/// A straight piece of a probe's path.
pub(super) struct Piece {
    pub(super) probe: usize,
    from_size: f64,
    to_size: f64,
    /// Shares of the piece that are allowed.
    low: f64,
    high: f64,
    from: White,
    along: White,
    /// Products of the two with themselves and with each other.
    from_square: f64,
    along_square: f64,
    along_from: f64,
}

/// Pieces as the columns of two matrices: where they start, and where they lead.
pub(super) struct Columns {
    pub(super) from: DMatrix<f64>,
    pub(super) along: DMatrix<f64>,
}

impl Columns {
    pub(super) fn of(pieces: &[Piece]) -> Self {
        let columns = |of: fn(&Piece) -> &White| {
            DMatrix::from_columns(&pieces.iter().map(|piece| of(piece).clone()).collect::<Vec<_>>())
        };
        Self {
            from: columns(|piece| &piece.from),
            along: columns(|piece| &piece.along),
        }
    }
}

impl Piece {
    /// A straight piece between two sizes, each with its action.
    fn new(
        probe: usize,
        [from_size, to_size]: [f64; 2],
        [low, high]: [f64; 2],
        from: &White,
        to: &White,
    ) -> Self {
        let along = to - from;
        Self {
            probe,
            from_size,
            to_size,
            low,
            high,
            from_square: from.norm_squared(),
            along_square: along.norm_squared(),
            along_from: along.dot(from),
            from: from.clone(),
            along,
        }
    }

    /// The squared distance to a target that the piece's best point gains, and its size, by the target's products with the piece.
    pub(super) fn best(&self, along_target: f64, from_target: f64) -> (f64, f64) {
        let square = self.along_square;
        let product = along_target - self.along_from;
        let share = (product / square.max(f64::MIN_POSITIVE)).clamp(self.low, self.high);
        let gain = 2.0 * from_target - self.from_square + share * (2.0 * product - share * square);
        (gain, self.at(share))
    }

    /// The size at a share of the piece.
    fn at(&self, share: f64) -> f64 {
        self.from_size + share * (self.to_size - self.from_size)
    }
}

impl Atlas {
    /// The paths of all probes that do not jump.
    pub(super) fn smooth_pieces(&self) -> Vec<Piece> {
        (0..self.probes.len())
            .filter(|&probe| !self.probes[probe].jumps())
            .flat_map(|probe| self.pieces(probe))
            .collect()
    }

    fn pieces(&self, probe: usize) -> Vec<Piece> {
        let path = Path::of(self.nodes(probe).into_iter());
        let piece = |([from, to], bounds): ([&Node; 2], [f64; 2])| {
            Piece::new(probe, [from.size, to.size], bounds, &from.action, &to.action)
        };
        path.ways().map(piece).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_point_of_a_piece_is_the_projection_within_its_bounds() {
        // From (1, 0) at size 2 straight up to (1, 4) at size 4, and half a piece beyond.
        let [from, to] = [[1.0, 0.0], [1.0, 4.0]].map(|v| White::from_vec(v.to_vec()));
        let piece = Piece::new(0, [2.0, 4.0], [0.0, 1.5], &from, &to);
        for (target, size, nearest) in [
            ([2.0, 3.0], 3.5, [1.0, 3.0]),
            ([0.0, 9.0], 5.0, [1.0, 6.0]),
            ([5.0, -1.0], 2.0, [1.0, 0.0]),
        ] {
            let [target, nearest] = [target, nearest].map(|v| White::from_vec(v.to_vec()));
            let (gain, found) = piece.best(piece.along.dot(&target), piece.from.dot(&target));
            let gained = target.norm_squared() - (&target - nearest).norm_squared();
            assert!((found - size).abs() < 1e-12 && (gain - gained).abs() < 1e-12);
        }
    }
}
