//! The format of a log (delimiter, decimal sign, header), determined from its first lines.

use std::collections::BTreeMap;

use super::cells::{Delimiter, before_comment, is_comment, is_hexadecimal, is_missing, number, split};
use super::{Meta, Options};
use crate::{Error, Result};

/// A line longer than this many bytes (about ten thousand columns) is not a row of a log.
const MAX_ROW_BYTES: usize = 1 << 18;

/// Format of a log.
#[derive(Debug, Clone)]
pub(super) struct Dialect {
    pub delimiter: Delimiter,
    pub decimal_comma: bool,
    pub terminator: u8,
    /// Number of cells in a row.
    pub count: usize,
    /// True if rows end with a superfluous delimiter.
    pub trailing: bool,
    pub header: Option<Vec<String>>,
    header_line: Option<usize>,
    skipped: usize,
    /// Number of text lines before the first row, comments included.
    pub preamble: usize,
}

/// A line that is neither empty nor a comment.
struct Line<'a> {
    number: usize,
    text: &'a [u8],
}

impl Dialect {
    /// Format of the log called `name`, from its first lines.
    pub(super) fn find(name: &str, head: &[u8], options: &Options) -> Result<Self> {
        let feed = memchr::memchr(b'\n', head).is_some() || memchr::memchr(b'\r', head).is_none();
        let terminator = if feed { b'\n' } else { b'\r' };
        let mut lines = Vec::new();
        // Lines of nothing but tabs, with their number of cells. They are rows if the tab is the delimiter and rows
        // have this number of cells.
        let mut tabs = Vec::new();
        // A comment directly before the first line may hold the column names.
        let mut comment = None;
        for (i, text) in head.split(|&byte| byte == terminator).enumerate() {
            // Keep tabs at both ends, which may delimit empty cells.
            let text = without_comment(trimmed(text));
            let line = Line { number: i + 1, text };
            if is_comment(text.trim_ascii()) {
                if lines.is_empty() {
                    comment = Some(line);
                }
            } else if !text.trim_ascii().is_empty() {
                lines.push(line);
            } else if !text.is_empty() {
                tabs.push((line.number, text.len() + 1));
            }
        }
        if lines.is_empty() {
            return Err(no_rows(name));
        }
        if let Some(line) = lines.iter().find(|line| line.text.len() > MAX_ROW_BYTES) {
            return Err(Error::Input(format!(
                "{name}: row {} has {} bytes: a row is one moment; samples that stand in a row have to be transposed",
                line.number,
                line.text.len()
            )));
        }
        let (delimiter, decimal_comma) = choose(&lines, comment.as_ref(), options);
        let number = |cell: &[u8]| number(cell, decimal_comma);
        let usual = usual_width(&lines, delimiter, &number);
        let is_row = |line: &Line| {
            let mut cells = split(line.text, delimiter);
            let usual = usual == 0 || cells.len() == usual;
            let plain = cells.iter().all(|cell| number(cell).is_some());
            if let Some(wanted) = &options.columns {
                cells = wanted.iter().filter_map(|&column| cells.get(column).copied()).collect();
            }
            let numbers = cells.iter().filter(|cell| !is_missing(cell) && number(cell).is_some()).count();
            let words = cells.iter().filter(|cell| number(cell).is_none()).count();
            // A line of mostly words is a header, even if some names are numbers. Other lines are rows, perhaps with
            // a bad cell. But a word and a number before rows of another width ("Fs,100") are a preamble, whatever
            // column is wanted.
            (words == 0 && (usual || plain)) || (numbers >= words && usual)
        };
        let first = first_row(name, &lines, lines.iter().position(is_row), delimiter, usual, &number)?;
        let rows: Vec<Vec<&[u8]>> = lines[first..].iter().map(|line| split(line.text, delimiter)).collect();
        let mut count = rows[0].len();
        let ends_empty =
            |cells: &[&[u8]]| cells.len() > 1 && cells.last().is_some_and(|cell| cell.is_empty());
        let fits =
            |cells: &[String]| cells.len() == count || (cells.len() + 1 == count && ends_empty(&rows[0]));
        let before: Vec<_> = lines[..first].iter().map(|line| names(line.text, delimiter, count)).collect();
        let mut header = None;
        let mut header_line = None;
        if let Some(i) = before.iter().position(|cells| fits(cells)) {
            header = Some(before[i].clone());
            header_line = Some(lines[i].number);
        } else if let ([cells], Delimiter::Byte(_)) = (before.as_slice(), delimiter)
            && cells.len() > 1
            && cells.iter().all(|cell| number(cell.as_bytes()).is_none())
        {
            let (row, found) = (lines[first].number, cells.len());
            return Err(Error::Input(format!("{name}: row {row} has {count} columns, the header {found}")));
        } else if first == 0
            && count > 1
            && let Some(line) = comment
        {
            let cells = names(uncommented(line.text), delimiter, count);
            if fits(&cells) && cells.iter().all(|cell| number(cell.as_bytes()).is_none()) {
                header = Some(cells);
                header_line = Some(line.number);
            }
        }
        let trailing = ends_empty(&rows[0])
            && delimiter != Delimiter::Space
            && match &header {
                Some(cells) => cells.len() + 1 == count || cells.last().is_some_and(String::is_empty),
                None => rows.iter().all(|cells| ends_empty(cells)),
            };
        if trailing {
            count -= 1;
            if let Some(cells) = &mut header {
                cells.truncate(count);
            }
        }
        let skipped = first - usize::from(first > 0 && header.is_some());
        let mut preamble = lines[first].number - 1;
        let cells = rows[0].len();
        while delimiter == Delimiter::Byte(b'\t') && tabs.contains(&(preamble, cells)) {
            preamble -= 1;
        }
        Ok(Self {
            delimiter,
            decimal_comma,
            terminator,
            count,
            trailing,
            header,
            header_line,
            skipped,
            preamble,
        })
    }

