//! Ctrl-C and termination: the first asks the work to stop, the second ends the program at once.

use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};

/// Exit status after the second Ctrl-C: 128 and the number of the signal, as shells have it.
const EXIT_STATUS: i32 = 130;

static STOP: Flag = Flag::new();

/// Why work stopped; [`anyhow::Error::is`] finds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Interrupted {
    /// The command cannot resume.
    #[error("interrupted: nothing was written")]
    Dropped,
    /// The command can.
    #[error("interrupted: run again with --resume to go on")]
    Resumable,
}

/// Catches Ctrl-C, and termination where the system has it, from here on.
///
/// # Errors
/// The system does not let us.
pub(crate) fn install() -> Result<()> {
    ctrlc::set_handler(|| {
        if STOP.raise() {
            eprintln!("lapwing: stopped at once; a folder that was begun is the .partial one beside --out");
            std::process::exit(EXIT_STATUS);
        }
    })
    .context("cannot catch Ctrl-C")
}

/// Nothing, until Ctrl-C is pressed; to be called between units of work.
///
/// # Errors
/// [`Interrupted::Dropped`] once it is.
pub(crate) fn check() -> Result<(), Interrupted> {
    STOP.check(Interrupted::Dropped)
}

/// As [`check`], for work that `--resume` takes up.
///
/// # Errors
/// [`Interrupted::Resumable`] once Ctrl-C is pressed.
pub(crate) fn check_resumable() -> Result<(), Interrupted> {
    STOP.check(Interrupted::Resumable)
}

#[derive(Debug)]
struct Flag(AtomicBool);

impl Flag {
    const fn new() -> Self {
        Self(AtomicBool::new(false))
    }

    /// Whether it was up already.
    fn raise(&self) -> bool {
        self.0.swap(true, Ordering::Relaxed)
    }

    fn check(&self, error: Interrupted) -> Result<(), Interrupted> {
        if self.0.load(Ordering::Relaxed) {
            Err(error)
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_signal_asks_and_the_second_is_told_apart() {
        let flag = Flag::new();
        assert_eq!(flag.check(Interrupted::Dropped), Ok(()));
        assert!(!flag.raise());
        let error = flag.check(Interrupted::Resumable).unwrap_err();
        assert_eq!(error.to_string(), "interrupted: run again with --resume to go on");
        assert!(flag.raise());
    }

    #[test]
    fn an_interrupt_is_found_under_its_context() {
        let error = anyhow::Error::from(Interrupted::Dropped).context("run a");
        assert!(error.is::<Interrupted>());
        assert_eq!(format!("{error:#}"), "run a: interrupted: nothing was written");
    }
}
