//! Text logs: no input makes the reader panic, and written numbers are read back.

use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use allanite::testing::text::{Options, Reader, Table, read};
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

fn table(text: &str) -> Table {
    read(Log::new(text.as_bytes()).path(), &Options::default(), &AtomicBool::new(false)).unwrap()
}

fn refusal(text: &str) -> String {
    let options = Options::default();
    read(Log::new(text.as_bytes()).path(), &options, &AtomicBool::new(false)).unwrap_err().to_string()
}

/// Columns with missing values as −1, because NaN equals nothing.
fn columns(text: &str) -> Vec<Vec<f64>> {
    let plain = |x: f64| if x.is_nan() { -1.0 } else { x };
    table(text).columns.into_iter().map(|column| column.into_iter().map(plain).collect()).collect()
}

#[test]
fn the_words_of_spreadsheets_are_missing_cells() {
    for word in ["#N/A", "#NA", "#NUM!", "#DIV/0!", "#VALUE!", "#REF!", "#NAME?", "#NULL!", "#n/a"] {
        for delimiter in [",", ";", "\t", " ", " ; "] {
            let text = ["a,b", "1,2", "#,3", "4,#", "#,#", "5,6", ""].join("\n");
            let text = text.replace(',', delimiter).replace('#', word);
            let found = table(&text);
            assert_eq!((found.meta.rows, found.meta.missing, found.meta.comments), (5, 4, 0), "{text}");
            assert_eq!(columns(&text), [[1.0, -1.0, 4.0, -1.0, 5.0], [2.0, 3.0, -1.0, -1.0, 6.0]], "{text}");
        }
        assert_eq!(columns(&format!("x\n1\n{word}\n3\n")), [[1.0, -1.0, 3.0]]);
    }
    assert_eq!(table("a b\n#NA means no answer\n# NA\n1 2\n").meta.comments, 2);
}

#[test]
fn a_comment_is_never_a_row() {
    let log = Log::new(b"a,b\n1,2\n# restart,7\n#N/A,4\n");
    let options = Options { columns: Some(vec![1]), ..Options::default() };
    let found = read(log.path(), &options, &AtomicBool::new(false)).unwrap();
    assert_eq!((found.columns, found.meta.comments), (vec![vec![2.0, 4.0]], 1));
}

#[test]
fn tabs_delimit_empty_cells_like_semicolons() {
    for text in [
        "a;b\n1.5;1\n2.5;\n3.5;2\n",
        "a;b\n;1\n2.5;\n;\n3.5;2\n",
        "a;b\n;\n;\n1;2\n",
        "a;b;c\n;;\n1;2;3\n;;\n4;;\n;;5\n",
        ";x;y\n0;1;2\n1;;3\n2;;\n",
        "a;b;\n1;2;\n;4;\n3;;\n",
        "a;b\n1;2;\n;4;\n",
        "1;2;\n3;;\n",
        "1;\n2;3\n4;5\n",
        "a;b\r\n1;\r\n2;3\r\n",
    ] {
        let tabbed = text.replace(';', "\t");
        assert_eq!(columns(&tabbed), columns(text), "{text}");
        let (mut found, wanted) = (table(&tabbed), table(text));
        found.meta.delimiter = ';';
        assert_eq!((found.header, found.meta), (wanted.header, wanted.meta), "{text}");
    }
    assert_eq!(table("gyro x\n1\t\n2\n3\t\n").header.unwrap(), ["gyro x"]);
    // Tabs between blanks, at the start or at the end count as blanks.
    for text in ["  a   b\n 1  2 \n\t3 \t 4\n", "\ta b\n\t1\t2\n\t3\t4\n", "a b\n1 2\t\n\t\n3 4\n"] {
        assert_eq!(columns(text), [[1.0, 3.0], [2.0, 4.0]], "{text}");
    }
    assert_eq!(table("a\tb\t\n1\t2\n").header.unwrap(), ["a", "b"]);
    assert_eq!(columns("a,b\t\n1,2\t\n3,4\t\n"), [[1.0, 3.0], [2.0, 4.0]]);
    assert_eq!(columns("Logger\n\t\na\tb\tc\n\t\n1\t2\t3\n"), [[1.0], [2.0], [3.0]]);
}

