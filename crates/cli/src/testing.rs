//! Texts for property tests.

use std::ops::RangeInclusive;

use proptest::prelude::*;

pub(crate) const LETTERS: &str = "abcdefghijklmnopqrstuvwxyz";
pub(crate) const DIGITS: &str = "0123456789";

/// Words of so many characters.
pub(crate) fn word(
    characters: impl Strategy<Value = char>,
    length: RangeInclusive<usize>,
) -> impl Strategy<Value = String> {
    proptest::collection::vec(characters, length).prop_map(String::from_iter)
}

/// One of the characters of some texts.
pub(crate) fn one_of(texts: &[&str]) -> impl Strategy<Value = char> {
    let characters: Vec<char> = texts.iter().flat_map(|text| text.chars()).collect();
    proptest::sample::select(characters)
}
