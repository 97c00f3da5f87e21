//! Times of E57 files, seconds of GPS time, as dates for people.

/// Seconds of a day.
const DAY: u64 = 86_400;

/// Year and month at whose beginning UTC fell behind GPS time by another second.
///
/// Source: IERS Bulletin C, up to the one of 2016-07-06; there was none since.
const LEAPS: [(u64, u64); 18] = [
    (1981, 7),
    (1982, 7),
    (1983, 7),
    (1985, 7),
    (1988, 1),
    (1990, 1),
    (1991, 1),
    (1992, 7),
    (1993, 7),
    (1994, 7),
    (1996, 1),
    (1997, 7),
    (1999, 1),
    (2006, 1),
    (2009, 1),
    (2012, 7),
    (2015, 7),
    (2017, 1),
];

/// A time as `2024-05-17 09:30:00 UTC`; `None` where it is not a time after 1980-01-06, or after the year 9999.
pub(crate) fn date(gps_seconds: f64) -> Option<String> {
    let in_range = (1.0..2.5e11).contains(&gps_seconds);
    let gps = in_range.then_some(gps_seconds as u64)?;
    let behind = (1..).zip(LEAPS).filter(|&(n, (year, month))| gps >= seconds(year, month, 1) + n);
    let utc = gps - behind.count() as u64;
    let (mut days, mut year, mut month) = (utc / DAY + 5, 1980, 1);
    while days >= days_of_year(year) {
        days -= days_of_year(year);
        year += 1;
    }
    while days >= days_of_month(year, month) {
        days -= days_of_month(year, month);
        month += 1;
    }
    let (day, second) = (days + 1, utc % DAY);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    Some(format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02} UTC"))
}

/// The GPS time of a date, which may have a time of day, in UTC; `None` where the text is something else.
pub(crate) fn gps_seconds(text: &str) -> Option<f64> {
    let text = text.trim();
    let text = text.strip_suffix("UTC").or_else(|| text.strip_suffix('Z')).unwrap_or(text).trim();
    let (date, time) = text.split_once(['T', ' ']).unwrap_or((text, "00:00:00"));
    let [year, month, day] = numbers(date, '-')?;
    let [hour, minute, second] = numbers(time, ':')?;
    let in_range = (1980..=9999).contains(&year) && (1..=12).contains(&month);
    if !in_range || day == 0 || day > days_of_month(year, month) {
        return None;
    }
    if hour > 23 || minute > 59 || second > 59 || (year, month, day) < (1980, 1, 6) {
        return None;
    }
    let behind = LEAPS.iter().filter(|leap| (year, month) >= **leap).count() as u64;
    let utc = seconds(year, month, day) + hour * 3600 + minute * 60 + second;
    Some((utc + behind) as f64)
}

/// Three numbers between separators; a fraction of the last is left out.
fn numbers(text: &str, separator: char) -> Option<[u64; 3]> {
    let mut parts = text.trim().split(separator);
    let mut number = || {
        let part = parts.next()?;
        let whole = part.split('.').next()?;
        whole.bytes().all(|byte| byte.is_ascii_digit()).then(|| whole.parse().ok())?
    };
    let all = [number()?, number()?, number()?];
    parts.next().is_none().then_some(all)
}

/// Seconds from 1980-01-06 to the beginning of a day from then on, all days alike.
fn seconds(year: u64, month: u64, day: u64) -> u64 {
    let years: u64 = (1980..year).map(days_of_year).sum();
    let months: u64 = (1..month).map(|month| days_of_month(year, month)).sum();
    (years + months + day).saturating_sub(6) * DAY
}

fn is_leap(year: u64) -> bool {
    year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
}

fn days_of_year(year: u64) -> u64 {
    if is_leap(year) { 366 } else { 365 }
}

fn days_of_month(year: u64, month: u64) -> u64 {
    match month {
        2 if is_leap(year) => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_known_seconds() {
        // 2017-01-01 00:00:00 UTC is second 1167264018 of GPS time, one second after the leap second.
        assert_eq!(date(1_167_264_018.0).unwrap(), "2017-01-01 00:00:00 UTC");
        assert_eq!(date(1_167_264_016.9).unwrap(), "2016-12-31 23:59:59 UTC");
        assert_eq!(date(1.5).unwrap(), "1980-01-06 00:00:01 UTC");
        assert_eq!(date(1_000_000_000.0).unwrap(), "2011-09-14 01:46:25 UTC");
        assert_eq!(gps_seconds("2011-09-14T01:46:25.7Z"), Some(1_000_000_000.0));
        for time in [2.0, 46_828_801.0, 9.5e8, 1_167_264_018.0, 1.4e9, 1e11] {
            assert_eq!(gps_seconds(&date(time).unwrap()), Some(time));
        }
        assert_eq!(gps_seconds("2020-02-29"), gps_seconds("2020-02-29 00:00:00 UTC"));
    }

    #[test]
    fn what_is_no_time_is_none() {
        for time in [0.0, -5.0, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(date(time), None, "{time}");
        }
        for text in [
            "",
            "yesterday",
            "2021-02-29",
            "1979-12-31",
            "2020-13-01",
            "2020-01-01 25:00:00",
            "2020-1",
        ] {
            assert_eq!(gps_seconds(text), None, "{text}");
        }
        assert_eq!(gps_seconds("2020-01-99999999999999999999"), None);
    }
}
