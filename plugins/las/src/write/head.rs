//! The header of a file that is written, and its records.

use super::encode::Counts;
use super::plan::Plan;
use super::scale::Steps;
use crate::extra::shortened;
use crate::header::{LONG, SHORT, months};
use crate::layout::STANDARD_TIME;
use crate::notes;
use crate::projection::{is_wkt, keys_of};
use crate::up_record;
use laz::LazVlr;
use surfelshop_api::Result;
use surfelshop_api::format::{CloudHeader, GPS_TIME, HeaderSupport, UpAxis, UpSupport};
use surfelshop_api::glam::DVec3;

/// What wrote the file.
const SOFTWARE: &str = concat!("Surfelshop ", env!("CARGO_PKG_VERSION"));
/// Longest payload of a record.
const LONGEST: usize = u16::MAX as usize;

/// Header and records, whose numbers of points are filled in when they are known.
pub(super) struct Head {
    minor: u8,
    header: Vec<u8>,
    records: Vec<u8>,
    n_records: u32,
}

impl Head {
    /// The head of a file; adds to `lines` what it cannot hold.
    ///
    /// # Errors
    /// Where the description of the compression cannot be written.
    pub(super) fn new(
        cloud: &CloudHeader,
        plan: &Plan,
        steps: Steps,
        vlr: Option<&LazVlr>,
        lines: &mut Vec<String>,
    ) -> Result<Self> {
        let len = if plan.minor >= 4 { LONG } else { SHORT };
        let mut head =
            Self { minor: plan.minor, header: vec![0; len], records: Vec::new(), n_records: 0 };
        if let Some(vlr) = vlr {
            let mut body = Vec::new();
            vlr.write_to(&mut body)?;
            head.add(LazVlr::USER_ID, LazVlr::RECORD_ID, &body);
        }
        if !plan.descriptions.is_empty() {
            head.add("LASF_Spec", 4, &plan.descriptions);
        }
        let is_keyed = head.add_projection(cloud, lines);
        head.add_comments(cloud, lines);
        if cloud.up != UpAxis::Z {
            head.add(up_record::USER, up_record::ID, up_record::body(cloud.up));
        }
        let mut encoding = u16::from(plan.minor >= 4 && !is_keyed) << 4;
        let time = cloud.column(GPS_TIME);
        if time.is_some_and(|(_, column)| column.description == STANDARD_TIME) {
            encoding |= 1;
        }
        head.put(0, b"LASF");
        head.put(6, &encoding.to_le_bytes());
        let note = |beginning| notes::find(&cloud.comments, beginning);
        let source_id = note(notes::SOURCE_ID).and_then(|id| id.parse::<u16>().ok());
        head.put(4, &source_id.unwrap_or(0).to_le_bytes());
        head.put(8, &note(notes::PROJECT_ID).and_then(notes::project_id).unwrap_or_default());
        head.put(24, &[1, plan.minor]);
        head.put(26, shortened(note(notes::SYSTEM).unwrap_or("OTHER"), 32).as_bytes());
        head.put(58, shortened(SOFTWARE, 31).as_bytes());
        let (day, year) = day_of(&cloud.time).unwrap_or_default();
        head.put(90, &day.to_le_bytes());
        head.put(92, &year.to_le_bytes());
        head.put(94, &(len as u16).to_le_bytes());
        head.put(96, &u32::try_from(head.points_at())?.to_le_bytes());
        head.put(100, &head.n_records.to_le_bytes());
        head.put(104, &[plan.format.id | if vlr.is_some() { 0x80 } else { 0 }]);
        head.put(105, &u16::try_from(plan.record_len)?.to_le_bytes());
        for axis in 0..3 {
            head.put(131 + 8 * axis, &steps.scale[axis].to_le_bytes());
            head.put(155 + 8 * axis, &steps.offset[axis].to_le_bytes());
        }
        lost(cloud, lines);
        Ok(head)
    }

    /// Where the points begin.
    pub(super) fn points_at(&self) -> u64 {
        (self.header.len() + self.records.len()) as u64
    }

    /// The bytes of a file with these points.
    pub(super) fn bytes(mut self, counts: &Counts, steps: Steps) -> Vec<u8> {
        if self.minor >= 4 {
            self.put(247, &counts.n_points.to_le_bytes());
            for (i, n) in counts.n_returns.iter().enumerate() {
                self.put(255 + 8 * i, &n.to_le_bytes());
            }
        } else {
            let fitting = |n: u64| u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes();
            self.put(107, &fitting(counts.n_points));
            for (i, &n) in counts.n_returns.iter().take(5).enumerate() {
                self.put(111 + 4 * i, &fitting(n));
            }
        }
        if let Some(bounds) = counts.bounds {
            let [low, high] = bounds.map(|steps_to| {
                DVec3::from_array(steps_to.map(f64::from)) * steps.scale + steps.offset
            });
            for axis in 0..3 {
                self.put(179 + 16 * axis, &high[axis].to_le_bytes());
                self.put(187 + 16 * axis, &low[axis].to_le_bytes());
            }
        }
        self.header.extend(self.records);
        self.header
    }

    fn put(&mut self, at: usize, bytes: &[u8]) {
        self.header[at..at + bytes.len()].copy_from_slice(bytes);
    }

    /// Adds a record, whose payload is short enough.
    fn add(&mut self, user: &str, id: u16, body: &[u8]) {
        let mut head = [0; 54];
        head[2..2 + user.len()].copy_from_slice(user.as_bytes());
        head[18..20].copy_from_slice(&id.to_le_bytes());
        head[20..22].copy_from_slice(&(body.len() as u16).to_le_bytes());
        self.records.extend(head);
        self.records.extend(body);
        self.n_records += 1;
    }

