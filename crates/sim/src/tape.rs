//! Draws that are made once for many simulations that meet the same.

use crate::World;
use crate::cast::LANES;
use crate::noise::{Stream, Streams};

/// What one run draws in its laps, made once for many simulations that meet the same draws: without it a quarter of the time of
/// laps goes to making them.
///
/// A run that takes longer between two gates than most, or goes farther, makes what the tape lacks itself: whoever drives with a
/// tape gets the same bits as without.
#[derive(Debug)]
pub struct Tape {
    streams: Streams,
    slip: Taped,
    sense: Taped,
    camera: Taped,
}

/// One purpose's draws, stretch by stretch.
#[derive(Debug)]
struct Taped {
    per_stretch: usize,
    draws: Vec<f64>,
}

/// How much of its streams a tape holds.
struct Length {
    /// Stretches from gate to gate.
    stretches: usize,
    /// Control steps in each.
    steps: usize,
    /// Draws of slip, of readings and of the camera in a control step.
    per_step: [usize; 3],
}

impl Tape {
    /// Draws for so many laps after the first.
    pub fn new(world: &World<'_>, streams: Streams, laps: usize) -> Self {
        let length = Length::new(world, laps);
        let tape = |purpose, per_step: usize, draw: fn(&mut Stream) -> f64| {
            let mut stream = streams.open(purpose);
            let per_stretch = per_step * length.steps;
            let mut draws = Vec::with_capacity(per_stretch * length.stretches);
            for stretch in 0..length.stretches as u64 {
                stream.enter(stretch);
                draws.extend((0..per_stretch).map(|_| draw(&mut stream)));
            }
            Taped { per_stretch, draws }
        };
        let [slip, sense, camera] = length.per_step;
        Self {
            streams,
            slip: tape("slip", slip, Stream::symmetric),
            sense: tape("sense", sense, Stream::normal),
            camera: tape("camera", camera, Stream::normal),
        }
    }

    /// Memory that [`Tape::new`] would take.
    pub fn bytes(world: &World<'_>, laps: usize) -> usize {
        let Length {
            stretches,
            steps,
            per_step,
        } = Length::new(world, laps);
        stretches * steps * per_step.iter().sum::<usize>() * size_of::<f64>()
    }

    /// The streams that it was made from.
    pub fn streams(&self) -> Streams {
        self.streams
    }
}

impl Length {
    fn new(world: &World<'_>, laps: usize) -> Self {
        /// Most robots take less than so many times as long as along the midline.
        const TIMES: f64 = 1.3;
        let (rules, gates) = (world.rules(), world.circuit().gates.len());
        let steps = world.nominal_lap_s() / rules.control_step_s / gates as f64;
        Self {
            // The lap that does not count, and the way to where it begins.
            stretches: (laps + 2) * gates,
            steps: (TIMES * steps).ceil() as usize,
            per_step: [2 * rules.physics_steps as usize, LANES, 2],
        }
    }
}

impl Taped {
    /// What was drawn for a stretch; nothing for one that the tape does not reach.
    fn of_stretch(&self, stretch: u64) -> &[f64] {
        let start = (usize::try_from(stretch).ok()).and_then(|stretch| stretch.checked_mul(self.per_stretch));
        let end = start.and_then(|start| start.checked_add(self.per_stretch));
        (start.zip(end))
            .and_then(|(start, end)| self.draws.get(start..end))
            .unwrap_or(&[])
    }
}

/// Where a run's draws come from.
#[derive(Debug, Clone, Copy)]
pub enum Draws<'t> {
    /// They are made as the run needs them.
    Fresh(Streams),
    /// They were made before.
    Taped(&'t Tape),
}

impl From<Streams> for Draws<'_> {
    fn from(streams: Streams) -> Self {
        Self::Fresh(streams)
    }
}

impl<'t> From<&'t Tape> for Draws<'t> {
    fn from(tape: &'t Tape) -> Self {
        Self::Taped(tape)
    }
}

impl<'t> Draws<'t> {
    /// The run's streams.
    pub(crate) fn streams(self) -> Streams {
        match self {
            Self::Fresh(streams) => streams,
            Self::Taped(tape) => tape.streams,
        }
    }

