//! Charts as SVG: axes, lines, points, error bars, ellipses, maps, panels, legends.
//!
//! A [`Figure`] is a grid of [`Panel`]s, a panel two [`Axis`]es and a list of [`Mark`]s, a mark a [`Shape`] (the
//! numbers), a [`Style`] (how they look) and a label (what the legend calls them). All of them are plain values;
//! [`Figure::to_svg`] turns them into one self-contained SVG text. The same figure always gives the same bytes.
//!
//! The picture needs no font, script or style sheet of its own, carries a title and a description for readers that do
//! not see it, and has no `id`s, so several of them can stand in one page. Colours are those of Okabe and Ito, which
//! people who do not see red or green can tell apart.
//!
//! ```
//! use chart::{Axis, Figure, Mark, Panel, Shape, Style};
//!
//! let figure = Figure {
//!     title: "Response of the sensor".into(),
//!     description: "The reading falls with distance.".into(),
//!     panels: vec![Panel {
//!         x: Axis::linear("distance, m"),
//!         y: Axis::linear("reading, counts"),
//!         marks: vec![
//!             Mark::new("model", Style::series(0), Shape::Line(vec![[0.0, 3800.0], [0.1, 300.0]])),
//!             Mark::new("measured", Style::series(1), Shape::Points(vec![[0.01, 1466.0], [0.05, 120.0]])),
//!         ],
//!         ..Panel::default()
//!     }],
//!     ..Figure::default()
//! };
//! let svg = figure.to_svg()?;
//! assert!(svg.starts_with("<svg ") && svg.contains("reading, counts"));
//! # Ok::<(), chart::Error>(())
//! ```

mod axes;
mod axis;
mod bar;
mod color;
mod draw;
mod error;
mod figure;
mod glyph;
mod layout;
mod legend;
mod mark;
mod numbers;
mod path;
mod plan;
mod style;
mod svg;
mod text;
mod ticks;

pub use axis::{Axis, Scale, Ticks};
pub use color::{Color, ColorMap, ColorScale, palette};
pub use error::{AxisName, Error};
pub use figure::{Aspect, Corner, Figure, Legend, Panel, Share, Side};
pub use mark::{Direction, Ellipse, GAP, Grid, Interval, Mark, Note, Shape};
pub use style::{Anchor, Dash, Fill, Marker, Style};
