//! Many lines into columns, in parallel; what was wrong, and where.

use rayon::prelude::*;

use super::Options;
use super::cells::{Delimiter, before_comment, is_comment, number, split};
use super::dialect::{Dialect, decoded};
use super::quick::quick;
use crate::{Error, Result};

/// Pieces of a chunk that are parsed side by side.
const PIECES: usize = 4;
/// Smaller pieces are not worth a thread.
const SMALLEST: usize = 64 << 10;

/// Columns of one piece, and what stood between its rows.
#[derive(Default)]
pub(super) struct Block {
    pub columns: Vec<Vec<f64>>,
    pub comments: usize,
    pub blank: usize,
    pub missing: usize,
    lines: usize,
    bad: Option<Bad>,
}

impl Block {
    /// Rows of numbers.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// What is wrong with the last line of a block.
enum Bad {
    Cell { column: usize, text: String },
    Infinite { column: usize, text: String },
    Count(usize),
}

/// The first rows of all columns of a log, whatever their cells hold.
#[derive(Debug, Clone, Default)]
pub struct Sample {
    /// One vector a column; NaN where a cell holds no number.
    pub columns: Vec<Vec<f64>>,
    /// Cells of each column that hold other text than a number or a word for nothing.
    pub words: Vec<usize>,
    /// A cell of each column: the first of these, else that of the first row.
    pub cells: Vec<String>,
}

/// Turns lines into the wanted columns.
pub(super) struct Rows {
    name: String,
    dialect: Dialect,
    /// Columns in the order asked for.
    pub wanted: Vec<usize>,
    mask: Vec<bool>,
    /// Whether infinite cells are refused.
    finite: bool,
    /// Lines before the chunk that comes next.
    line: usize,
}

impl Rows {
    /// For the log called `name`; checks that the columns exist.
    pub fn new(name: &str, dialect: &Dialect, options: &Options) -> Result<Self> {
        let count = dialect.count;
        let wanted = options.columns.clone().unwrap_or_else(|| (0..count).collect());
        let name = name.to_owned();
        let (dialect, finite) = (dialect.clone(), options.finite);
        let mut rows = Self { name, dialect, wanted: Vec::new(), mask: Vec::new(), finite, line: 0 };
        rows.select(wanted)?;
        Ok(rows)
    }

    /// Wants other columns from here on; checks that they exist.
    pub fn select(&mut self, wanted: Vec<usize>) -> Result<()> {
        let (name, count) = (&self.name, self.dialect.count);
        if let Some(column) = wanted.iter().find(|&&column| column >= count) {
            let named = column.saturating_add(1);
            return Err(Error::Input(format!("{name}: there is no column {named}; it has {count}")));
        }
        if wanted.is_empty() {
            return Err(Error::Input(format!("{name}: no column was asked for")));
        }
        if let Some(column) = (1..wanted.len()).find(|&i| wanted[..i].contains(&wanted[i])) {
            return Err(Error::Input(format!("{name}: column {} was asked for twice", wanted[column] + 1)));
        }
        self.mask = (0..count).map(|column| wanted.contains(&column)).collect();
        self.wanted = wanted;
        Ok(())
    }

    /// The columns of the next whole lines, in pieces in their order.
    pub fn parse(&mut self, chunk: &[u8]) -> Result<Vec<Block>> {
        let mut pieces = Vec::new();
        let mut rest = chunk;
        let goal = (chunk.len() / PIECES).max(SMALLEST);
        while !rest.is_empty() {
            let cut = rest
                .get(goal..)
                .and_then(|tail| memchr::memchr(self.dialect.terminator, tail))
                .map_or(rest.len(), |more| goal + more + 1);
            let (piece, tail) = rest.split_at(cut);
            pieces.push(piece);
            rest = tail;
        }
        // The lines of text before the first row are counted but not read again.
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

    fn piece(&self, bytes: &[u8], skip: usize) -> Block {
        let mut all = vec![Vec::new(); self.dialect.count];
        // Rows have much the same length: the first line tells how many to expect.
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
            if let Some(missing) = quick(line, &self.dialect, &self.mask, &mut row)
                && block.lines > skip
            {
                block.missing += missing;
            } else {
                let trimmed = line.trim_ascii();
                if is_comment(trimmed) {
                    block.comments += 1;
                    continue;
                }
                // A tab may stand between empty cells.
                let tabbed = self.dialect.delimiter == Delimiter::Byte(b'\t') && line.contains(&b'\t');
                if trimmed.is_empty() && !tabbed {
                    block.blank += 1;
                    continue;
                }
                if block.lines <= skip {
                    continue;
                }
                match self.slow(line, &mut row) {
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

    /// Up to `most` rows at the beginning of a log; lines with another number of cells are left out.
    pub fn sample(&self, bytes: &[u8], most: usize) -> Sample {
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
                    found.cells[j] = shown(cell);
                }
                found.words[j] += usize::from(value.is_none());
                found.columns[j].push(value.unwrap_or(f64::NAN));
            }
        }
        found
    }

    /// A line that is not as simple as most: quotes, words for nothing, an empty last cell, a comment at its end, or
    /// wrong.
    fn slow(&self, line: &[u8], row: &mut [f64]) -> std::result::Result<usize, Bad> {
        self.cells(line, row).or_else(|bad| {
            // What looks like a comment may be text in a column that is not read: it is cut only if the row cannot be read whole.
            before_comment(line).and_then(|before| self.cells(before, row).ok()).ok_or(bad)
        })
    }

    fn cells(&self, line: &[u8], row: &mut [f64]) -> std::result::Result<usize, Bad> {
        let mut cells = split(line, self.dialect.delimiter);
        if self.dialect.trailing && cells.len() == row.len() + 1 && cells.last().is_some_and(|c| c.is_empty())
        {
            cells.pop();
        }
        if cells.len() != row.len() {
            return Err(Bad::Count(cells.len()));
        }
        let mut missing = 0;
        for (column, (value, cell)) in row.iter_mut().zip(cells).enumerate() {
            if !self.mask[column] {
                continue;
            }
            let Some(found) = number(cell, self.dialect.decimal_comma) else {
                return Err(Bad::Cell { column, text: shown(cell) });
            };
            if self.finite && found.is_infinite() {
                return Err(Bad::Infinite { column, text: shown(cell) });
            }
            missing += usize::from(found.is_nan());
            *value = found;
        }
        Ok(missing)
    }

    fn explain(&self, line: usize, bad: &Bad) -> Error {
        let name = &self.name;
        let place = |column: usize| {
            let title = self.dialect.header.as_ref().map(|names| format!(" ({})", names[column]));
            format!("row {line}, column {}{}", column + 1, title.unwrap_or_default())
        };
        Error::Input(match bad {
            Bad::Count(found) => {
                format!("{name}: row {line} has {found} columns, the others {}", self.dialect.count)
            }
            Bad::Cell { column, text } => format!("{name}: {}: {text:?} is not a number", place(*column)),
            Bad::Infinite { column, text } => {
                format!("{name}: {}: {text:?} is infinite: write nan for a missing sample", place(*column))
            }
        })
    }
}

/// A cell for a message.
fn shown(cell: &[u8]) -> String {
    let text = decoded(cell);
    if text.chars().count() > 24 { text.chars().take(24).chain(['…']).collect() } else { text }
}
