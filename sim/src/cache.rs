//! Pictures kept on disk under a hash of all that they depend on.

use std::fmt::{self, Write as _};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// First bytes of a file; the number changes whenever pictures of the same key would.
const MAGIC: &[u8; 16] = b"coshade-picture1";

/// A hash of 128 bits over whatever is written into it (FNV-1a). Not against malice: it tells settings apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ContentHash(u128);

impl Default for ContentHash {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl ContentHash {
    /// Takes in bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }

    /// The hash of what a value prints.
    pub fn of(value: &impl fmt::Debug) -> Self {
        let mut hash = Self::default();
        // Writing into a hash cannot fail.
        let _ = write!(hash, "{value:?}");
        hash
    }
}

impl fmt::Write for ContentHash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.bytes(text.as_bytes());
        Ok(())
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

/// A folder of pictures. Several processes may use it at once: files appear whole or not at all.
#[derive(Clone, Debug)]
pub struct PictureCache {
    folder: PathBuf,
}

impl PictureCache {
    /// In a folder, which is made when the first picture is kept.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// `$XDG_CACHE_HOME/coshade/sim`, else `~/.cache/coshade/sim`; `None` where there is neither.
    pub fn of_user() -> Option<Self> {
        let set = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let folder = set("XDG_CACHE_HOME").or_else(|| Some(set("HOME")?.join(".cache")))?;
        Some(Self::new(folder.join("coshade/sim")))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn file(&self, key: &ContentHash) -> PathBuf {
        self.folder.join(format!("{key}.picture"))
    }

    /// True if there is a picture of this key.
    pub fn contains(&self, key: &ContentHash) -> bool {
        self.file(key).is_file()
    }

    /// The `count` numbers that were kept; `None` if there are none, or the file is damaged.
    pub fn get(&self, key: &ContentHash, count: usize) -> Option<Vec<f32>> {
        let path = self.file(key);
        let expected = MAGIC.len() + 16 + count.checked_mul(4)?;
        // Asked first: a file of another length is not worth reading.
        if std::fs::metadata(&path).ok()?.len() != expected as u64 {
            return None;
        }
        let bytes = std::fs::read(&path).ok()?;
        let (hash, numbers) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<16>()?;
        let mut found = ContentHash::default();
        found.bytes(numbers);
        if found.0.to_le_bytes() != *hash {
            tracing::warn!("{}: damaged, made anew", path.display());
            return None;
        }
        Some(numbers.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect())
    }

    /// Keeps a picture.
    ///
    /// # Errors
    /// Of the file system.
    pub fn put(&self, key: &ContentHash, numbers: &[f32]) -> io::Result<()> {
        std::fs::create_dir_all(&self.folder)?;
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let mut hash = ContentHash::default();
        hash.bytes(&bytes);
        let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
        file.write_all(MAGIC)?;
        file.write_all(&hash.0.to_le_bytes())?;
        file.write_all(&bytes)?;
        file.persist(self.file(key))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_fnv_1a() {
        // Test vectors of the FNV page (Noll): the empty text and "a".
        assert_eq!(ContentHash::default().to_string(), "6c62272e07bb014262b821756295c58d");
        let mut hash = ContentHash::default();
        hash.bytes(b"a");
        assert_eq!(hash.to_string(), "d228cb696f1a8caf78912b704e4a8964");
    }

    #[test]
    fn pictures_are_kept_and_damaged_ones_refused() {
        let folder = tempfile::tempdir().unwrap();
        let cache = PictureCache::new(folder.path().join("new"));
        let (key, numbers) = (ContentHash::of(&"x"), [0.5, -1.0, f32::INFINITY]);
        assert_eq!(cache.get(&key, 3), None);
        cache.put(&key, &numbers).unwrap();
        assert!(cache.contains(&key));
        assert_eq!(cache.get(&key, 3).unwrap(), numbers);
        assert_eq!(cache.get(&key, 4), None);
        let path = cache.file(&key);
        let mut bytes = std::fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(cache.get(&key, 3), None);
        assert_eq!(std::fs::read_dir(cache.folder()).unwrap().count(), 1, "no temporary files are left");
    }
}
