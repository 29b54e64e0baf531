//! Parallel parsing of lines into columns, with the position of errors.

use rayon::prelude::*;

use super::Options;
use super::cells::{Delimiter, before_comment, is_comment, number, split};
use super::dialect::{Dialect, decoded};
use super::quick::parse_simple_line;
use crate::{Error, Result};

/// Number of pieces of a chunk that are parsed in parallel.
const PIECES: usize = 4;
/// Minimum size of a piece in bytes. Chosen by judgment; not measured.
const MIN_PIECE_BYTES: usize = 64 << 10;

/// Parsed piece: columns and counts of lines.
#[derive(Default)]
pub(super) struct Block {
    pub columns: Vec<Vec<f64>>,
    pub comments: usize,
    pub blank: usize,
    pub missing: usize,
    lines: usize,
    bad: Option<RowError>,
}

impl Block {
    /// Rows of numbers.
    pub(super) fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// Error in the last line of a piece.
enum RowError {
    Cell { column: usize, text: String },
    Infinite { column: usize, text: String },
    Count(usize),
}

/// The first rows of all columns of a log, whatever their cells contain.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// One vector per column; NaN for cells without a number.
    pub columns: Vec<Vec<f64>>,
    /// For each column, the number of cells with text other than a number or a word for a missing number.
    pub words: Vec<usize>,
    /// For each column, the first such cell, else the cell of the first row.
    pub cells: Vec<String>,
}

/// Parser of lines into the wanted columns.
pub(super) struct Rows {
    name: String,
    dialect: Dialect,
    /// Indices of the wanted columns, in the requested order.
    pub wanted: Vec<usize>,
    mask: Vec<bool>,
    /// True if infinite cells are errors.
    finite: bool,
    /// Number of lines before the next chunk.
    line: usize,
}

impl Rows {
    /// Parser for the log called `name`. Error if a wanted column does not exist.
    pub(super) fn new(name: &str, dialect: &Dialect, options: &Options) -> Result<Self> {
        let count = dialect.count;
        let wanted = options.columns.clone().unwrap_or_else(|| (0..count).collect());
        let name = name.to_owned();
        let (dialect, finite) = (dialect.clone(), options.finite);
        let mut rows = Self { name, dialect, wanted: Vec::new(), mask: Vec::new(), finite, line: 0 };
        rows.select(wanted)?;
        Ok(rows)
    }

    /// Selects other columns. Error if one does not exist or is given twice.
    pub(super) fn select(&mut self, wanted: Vec<usize>) -> Result<()> {
        let (name, count) = (&self.name, self.dialect.count);
        if let Some(column) = wanted.iter().find(|&&column| column >= count) {
            let named = column.saturating_add(1);
            return Err(Error::Input(format!("{name}: there is no column {named}; it has {count}")));
        }
        if wanted.is_empty() {
            return Err(Error::Input(format!("{name}: no column is requested")));
        }
        if let Some(column) = (1..wanted.len()).find(|&i| wanted[..i].contains(&wanted[i])) {
            return Err(Error::Input(format!("{name}: column {} is requested twice", wanted[column] + 1)));
        }
        self.mask = (0..count).map(|column| wanted.contains(&column)).collect();
        self.wanted = wanted;
        Ok(())
    }

    /// Columns of the next whole lines, in pieces, in their order.
    pub(super) fn parse(&mut self, chunk: &[u8]) -> Result<Vec<Block>> {
        let mut pieces = Vec::new();
        let mut rest = chunk;
        let goal = (chunk.len() / PIECES).max(MIN_PIECE_BYTES);
        while !rest.is_empty() {
            let cut = rest
                .get(goal..)
                .and_then(|tail| memchr::memchr(self.dialect.terminator, tail))
                .map_or(rest.len(), |more| goal + more + 1);
            let (piece, tail) = rest.split_at(cut);
            pieces.push(piece);
            rest = tail;
        }
        // Text lines before the first row are counted but not parsed again.
        let skip = self.dialect.preamble.saturating_sub(self.line);
        let first = self.line;
        let blocks: Vec<Block> = if pieces.len() == 1 {
            vec![self.piece(chunk, skip)]
        } else {
            pieces
                .par_iter()
                .enumerate()
                .map(|(i, piece)| self.piece(piece, if i == 0 { skip } else { 0 }))
                .collect()
        };
        let mut line = first;
        for block in &blocks {
            line += block.lines;
            if let Some(bad) = &block.bad {
                return Err(self.explain(line, bad));
            }
        }
        self.line = line;
        Ok(blocks)
    }

