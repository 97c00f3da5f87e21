//! Files made by hand, without the writer: directories with any entries, and records with any bytes.

/// A directory.
#[derive(Clone, Default)]
pub(super) struct Made {
    entries: Vec<(u16, u16, u32, Vec<u8>)>,
    data: Option<(u32, Vec<u8>)>,
    children: Vec<Self>,
}

impl Made {
    /// Adds an entry.
    pub(super) fn with(mut self, tag: u16, kind: u16, count: u32, bytes: Vec<u8>) -> Self {
        self.entries.push((tag, kind, count, bytes));
        self
    }

    /// The same without the entries of a tag.
    pub(super) fn without(mut self, tag: u16) -> Self {
        self.entries.retain(|entry| entry.0 != tag);
        self
    }

    /// Adds 32-bit numbers.
    pub(super) fn words(self, tag: u16, values: &[u32]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, 4, values.len() as u32, bytes)
    }

    /// Adds 16-bit numbers.
    pub(super) fn shorts(self, tag: u16, values: &[u16]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, 2, values.len() as u32, bytes)
    }

    /// Adds 32-bit floats.
    pub(super) fn floats(self, tag: u16, values: &[f32]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, 6, values.len() as u32, bytes)
    }

    /// Adds 64-bit floats.
    pub(super) fn doubles(self, tag: u16, values: &[f64]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, 7, values.len() as u32, bytes)
    }

    /// Adds text.
    pub(super) fn text(self, tag: u16, text: &str) -> Self {
        let bytes: Vec<u8> = text.bytes().chain([0]).collect();
        self.with(tag, 8, bytes.len() as u32, bytes)
    }

    /// Adds a child.
    pub(super) fn child(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    /// The directory's bytes at the end of a file. The offset of its next sibling is where it ends.
    fn add_to(&self, file: &mut Vec<u8>) {
        let is_leaf = self.children.is_empty();
        let n_entries =
            self.entries.len() + usize::from(self.data.is_some()) + if is_leaf { 1 } else { 2 };
        let start = file.len();
        file.resize(start + 12 * n_entries, 0);
        let mut place = start;
        let mut entry = |file: &mut Vec<u8>, tag: u16, kind: u16, count: u32, value: [u8; 4]| {
            file[place..place + 2].copy_from_slice(&tag.to_be_bytes());
            file[place + 2..place + 4].copy_from_slice(&kind.to_be_bytes());
            file[place + 4..place + 8].copy_from_slice(&count.to_be_bytes());
            file[place + 8..place + 12].copy_from_slice(&value);
            place += 12;
        };
        for (tag, kind, count, bytes) in &self.entries {
            let mut value = [0; 4];
            if bytes.len() <= 4 {
                value[..bytes.len()].copy_from_slice(bytes);
            } else {
                value = (file.len() as u32).to_be_bytes();
                file.extend(bytes);
                pad(file);
            }
            entry(file, *tag, *kind, *count, value);
        }
        if let Some((count, bytes)) = &self.data {
            entry(file, 0x0171, 10, *count, (file.len() as u32).to_be_bytes());
            file.extend(bytes);
            pad(file);
        }
        let child = file.len() as u32;
        if is_leaf {
            entry(file, 1, 11, 1, child.to_be_bytes());
            return;
        }
        entry(file, 3, 4, 1, (self.children.len() as u32 + 1).to_be_bytes());
        for child in &self.children {
            child.add_to(file);
        }
        let next = file.len() as u32 + 12;
        close(file, next);
        entry(file, 2, 12, next, child.to_be_bytes());
    }
}

fn pad(file: &mut Vec<u8>) {
    file.resize(file.len().next_multiple_of(4), 0);
}

fn close(file: &mut Vec<u8>, next: u32) {
    file.extend([0, 0, 0, 11, 0, 0, 0, 1]);
    file.extend(next.to_be_bytes());
}

/// A file with a root directory, and bytes between it and the header.
pub(super) fn file_behind(between: &[u8], root: &Made) -> Vec<u8> {
    let mut file = b"GFLF\0\0\0\0SFLF\0\0\0\0\0\0\0\x14".to_vec();
    file.extend(between);
    root.add_to(&mut file);
    close(&mut file, 0);
    file
}

/// A file with these surfel sets.
pub(super) fn file_of(sets: Vec<Made>) -> Vec<u8> {
    file_behind(&[], &root_of(sets))
}

/// A root directory with a list of these surfel sets.
pub(super) fn root_of(sets: Vec<Made>) -> Made {
    let list = Made { children: sets, ..Made::default() };
    let n_sets = list.children.len() as u32;
    Made::default().words(0x0120, &[0]).child(list.words(0x0130, &[n_sets]))
}

/// A resolution of so many surfels with these records.
pub(super) fn resolution(n_surfels: u32, records: &[u8]) -> Made {
    let count = records.len() as u32;
    let made = Made { data: Some((count, records.to_vec())), ..Made::default() };
    made.words(0x0170, &[n_surfels])
}

/// A surfel set without children, whose records have properties at places.
pub(super) fn set(version: u32, record: u32, bits: &[u32], properties: &[(u16, u32)]) -> Made {
    let (ids, offsets): (Vec<u16>, Vec<u32>) = properties.iter().copied().unzip();
    Made::default()
        .words(0x0150, &[version])
        .words(0x0151, &[record])
        .words(0x0152, bits)
        .shorts(0x0153, &ids)
        .words(0x0154, &offsets)
}

/// The bytes of floats.
pub(super) fn bytes_of(floats: &[f32]) -> Vec<u8> {
    floats.iter().flat_map(|float| float.to_be_bytes()).collect()
}
