//! How far work has come, on stderr: a bar on a terminal, else a line now and then.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Between two lines where there is no terminal.
const INTERVAL: Duration = Duration::from_secs(10);

/// Progress over a known number of units, to be shared by threads. A bar vanishes when dropped.
#[derive(Debug)]
pub(crate) struct Progress(Sink);

#[derive(Debug)]
enum Sink {
    Silent,
    Bar(ProgressBar),
    Lines(Lines<std::io::Stderr>),
}

impl Progress {
    /// Progress from 0 to `total`, on stderr; silent with `--quiet`.
    pub(crate) fn new(message: &str, total: u64, quiet: bool) -> Self {
        Self::over(message, Some(total), quiet)
    }

    /// Progress of work that ends nobody knows when, on stderr: what is being done, and for how long; silent with `--quiet`.
    pub(crate) fn open(message: &str, quiet: bool) -> Self {
        Self::over(message, None, quiet)
    }

    fn over(message: &str, total: Option<u64>, quiet: bool) -> Self {
        Self(if quiet {
            Sink::Silent
        } else if std::io::stderr().is_terminal() {
            Sink::Bar(bar(message, total))
        } else {
            Sink::Lines(Lines::new(std::io::stderr(), message, total, INTERVAL))
        })
    }

    /// Counts `units` more as done.
    pub(crate) fn tick(&self, units: u64) {
        match &self.0 {
            Sink::Silent => {}
            Sink::Bar(bar) => bar.inc(units),
            Sink::Lines(lines) => lines.tick(units),
        }
    }

    /// Says what is being done now.
    pub(crate) fn message(&self, message: &str) {
        match &self.0 {
            Sink::Silent => {}
            Sink::Bar(bar) => bar.set_message(message.to_owned()),
            Sink::Lines(lines) => lines.message(message),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Sink::Bar(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

fn bar(message: &str, total: Option<u64>) -> ProgressBar {
    let (bar, template) = match total {
        Some(total) => (ProgressBar::new(total), "{msg} {wide_bar} {pos}/{len} {eta}"),
        None => (ProgressBar::new_spinner(), "{spinner} {elapsed} {wide_msg}"),
    };
    let style =
        ProgressStyle::with_template(template).expect("both templates are constants, which a test checks");
    let bar = bar.with_style(style).with_message(message.to_owned());
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

#[derive(Debug)]
struct Lines<W> {
    done: AtomicU64,
    total: Option<u64>,
    interval: Duration,
    said: Mutex<Said<W>>,
}

#[derive(Debug)]
struct Said<W> {
    to: W,
    message: String,
    at: Instant,
}

impl<W: Write> Lines<W> {
    fn new(to: W, message: &str, total: Option<u64>, interval: Duration) -> Self {
        let said = Said {
            to,
            message: message.to_owned(),
            at: Instant::now(),
        };
        Self {
            done: AtomicU64::new(0),
            total,
            interval,
            said: Mutex::new(said),
        }
    }

    fn tick(&self, units: u64) {
        let done = units + self.done.fetch_add(units, Ordering::Relaxed);
        // Whoever finds the lock taken has nothing to add to what is being said.
        if let Ok(mut said) = self.said.try_lock() {
            self.say(&mut said, done);
        }
    }

    fn message(&self, message: &str) {
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        message.clone_into(&mut said.message);
        if self.total.is_none() {
            self.say(&mut said, 0);
        }
    }

    /// A line, if the last one was said long enough ago.
    fn say(&self, said: &mut Said<W>, done: u64) {
        if said.at.elapsed() < self.interval {
            return;
        }
        said.at = Instant::now();
        let line = match self.total {
            Some(total) => format!("{}: {done} of {total}", said.message),
            None => said.message.clone(),
        };
        write_line(&mut said.to, &line);
    }
}

/// Progress that cannot be shown is no reason to stop working.
fn write_line(to: &mut impl Write, line: &str) {
    let _ = writeln!(to, "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(lines: Lines<Vec<u8>>) -> String {
        String::from_utf8(lines.said.into_inner().unwrap().to).unwrap()
    }

    #[test]
    fn lines_count_and_carry_the_message() {
        let lines = Lines::new(Vec::new(), "driving", Some(3), Duration::ZERO);
        lines.tick(1);
        lines.message("comparing");
        lines.tick(2);
        assert_eq!(said(lines), "driving: 1 of 3\ncomparing: 3 of 3\n");
    }

    #[test]
    fn lines_without_an_end_say_what_is_done() {
        let lines = Lines::new(Vec::new(), "naming", None, Duration::ZERO);
        lines.message("naming: wheel-scale");
        assert_eq!(said(lines), "naming: wheel-scale\n");
        Progress(Sink::Bar(bar("naming", None))).message("naming: slip-level");
    }

    #[test]
    fn lines_keep_quiet_for_their_interval() {
        let lines = Lines::new(Vec::new(), "driving", Some(1000), INTERVAL);
        (0..1000).for_each(|_| lines.tick(1));
        assert_eq!(lines.done.load(Ordering::Relaxed), 1000);
        assert_eq!(said(lines), "");
    }

    #[test]
    fn threads_lose_no_tick() {
        let lines = Lines::new(Vec::new(), "driving", Some(4000), Duration::ZERO);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..1000).for_each(|_| lines.tick(1)));
            }
        });
        assert_eq!(lines.done.load(Ordering::Relaxed), 4000);
    }

    #[test]
    fn the_template_of_the_bar_is_well_formed() {
        let progress = Progress(Sink::Bar(bar("driving", Some(2))));
        progress.tick(2);
        progress.message("comparing");
        Progress::new("silent", 1, true).tick(1);
    }
}
