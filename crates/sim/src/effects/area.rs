//! A part of the floor that differs from the rest.

use track::Vec2;

/// What a cause without a name does that acts on a part of the floor: everywhere `amount` exp(-(d / `radius_m`)^(2 / `softness`) / 2)
/// at the distance d from its middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// In its middle, in the units of what it acts on.
    pub amount: f64,
    /// Its middle, from the arena's, m.
    pub middle_m: Vec2,
    /// The distance at which exp(-1/2) of the amount is left; above 0.
    pub radius_m: f64,
    /// How softly it ends: a normal law's bell at 1, a disc with an ever sharper edge down to [`Area::SHARPEST`].
    pub softness: f64,
}

impl Area {
    /// The basis that stands for it.
    pub const BASIS: &str = "area";

    /// The least softness that makes a difference.
    pub const SHARPEST: f64 = 0.05;

    /// From coefficients: the amount, the middle's x and y, the radius, and the softness, which may be left out of a bell; `None` where the
    /// radius is missing or not positive.
    pub(super) fn of(coefficients: &[f64]) -> Option<Self> {
        match *coefficients {
            [amount, x, y, radius_m, ref softness @ ..] if radius_m > 0.0 => Some(Self {
                amount,
                middle_m: Vec2::new(x, y),
                radius_m,
                softness: softness
                    .first()
                    .map_or(1.0, |softness| softness.max(Self::SHARPEST)),
            }),
            _ => None,
        }
    }

    /// What it does at a place, from the arena's middle, m.
    pub(super) fn at(&self, place: Vec2) -> f64 {
        let off = (place - self.middle_m) / self.radius_m;
        self.amount * (-0.5 * off.length_squared().powf(1.0 / self.softness)).exp()
    }
}
