//! Fast parser for the lines that most logs consist of.

use super::cells::{Delimiter, is_comment, number};
use super::dialect::Dialect;

/// Parses the wanted cells of a simple line into `row` and returns the number of missing cells.
///
/// `None` means that the line is not simple. The slow parser must then parse it or explain the error.
pub(super) fn parse_simple_line(
    line: &[u8],
    dialect: &Dialect,
    wanted: &[bool],
    row: &mut [f64],
) -> Option<usize> {
    let (delimiter, spaced) = match dialect.delimiter {
        Delimiter::Byte(byte) => (byte, false),
        Delimiter::Space => (b' ', true),
    };
    let is_blank = |byte: u8| byte == b' ' || (byte == b'\t' && delimiter != b'\t');
    let after_blanks = |mut at: usize| {
        while at < line.len() && is_blank(line[at]) {
            at += 1;
        }
        at
    };
    let length_of_cell = |rest: &[u8]| {
        let end = if spaced {
            rest.iter().position(|&byte| is_blank(byte))
        } else {
            memchr::memchr2(delimiter, b'"', rest)
        };
        end.unwrap_or(rest.len())
    };
    let mut at = 0;
    let mut missing = 0;
    for (j, (value, &wanted)) in row.iter_mut().zip(wanted).enumerate() {
        if j > 0 && !spaced {
            if line.get(at) != Some(&delimiter) {
                return None;
            }
            at += 1;
        } else if j > 0 && !line.get(at).copied().is_some_and(is_blank) {
            return None;
        }
        at = after_blanks(at);
        let rest = &line[at..];
        if !wanted {
            // An unwanted cell may hold any text, but the line must not be a comment.
            if j == 0 && is_comment(rest) {
                return None;
            }
            at += length_of_cell(rest);
        } else if rest.first() == Some(&delimiter) {
            *value = f64::NAN;
            missing += 1;
        } else {
            let length;
            (*value, length) = if dialect.decimal_comma {
                let length = length_of_cell(rest);
                (number(rest[..length].trim_ascii_end(), true)?, length)
            } else {
                fast_float2::parse_partial(rest).ok()?
            };
            if !value.is_finite() {
                if value.is_infinite() {
                    return None;
                }
                missing += 1;
            }
            at += length;
        }
        if !spaced {
            at = after_blanks(at);
        }
    }
    at = after_blanks(at);
    if dialect.trailing && line.get(at) == Some(&delimiter) {
        at = after_blanks(at + 1);
    }
    (at == line.len()).then_some(missing)
}
