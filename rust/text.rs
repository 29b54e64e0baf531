//! Numeric columns of a text log.
//!
//! | step | file |
//! |---|---|
//! | bytes → whole lines, from files and pipes | [`source`] |
//! | delimiter, decimal sign, header, comments, from the first lines | [`dialect`] |
//! | one line → cells → numbers | [`cells`] |
//! | date-times → seconds | [`moment`] |
//! | many lines → columns, on all threads, with errors and their positions | [`rows`] |
//!
//! A file is read in chunks, never as a whole, so that memory is needed only for the numbers.

mod cells;
mod dialect;
mod moment;
mod quick;
mod rows;
mod source;

use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use dialect::{Dialect, no_rows};
use rows::Rows;
pub(crate) use rows::Sample;
use source::Source;

use crate::parallel::pooled;
use crate::{Error, Result};

/// Options that override what the first lines of the file suggest.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The delimiter, one byte. A blank means any run of white space.
    pub delimiter: Option<u8>,
    /// Whether 1,5 is one and a half.
    pub decimal_comma: Option<bool>,
    /// Columns to read, counted from 0, in the requested order. Other columns may hold any text.
    pub columns: Option<Vec<usize>>,
    /// True if infinite cells are errors.
    pub finite: bool,
}

/// Format of the log and counts of its lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Meta {
    /// The delimiter. A blank means any run of white space.
    pub delimiter: char,
    /// Whether 1,5 is one and a half.
    pub decimal_comma: bool,
    /// Number of comment lines.
    pub comments: usize,
    /// Number of empty lines.
    pub blank: usize,
    /// Number of the header line, counted from 1.
    pub header_line: Option<usize>,
    /// Number of text lines before the first row that are neither header nor comment.
    pub skipped: usize,
    /// Number of missing values: empty cells and words such as "nan".
    pub missing: usize,
    /// Number of rows.
    pub rows: usize,
}

/// Columns of a log.
#[derive(Debug, Clone)]
pub struct Table {
    /// Names of the columns, if the log has them.
    pub header: Option<Vec<String>>,
    /// One vector per column.
    pub columns: Vec<Vec<f64>>,
    /// Format of the log and counts of its lines.
    pub meta: Meta,
}

/// Number of bytes at the start of a log from which samples of its columns are taken.
const SAMPLE_BYTES: usize = 2 << 20;

/// Reader of a log in chunks of bounded size.
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
    /// Opens a file, or standard input for `-`, and determines its format from the first lines.
    pub fn open(path: impl AsRef<Path>, options: &Options, stop: &AtomicBool) -> Result<Self> {
        let mut source = Source::open(path.as_ref())?;
        let head = source.head(stop)?;
        let dialect = Dialect::find(source.name(), &head, options)?;
        let meta = dialect.meta();
        let rows = Rows::new(source.name(), &dialect, options)?;
        Ok(Self { source, dialect, rows, first: Some(head), ready: VecDeque::new(), used: 0, meta })
    }

    /// Names of the selected columns, if the log has them.
    pub fn header(&self) -> Option<Vec<String>> {
        let names = self.dialect.header.as_ref()?;
        Some(self.rows.wanted.iter().map(|&j| names[j].clone()).collect())
    }

    /// Format of the log and counts of the lines read so far.
    pub fn meta(&self) -> &Meta {
        &self.meta
    }

    /// Number of selected columns.
    pub fn width(&self) -> usize {
        self.rows.wanted.len()
    }

    /// Selects columns. Must be called before the first rows are read.
    pub fn select(&mut self, columns: Vec<usize>) -> Result<()> {
        if self.first.is_none() {
            return Err(Error::Input(format!("{}: rows were read already", self.source.name())));
        }
        self.rows.select(columns)
    }

    /// Up to `most` first rows of all columns. Must be called before the first rows are read; these rows are read
    /// again afterwards.
    pub fn sample(&mut self, most: usize, stop: &AtomicBool) -> Result<Sample> {
        let Some(mut first) = self.first.take() else {
            return Err(Error::Input(format!("{}: rows were read already", self.source.name())));
        };
        while first.len() < SAMPLE_BYTES
            && let Some(more) = self.source.chunk(stop)?
        {
            first.extend_from_slice(&more);
            self.source.recycle(more);
        }
        let sample = self.rows.sample(&first, most);
        self.first = Some(first);
        Ok(sample)
    }

    /// Reads and parses the next chunk of whole lines; false at the end of the log.
    fn read_more(&mut self, stop: &AtomicBool) -> Result<bool> {
        let chunk = match self.first.take() {
            Some(head) => head,
            None => match self.source.chunk(stop)? {
                Some(chunk) => chunk,
                None => return Ok(false),
            },
        };
        let source = &mut self.source;
        let rows = &mut self.rows;
        let (ahead, blocks) = pooled(|| rayon::join(|| source.prefetch(stop), || rows.parse(&chunk)))?;
        for block in blocks? {
            self.meta.comments += block.comments;
            self.meta.blank += block.blank;
            self.meta.missing += block.missing;
            self.meta.rows += block.rows();
            if block.rows() > 0 {
                self.ready.push_back(block.columns);
            }
        }
        self.source.recycle(chunk);
        ahead?;
        Ok(true)
    }

    /// Up to `count` further rows, in row-major order; `None` at the end of the log.
    pub fn next(&mut self, count: usize, stop: &AtomicBool) -> Result<Option<Vec<f64>>> {
        let mut available = self.ready.iter().map(|block| block[0].len()).sum::<usize>() - self.used;
        while available < count {
            let before = self.meta.rows;
            if !self.read_more(stop)? {
                break;
            }
            available += self.meta.rows - before;
        }
        if self.meta.rows == 0 && count > 0 {
            return Err(no_rows(self.source.name()));
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

    /// All remaining rows, column by column.
    pub(crate) fn rest(mut self, stop: &AtomicBool) -> Result<Table> {
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); self.width()];
        loop {
            let more = self.read_more(stop)?;
            for block in self.ready.drain(..) {
                for (column, piece) in columns.iter_mut().zip(block) {
                    let piece = &piece[self.used..];
                    if column.is_empty() {
                        // Reserve the length expected from the file size: untouched pages cost nothing.
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
            return Err(no_rows(self.source.name()));
        }
        for column in &mut columns {
            column.shrink_to_fit();
        }
        Ok(Table { header: self.header(), columns, meta: self.meta })
    }
}

/// All selected columns of a log.
pub fn read(path: impl AsRef<Path>, options: &Options, stop: &AtomicBool) -> Result<Table> {
    Reader::open(path, options, stop)?.rest(stop)
}