    /// Metadata that is known before the first row is read.
    pub(super) fn meta(&self) -> Meta {
        Meta {
            delimiter: match self.delimiter {
                Delimiter::Byte(byte) => byte as char,
                Delimiter::Space => ' ',
            },
            decimal_comma: self.decimal_comma,
            comments: 0,
            blank: 0,
            header_line: self.header_line,
            skipped: self.skipped,
            missing: 0,
            rows: 0,
        }
    }
}

/// Index of the first row. Two or more preceding rows of hexadecimal numbers are an error, because their samples
/// would silently be lost. A single one may hold names, such as those of registers.
fn first_row(
    name: &str,
    lines: &[Line],
    first: Option<usize>,
    delimiter: Delimiter,
    usual: usize,
    number: &impl Fn(&[u8]) -> Option<f64>,
) -> Result<usize> {
    let before = &lines[..first.unwrap_or(lines.len())];
    let mut foreign = before.iter().filter_map(|line| {
        // The delimiter is unknown if no cell is a number, so split at all common ones.
        let mut cells = line.text.split(|byte| b",;|\t ".contains(byte)).filter(|cell| !cell.is_empty());
        let all = cells.clone().all(|cell| is_hexadecimal(cell) || number(cell).is_some());
        let usual = usual == 0 || split(line.text, delimiter).len() == usual;
        let found = cells.find(|cell| is_hexadecimal(cell))?;
        (usual && all).then(|| (line.number, decoded(found)))
    });
    if let (Some((row, cell)), Some(_)) = (foreign.next(), foreign.next()) {
        return Err(Error::Input(format!("{name}: row {row} has {cell}: hexadecimal numbers are not read")));
    }
    first.ok_or_else(|| no_rows(name))
}

/// Number of cells of most rows that consist of numbers only; 0 if there is no such row.
fn usual_width(lines: &[Line], delimiter: Delimiter, number: &impl Fn(&[u8]) -> Option<f64>) -> usize {
    let mut widths = BTreeMap::new();
    for line in &lines[..lines.len().min(256)] {
        let cells = split(line.text, delimiter);
        if cells.iter().all(|cell| number(cell).is_some()) {
            *widths.entry(cells.len()).or_insert(0) += 1;
        }
    }
    widths.into_iter().max_by_key(|&(_, rows)| rows).map_or(0, |(width, _)| width)
}

