//! How much room text takes.

/// Advance widths of the letters a to z in DejaVu Sans, the widest of the usual fonts, in thousandths of the font size.
const LOWER: [u16; 26] = [
    613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579, 278, 974, 634, 612, 635, 635, 411, 521, 392, 634,
    592, 818, 592, 592, 525,
];
/// The same for A to Z.
const UPPER: [u16; 26] = [
    684, 686, 698, 770, 632, 575, 775, 752, 295, 295, 656, 557, 863, 748, 787, 603, 787, 695, 635, 611, 732,
    684, 989, 685, 611, 685,
];

/// The distance between lines, in font sizes.
pub(crate) const LINE: f64 = 1.25;

fn advance(letter: char) -> f64 {
    let thousandths = match letter {
        'a'..='z' => LOWER[letter as usize - 'a' as usize],
        'A'..='Z' => UPPER[letter as usize - 'A' as usize],
        ' ' | '.' | ',' | '\'' | '|' => 318,
        '-' | '(' | ')' | '[' | ']' | '/' | ':' | ';' => 391,
        '⁰' | '¹' | '²' | '³' | '⁴'..='⁹' | '⁻' => 450,
        '%' | '@' | 'µ' | 'μ' => 950,
        '+' | '=' | '<' | '>' | '−' | '×' | '±' | '≤' | '≥' => 838,
        letter if letter.is_ascii() => 636,
        letter if (letter as u32) < 0x2000 => 720,
        _ => 1000,
    };
    f64::from(thousandths) / 1000.0
}

/// The width of a text in px, at most: fonts that a reader is likely to have are as wide or narrower.
pub(crate) fn width_px(text: &str, size_px: f64) -> f64 {
    text.chars().map(advance).sum::<f64>() * size_px
}

/// The width of the widest line, px.
pub(crate) fn widest_px(lines: &[String], size_px: f64) -> f64 {
    lines
        .iter()
        .map(|line| width_px(line, size_px))
        .fold(0.0, f64::max)
}

/// The text in lines no wider than asked for, broken at spaces; a word that is wider stands alone.
pub(crate) fn wrap(text: &str, size_px: f64, room_px: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_px(line, size_px) + width_px(word, size_px) + 0.32 * size_px <= room_px => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn width_grows_with_size_and_length() {
        assert!((width_px("abc", 10.0) - 17.98).abs() < 1e-9);
        assert!((width_px("abc", 20.0) - 35.96).abs() < 1e-9);
    }

    #[test]
    fn lines_keep_to_their_room() {
        let text = "one two three four five six";
        let lines = wrap(text, 10.0, 60.0);
        assert!(
            lines.len() > 1 && lines.iter().all(|line| width_px(line, 10.0) <= 60.0),
            "{lines:?}"
        );
        assert_eq!(lines.join(" "), text);
    }

    #[test]
    fn a_long_word_stands_alone() {
        assert_eq!(
            wrap("a incomprehensible b", 10.0, 20.0),
            ["a", "incomprehensible", "b"]
        );
    }
}
