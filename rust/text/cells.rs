//! Splitting lines into cells and parsing cells as numbers.

use super::moment::moment;

/// The separator of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Delimiter {
    Byte(u8),
    /// Any run of blanks and tabs.
    Space,
}

/// True if a line is a comment.
pub(super) fn is_comment(trimmed: &[u8]) -> bool {
    matches!(trimmed, [b'#' | b'%' | b'!', ..] | [b'/', b'/', ..]) && !starts_with_error(trimmed)
}

/// Error values of spreadsheets, which mean a missing number. A word that is the prefix of another comes after it.
const SPREADSHEET_ERRORS: [&[u8]; 8] =
    [b"#N/A", b"#NUM!", b"#DIV/0!", b"#VALUE!", b"#REF!", b"#NAME?", b"#NULL!", b"#NA"];

/// True if a line starts with an error value of a spreadsheet, so that its `#` does not start a comment.
fn starts_with_error(trimmed: &[u8]) -> bool {
    let is_error =
        |word: &&[u8]| trimmed.get(..word.len()).is_some_and(|cell| cell.eq_ignore_ascii_case(word));
    let Some(word) = SPREADSHEET_ERRORS.iter().find(|word| is_error(word)) else { return false };
    let rest = &trimmed[word.len()..];
    match rest.trim_ascii_start() {
        [] | [b',' | b';' | b'|', ..] => true,
        // "#NA means no answer" is a comment.
        next => {
            let end = next.iter().position(u8::is_ascii_whitespace).unwrap_or(next.len());
            rest[0] == b'\t' || (rest[0] == b' ' && number(&next[..end], true).is_some())
        }
    }
}

/// The part of a line before a trailing comment; `None` without one.
pub(super) fn before_comment(line: &[u8]) -> Option<&[u8]> {
    // A comment must follow a blank, which distinguishes it from a damaged number. A single percent sign is a unit.
    let begins = |at: &usize| {
        matches!(line[at - 1], b' ' | b'\t') && is_comment(&line[*at..]) && line[*at..].trim_ascii() != b"%"
    };
    let before = line[..(1..line.len()).find(begins)?].trim_ascii_end();
    (!before.is_empty()).then_some(before)
}

/// A cell without its enclosing quotes.
fn unquoted(cell: &[u8]) -> &[u8] {
    match cell {
        [b'"', inner @ .., b'"'] | [b'\'', inner @ .., b'\''] => inner.trim_ascii(),
        _ => cell,
    }
}

/// Cells of a line, trimmed and without quotes. Delimiters between double quotes do not separate.
pub(super) fn split(line: &[u8], delimiter: Delimiter) -> Vec<&[u8]> {
    let mut cells = Vec::new();
    let mut start = 0;
    let mut quoted = false;
    for (i, &byte) in line.iter().enumerate() {
        let separates = match delimiter {
            Delimiter::Byte(wanted) => byte == wanted,
            Delimiter::Space => byte.is_ascii_whitespace(),
        };
        if byte == b'"' {
            quoted = !quoted;
        } else if separates && !quoted {
            cells.push(&line[start..i]);
            start = i + 1;
        }
    }
    cells.push(&line[start..]);
    if delimiter == Delimiter::Space {
        cells.retain(|cell| !cell.is_empty());
    }
    cells.into_iter().map(|cell| unquoted(cell.trim_ascii())).collect()
}

/// True if a cell is empty or a word for a missing number.
pub(super) fn is_missing(cell: &[u8]) -> bool {
    const WORDS: [&[u8]; 6] = [b"", b"nan", b"na", b"n/a", b"null", b"none"];
    let words = if cell.starts_with(b"#") { &SPREADSHEET_ERRORS[..] } else { &WORDS[..] };
    words.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// Number in a cell, or seconds of a date-time; NaN if the cell means a missing number; `None` for other text.
pub(super) fn number(cell: &[u8], decimal_comma: bool) -> Option<f64> {
    if is_missing(cell) {
        return Some(f64::NAN);
    }
    if decimal_comma && memchr::memchr(b',', cell).is_some() {
        let mut copy = [0; 64];
        let copy = copy.get_mut(..cell.len())?;
        for (to, &from) in copy.iter_mut().zip(cell) {
            *to = match from {
                b',' => b'.',
                // 1.234,5 has a thousands separator, which is ambiguous.
                b'.' => return None,
                other => other,
            };
        }
        return fast_float2::parse(&*copy).ok().or_else(|| fortran(copy)).or_else(|| moment(cell));
    }
    fast_float2::parse(cell).ok().or_else(|| fortran(cell)).or_else(|| moment(cell))
}

/// Number with the exponent of a Fortran double: 1.5D-03, -.25d+2.
fn fortran(cell: &[u8]) -> Option<f64> {
    let mark = memchr::memchr2(b'D', b'd', cell)?;
    // Require a digit or a point before the mark and a digit at the end, because "3D" and "day" are words.
    let mantissa = mark > 0 && (cell[mark - 1].is_ascii_digit() || cell[mark - 1] == b'.');
    if !mantissa || !cell.last()?.is_ascii_digit() {
        return None;
    }
    let mut copy = [0; 64];
    let copy = copy.get_mut(..cell.len())?;
    copy.copy_from_slice(cell);
    copy[mark] = b'e';
    fast_float2::parse(&*copy).ok()
}

/// True if a cell is a hexadecimal number as C and Python print it ("-0x1.8p+3"). Such numbers are not supported.
pub(super) fn is_hexadecimal(cell: &[u8]) -> bool {
    let unsigned = cell.strip_prefix(b"-").or(cell.strip_prefix(b"+")).unwrap_or(cell);
    let [b'0', b'x' | b'X', digits @ ..] = unsigned else { return false };
    let digit = |byte: &u8| byte.is_ascii_hexdigit() || b".pP+-".contains(byte);
    digits.first().is_some_and(u8::is_ascii_hexdigit) && digits.iter().all(digit)
}