/// A row of numbers without its trailing comment; other lines unchanged.
fn without_comment(line: &[u8]) -> &[u8] {
    let are_numbers =
        |text: &&[u8]| text.split(|byte| b",;|\t ".contains(byte)).all(|cell| number(cell, false).is_some());
    before_comment(line).filter(are_numbers).unwrap_or(line)
}

/// A line without blanks at both ends; tabs are kept.
fn trimmed(line: &[u8]) -> &[u8] {
    let is_text = |byte: &u8| *byte == b'\t' || !byte.is_ascii_whitespace();
    let start = line.iter().position(is_text).unwrap_or(line.len());
    let end = line.iter().rposition(is_text).map_or(start, |last| last + 1);
    &line[start..end]
}

/// Error for a log without rows.
pub(super) fn no_rows(name: &str) -> Error {
    Error::Input(format!("{name}: no rows of numbers in it"))
}

/// A comment without its leading comment characters.
fn uncommented(line: &[u8]) -> &[u8] {
    let start = line.iter().position(|byte| !b"#%!/ \t".contains(byte)).unwrap_or(line.len());
    &line[start..]
}

/// Weight of a row of numbers relative to a single number, in `score`.
const ROW_WEIGHT: usize = 1_000_000;

/// Delimiter and decimal sign with which most lines are rows of numbers.
fn choose(lines: &[Line], comment: Option<&Line>, options: &Options) -> (Delimiter, bool) {
    let delimiters = match options.delimiter {
        Some(b' ') => vec![Delimiter::Space],
        Some(byte) => vec![Delimiter::Byte(byte)],
        None => {
            [b'\t', b';', b'|', b','].map(Delimiter::Byte).into_iter().chain([Delimiter::Space]).collect()
        }
    };
    let signs = options.decimal_comma.map_or(vec![false, true], |comma| vec![comma]);
    let sample = &lines[..lines.len().min(256)];
    let mut best = (0, (*delimiters.last().unwrap_or(&Delimiter::Space), signs[0]));
    for &delimiter in &delimiters {
        for &comma in &signs {
            if comma && delimiter == Delimiter::Byte(b',') && options.delimiter.is_none() && !quoted(sample) {
                continue;
            }
            let score = score(sample, delimiter, comma);
            // Blanks within tab-separated cells separate date and time, not columns.
            let tabs = best.1.0 == Delimiter::Byte(b'\t')
                && (best.0 >= ROW_WEIGHT && score / ROW_WEIGHT <= best.0 / ROW_WEIGHT
                    || is_table(sample, best.1.0));
            if tabs && delimiter == Delimiter::Space {
                continue;
            }
            if score > best.0 {
                best = (score, (delimiter, comma));
            }
        }
    }
    let found = best.1;
    let free = options.delimiter.is_none() && options.decimal_comma.is_none();
    if free && found == (Delimiter::Byte(b','), false) && is_one_column(sample, comment) {
        return (Delimiter::Space, true);
    }
    found
}

/// True if a delimiter splits all lines, header included, into the same number of cells (at least two). This
/// recognizes tables with a column of text, which have no rows of numbers only.
fn is_table(sample: &[Line], delimiter: Delimiter) -> bool {
    let mut widths = sample.iter().map(|line| split(line.text, delimiter).len());
    widths.next().is_some_and(|first| first > 1 && sample.len() > 1 && widths.all(|width| width == first))
}

/// True if commas in lines like "1,2" are decimal commas rather than delimiters. Evidence is a header with a single
/// name, or a whole part of −0, which an integer never has.
fn is_one_column(sample: &[Line], comment: Option<&Line>) -> bool {
    let Some(first) = sample.iter().position(|line| whole_part(line.text).is_some()) else { return false };
    let mut negative_zero = false;
    for line in &sample[first..] {
        match whole_part(line.text) {
            Some(whole) => negative_zero |= whole == b"-0",
            None if number(line.text.trim_ascii(), true).is_some() => {}
            None => return false,
        }
    }
    // A comma between names means two columns.
    if sample[..first].iter().chain(comment).any(|line| line.text.contains(&b',')) {
        return false;
    }
    // "Serial: 5" is not a column name.
    let one_name = first == 1
        && number(sample[0].text.trim_ascii(), true).is_none()
        && !sample[0].text.iter().any(|byte| b";|:=\t".contains(byte));
    one_name || negative_zero
}

