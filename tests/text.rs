//! Text logs: no bytes make the reader panic, and what is written is read.

use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use allanite::text::{Options, Reader, read};
use proptest::prelude::*;

struct Log(std::path::PathBuf);

impl Log {
    fn new(bytes: &[u8]) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("allanite-{}-{number}.csv", std::process::id()));
        std::fs::File::create(&path).unwrap().write_all(bytes).unwrap();
        Self(path)
    }

    fn path(&self) -> &str {
        self.0.to_str().unwrap()
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn numbers() -> impl Strategy<Value = Vec<Vec<f64>>> {
    (1..6_usize)
        .prop_flat_map(|width| prop::collection::vec(prop::collection::vec(-1e12..1e12_f64, width), 1..60))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let log = Log::new(&bytes);
        let stop = AtomicBool::new(false);
        let _ = read(log.path(), &Options::default(), &stop);
    }

    #[test]
    fn log_like_bytes_are_read_or_refused(text in "([0-9.,; \t\n\r\"#ax-]|nan){0,200}") {
        let log = Log::new(text.as_bytes());
        let stop = AtomicBool::new(false);
        let all = read(log.path(), &Options::default(), &stop);
        let mut pieces = 0;
        let parts = Reader::open(log.path(), &Options::default(), &stop).and_then(|mut reader| {
            while let Some(rows) = reader.next(3, &stop)? {
                pieces += rows.len() / reader.width();
            }
            Ok(())
        });
        prop_assert_eq!(parts.is_ok(), all.is_ok());
        if let Ok(table) = all {
            prop_assert_eq!(table.meta.rows, pieces);
            prop_assert!(table.columns.iter().all(|column| column.len() == pieces));
        }
    }

    #[test]
    fn what_is_written_is_read(
        rows in numbers(),
        delimiter in prop::sample::select(vec![",", ";", "\t", " ", "  "]),
        end in prop::sample::select(vec!["\n", "\r\n"]),
    ) {
        let mut text = String::new();
        for row in &rows {
            let cells: Vec<_> = row.iter().map(|x| format!("{x:?}")).collect();
            text += &cells.join(delimiter);
            text += end;
        }
        let log = Log::new(text.as_bytes());
        let table = read(log.path(), &Options::default(), &AtomicBool::new(false)).unwrap();
        for (j, column) in table.columns.iter().enumerate() {
            let written: Vec<_> = rows.iter().map(|row| row[j].to_bits()).collect();
            let found: Vec<_> = column.iter().map(|x| x.to_bits()).collect();
            prop_assert_eq!(found, written);
        }
    }
}
