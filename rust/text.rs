//! Numeric columns of a text log.
//!
//! | step | file |
//! |---|---|
//! | bytes → whole lines, from files and pipes | [`source`] |
//! | delimiter, decimal sign, header, comments: found from the first lines | [`dialect`] |
//! | one line → cells → numbers | [`cells`] |
//! | date-times → seconds | [`moment`] |
//! | many lines → columns, on all threads; what was wrong where | [`rows`] |
//!
//! A file is read in chunks, never as a whole, so that memory is that of the numbers.

mod cells;
mod dialect;
mod moment;
mod quick;
mod rows;
mod source;

use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use dialect::Dialect;
use rows::Rows;
pub use rows::Sample;
use source::Source;

use crate::parallel::pooled;
use crate::{Error, Result};

/// What the caller knows better than the file's first lines.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// One byte; a blank stands for any run of white space.
    pub delimiter: Option<u8>,
    /// Whether 1,5 is one and a half.
    pub decimal_comma: Option<bool>,
    /// Columns wanted, from 0, in the order wanted; the others may hold any text.
    pub columns: Option<Vec<usize>>,
    /// Whether an infinite cell is refused, as a cell that is no number is.
    pub finite: bool,
}

/// What was found besides numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Meta {
    /// The delimiter; a blank stands for any run of white space.
    pub delimiter: char,
    /// Whether 1,5 is one and a half.
    pub decimal_comma: bool,
    /// Comment lines.
    pub comments: usize,
    /// Empty lines.
    pub blank: usize,
    /// Line of the header, from 1.
    pub header_line: Option<usize>,
    /// Lines of text before the numbers that are neither header nor comment.
    pub skipped: usize,
    /// Cells that are empty or say that there is no number.
    pub missing: usize,
    /// Rows of numbers.
    pub rows: usize,
}

/// Columns of a log.
#[derive(Debug, Clone)]
pub struct Table {
    /// Names of the columns, if the log has them.
    pub header: Option<Vec<String>>,
    /// One vector a column.
    pub columns: Vec<Vec<f64>>,
    /// What else was found.
    pub meta: Meta,
}

/// Bytes at the beginning of a log that a sample is taken of.
const SAMPLED: usize = 2 << 20;

/// A log that is read in bounded chunks.
pub struct Reader {
    source: Source,
    dialect: Dialect,
    rows: Rows,
    first: Option<Vec<u8>>,
    ready: VecDeque<Vec<Vec<f64>>>,
    used: usize,
    meta: Meta,
}

impl Reader {
    /// Opens a file, or standard input for `-`, and looks at its first lines.
    pub fn open(path: impl AsRef<Path>, options: &Options, stop: &AtomicBool) -> Result<Self> {
        let mut source = Source::open(path.as_ref())?;
        let head = source.head(stop)?;
        let dialect = Dialect::find(source.name(), &head, options)?;
        let meta = dialect.meta();
        let rows = Rows::new(source.name(), &dialect, options)?;
        Ok(Self { source, dialect, rows, first: Some(head), ready: VecDeque::new(), used: 0, meta })
    }

    /// Names of the columns asked for, if the log has them.
    pub fn header(&self) -> Option<Vec<String>> {
        let names = self.dialect.header.as_ref()?;
        Some(self.rows.wanted.iter().map(|&j| names[j].clone()).collect())
    }

    /// What was found so far.
    pub fn meta(&self) -> &Meta {
        &self.meta
    }

    /// Number of columns asked for.
    pub fn width(&self) -> usize {
        self.rows.wanted.len()
    }

    /// Asks for some columns only, once their names are known; before the first rows.
    pub fn select(&mut self, columns: Vec<usize>) -> Result<()> {
        if self.first.is_none() {
            return Err(Error::Input(format!("{}: rows were read already", self.source.name())));
        }
        self.rows.select(columns)
    }

    /// Up to `most` first rows of all columns, before the first rows are read; they are still read afterwards.
    pub fn sample(&mut self, most: usize, stop: &AtomicBool) -> Result<Sample> {
        let Some(mut first) = self.first.take() else {
            return Err(Error::Input(format!("{}: rows were read already", self.source.name())));
        };
        while first.len() < SAMPLED
            && let Some(more) = self.source.chunk(stop)?
        {
            first.extend_from_slice(&more);
            self.source.give_back(more);
        }
        let sample = self.rows.sample(&first, most);
        self.first = Some(first);
        Ok(sample)
    }

    /// The next chunk of whole lines and how they parse.
    fn more(&mut self, stop: &AtomicBool) -> Result<bool> {
        let chunk = match self.first.take() {
            Some(head) => head,
            None => match self.source.chunk(stop)? {
                Some(chunk) => chunk,
                None => return Ok(false),
            },
        };
        let source = &mut self.source;
        let rows = &mut self.rows;
        let (ahead, blocks) = pooled(|| rayon::join(|| source.prefetch(stop), || rows.parse(&chunk)));
        for block in blocks? {
            self.meta.comments += block.comments;
            self.meta.blank += block.blank;
            self.meta.missing += block.missing;
            self.meta.rows += block.rows();
            if block.rows() > 0 {
                self.ready.push_back(block.columns);
            }
        }
        self.source.give_back(chunk);
        ahead?;
        Ok(true)
    }

    fn empty(&self) -> Error {
        Error::Input(format!("{}: no rows of numbers in it", self.source.name()))
    }

    /// Up to `count` further rows, row after row; `None` at the end of the log.
    pub fn next(&mut self, count: usize, stop: &AtomicBool) -> Result<Option<Vec<f64>>> {
        let mut available = self.ready.iter().map(|block| block[0].len()).sum::<usize>() - self.used;
        while available < count {
            let before = self.meta.rows;
            if !self.more(stop)? {
                break;
            }
            available += self.meta.rows - before;
        }
        if self.meta.rows == 0 && count > 0 {
            return Err(self.empty());
        }
        let take = available.min(count);
        if take == 0 && count > 0 {
            return Ok(None);
        }
        let width = self.width();
        let mut table = Vec::with_capacity(take * width);
        while table.len() < take * width {
            let Some(block) = self.ready.front() else { break };
            let end = block[0].len().min(self.used + take - table.len() / width);
            for i in self.used..end {
                table.extend(block.iter().map(|column| column[i]));
            }
            self.used = end;
            if end == block[0].len() {
                self.ready.pop_front();
                self.used = 0;
            }
        }
        Ok(Some(table))
    }

    /// All that is left, column by column.
    pub fn rest(mut self, stop: &AtomicBool) -> Result<Table> {
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); self.width()];
        loop {
            let more = self.more(stop)?;
            for block in self.ready.drain(..) {
                for (column, piece) in columns.iter_mut().zip(block) {
                    let piece = &piece[self.used..];
                    if column.is_empty() {
                        // Untouched pages cost nothing: reserve what the size of the file lets expect.
                        let expected = self.source.expected(piece.len());
                        column.try_reserve_exact(expected).map_err(|_| {
                            Error::Input(format!("{}: does not fit into memory", self.source.name()))
                        })?;
                    }
                    column.extend_from_slice(piece);
                }
                self.used = 0;
            }
            if !more {
                break;
            }
        }
        if self.meta.rows == 0 {
            return Err(self.empty());
        }
        for column in &mut columns {
            column.shrink_to_fit();
        }
        Ok(Table { header: self.header(), columns, meta: self.meta })
    }
}

/// All columns of a log.
pub fn read(path: impl AsRef<Path>, options: &Options, stop: &AtomicBool) -> Result<Table> {
    Reader::open(path, options, stop)?.rest(stop)
}