    /// Adds the coordinate system; says whether it is one of `GeoTIFF` keys.
    fn add_projection(&mut self, cloud: &CloudHeader, lines: &mut Vec<String>) -> bool {
        let system = cloud.coordinate_system.trim();
        let code = system.strip_prefix("EPSG:").and_then(|code| code.parse::<u16>().ok());
        let own = notes::keys(&cloud.comments).filter(|_| code.is_none());
        let mut has_keys = code.is_some();
        if let Some(lists) = own {
            has_keys = self.minor < 4;
            if has_keys {
                for (id, list) in (34735..).zip(lists).filter(|(_, list)| !list.is_empty()) {
                    self.add("LASF_Projection", id, &list);
                }
            } else if !is_wkt(system) {
                lines.push(
                    "the GeoTIFF keys of the coordinate system are left out: LAS 1.4 has systems as WKT"
                        .to_owned(),
                );
            }
        }
        let metres = cloud.metres_per_unit;
        let has_unit = metres > 0.0 && metres.to_bits() != 1f64.to_bits();
        if system.is_empty() && has_unit && !has_keys {
            lines.push(format!(
                "the unit of {metres} m is left out: LAS says units with a coordinate system alone"
            ));
        }
        if let Some(code) = code {
            self.add("LASF_Projection", 34735, &keys_of(code, cloud.metres_per_unit));
        } else if is_wkt(system) && system.len() < LONGEST {
            self.add("LASF_Projection", 2112, &[system.as_bytes(), b"\0"].concat());
            if self.minor < 4 && !has_keys {
                lines.push(
                    "the coordinate system is written as WKT, which other programs may look for in LAS 1.4 alone: \
                     `--write-set version=1.4`"
                        .to_owned(),
                );
            }
        } else if !system.is_empty() {
            lines.push(format!(
                "the coordinate system `{}` is left out: expected WKT of at most {LONGEST} bytes or an EPSG code",
                shortened(system, 60)
            ));
        }
        has_keys
    }

    fn add_comments(&mut self, cloud: &CloudHeader, lines: &mut Vec<String>) {
        let has_place = |comment: &&String| notes::ALL.iter().any(|note| comment.starts_with(note));
        for comment in cloud.comments.iter().filter(|comment| !has_place(comment)) {
            let body = shortened(comment, LONGEST - 1);
            if body.len() < comment.len() {
                lines.push("a comment of more than 65534 bytes is cut short".to_owned());
            }
            self.add("LASF_Spec", 3, &[body.as_bytes(), b"\0"].concat());
        }
        let others = cloud.comments.iter().filter_map(|text| text.strip_prefix(notes::NOT_READ));
        let others: Vec<&str> = others.collect();
        if !others.is_empty() {
            let (named, n_more) = (&others[..others.len().min(4)], others.len().saturating_sub(4));
            let more = if n_more > 0 { format!("; {n_more} more") } else { String::new() };
            lines.push(format!(
                "records of the file that was read are left out: {}{more}",
                named.join("; ")
            ));
        }
    }
}

/// Says what of a cloud's header LAS has no place for.
fn lost(cloud: &CloudHeader, lines: &mut Vec<String>) {
    let which = match cloud.up {
        UpAxis::X => Some("x points up in this cloud"),
        UpAxis::Y => Some("y points up in this cloud"),
        UpAxis::Unknown => Some("this cloud does not say which axis points up"),
        UpAxis::Z => None,
    };
    if let Some(which) = which {
        lines.push(format!(
            "{which}, and programs read LAS with z up; a record for Surfelshop notes it"
        ));
    }
    // A header has the day alone; units and systems have lines of their own.
    let rest = cloud.time.get(10..).unwrap_or_default();
    let is_day = ["", " 00:00:00 UTC"].contains(&rest) && day_of(&cloud.time).is_some();
    let held = HeaderSupport {
        unit: true,
        coordinate_system: true,
        time: is_day,
        ..HeaderSupport::default()
    };
    lines.extend(
        cloud.left_out("LAS", HeaderSupport { up: UpSupport::Said, comments: true, ..held }),
    );
}

/// Day of the year, from 1, and year of a time that begins with a date: `2018-03-05`; 0 and the year where it is that
/// alone, as the reader has it then.
fn day_of(time: &str) -> Option<(u16, u16)> {
    if time.len() == 4 {
        return Some((0, time.parse().ok()?));
    }
    let mut parts = time.get(..10)?.split('-').map(str::parse::<u16>);
    let (year, month, day) = (parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?);
    let months = months(u32::from(year));
    let before = months.get(..usize::from(month.checked_sub(1)?))?;
    let is_day = (1..=*months.get(before.len())?).contains(&u32::from(day));
    let days = before.iter().sum::<u32>() + u32::from(day);
    (is_day && parts.next().is_none()).then_some((u16::try_from(days).ok()?, year))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_counted_within_their_year() {
        assert_eq!(day_of("2018-01-01"), Some((1, 2018)));
        assert_eq!(day_of("2020-12-31T10:00"), Some((366, 2020)));
        assert_eq!(day_of("1900-03-01"), Some((60, 1900)));
        for time in [
            "",
            "201",
            "20188",
            "2018-13-01",
            "2018-02-29",
            "2018-00-10",
            "2018-01-00",
            "18-1-1-11",
        ] {
            assert_eq!(day_of(time), None, "{time}");
        }
        assert_eq!(day_of("2018"), Some((0, 2018)));
    }
}