    /// What slip, readings and the camera draw in its steps.
    pub(crate) fn of_steps(self) -> [Played<'t>; 3] {
        let open = |purpose, taped: fn(&'t Tape) -> &'t Taped| Played {
            stream: self.streams().open(purpose),
            taped: match self {
                Self::Fresh(_) => None,
                Self::Taped(tape) => Some(taped(tape)),
            },
            ready: &[],
        };
        [
            open("slip", |tape| &tape.slip),
            open("sense", |tape| &tape.sense),
            open("camera", |tape| &tape.camera),
        ]
    }
}

/// A stream, from its tape as far as that reaches. All its draws are of one kind, and come as many at a time as in a step.
#[derive(Debug)]
pub(crate) struct Played<'t> {
    stream: Stream,
    taped: Option<&'t Taped>,
    /// Draws of this stretch that are still to come from the tape; once there are none, the stream is past them.
    ready: &'t [f64],
}

impl Played<'_> {
    /// See [`Stream::enter`].
    pub(crate) fn enter(&mut self, stretch: u64) {
        self.stream.enter(stretch);
        if let Some(taped) = self.taped {
            self.ready = taped.of_stretch(stretch);
        }
    }

    /// See [`Stream::normal`].
    #[inline]
    pub(crate) fn normals<const N: usize>(&mut self) -> [f64; N] {
        self.next(Stream::normal)
    }

    /// See [`Stream::symmetric`].
    #[inline]
    pub(crate) fn symmetrics<const N: usize>(&mut self) -> [f64; N] {
        self.next(Stream::symmetric)
    }

    #[inline(always)]
    fn next<const N: usize>(&mut self, draw: fn(&mut Stream) -> f64) -> [f64; N] {
        let mut draws = [0.0; N];
        if let Some((made, rest)) = self.ready.split_first_chunk() {
            draws = *made;
            self.ready = rest;
            if rest.is_empty() {
                self.catch_up(draw);
            }
        } else {
            debug_assert!(self.ready.is_empty(), "a tape holds the draws of whole steps");
            draws.iter_mut().for_each(|place| *place = draw(&mut self.stream));
        }
        draws
    }

    /// Brings the stream past what came from the tape.
    #[cold]
    fn catch_up(&mut self, draw: fn(&mut Stream) -> f64) {
        for _ in 0..self.taped.map_or(0, |taped| taped.per_stretch) {
            draw(&mut self.stream);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{declared, scene};
    use crate::{Setting, drive};

    #[test]
    fn laps_with_a_tape_are_those_without_to_the_last_bit() {
        let streams = Streams { seed: 4, run: 2 };
        // One drives as most do, one takes too long for the tape between two gates, one goes on beyond its end.
        for (speed, laps, taped_laps) in [(1.0, 2, 2), (0.5, 2, 2), (1.0, 3, 1)] {
            let mut model = declared();
            let slower = Setting::constant(crate::find("wheel-scale").unwrap(), [speed]);
            model.effects.push(slower);
            let world = scene().world(&model, 0).unwrap();
            let tape = Tape::new(&scene().world(&declared(), 0).unwrap(), streams, taped_laps);
            let (mut fresh, mut played) = (Vec::new(), Vec::new());
            let without = drive(&world, streams, laps, |step| fresh.push(*step)).unwrap();
            let with = drive(&world, &tape, laps, |step| played.push(*step)).unwrap();
            assert_eq!(without.laps.len(), laps);
            assert!(without == with && fresh == played, "{speed} {laps}");
        }
    }

    #[test]
    fn a_tape_holds_most_of_what_a_run_draws() {
        let (model, streams) = (declared(), Streams { seed: 4, run: 0 });
        let world = scene().world(&model, 0).unwrap();
        let tape = Tape::new(&world, streams, 3);
        let held = tape.sense.draws.len() + tape.slip.draws.len() + tape.camera.draws.len();
        assert_eq!(Tape::bytes(&world, 3), held * size_of::<f64>());
        let steps = drive(&world, &tape, 3, |_| ()).unwrap().steps as usize;
        let per_step = LANES + 2 + 2 * world.rules().physics_steps as usize;
        assert!(
            steps * per_step < held && held < 2 * steps * per_step,
            "{steps} steps, {held} draws"
        );
    }

    #[test]
    fn stretches_that_a_tape_does_not_reach_are_empty() {
        let taped = Taped {
            per_stretch: 3,
            draws: vec![0.0, 0.1, 0.2, 1.0, 1.1, 1.2],
        };
        assert_eq!(taped.of_stretch(1), [1.0, 1.1, 1.2]);
        for beyond in [2, u64::MAX, u64::MAX / 3] {
            assert!(taped.of_stretch(beyond).is_empty());
        }
    }
}
