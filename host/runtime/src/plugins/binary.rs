//! What a shared library of any system says in its headers: ELF, Mach-O and PE.
//!
//! Only headers and the two exported symbols are read; every offset taken from the file is
//! checked against the file's length.

use super::inspect::{Refused, first_bytes};
use object::read::elf::{FileHeader, SectionHeader};
use object::read::macho::{FatArch, MachHeader, MachOFatFile32, MachOFatFile64};
use object::{
    Architecture, BinaryFormat, Endianness, ExportTarget, FileKind, NameOrOrdinal, Object,
    ObjectKind, ObjectSection, ObjectSegment, ReadRef, elf, macho,
};
use std::env::consts;

/// How many bytes tell the type of a file.
pub(super) const MAGIC_LEN: usize = 16;

/// How a library of Linux and most Unix systems begins.
pub(super) const ELF_MAGIC: [u8; 4] = *b"\x7fELF";

/// Libraries with more exported symbols are refused: Mach-O names them with a tree whose branches
/// may share their ends, so a small file can announce more than could ever be read.
const MAX_EXPORTS: usize = 1 << 20;

/// A parsed shared library.
pub(super) struct Library<'a, R: ReadRef<'a> = &'a [u8]> {
    /// The library: the whole file, or the part of a universal file that is for this machine.
    bytes: R,
    file: object::File<'a, R>,
}

impl<'a> Library<'a> {
    /// Parses the headers of a file in memory.
    pub(super) fn parse(whole: &'a [u8]) -> Result<Self, Refused> {
        let kind = match FileKind::parse(whole) {
            Ok(kind) => kind,
            Err(error) if looks_like_library(whole) => return Err(damaged(error)),
            Err(_) => return Err(Refused::NotALibrary { first_bytes: first_bytes(whole) }),
        };
        let bytes = match kind {
            FileKind::MachOFat32 => {
                fat_slice(whole, MachOFatFile32::parse(whole).map_err(damaged)?.arches())?
            }
            FileKind::MachOFat64 => {
                fat_slice(whole, MachOFatFile64::parse(whole).map_err(damaged)?.arches())?
            }
            _ => whole,
        };
        Self::of(bytes)
    }
}

impl<'a, R: ReadRef<'a>> Library<'a, R> {
    /// Parses the headers of a library that is for one machine.
    pub(super) fn of(bytes: R) -> Result<Self, Refused> {
        match FileKind::parse(bytes).map_err(damaged)? {
            FileKind::Elf32 => check_elf_tables::<elf::FileHeader32<Endianness>, R>(bytes)?,
            FileKind::Elf64 => check_elf_tables::<elf::FileHeader64<Endianness>, R>(bytes)?,
            FileKind::MachO32 => check_macho_commands::<macho::MachHeader32<Endianness>, R>(bytes)?,
            FileKind::MachO64 => check_macho_commands::<macho::MachHeader64<Endianness>, R>(bytes)?,
            _ => {}
        }
        let file = object::File::parse(bytes).map_err(damaged)?;
        match file.kind() {
            ObjectKind::Executable => Err(Refused::OtherKind { found: "a program" }),
            ObjectKind::Relocatable => Err(Refused::OtherKind { found: "an object file" }),
            ObjectKind::Core => Err(Refused::OtherKind { found: "a memory dump" }),
            // A Mach-O bundle is loaded like a library and reported as unknown.
            _ => Ok(Self { bytes, file }),
        }
    }

    /// Refuses libraries for other processors or systems.
    pub(super) fn check_machine(&self) -> Result<(), Refused> {
        let little = self.file.is_little_endian();
        let machine = machine_name(self.file.architecture());
        let found = (machine.as_str(), self.file.is_64(), little, self.system());
        let host = (
            consts::ARCH,
            cfg!(target_pointer_width = "64"),
            cfg!(target_endian = "little"),
            host_system(),
        );
        if found == host {
            return Ok(());
        }
        Err(Refused::OtherMachine { found: describe(found), host: describe(host) })
    }

    /// The system the library is for.
    fn system(&self) -> &'static str {
        // Byte 7 of an ELF file names the system's ABI.
        let mark = self.bytes.read_bytes_at(7, 1).ok().and_then(|bytes| bytes.first());
        match (self.file.format(), mark) {
            (BinaryFormat::MachO, _) => "macOS",
            (BinaryFormat::Pe, _) => "Windows",
            (BinaryFormat::Elf, Some(3)) => "Linux",
            (BinaryFormat::Elf, Some(9)) => "FreeBSD",
            // Most Unix systems leave the mark at zero, so it fits whichever of them this is.
            (BinaryFormat::Elf, Some(0)) => match host_system() {
                "macOS" | "Windows" => "Linux",
                unix => unix,
            },
            _ => "another system",
        }
    }

    /// Refuses libraries of which a part is missing.
    pub(super) fn check_length(&self) -> Result<(), Refused> {
        let segments = self.file.segments().map(|segment| segment.file_range());
        let sections = self.file.sections().filter_map(|section| section.file_range());
        let ends = segments.chain(sections).map(|(offset, len)| offset.saturating_add(len));
        check_end(ends.max().unwrap_or(0), self.bytes)
    }

    /// The addresses that symbols of these names are exported at.
    pub(super) fn exports<const N: usize>(
        &self,
        names: [&str; N],
    ) -> Result<[Option<u64>; N], Refused> {
        let mut found = [None; N];
        for (i, export) in self.file.exports().map_err(damaged)?.enumerate() {
            if i == MAX_EXPORTS {
                return Err(Refused::Damaged(format!("it exports more than {i} symbols")));
            }
            let export = export.map_err(damaged)?;
            let (NameOrOrdinal::Name(name), ExportTarget::Address { address }) =
                (export.name(), export.target())
            else {
                continue;
            };
            // Mach-O puts an underscore before the names of the source code.
            let name = match self.file.format() {
                BinaryFormat::MachO => name.strip_prefix(b"_").unwrap_or(name),
                _ => name,
            };
            if let Some(i) = names.iter().position(|wanted| wanted.as_bytes() == name) {
                found[i].get_or_insert(address);
            }
        }
        Ok(found)
    }

    /// The bytes of the file that are loaded at an address and behind it, at most so many.
    pub(super) fn bytes_at(&self, address: u64, most: u64) -> Option<&'a [u8]> {
        self.file.segments().find_map(|segment| {
            let offset = address.checked_sub(segment.address())?;
            let (start, len) = segment.file_range();
            let len = len.checked_sub(offset)?.min(most);
            let bytes = self.bytes.read_bytes_at(start.checked_add(offset)?, len).ok()?;
            Some(bytes).filter(|bytes| !bytes.is_empty())
        })
    }

    /// Whether `len` bytes at an address lie inside one segment.
    pub(super) fn holds(&self, address: u64, len: u64) -> bool {
        self.file.segments().any(|segment| {
            address
                .checked_sub(segment.address())
                .and_then(|offset| offset.checked_add(len))
                .is_some_and(|end| end <= segment.size())
        })
    }
}

