//! Properties of the reader that hold for any bytes. `fuzz/` searches for counterexamples.

#![allow(dead_code, reason = "each program uses some of the functions")]

use std::cell::OnceCell;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use allanite::testing::text::{Options, Reader, Table, read};
use allanite::testing::{Error, Result};

/// Scratch file of this thread, reused for every input.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

thread_local! {
    static SCRATCH: OnceCell<Scratch> = const { OnceCell::new() };
}

fn with_file<T>(bytes: &[u8], work: impl FnOnce(&Path) -> T) -> T {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    SCRATCH.with(|cell| {
        let scratch = cell.get_or_init(|| {
            let name =
                format!("allanite-any-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
            Scratch(std::env::temp_dir().join(name))
        });
        File::create(&scratch.0)
            .and_then(|mut file| file.write_all(bytes))
            .expect("a folder for temporary files");
        work(&scratch.0)
    })
}

fn stop() -> AtomicBool {
    AtomicBool::new(false)
}

fn bits(columns: &[Vec<f64>]) -> Vec<Vec<u64>> {
    columns.iter().map(|column| column.iter().map(|x| x.to_bits()).collect()).collect()
}

/// All rows, `count` at a time.
fn in_pieces(path: &Path, options: &Options, count: usize) -> Result<Vec<Vec<u64>>> {
    let mut reader = Reader::open(path, options, &stop())?;
    let mut columns = vec![Vec::new(); reader.width()];
    while let Some(rows) = reader.next(count, &stop())? {
        for (i, x) in rows.into_iter().enumerate() {
            let width = columns.len();
            columns[i % width].push(x.to_bits());
        }
    }
    Ok(columns)
}

/// Checks the invariants of a table.
fn check_table(table: &Table) {
    assert!(!table.columns.is_empty());
    assert!(table.meta.rows > 0);
    assert!(table.columns.iter().all(|column| column.len() == table.meta.rows));
    if let Some(header) = &table.header {
        assert_eq!(header.len(), table.columns.len());
        assert!(table.meta.header_line.is_some());
    }
    let missing = table.columns.iter().flatten().filter(|x| x.is_nan()).count();
    assert!(missing >= table.meta.missing, "{missing} {}", table.meta.missing);
}

/// Reading in pieces gives the same rows. With infinities refused, a log is refused exactly if it holds one.
pub(crate) fn text(bytes: &[u8]) {
    with_file(bytes, |path| {
        let all = read(path, &Options::default(), &stop());
        let parts = in_pieces(path, &Options::default(), 3);
        assert_eq!(all.is_ok(), parts.is_ok());
        let finite = read(path, &Options { finite: true, ..Options::default() }, &stop());
        if let (Ok(table), Ok(parts)) = (&all, parts) {
            check_table(table);
            assert_eq!(bits(&table.columns), parts);
            let infinite = table.columns.iter().flatten().any(|x| x.is_infinite());
            assert_eq!(finite.is_err(), infinite);
        } else {
            assert!(finite.is_err());
        }
    });
}

/// Uses the first three bytes as reader options and the others as the first lines of a log.
pub(crate) fn dialect(bytes: &[u8]) {
    let [delimiter, signs, columns, log @ ..] = bytes else { return };
    let options = Options {
        delimiter: match delimiter % 8 {
            0..3 => None,
            3 => Some(b' '),
            4 => Some(b','),
            5 => Some(b';'),
            6 => Some(b'\t'),
            _ => Some(*delimiter),
        },
        decimal_comma: [None, Some(false), Some(true)][usize::from(signs % 3)],
        columns: match columns % 4 {
            0 | 1 => None,
            2 => Some(vec![usize::from(columns / 4)]),
            _ => Some(vec![1, 0, usize::from(columns / 4) % 3]),
        },
        finite: signs & 128 != 0,
    };
    with_file(log, |path| {
        let Ok(mut reader) = Reader::open(path, &options, &stop()) else { return };
        let width = reader.width();
        assert!(width > 0);
        assert!(reader.header().is_none_or(|header| header.len() == width));
        let found = reader.meta().clone();
        // Giving the detected options explicitly must not change the result.
        let said = Options {
            delimiter: Some(u8::try_from(found.delimiter).unwrap()),
            decimal_comma: Some(found.decimal_comma),
            ..options.clone()
        };
        let again = Reader::open(path, &said, &stop()).unwrap();
        assert_eq!((again.header(), again.width(), again.meta()), (reader.header(), width, &found));
        if let Ok(Some(rows)) = reader.next(2, &stop()) {
            assert_eq!(rows.len() % width, 0);
            assert!(reader.select(vec![0]).is_err());
        }
        let mut one = Reader::open(path, &options, &stop()).unwrap();
        assert!(one.select(vec![usize::MAX]).is_err());
    });
}

/// Reading a log through a pipe equals reading it from a file. The first byte sets the length of the pieces.
#[cfg(unix)]
pub(crate) fn pipes(bytes: &[u8]) {
    let Some((&first, log)) = bytes.split_first() else { return };
    // A pipe holds this much. The format of a longer log is determined from fewer lines than in a file.
    if log.len() > 60_000 || log.split(|&byte| byte == b'\n').count() > 40 {
        return;
    }
    let said = |result: Result<Table>, name: &str| match result {
        Ok(table) => Ok((bits(&table.columns), table.header, table.meta)),
        Err(Error::Input(message)) => Err(message.replace(name, "")),
        Err(error) => Err(error.to_string()),
    };
    let whole = with_file(log, |path| said(read(path, &Options::default(), &stop()), path.to_str().unwrap()));
    let pieces = through_pipe(log, usize::from(first) + 1, |path| {
        said(read(path, &Options::default(), &stop()), path.to_str().unwrap())
    });
    assert_eq!(whole, pieces);
}

#[cfg(not(unix))]
pub(crate) fn pipes(_: &[u8]) {}

/// Writes each piece after the previous one was read, so that each piece is read separately.
#[cfg(unix)]
fn through_pipe<T>(log: &[u8], length: usize, work: impl FnOnce(&Path) -> T) -> T {
    use std::os::fd::AsRawFd;

    let (reader, mut writer) = std::io::pipe().unwrap();
    let path = PathBuf::from(format!("/dev/fd/{}", reader.as_raw_fd()));
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (done, reader) = (&done, &reader);
        scope.spawn(move || {
            for piece in log.chunks(length) {
                let mut waiting: libc::c_int = 1;
                while waiting > 0 && !done.load(Ordering::Relaxed) {
                    // SAFETY: the descriptor is open as long as the scope, and `waiting` is the int that the call
                    // fills.
                    unsafe { libc::ioctl(reader.as_raw_fd(), libc::FIONREAD, &raw mut waiting) };
                    std::thread::yield_now();
                }
                // A reader that has refused the log reads no more of it.
                if done.load(Ordering::Relaxed) || writer.write_all(piece).is_err() {
                    break;
                }
            }
        });
        let found = work(&path);
        done.store(true, Ordering::Relaxed);
        found
    })
}
