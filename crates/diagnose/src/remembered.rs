//! Answers to questions that are asked again.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard};

/// Why the lock of a list is not poisoned.
pub(crate) const NO_PANIC: &str = "no thread panics while it holds the list";

/// The latest answers, by what was asked.
#[derive(Debug)]
pub(crate) struct Remembered<Q, A> {
    kept: usize,
    /// Oldest first.
    known: Mutex<VecDeque<(Q, A)>>,
}

impl<Q, A: Clone> Remembered<Q, A> {
    /// So many of them are kept.
    pub(crate) fn new(kept: usize) -> Self {
        Self {
            kept,
            known: Mutex::default(),
        }
    }

    /// The answer to a question that `is_it` knows.
    pub(crate) fn find(&self, is_it: impl Fn(&Q) -> bool) -> Option<A> {
        let known = self.known();
        let found = known.iter().rev().find(|(question, _)| is_it(question));
        found.map(|(_, answer)| answer.clone())
    }

    /// Keeps an answer.
    pub(crate) fn keep(&self, question: Q, answer: A) {
        let mut known = self.known();
        if known.len() == self.kept {
            known.pop_front();
        }
        known.push_back((question, answer));
    }

    fn known(&self) -> MutexGuard<'_, VecDeque<(Q, A)>> {
        self.known.lock().expect(NO_PANIC)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_answers_are_known() {
        let squares = Remembered::new(2);
        (1..=3).for_each(|n| squares.keep(n, n * n));
        let of = |n: i32| squares.find(|question| *question == n);
        assert_eq!([of(1), of(2), of(3)], [None, Some(4), Some(9)]);
        // Of two answers the later one.
        squares.keep(3, 10);
        assert_eq!([of(2), of(3)], [None, Some(10)]);
    }
}
