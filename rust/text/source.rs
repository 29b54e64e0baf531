//! Reading of whole lines from a file or a pipe, in chunks.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::parallel::check;
use crate::{Error, Result};

/// Number of bytes read at a time.
const CHUNK: usize = 4 << 20;
/// Numbers of bytes and of lines that suffice to determine the format of a log.
const HEAD: (usize, usize) = (64 << 10, 40);
/// Maximum number of bytes without an end of line.
const MAX_LINE_BYTES: usize = 16 << 20;

/// An open log.
pub(super) struct Source {
    name: String,
    file: File,
    /// Size in bytes if known, else 0.
    size: usize,
    /// True if a read may block until another process writes.
    waits: bool,
    done: bool,
    /// The byte that ends every line.
    pub terminator: u8,
    /// Bytes read but not yet returned: the start of an unfinished line, or data read ahead.
    carry: Vec<u8>,
    spare: Vec<u8>,
    handed: usize,
}

impl Source {
    /// Opens a file, or standard input for `-`.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let (name, file) = if path.as_os_str() == "-" {
            ("standard input".to_owned(), standard_input())
        } else {
            (path.display().to_string(), File::open(path))
        };
        let refuse = |error: std::io::Error| {
            Error::Input(match error.kind() {
                ErrorKind::NotFound => format!("{name}: no such file"),
                _ => format!("{name}: cannot be read: {error}"),
            })
        };
        let file = file.map_err(refuse)?;
        let metadata = file.metadata().map_err(refuse)?;
        if metadata.is_dir() {
            return Err(Error::Input(format!("{name}: is a directory, not a log")));
        }
        let (size, waits) = if metadata.is_file() { (metadata.len() as usize, false) } else { (0, true) };
        Ok(Self {
            name,
            file,
            size,
            waits,
            done: false,
            terminator: b'\n',
            carry: Vec::new(),
            spare: Vec::new(),
            handed: 0,
        })
    }

    /// Name of the log for messages.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Expected total number of rows if the data returned so far gave `rows` rows.
    pub(super) fn expected(&self, rows: usize) -> usize {
        let all = rows as f64 * (self.size as f64 / self.handed.max(1) as f64);
        // Add a margin, because later rows may be shorter.
        rows.max((1.02 * all) as usize + 64)
    }

    /// The first whole lines, enough to determine the format. Error if the file is not text.
    pub(super) fn head(&mut self, stop: &AtomicBool) -> Result<Vec<u8>> {
        let lines = |bytes: &[u8]| memchr::memchr_iter(b'\n', bytes).take(HEAD.1).count();
        while !self.done && self.carry.len() < HEAD.0 && (!self.waits || lines(&self.carry) < HEAD.1) {
            self.fill(HEAD.0, stop)?;
        }
        let name = &self.name;
        match self.carry.as_slice() {
            [] => return Err(Error::Input(format!("{name}: is empty"))),
            [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => {
                return Err(Error::Input(format!("{name}: is UTF-16 text; save it as UTF-8")));
            }
            [0x1F, 0x8B, ..] => {
                return Err(Error::Input(format!("{name}: is compressed by gzip; unpack it first")));
            }
            bytes if memchr::memchr(0, bytes).is_some() => {
                return Err(Error::Input(format!(
                    "{name}: not a text log but binary data: give the name of the file"
                )));
            }
            bytes => {
                let returns = memchr::memchr(b'\r', bytes).is_some();
                if returns && memchr::memchr(b'\n', bytes).is_none() {
                    self.terminator = b'\r';
                }
            }
        }
        if self.carry.starts_with(b"\xEF\xBB\xBF") {
            self.carry.drain(..3);
        }
        Ok(self.chunk(stop)?.unwrap_or_default())
    }

    /// The next whole lines; `None` at the end.
    pub(super) fn chunk(&mut self, stop: &AtomicBool) -> Result<Option<Vec<u8>>> {
        loop {
            if let Some(end) = memchr::memrchr(self.terminator, &self.carry) {
                return Ok(Some(self.take_chunk(end + 1)));
            }
            if self.done {
                // The last line may lack its end of line.
                let all = self.carry.len();
                return Ok(if all == 0 { None } else { Some(self.take_chunk(all)) });
            }
            if self.carry.len() > MAX_LINE_BYTES {
                return Err(Error::Input(format!(
                    "{}: no end of line in {} bytes; not a log of rows",
                    self.name,
                    self.carry.len()
                )));
            }
            self.fill(CHUNK, stop)?;
        }
    }

    /// Reads ahead the data that `chunk` returns next. Pipes are not read ahead, because their rows are needed at
    /// once.
    pub(super) fn prefetch(&mut self, stop: &AtomicBool) -> Result<()> {
        if self.done || self.waits { Ok(()) } else { self.fill(CHUNK, stop) }
    }

    /// Returns the memory of a chunk for reuse.
    pub(super) fn recycle(&mut self, chunk: Vec<u8>) {
        self.spare = chunk;
    }

    /// Removes the first `end` bytes and returns them.
    fn take_chunk(&mut self, end: usize) -> Vec<u8> {
        let mut rest = std::mem::take(&mut self.spare);
        rest.clear();
        rest.extend_from_slice(&self.carry[end..]);
        let mut chunk = std::mem::replace(&mut self.carry, rest);
        chunk.truncate(end);
        self.handed += end;
        chunk
    }

    /// Reads up to `count` bytes and appends them to `carry`.
    fn fill(&mut self, count: usize, stop: &AtomicBool) -> Result<()> {
        let start = self.carry.len();
        self.carry.resize(start + count, 0);
        let mut end = start;
        while end < self.carry.len() {
            check(stop)?;
            if self.waits && !readable(&self.file) {
                continue;
            }
            match self.file.read(&mut self.carry[end..]) {
                Ok(0) => {
                    self.done = true;
                    break;
                }
                Ok(read) => end += read,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::Input(format!("{}: cannot be read: {error}", self.name))),
            }
            if self.waits {
                break;
            }
        }
        self.carry.truncate(end);
        Ok(())
    }
}

/// The standard input as a file.
#[cfg(unix)]
fn standard_input() -> std::io::Result<File> {
    use std::os::fd::AsFd;
    // Duplicate the descriptor to bypass the buffer of the standard library.
    Ok(File::from(std::io::stdin().as_fd().try_clone_to_owned()?))
}

/// The standard input as a file.
#[cfg(windows)]
fn standard_input() -> std::io::Result<File> {
    use std::os::windows::io::AsHandle;
    Ok(File::from(std::io::stdin().as_handle().try_clone_to_owned()?))
}

/// True if data are available; waits at most 0.1 s, so that Ctrl-C is handled while no data arrive.
#[cfg(unix)]
fn readable(file: &File) -> bool {
    use std::os::fd::AsRawFd;
    let mut wanted = libc::pollfd { fd: file.as_raw_fd(), events: libc::POLLIN, revents: 0 };
    // SAFETY: `wanted` is one valid pollfd for the length of the call, and `file` keeps its descriptor open.
    unsafe { libc::poll(&raw mut wanted, 1, 100) != 0 }
}

/// Always true: other systems do not wait for data here.
#[cfg(not(unix))]
fn readable(_: &File) -> bool {
    true
}
