//! Colours, and the scales that turn values into them.

use std::fmt;

/// A colour of eight bits a channel; its text form is `#rrggbb`.
///
/// ```
/// assert_eq!(chart::Color::BLUE.to_string(), "#0072b2");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color {
    /// Red, 0 to 255.
    pub red: u8,
    /// Green, 0 to 255.
    pub green: u8,
    /// Blue, 0 to 255.
    pub blue: u8,
}

impl Color {
    /// Black of Okabe and Ito, "Color Universal Design" (2008), from where all named colours but the greys are.
    pub const BLACK: Self = Self::rgb(0x00_0000);
    /// Orange.
    pub const ORANGE: Self = Self::rgb(0xe6_9f00);
    /// Sky blue.
    pub const SKY: Self = Self::rgb(0x56_b4e9);
    /// Bluish green.
    pub const GREEN: Self = Self::rgb(0x00_9e73);
    /// Yellow; faint on white, so for areas rather than lines.
    pub const YELLOW: Self = Self::rgb(0xf0_e442);
    /// Blue.
    pub const BLUE: Self = Self::rgb(0x00_72b2);
    /// Vermillion, the palette's red.
    pub const VERMILLION: Self = Self::rgb(0xd5_5e00);
    /// Reddish purple.
    pub const PURPLE: Self = Self::rgb(0xcc_79a7);
    /// White.
    pub const WHITE: Self = Self::rgb(0xff_ffff);
    /// Dark grey, for text and axes.
    pub const INK: Self = Self::rgb(0x26_2626);
    /// Middle grey, for what stands behind the subject.
    pub const GREY: Self = Self::rgb(0x80_8080);
    /// Light grey, for grids and shading.
    pub const MIST: Self = Self::rgb(0xe4_e4e4);

    const fn rgb(hex: u32) -> Self {
        let [_, red, green, blue] = hex.to_be_bytes();
        Self { red, green, blue }
    }

    /// The colour a given share of the way from this one to another, channel by channel; the share is cut to 0 to 1.
    #[must_use]
    pub fn mix(self, other: Self, share: f64) -> Self {
        let share = share.clamp(0.0, 1.0);
        let channel = |a: u8, b: u8| (f64::from(a) + share * (f64::from(b) - f64::from(a))).round() as u8;
        Self {
            red: channel(self.red, other.red),
            green: channel(self.green, other.green),
            blue: channel(self.blue, other.blue),
        }
    }

    /// The light variant: half way to white, for the weaker of two related series.
    #[must_use]
    pub fn light(self) -> Self {
        self.mix(Self::WHITE, 0.5)
    }

    /// The dark variant: two fifths of the way to black.
    #[must_use]
    pub fn dark(self) -> Self {
        self.mix(Self::BLACK, 0.4)
    }

    /// Whether white text reads better on it than black: by luminance (Rec. 709, gamma of 2).
    pub(crate) fn is_dark(self) -> bool {
        let light = |channel: u8| (f64::from(channel) / 255.0).powi(2);
        0.2126 * light(self.red) + 0.7152 * light(self.green) + 0.0722 * light(self.blue) < 0.25
    }
}

impl fmt::Display for Color {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.red, self.green, self.blue)
    }
}

/// The colours of series, those that stand out from each other most first.
const PALETTE: [Color; 7] = [
    Color::BLUE,
    Color::VERMILLION,
    Color::GREEN,
    Color::PURPLE,
    Color::ORANGE,
    Color::SKY,
    Color::INK,
];

/// The colour of the series with this number, from 0; every second round is the dark variant.
///
/// ```
/// assert_eq!(chart::palette(1), chart::Color::VERMILLION);
/// assert_ne!(chart::palette(8), chart::palette(1));
/// ```
#[must_use]
pub fn palette(series: usize) -> Color {
    let color = PALETTE[series % PALETTE.len()];
    if (series / PALETTE.len()).is_multiple_of(2) {
        color
    } else {
        color.dark()
    }
}

/// How a scale of values runs through colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColorMap {
    /// From dark violet to yellow, evenly in lightness (matplotlib's viridis): for values without a middle.
    #[default]
    Sequential,
    /// From blue through white to vermillion: for signed values; the range is centred on zero unless it is given.
    Diverging,
}

/// Viridis at tenths of its range.
const VIRIDIS: [Color; 11] = [
    Color::rgb(0x44_0154),
    Color::rgb(0x48_2475),
    Color::rgb(0x41_4487),
    Color::rgb(0x35_5f8d),
    Color::rgb(0x2a_788e),
    Color::rgb(0x21_918c),
    Color::rgb(0x22_a884),
    Color::rgb(0x44_bf70),
    Color::rgb(0x7a_d151),
    Color::rgb(0xbd_df26),
    Color::rgb(0xfd_e725),
];

/// Blue to vermillion through a white that still shows on white paper.
const DIVERGING: [Color; 5] = [
    Color::rgb(0x00_4a80),
    Color::rgb(0x4b_9bd0),
    Color::rgb(0xec_ecea),
    Color::rgb(0xe8_8a45),
    Color::rgb(0xa0_3c00),
];

impl ColorMap {
    /// The colour at a share of the range, cut to 0 to 1.
    #[must_use]
    pub fn at(self, share: f64) -> Color {
        let stops: &[Color] = match self {
            Self::Sequential => &VIRIDIS,
            Self::Diverging => &DIVERGING,
        };
        let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let stop = (place as usize).min(stops.len() - 2);
        stops[stop].mix(stops[stop + 1], place - stop as f64)
    }
}

/// The colours of a panel's values, shown as a bar at its right.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColorScale {
    /// What the colour stands for, with its unit.
    pub label: String,
    /// The colours.
    pub map: ColorMap,
    /// The values at the two ends, increasing; taken from the marks if absent.
    pub range: Option<[f64; 2]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_start_and_end_on_their_stops() {
        assert_eq!(ColorMap::Sequential.at(0.0), VIRIDIS[0]);
        assert_eq!(ColorMap::Sequential.at(1.0), VIRIDIS[10]);
        assert_eq!(ColorMap::Diverging.at(0.5), DIVERGING[2]);
        assert_eq!(ColorMap::Diverging.at(7.0), DIVERGING[4]);
    }

    #[test]
    fn mixing_half_way_is_the_mean() {
        assert_eq!(Color::BLACK.mix(Color::WHITE, 0.5), Color::rgb(0x80_8080));
        assert_eq!(Color::BLUE.mix(Color::WHITE, 0.0), Color::BLUE);
    }

    #[test]
    fn first_fourteen_series_differ() {
        for a in 0..14 {
            for b in 0..a {
                assert_ne!(palette(a), palette(b), "series {a} and {b}");
            }
        }
    }
}