/// Whole part of a line that is a number like -12,0345; `None` for other lines.
fn whole_part(line: &[u8]) -> Option<&[u8]> {
    let line = line.trim_ascii();
    let (whole, fraction) = line.split_at(memchr::memchr(b',', line)?);
    let digits = |text: &[u8]| !text.is_empty() && text.iter().all(u8::is_ascii_digit);
    let unsigned = whole.strip_prefix(b"-").or(whole.strip_prefix(b"+")).unwrap_or(whole);
    (digits(unsigned)
        && number(line, true).is_some()
        && fraction[1..].first().is_some_and(u8::is_ascii_digit))
    .then_some(whole)
}

/// True if a line contains a double quote.
fn quoted(sample: &[Line]) -> bool {
    sample.iter().any(|line| line.text.contains(&b'"'))
}

/// Score of a delimiter and decimal sign. Most important is the number of rows that consist of numbers only and have
/// the same number of cells, then the number of numbers. Delimiters that separate nothing score nothing. Decimal
/// commas that could be delimiters in most lines ("1,2") get no credit for rows, so that one short row does not turn
/// two columns into one.
fn score(sample: &[Line], delimiter: Delimiter, comma: bool) -> usize {
    let mut numbers = 0;
    let mut widths = BTreeMap::new();
    let mut either = 0;
    let is_inside = |line: &Line| line.text.trim_ascii().contains(&b'\t');
    if delimiter == Delimiter::Byte(b'\t')
        && (sample.iter().all(|line| line.text.starts_with(b"\t")) || !sample.iter().any(is_inside))
    {
        // Tabs that indent every line or stand only at the ends separate nothing.
        return 0;
    }
    for line in sample {
        let cells = split(line.text, delimiter);
        if cells.len() == 1 && delimiter != Delimiter::Space {
            continue;
        }
        let good = cells.iter().filter(|cell| number(cell, comma).is_some()).count();
        numbers += good;
        if good == cells.len() {
            *widths.entry(good).or_insert(0) += 1;
            either += usize::from(comma && good == 1 && cells[0].contains(&b','));
        }
    }
    let rows: usize = widths.into_values().max().unwrap_or(0);
    if delimiter == Delimiter::Space && 2 * either > rows {
        return numbers;
    }
    ROW_WEIGHT * rows + numbers
}

/// Cells of a line as names of `count` columns.
fn names(line: &[u8], delimiter: Delimiter, count: usize) -> Vec<String> {
    let mut cells: Vec<String> = split(line, delimiter).into_iter().map(decoded).collect();
    if delimiter == Delimiter::Byte(b'\t') && cells.len() == count + 1 && cells[count].is_empty() {
        // Drop the empty cell after a tab at the end.
        cells.pop();
    }
    if delimiter == Delimiter::Space && cells.len() != count {
        if count == 1 {
            return vec![decoded(line.trim_ascii())];
        }
        // Join a unit in brackets, which may contain blanks, to the name before it.
        let mut merged: Vec<String> = Vec::new();
        let mut open = false;
        for cell in cells {
            let joins = open || cell.starts_with(['[', '(']);
            let closed = cell.ends_with([']', ')']);
            match merged.last_mut() {
                Some(last) if joins => {
                    last.push(' ');
                    last.push_str(&cell);
                }
                _ => merged.push(cell),
            }
            open = joins && !closed;
        }
        cells = merged;
    }
    cells
}

/// Text decoded as UTF-8 or, if that fails, as Latin-1 (older loggers write degree signs in Latin-1).
pub(super) fn decoded(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| byte as char).collect(),
    }
}
