//! Parsing of date-times: ISO 8601 and common variants of loggers.

/// Seconds since 1970 (UTC) for a date-time or date, or seconds since midnight for a time of day; `None` for other
/// text.
///
/// Examples: 2026-01-31T12:00:00.5Z, 2026-01-31 12:00:00,5+01:00, 2026/01/31 12:00:00, 31.01.2026 12:00:00,
/// 2026-01-31, 12:00:00.25, 01/31/2026 12:00:00.000000000, 1/31/2026 2:00:00 PM. A time without an offset is taken as
/// UTC, because only differences matter. In a/b/2026 the month comes first unless a is above 12; the caller compares
/// both orders.
pub(super) fn moment(cell: &[u8]) -> Option<f64> {
    // Start with a cheap test that numbers fail.
    let dated = cell.len() >= 8 && matches!(cell[4], b'-' | b'/') && matches!(cell[7], b'-' | b'/');
    let day_first = !dated && cell.len() >= 10 && cell[2] == b'.' && cell[5] == b'.';
    if !dated && !day_first {
        return match cell {
            [_, b'/', ..] | [_, _, b'/', ..] => slashed(cell),
            [_, _, b'-', first, ..] if first.is_ascii_alphabetic() => named_month(cell),
            [_, _, b':', ..] => time(cell),
            _ => None,
        };
    }
    let (year, month, day) = if day_first { (6..10, 3..5, 0..2) } else { (0..4, 5..7, 8..10) };
    let (year, month, day) = (digits(cell.get(year)?)?, digits(cell.get(month)?)?, digits(cell.get(day)?)?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    at_day(days(year, month, day), &cell[10..])
}

/// Seconds since 1970 for a day and the text after its date.
fn at_day(day: i64, rest: &[u8]) -> Option<f64> {
    let midnight = 86_400.0 * day as f64;
    match rest.first() {
        None => Some(midnight),
        Some(b'T' | b't' | b' ' | b'_') => Some(midnight + time(rest[1..].trim_ascii())?),
        _ => None,
    }
}

/// Seconds since 1970 for dates with the name of the month, as MATLAB writes them: 31-Jan-2026 12:00:00.5.
fn named_month(cell: &[u8]) -> Option<f64> {
    const MONTHS: &[u8] = b"janfebmaraprmayjunjulaugsepoctnovdec";
    let name = cell.get(3..6)?.to_ascii_lowercase();
    let month = 1 + i64::try_from(MONTHS.chunks(3).position(|month| *month == *name)?).ok()?;
    let (day, year) = (digits(cell.get(..2)?)?, digits(cell.get(7..11)?)?);
    let valid = cell[6] == b'-' && (1..=31).contains(&day);
    if valid { at_day(days(year, month, day), &cell[11..]) } else { None }
}

/// Seconds since 1970 for dates with slashes, such as 05/03/2026 14:00:00.000000000 and 5/3/2026 2:00:00 PM.
fn slashed(cell: &[u8]) -> Option<f64> {
    let end = cell.iter().position(|byte| matches!(byte, b' ' | b'T' | b'_')).unwrap_or(cell.len());
    let mut parts = cell[..end].split(|byte| *byte == b'/');
    let (one, two, year) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() || one.len() > 2 || two.len() > 2 || year.len() != 4 {
        return None;
    }
    let (one, two, year) = (digits(one)?, digits(two)?, digits(year)?);
    let (month, day) = if one > 12 { (two, one) } else { (one, two) };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    let day = days(year, month, day);
    let rest = &cell[end..];
    // Convert one-digit hours and AM/PM to the form that `time` parses.
    let clock = rest.get(1..).unwrap_or_default().trim_ascii();
    let half = clock.len().checked_sub(2).map(|at| clock[at..].to_ascii_uppercase());
    let (clock, half) = match half.as_deref() {
        Some(b"AM") => (clock[..clock.len() - 2].trim_ascii(), Some(0.0)),
        Some(b"PM") => (clock[..clock.len() - 2].trim_ascii(), Some(43_200.0)),
        _ => (clock, None),
    };
    let padded = if clock.get(1) == Some(&b':') { [b"0", clock].concat() } else { clock.to_vec() };
    if padded.is_empty() {
        return at_day(day, rest);
    }
    let seconds = time(&padded)?;
    let seconds = match half {
        Some(later) if (3_600.0..46_800.0).contains(&seconds) => seconds % 43_200.0 + later,
        Some(_) => return None,
        None => seconds,
    };
    Some(86_400.0 * day as f64 + seconds)
}

/// Seconds since midnight (UTC) for hh:mm:ss or hh:mm:ss.fff, optionally with Z or an offset.
fn time(cell: &[u8]) -> Option<f64> {
    let (clock, offset) = offset(cell)?;
    if clock.len() < 8 || clock[2] != b':' || clock[5] != b':' {
        return None;
    }
    let (hour, minute, second) = (digits(&clock[..2])?, digits(&clock[3..5])?, digits(&clock[6..8])?);
    if hour > 24 || minute > 59 || second > 60 {
        return None;
    }
    let fraction = match clock.get(8) {
        None => 0.0,
        Some(b'.' | b',' | b':') => {
            let text = &clock[9..];
            let scale = 10f64.powi(i32::try_from(text.len()).ok()?);
            digits(text.get(..text.len().min(15))?)? as f64 / scale.min(1e15)
        }
        Some(_) => return None,
    };
    Some((3600 * hour + 60 * minute + second - offset) as f64 + fraction)
}

/// Time of day without its offset, and the offset in seconds.
fn offset(cell: &[u8]) -> Option<(&[u8], i64)> {
    if let Some(clock) = cell.strip_suffix(b"Z").or(cell.strip_suffix(b"z")) {
        return Some((clock.trim_ascii_end(), 0));
    }
    let Some(at) = cell.iter().rposition(|byte| matches!(byte, b'+' | b'-')) else { return Some((cell, 0)) };
    let sign = if cell[at] == b'+' { 1 } else { -1 };
    let text: Vec<u8> = cell[at + 1..].iter().copied().filter(|byte| *byte != b':').collect();
    let seconds = match text.len() {
        2 => 3600 * digits(&text)?,
        4 => 3600 * digits(&text[..2])? + 60 * digits(&text[2..])?,
        _ => return None,
    };
    Some((cell[..at].trim_ascii_end(), sign * seconds))
}

/// Value of a string of digits; `None` for other text.
fn digits(text: &[u8]) -> Option<i64> {
    if text.is_empty() || !text.iter().all(u8::is_ascii_digit) {
        return None;
    }
    std::str::from_utf8(text).ok()?.parse().ok()
}

/// Days since 1970-01-01 in the Gregorian calendar (Hinnant, "chrono-compatible low-level date algorithms").
fn days(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year - 400 * era;
    let of_year = (153 * (month + if month > 2 { -3 } else { 9 }) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::moment;

    #[test]
    fn date_times_are_seconds_since_1970() {
        for (text, seconds) in [
            ("1970-01-01", 0.0),
            ("2000-02-29T00:00:00Z", 951_782_400.0),
            ("2026-01-31T12:00:00.5Z", 1_769_860_800.5),
            ("2026-01-31 13:00:00,5+01:00", 1_769_860_800.5),
            ("2026/01/31_12:00:00.500", 1_769_860_800.5),
            ("31.01.2026 12:00:00.500", 1_769_860_800.5),
            ("31.01.2026", 1_769_817_600.0),
            ("2026-01-31T12:00:00.500000-0000", 1_769_860_800.5),
            ("12:00:01.25", 43_201.25),
            ("01/31/2026 12:00:00.500000000", 1_769_860_800.5),
            ("31/01/2026 12:00:00,5", 1_769_860_800.5),
            ("1/31/2026 1:00:00.5 PM", 1_769_864_400.5),
            ("1/31/2026 12:00:00 am", 1_769_817_600.0),
            ("1/31/2026", 1_769_817_600.0),
            ("31-Jan-2026 12:00:00.500", 1_769_860_800.5),
            ("31-JAN-2026", 1_769_817_600.0),
            ("1969-12-31T23:59:59", -1.0),
        ] {
            assert_eq!(moment(text.as_bytes()), Some(seconds), "{text}");
        }
        for text in [
            "2026-13-01",
            "01.31.2026",
            "1.2.2026",
            "31.01.26 1",
            "2026-01-31T25:00:00x",
            "2026-01-3",
            "12:00",
            "1-2-3",
            "2026-01-31T",
            "12:0a:00",
            "13/13/2026",
            "31-Abc-2026",
            "32-Jan-2026",
            "31-Jan-26",
            "31-Jan 2026",
            "1/2",
            "1/2/26",
            "1/31/2026 13:00:00 PM",
            "1/2/2026/3",
        ] {
            assert_eq!(moment(text.as_bytes()), None, "{text}");
        }
    }
}
