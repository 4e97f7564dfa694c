//! What is computed from values that seldom change.

/// A function's last value, for as long as it is asked for the same.
#[derive(Debug, Default)]
pub(super) struct Kept<const N: usize, T> {
    last: Option<([f64; N], T)>,
}

impl<const N: usize, T: Copy> Kept<N, T> {
    /// The function's value.
    #[inline]
    pub(super) fn of(&mut self, asked: [f64; N], function: impl FnOnce([f64; N]) -> T) -> T {
        match self.last {
            Some((known, value)) if known == asked => value,
            _ => {
                let value = function(asked);
                self.last = Some((asked, value));
                value
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_is_called_where_its_arguments_change() {
        let (mut kept, mut calls) = (Kept::default(), 0);
        let values = [2.0, 2.0, 3.0, 2.0].map(|x| {
            kept.of([x, 1.0], |[x, y]| {
                calls += 1;
                x + y
            })
        });
        assert_eq!((values, calls), ([3.0, 3.0, 4.0, 3.0], 3));
    }
}