fn damaged(error: object::Error) -> Refused {
    Refused::Damaged(error.to_string())
}

/// Whether the first bytes are those of a library whose rest cannot be understood.
fn looks_like_library(bytes: &[u8]) -> bool {
    bytes.starts_with(&ELF_MAGIC) || bytes.starts_with(b"MZ")
}

fn check_end<'a>(needed: u64, bytes: impl ReadRef<'a>) -> Result<(), Refused> {
    let found = bytes.len().unwrap_or_default();
    if needed > found { Err(Refused::Truncated { needed, found }) } else { Ok(()) }
}

/// Refuses an ELF file whose header tables reach beyond its end.
///
/// Linkers put the section headers last, so nearly every cut removes some of them, and a parser
/// that only says "invalid table" would leave the reader guessing.
fn check_elf_tables<'a, Elf: FileHeader<Endian = Endianness>, R: ReadRef<'a>>(
    bytes: R,
) -> Result<(), Refused> {
    let Ok(header) = Elf::parse(bytes) else {
        return check_end(size_of::<Elf>() as u64, bytes);
    };
    let endian = header.endian().map_err(damaged)?;
    let table = |offset: u64, count: u16, size: u16| {
        offset.saturating_add(u64::from(count) * u64::from(size))
    };
    let segments =
        table(header.e_phoff(endian).into(), header.e_phnum(endian), header.e_phentsize(endian));
    let sections =
        table(header.e_shoff(endian).into(), header.e_shnum(endian), header.e_shentsize(endian));
    check_end(segments.max(sections), bytes)?;
    // The sections of a file that is cut in its middle may still have whole headers.
    let headers = header.section_headers(endian, bytes).map_err(damaged)?;
    let ends = headers.iter().filter_map(|section| section.file_range(endian));
    check_end(ends.map(|(offset, len)| offset.saturating_add(len)).max().unwrap_or(0), bytes)
}

/// Refuses a Mach-O file whose load commands reach beyond its end; a parser would find none.
fn check_macho_commands<'a, Mach: MachHeader<Endian = Endianness>, R: ReadRef<'a>>(
    bytes: R,
) -> Result<(), Refused> {
    let Ok(header) = Mach::parse(bytes, 0) else {
        return check_end(size_of::<Mach>() as u64, bytes);
    };
    let commands = header.sizeofcmds(header.endian().map_err(damaged)?);
    check_end(size_of::<Mach>() as u64 + u64::from(commands), bytes)
}

