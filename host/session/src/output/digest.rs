//! What tells the contents of files apart.

use serde::{Deserialize, Serialize};
use siphasher::sip128::{Hasher128 as _, SipHasher13};
use std::hash::Hasher as _;
use std::io::Read as _;
use std::path::Path;

/// What a file holds, wherever it lies and whenever it was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileDigest {
    /// Its name, without folders.
    pub name: String,
    /// Its length.
    pub bytes: u64,
    /// A hash of its bytes (`SipHash` 1-3, 128 bits), in hexadecimal digits: it tells files apart, and is no protection
    /// against those who want two to look alike.
    pub sum: String,
}

/// Bytes of a pyramid's head, which has checksums of all the rest.
const PYRAMID_HEAD: u64 = 64;

impl FileDigest {
    /// That of a file. Of a pyramid the head is read alone.
    ///
    /// # Errors
    /// One line where it cannot be read.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        let failed = |error| anyhow::anyhow!("{}: {error}", path.display());
        let (mut file, metadata) = surfelshop_cloud::files::open(path).map_err(failed)?;
        let is_pyramid = path.extension().is_some_and(|ending| ending == "surfels");
        let most = if is_pyramid { PYRAMID_HEAD } else { u64::MAX };
        let unread = |error| failed(surfelshop_cloud::files::OpenFault::Io(error));
        let (mut hasher, mut buffer) = (SipHasher13::new(), vec![0; 1 << 16]);
        let mut file = (&mut file).take(most);
        loop {
            let n = file.read(&mut buffer).map_err(unread)?;
            match buffer.get(..n) {
                Some(part) if n > 0 => hasher.write(part),
                _ => break,
            }
        }
        Ok(Self {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            bytes: metadata.len(),
            sum: format!("{:032x}", hasher.finish128().as_u128()),
        })
    }

    /// Those of several files, each once, by their names and contents.
    ///
    /// # Errors
    /// One line where one cannot be read.
    pub fn of_all<'a>(paths: impl IntoIterator<Item = &'a Path>) -> anyhow::Result<Vec<Self>> {
        let mut all: Vec<Self> = paths.into_iter().map(Self::of).collect::<Result<_, _>>()?;
        let key = |file: &Self| (file.name.clone(), file.sum.clone());
        all.sort_by_key(key);
        all.dedup();
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_count_and_places_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, text).unwrap();
            path
        };
        let (a, same, other) = (put("a.ply", "one"), put("b/a.ply", "one"), put("c/a.ply", "two"));
        assert_eq!(FileDigest::of(&a).unwrap(), FileDigest::of(&same).unwrap());
        assert_ne!(FileDigest::of(&a).unwrap(), FileDigest::of(&other).unwrap());
        let all = [&a, &same, &other].map(|path| path.as_path());
        assert_eq!(FileDigest::of_all(all).unwrap().len(), 2);
        let missing = FileDigest::of(&folder.path().join("none.ply")).unwrap_err().to_string();
        assert!(missing.contains("none.ply"), "{missing}");
    }
}