    /// Parses one piece; its first `skip` lines are not rows.
    fn piece(&self, bytes: &[u8], skip: usize) -> Block {
        let mut all = vec![Vec::new(); self.dialect.count];
        // Estimate the number of rows from the length of the first line.
        let shortest = memchr::memchr(self.dialect.terminator, bytes).unwrap_or(bytes.len()).max(2);
        for (column, _) in all.iter_mut().zip(&self.mask).filter(|(_, wanted)| **wanted) {
            column.reserve(bytes.len() / shortest + bytes.len() / shortest / 8 + 1);
        }
        let mut block = Block::default();
        let mut row = vec![0.0; self.dialect.count];
        let mut start = 0;
        while start < bytes.len() {
            let end =
                memchr::memchr(self.dialect.terminator, &bytes[start..]).map_or(bytes.len(), |n| start + n);
            let line = &bytes[start..end];
            start = end + 1;
            block.lines += 1;
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            if let Some(missing) = parse_simple_line(line, &self.dialect, &self.mask, &mut row)
                && block.lines > skip
            {
                block.missing += missing;
            } else {
                let trimmed = line.trim_ascii();
                if is_comment(trimmed) {
                    block.comments += 1;
                    continue;
                }
                // A tab may separate empty cells.
                let tabbed = self.dialect.delimiter == Delimiter::Byte(b'\t') && line.contains(&b'\t');
                if trimmed.is_empty() && !tabbed {
                    block.blank += 1;
                    continue;
                }
                if block.lines <= skip {
                    continue;
                }
                match self.parse_line(line, &mut row) {
                    Ok(missing) => block.missing += missing,
                    Err(bad) => {
                        block.bad = Some(bad);
                        break;
                    }
                }
            }
            for ((column, &value), _) in
                all.iter_mut().zip(&row).zip(&self.mask).filter(|(_, wanted)| **wanted)
            {
                column.push(value);
            }
        }
        block.columns = self.wanted.iter().map(|&j| std::mem::take(&mut all[j])).collect();
        block
    }

    /// Up to `most` rows at the start of a log. Lines with another number of cells are skipped.
    pub(super) fn sample(&self, bytes: &[u8], most: usize) -> Sample {
        let (count, dialect) = (self.dialect.count, &self.dialect);
        let mut found = Sample {
            columns: vec![Vec::new(); count],
            words: vec![0; count],
            cells: vec![String::new(); count],
        };
        let lines = bytes.split(|byte| *byte == dialect.terminator).skip(dialect.preamble);
        for line in lines {
            if found.columns[0].len() == most {
                break;
            }
            let line = line.strip_suffix(b"\r").unwrap_or(line);
            let trimmed = line.trim_ascii();
            if is_comment(trimmed) || trimmed.is_empty() {
                continue;
            }
            let cells_of = |line| {
                let mut cells = split(line, dialect.delimiter);
                if dialect.trailing && cells.len() == count + 1 {
                    cells.pop();
                }
                (cells.len() == count).then_some(cells)
            };
            let Some(cells) = cells_of(line).or_else(|| before_comment(line).and_then(cells_of)) else {
                continue;
            };
            for (j, cell) in cells.into_iter().enumerate() {
                let value = number(cell, dialect.decimal_comma);
                if found.columns[j].is_empty() || (value.is_none() && found.words[j] == 0) {
                    found.cells[j] = cell_text(cell);
                }
                found.words[j] += usize::from(value.is_none());
                found.columns[j].push(value.unwrap_or(f64::NAN));
            }
        }
        found
    }

    /// Parses a line that is not simple: with quotes, words for missing numbers, an empty last cell, a trailing
    /// comment, or an error. Returns the number of missing cells.
    fn parse_line(&self, line: &[u8], row: &mut [f64]) -> std::result::Result<usize, RowError> {
        self.cells(line, row).or_else(|bad| {
            // An apparent comment may be text in an unwanted column, so it is removed only if the whole row cannot be
            // parsed.
            before_comment(line).and_then(|before| self.cells(before, row).ok()).ok_or(bad)
        })
    }

    /// Parses all wanted cells of a line; returns the number of missing ones.
    fn cells(&self, line: &[u8], row: &mut [f64]) -> std::result::Result<usize, RowError> {
        let mut cells = split(line, self.dialect.delimiter);
        if self.dialect.trailing && cells.len() == row.len() + 1 && cells.last().is_some_and(|c| c.is_empty())
        {
            cells.pop();
        }
        if cells.len() != row.len() {
            return Err(RowError::Count(cells.len()));
        }
        let mut missing = 0;
        for (column, (value, cell)) in row.iter_mut().zip(cells).enumerate() {
            if !self.mask[column] {
                continue;
            }
            let Some(found) = number(cell, self.dialect.decimal_comma) else {
                return Err(RowError::Cell { column, text: cell_text(cell) });
            };
            if self.finite && found.is_infinite() {
                return Err(RowError::Infinite { column, text: cell_text(cell) });
            }
            missing += usize::from(found.is_nan());
            *value = found;
        }
        Ok(missing)
    }

    /// Error message for a line.
    fn explain(&self, line: usize, bad: &RowError) -> Error {
        let name = &self.name;
        let place = |column: usize| {
            let title = self.dialect.header.as_ref().map(|names| format!(" ({})", names[column]));
            format!("row {line}, column {}{}", column + 1, title.unwrap_or_default())
        };
        Error::Input(match bad {
            RowError::Count(found) => {
                format!("{name}: row {line} has {found} columns, the others {}", self.dialect.count)
            }
            RowError::Cell { column, text } => {
                format!("{name}: {}: {text:?} is not a number", place(*column))
            }
            RowError::Infinite { column, text } => {
                format!("{name}: {}: {text:?} is infinite: write nan for a missing sample", place(*column))
            }
        })
    }
}

/// Cell for a message, cut to 24 characters.
fn cell_text(cell: &[u8]) -> String {
    let text = decoded(cell);
    if text.chars().count() > 24 { text.chars().take(24).chain(['…']).collect() } else { text }
}