/// The part of a universal Mach-O file that is for this machine.
fn fat_slice<'a, Arch: FatArch>(whole: &'a [u8], arches: &[Arch]) -> Result<&'a [u8], Refused> {
    let names: Vec<String> = arches.iter().map(|a| machine_name(a.architecture())).collect();
    let Some(i) = names.iter().position(|name| name == consts::ARCH) else {
        return Err(Refused::OtherMachine {
            found: format!("{} macOS", names.join(" and ")),
            host: format!("{} {}", consts::ARCH, host_system()),
        });
    };
    let (offset, len) = arches[i].file_range();
    check_end(offset.saturating_add(len), whole)?;
    arches[i].data(whole).map_err(damaged)
}

/// The name Rust uses for a processor.
fn machine_name(architecture: Architecture) -> String {
    match architecture {
        Architecture::I386 => "x86".to_owned(),
        Architecture::Unknown => "an unknown processor".to_owned(),
        other => format!("{other:?}").to_lowercase(),
    }
}

fn host_system() -> &'static str {
    match consts::OS {
        "linux" | "android" => "Linux",
        "macos" => "macOS",
        "windows" => "Windows",
        "freebsd" => "FreeBSD",
        other => other,
    }
}

fn describe((machine, wide, little, system): (&str, bool, bool, &str)) -> String {
    let bits = if wide { 64 } else { 32 };
    let order = if little { "" } else { " big-endian" };
    format!("{machine} {bits}-bit{order} {system}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::manifest;

    // Libraries of systems that the tests do not run on; `plugin.rs` beside them says how they
    // were made.
    const DLL: &[u8] =
        include_bytes!("../../../../tests/fixtures/faulty/foreign/plugin.dll").as_slice();
    const DYLIB: &[u8] =
        include_bytes!("../../../../tests/fixtures/faulty/foreign/plugin.dylib").as_slice();

    fn reason<T>(result: Result<T, Refused>) -> String {
        result.err().map(|refused| refused.to_string()).unwrap_or_default()
    }

    /// A universal file with this one part.
    fn universal(part: &[u8]) -> Vec<u8> {
        let cpu_arm64 = 0x0100_000c_u32;
        let header = [0xcafe_babe_u32, 1, cpu_arm64, 0, 4096, part.len() as u32, 12];
        let mut bytes: Vec<u8> = header.iter().flat_map(|word| word.to_be_bytes()).collect();
        bytes.resize(4096, 0);
        bytes.extend_from_slice(part);
        bytes
    }

    #[test]
    fn manifests_of_other_systems_are_found() {
        for (bytes, system) in [(DLL, "Windows"), (DYLIB, "macOS")] {
            let library = Library::parse(bytes).unwrap();
            library.check_length().unwrap();
            assert_eq!(library.system(), system);
            let [manifest, table] =
                library.exports([manifest::SYMBOL, "SURFELSHOP_PLUGIN"]).unwrap();
            let contents = library.bytes_at(manifest.unwrap(), 4096).unwrap();
            assert_eq!(manifest::decode(contents).unwrap().id, "org.surfelshop.test.foreign");
            assert!(library.holds(table.unwrap(), 64), "{system}");
            assert!(!library.holds(table.unwrap(), 1 << 20), "{system}");
            assert!(!library.holds(u64::MAX, 1), "{system}");
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn libraries_of_other_systems_are_refused_by_name() {
        let machine = |bytes| reason(Library::parse(bytes).and_then(|l| l.check_machine()));
        assert!(machine(DLL).starts_with("is built for x86_64 64-bit Windows, this host is "));
        assert!(machine(DYLIB).starts_with("is built for aarch64 64-bit macOS, this host is "));
        let host_is_arm64 = cfg!(target_arch = "aarch64");
        let expected = if host_is_arm64 { "aarch64 64-bit macOS" } else { "aarch64 macOS" };
        assert!(machine(&universal(DYLIB)).starts_with(&format!("is built for {expected}")));
    }

    #[test]
    fn parts_of_libraries_are_refused() {
        let read = |bytes| reason(Library::parse(bytes).and_then(|l| l.check_length()));
        for whole in [DLL, DYLIB] {
            assert_eq!(read(whole), "");
            for len in 0..whole.len() * 2 / 3 {
                assert!(!read(&whole[..len]).is_empty(), "accepted with {len} bytes");
            }
        }
        let cut = read(&DYLIB[..DYLIB.len() - 1]);
        assert!(cut.starts_with("is cut off: its headers need"), "{cut}");
    }

    #[test]
    fn damaged_headers_never_panic() {
        for whole in [DLL, DYLIB] {
            let mut bytes = whole.to_vec();
            for i in 0..bytes.len().min(2048) {
                for value in [0, 0x7f, 0xff] {
                    bytes[i] = value;
                    if let Ok(library) = Library::parse(&bytes) {
                        let exports = library.exports([manifest::SYMBOL]);
                        let address = exports.ok().and_then(|[address]| address);
                        let contents = address.and_then(|address| library.bytes_at(address, 4096));
                        let results = (contents.map(manifest::decode), library.check_length());
                        drop(results); // Any answer is right as long as there is one.
                    }
                }
                bytes[i] = whole[i];
            }
        }
    }
}