#[test]
fn commas_under_a_single_name_are_decimal() {
    let column = [[0.1257, -0.1321, 2.0, -1.0, 1.5e-3]];
    for text in [
        "gyro\n0,1257\n-0,1321\n2\nnan\n1,5e-3\n",
        "gyro x [deg/s]\r\n0,1257\r\n-0,1321\r\n2\r\n#N/A\r\n1,5e-3\r\n",
        "0,1257\n-0,1321\n2\nnan\n1,5e-3\n",
        "Logger\nSerial: A\n0,1257\n-0,1321\n2\nnan\n1,5e-3\n",
    ] {
        assert_eq!(columns(text), column, "{text}");
    }
    assert_eq!(table("gyro\n9,81\n9,82\n").header.unwrap(), ["gyro"]);
    assert_eq!(columns("gyro\n9,81\n9,82\n"), [[9.81, 9.82]]);
    // Whole numbers, or too little evidence.
    for text in ["a,b\n1,2\n3,4\n", "1,2\n3,4\n", "Serial: 5\n1,2\n3,4\n", "Logger 7\nStatic\n1,2\n3,4\n"] {
        assert_eq!(columns(text), [[1.0, 3.0], [2.0, 4.0]], "{text}");
    }
    assert_eq!(columns("Logger\n1,-2\n3,4\n").len(), 2);
    assert_eq!(columns("a,b\n-0,2\n3,4\n").len(), 2);
    assert_eq!(columns("# a,b\n-0,2\n3,4\n").len(), 2);
}

#[test]
fn an_infinite_cell_is_named_by_row_and_column() {
    let options = Options { finite: true, ..Options::default() };
    let stop = AtomicBool::new(false);
    let refusal =
        |text: &str| read(Log::new(text.as_bytes()).path(), &options, &stop).unwrap_err().to_string();
    let words = "row 4, column 2 (b): \"inf\" is infinite: write nan for a missing sample";
    assert!(refusal("a,b\n1,2\n# c\n3,inf\n").ends_with(words));
    assert!(refusal("1\n-Infinity\n").contains("row 2, column 1: \"-Infinity\""));
    assert!(refusal("1\n1e999\n").contains("row 2, column 1: \"1e999\""));
    assert!(refusal("a;b\n1,5;2,5\n3;inf\n").contains("row 3, column 2 (b)"));
    // Infinite cells are accepted in unwanted columns and if the caller allows them.
    let log = Log::new(b"a,b\n1,2\n3,inf\n");
    let mut reader = Reader::open(log.path(), &options, &stop).unwrap();
    reader.select(vec![0]).unwrap();
    assert_eq!(reader.next(9, &stop).unwrap().unwrap(), [1.0, 3.0]);
    assert!(reader.select(vec![1]).is_err());
    assert_eq!(columns("a,b\n1,2\n3,inf\n")[1], [2.0, f64::INFINITY]);
}

#[test]
fn rows_of_hexadecimal_numbers_are_no_header() {
    for row in ["0x1.8p+0", "1,-0x1.8p-3,0x1F", "0x1F,0XAB"] {
        let width = row.split(',').count();
        let decimal = vec!["1.5"; width].join(",");
        for text in
            [[row; 100].join("\n"), format!("{}\n{}\n", [row; 100].join("\n"), [&*decimal; 9].join("\n"))]
        {
            let said = refusal(&text);
            assert!(
                said.contains("row 1 has ") && said.ends_with(": hexadecimal numbers are not read"),
                "{said}"
            );
        }
    }
    assert!(refusal(&["1,-0x1.8p-3"; 100].join("\n")).contains("-0x1.8p-3"));
    // Such words may be names of registers.
    assert_eq!(table("0x10,0x11\n1,2\n3,4\n").header.unwrap(), ["0x10", "0x11"]);
    assert_eq!(table("id,0x1F\nx,y\n1,2\n3,4\n").meta.rows, 2);
}

#[test]
fn a_trailing_comment_keeps_the_row() {
    for comment in ["# note", "#", "% moved, 3 mm", "// 12", "! see 7"] {
        let one = format!("0.5 {comment}\n1.5\n2.5\t{comment}\n3.5\n");
        assert_eq!(columns(&one), [[0.5, 1.5, 2.5, 3.5]], "{one}");
        assert_eq!(columns(&format!("gyro\n{one}")), [[0.5, 1.5, 2.5, 3.5]], "{one}");
        for delimiter in [",", ";", "\t", " "] {
            let d = delimiter;
            let two = format!("1{d}2 {comment}\n3{d}4\nnan{d}6 {comment}\n7{d}8\n");
            assert_eq!(columns(&two), [[1.0, 3.0, -1.0, 7.0], [2.0, 4.0, 6.0, 8.0]], "{two}");
        }
    }
    assert!(refusal("1\n2\n3#4\n").contains("row 3"));
    assert!(refusal("1,2\n3,4\n5 # lost,6\n").contains("row 3"));
    assert!(refusal("1,2\n3,four # 5\n").contains("row 2, column 2: \"four # 5\""));
    // Names and text in unwanted columns are not cut.
    assert_eq!(table("sensor #1,sensor #2\n1,2\n").header.unwrap(), ["sensor #1", "sensor #2"]);
    let log = Log::new(b"x,note,y\n1,bump # 7,2\n3,,4\n");
    let options = Options { columns: Some(vec![0, 2]), ..Options::default() };
    let found = read(log.path(), &options, &AtomicBool::new(false)).unwrap();
    assert_eq!(found.columns, [[1.0, 3.0], [2.0, 4.0]]);
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
    fn written_numbers_are_read_back(
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
