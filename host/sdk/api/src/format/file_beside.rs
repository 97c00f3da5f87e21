//! Files that lie beside the one that is read, as bytes of it.
//!
//! A format is lent one file. Where it names others of its folder, these are bytes of that file, too, far behind its
//! end: a call says where each of them begins. So they cross every boundary that a file crosses.

use super::file::FileHost;
use serde::{Deserialize, Serialize};
use std::io;
use std::sync::Arc;

/// Bytes from the beginning of a file to that of the next one: no file is as long.
const STEP: u64 = 1 << 48;
/// Most files beside one, so that all addresses are numbers.
const MOST: usize = (1 << 15) - 1;

/// A file of the same folder that may be read, too. Came while ABI 3.11 was current.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileBeside {
    /// Its name, without the folder.
    pub name: String,
    /// Where its first byte is among those of the file that is lent.
    pub at: u64,
    /// Its length in bytes.
    pub length: u64,
}

/// A file with others of its folder behind its end, for hosts.
pub struct WithFilesBeside {
    file: Arc<dyn FileHost>,
    beside: Vec<(String, Arc<dyn FileHost>)>,
}

impl WithFilesBeside {
    /// A file, and those beside it by their names; of more than 32767 the first ones.
    #[must_use]
    pub fn new(file: Arc<dyn FileHost>, mut beside: Vec<(String, Arc<dyn FileHost>)>) -> Self {
        beside.truncate(MOST);
        Self { file, beside }
    }
}

impl FileHost for WithFilesBeside {
    fn length(&self) -> u64 {
        self.file.length()
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let file = match offset / STEP {
            0 => Some(&self.file),
            number => self.beside.get(number as usize - 1).map(|(_, file)| file),
        };
        file.map_or(Ok(0), |file| file.read_at(offset % STEP, buffer))
    }

    fn beside(&self) -> Vec<FileBeside> {
        let files = (1..).zip(&self.beside);
        let listed = files.map(|(number, (name, file))| FileBeside {
            name: name.clone(),
            at: number * STEP,
            length: file.length().min(STEP),
        });
        listed.collect()
    }
}

/// Bytes of a file as a file.
pub(super) struct Part {
    pub(super) host: Arc<dyn FileHost>,
    /// Its first byte, and how many there are.
    pub(super) at: u64,
    pub(super) length: u64,
}

impl FileHost for Part {
    fn length(&self) -> u64 {
        self.length
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.length.saturating_sub(offset);
        let len = buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        match self.at.checked_add(offset) {
            Some(place) if len > 0 => self.host.read_at(place, &mut buffer[..len]),
            _ => Ok(0),
        }
    }

    fn beside(&self) -> Vec<FileBeside> {
        self.host.beside()
    }
}

#[cfg(test)]
mod tests {
    use crate::format::FileSource;
    use std::io::Read as _;

    #[test]
    fn files_beside_one_are_read_by_their_names_and_end_where_they_end() {
        let files = vec![("a.json", b"{}".to_vec()), ("a.bin", b"abc".to_vec()), ("b.bin", vec![])];
        let file = FileSource::of_files(files);
        assert_eq!((file.name(), file.length()), ("a.json", 2));
        assert_eq!(file.read_at(2, &mut [0; 9]).unwrap(), 0);
        let beside = file.beside("a.bin").unwrap();
        assert_eq!((beside.name(), beside.length()), ("a.bin", 3));
        let mut text = String::new();
        beside.stream().read_to_string(&mut text).unwrap();
        assert_eq!(text, "abc");
        assert_eq!(beside.bytes_at(1, 2).unwrap(), b"bc");
        let line = beside.bytes_at(1, 3).unwrap_err().to_string();
        assert!(line.contains("found 2") && line.contains("cut short"), "{line}");
        assert_eq!(beside.read_at(u64::MAX, &mut [0; 9]).unwrap(), 0);
        assert_eq!(file.beside("A.BIN").unwrap().name(), "a.bin");
        // From one of them to another.
        assert_eq!(beside.beside("b.bin").unwrap().length(), 0);
        for missing in ["c.bin", "", "../a.bin"] {
            let line = file.beside(missing).err().unwrap().to_string();
            assert!(line.contains(&format!("expected the file `{missing}`")), "{line}");
        }
        assert!(FileSource::of_bytes(vec![1], "a").beside("a").is_err());
    }
}
