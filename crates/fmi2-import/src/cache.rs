//! Unpacked archives, kept for the next time.
//!
//! An entry is a folder named after the SHA-256 of the .fmu file. It appears complete (written beside, then renamed), so
//! that several processes can use the cache at once. What is taken from it is compared with the sizes and CRC-32 of the
//! archive. Units get files of their own: they may write to their resources. Whatever fails, the archive is
//! unpacked as without a cache.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::{Duration, SystemTime};

use sha2::{Digest as _, Sha256};

use crate::archive::Entry;
use crate::package::PLATFORM;

/// Variable of the environment that names another folder, or is `off`.
const VARIABLE: &str = "MAGLEV_CACHE";
/// Archives with less to unpack are not kept, in bytes: they are unpacked as fast as they are found.
const SMALLEST: u64 = 256 << 10;
/// Bytes in all entries together, beyond which those that were not used for the longest time are removed.
const MOST: u64 = 512 << 20;
/// Beginning of the names of folders that are being written.
const NEW: &str = "new-";
/// Age of such a folder when its process has certainly ended.
const FORGOTTEN: Duration = Duration::from_hours(1);

/// The folder with the entries.
#[derive(Debug, Clone)]
pub(crate) struct Cache {
    folder: PathBuf,
}

/// The entry of one archive, whether or not it exists.
#[derive(Debug)]
pub(crate) struct Slot<'a> {
    cache: &'a Cache,
    folder: PathBuf,
    entries: Vec<Entry>,
    /// Whether libraries may be the same file for several instances of [`Package`](crate::package::Package), where
    /// the system can remove a link to a file that is in use ([`system::LINKS`]).
    linked: bool,
}

impl Cache {
    /// The cache of this user; none if there is no place for it, or the user does not want one.
    pub fn of_user() -> Option<&'static Self> {
        // chosen once: a unit may change the working directory, to which the path may be relative
        static CACHE: LazyLock<Option<Cache>> = LazyLock::new(|| {
            let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
            let cache = Cache::chosen(variable, cfg!(target_os = "macos"), cfg!(windows))?;
            std::path::absolute(cache.folder).ok().map(|folder| Cache { folder })
        });
        CACHE.as_ref()
    }

    fn chosen(
        variable: impl Fn(&str) -> Option<OsString>,
        mac: bool,
        windows: bool,
    ) -> Option<Self> {
        if let Some(given) = variable(VARIABLE) {
            return (given != "off").then(|| Self { folder: given.into() });
        }
        let home = |below: &str| variable("HOME").map(|home| Path::new(&home).join(below));
        let caches = if windows {
            variable("LOCALAPPDATA").map(PathBuf::from)
        } else if mac {
            home("Library/Caches")
        } else {
            variable("XDG_CACHE_HOME").map(PathBuf::from).or_else(|| home(".cache"))
        };
        let folder = caches.filter(|caches| caches.is_absolute())?.join("maglev");
        Some(Self { folder })
    }

    /// The entry for an archive with these contents; none for small ones. Libraries are linked if `linked`.
    pub fn slot(
        &self,
        archive: &Path,
        entries: Vec<Entry>,
        linked: bool,
    ) -> io::Result<Option<Slot<'_>>> {
        let size: u64 = entries.iter().map(|entry| entry.size).sum();
        if !(SMALLEST..=MOST / 2).contains(&size) {
            return Ok(None);
        }
        let mut digest = Sha256::new();
        let (mut file, mut buffer) = (File::open(archive)?, vec![0; 64 << 10]);
        loop {
            match file.read(&mut buffer)? {
                0 => break,
                read => digest.update(&buffer[..read]),
            }
        }
        let digest = digest.finalize();
        let digest: String = digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
        let folder = self.folder.join(format!("{digest}-{PLATFORM}-{size}"));
        Ok(Some(Slot { cache: self, folder, entries, linked }))
    }

    /// Removes the entries that were not used for the longest time, until all fit. Others may do the same.
    fn prune(&self) -> io::Result<()> {
        let mut entries = Vec::new();
        for entry in fs::read_dir(&self.folder)?.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let used = entry.metadata()?.modified()?;
            if name.starts_with(NEW) {
                if SystemTime::now().duration_since(used).is_ok_and(|age| age > FORGOTTEN) {
                    fs::remove_dir_all(entry.path())?;
                }
            } else if let Some(size) =
                name.rsplit_once('-').and_then(|(_, size)| size.parse::<u64>().ok())
            {
                entries.push((used, size, entry.path()));
            }
        }
        entries.sort_unstable();
        let mut total: u64 = entries.iter().map(|(_, size, _)| size).sum();
        for (_, size, path) in entries {
            if total <= MOST {
                break;
            }
            remove(&path)?;
            total -= size;
        }
        Ok(())
    }
}

impl Slot<'_> {
    /// Fills a folder with the files of the entry.
    ///
    /// # Errors
    /// There is no such entry, or it is not what the archive contains and is removed. The folder may then have some of
    /// the files.
    pub fn fill(&self, folder: &Path) -> io::Result<()> {
        system::check_owner(&self.cache.folder)?;
        self.folder.symlink_metadata()?;
        for entry in &self.entries {
            let (kept, path) = (self.folder.join(&entry.name), folder.join(&entry.name));
            let sound = |content: &Vec<u8>| {
                content.len() as u64 == entry.size && crc32fast::hash(content) == entry.crc
            };
            let Some(content) = fs::read(&kept).ok().filter(sound) else {
                // damaged, or changed by somebody
                remove(&self.folder)?;
                return Err(io::ErrorKind::InvalidData.into());
            };
            create_parent(&path)?;
            let library = system::LINKS && self.linked && entry.name.starts_with("binaries/");
            if !library || fs::hard_link(&kept, &path).is_err() {
                fs::write(&path, &content)?;
            }
        }
        // for `prune`; where it cannot be set, entries go by their age
        let _ = File::open(&self.folder).and_then(|it| it.set_modified(SystemTime::now()));
        Ok(())
    }

    /// Keeps the files, which have just been unpacked to a folder.
    ///
    /// # Errors
    /// The cache cannot be written.
    pub fn keep(&self, unpacked: &Path) -> io::Result<()> {
        system::create(&self.cache.folder)?;
        system::check_owner(&self.cache.folder)?;
        let new = tempfile::Builder::new().prefix(NEW).tempdir_in(&self.cache.folder)?;
        for Entry { name, .. } in &self.entries {
            let path = new.path().join(name);
            create_parent(&path)?;
            fs::copy(unpacked.join(name), &path)?;
            system::protect(&path)?;
        }
        // fails if another process was faster
        fs::rename(new.path(), &self.folder)?;
        // it is not there any more
        let _ = new.keep();
        self.cache.prune()
    }
}

/// Removes an entry, at once for others.
fn remove(entry: &Path) -> io::Result<()> {
    let gone = tempfile::Builder::new().prefix(NEW).tempdir_in(entry.parent().unwrap_or(entry))?;
    fs::rename(entry, gone.path().join("entry"))?;
    gone.close()
}

fn create_parent(path: &Path) -> io::Result<()> {
    path.parent().map_or(Ok(()), fs::create_dir_all)
}

#[cfg(unix)]
mod system {
    /// A link can be removed whoever uses the file.
    pub(super) const LINKS: bool = true;

    use std::fs::{DirBuilder, Permissions, set_permissions};
    use std::io;
    use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, PermissionsExt as _};
    use std::path::Path;

    pub(super) fn create(folder: &Path) -> io::Result<()> {
        DirBuilder::new().recursive(true).mode(0o700).create(folder)
    }

    /// Libraries from a folder that others can write to would be a way to run their code.
    pub(super) fn check_owner(folder: &Path) -> io::Result<()> {
        let about = folder.metadata()?;
        // SAFETY: asks for a number
        let own = about.uid() == unsafe { libc::geteuid() } && about.mode() & 0o022 == 0;
        if own { Ok(()) } else { Err(io::ErrorKind::PermissionDenied.into()) }
    }

    /// A unit that writes to its own library would change that of others.
    pub(super) fn protect(file: &Path) -> io::Result<()> {
        set_permissions(file, Permissions::from_mode(0o500))
    }
}

#[cfg(not(unix))]
mod system {
    use std::io;
    use std::path::Path;

    /// No link to a library can be removed while any process has loaded it, so the folders of others would remain.
    pub(super) const LINKS: bool = false;

    pub(super) fn create(folder: &Path) -> io::Result<()> {
        std::fs::create_dir_all(folder)
    }

    /// The folder is the user's own by where it lies.
    pub(super) fn check_owner(_: &Path) -> io::Result<()> {
        Ok(())
    }

    /// Files that cannot be written cannot be removed either here.
    pub(super) fn protect(_: &Path) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 2] = ["binaries/linux64/x.so", "resources/deep/data.json"];

    /// Writes the files to a folder, and returns their entries.
    fn files(folder: &Path, byte: u8) -> Vec<Entry> {
        let content = vec![byte; 200 << 10];
        let write = |name: &str| {
            let path = folder.join(name);
            create_parent(&path).unwrap();
            fs::write(path, &content).unwrap();
            Entry { name: name.to_owned(), size: 200 << 10, crc: crc32fast::hash(&content) }
        };
        NAMES.map(write).into()
    }

    fn read(folder: &Path) -> Vec<Vec<u8>> {
        NAMES.map(|name| fs::read(folder.join(name)).unwrap()).into()
    }

    fn cache(place: &Path) -> Cache {
        Cache { folder: place.join("cache") }
    }

    #[test]
    fn invariant_what_was_kept_is_found_and_belongs_to_the_unit() {
        let place = tempfile::tempdir().unwrap();
        let [archive, unpacked, filled, again] =
            ["a.fmu", "unpacked", "filled", "again"].map(|name| place.path().join(name));
        fs::write(&archive, "a").unwrap();
        let cache = cache(place.path());
        let slot = || cache.slot(&archive, files(&unpacked, 1), true).unwrap().unwrap();
        assert!(slot().fill(&filled).is_err());
        slot().keep(&unpacked).unwrap();
        assert!(slot().keep(&unpacked).is_err(), "another process was faster");
        slot().fill(&filled).unwrap();
        assert_eq!(read(&filled), read(&unpacked));
        // what a unit writes to its resources is not seen by the next
        fs::write(filled.join(NAMES[1]), "changed").unwrap();
        slot().fill(&again).unwrap();
        assert_eq!(read(&again), read(&unpacked));
        assert_eq!(fs::read_dir(&cache.folder).unwrap().count(), 1);
        // another archive
        fs::write(&archive, "b").unwrap();
        assert!(slot().fill(&place.path().join("other")).is_err());
    }

    #[test]
    fn issue_a_damaged_entry_is_not_used() {
        let place = tempfile::tempdir().unwrap();
        let [archive, unpacked, filled] =
            ["a.fmu", "unpacked", "filled"].map(|name| place.path().join(name));
        fs::write(&archive, "a").unwrap();
        let cache = cache(place.path());
        let slot = cache.slot(&archive, files(&unpacked, 1), true).unwrap().unwrap();
        slot.keep(&unpacked).unwrap();
        let kept = slot.folder.join(NAMES[1]);
        fs::remove_file(&kept).unwrap();
        fs::write(&kept, vec![2; 200 << 10]).unwrap();
        assert_eq!(slot.fill(&filled).unwrap_err().kind(), io::ErrorKind::InvalidData);
        assert!(!slot.folder.exists());
        slot.keep(&unpacked).unwrap();
        slot.fill(&place.path().join("again")).unwrap();
    }

    #[test]
    fn issue_the_cache_is_bounded_and_small_archives_stay_out() {
        let place = tempfile::tempdir().unwrap();
        let (archive, cache) = (place.path().join("a.fmu"), cache(place.path()));
        fs::write(&archive, "a").unwrap();
        let small = vec![Entry { name: "x".to_owned(), size: 100, crc: 0 }];
        assert!(cache.slot(&archive, small, true).unwrap().is_none());
        for (name, age) in [("a", 30), ("b", 20), ("c", 10)] {
            let path = cache.folder.join(format!("{name}-{}", MOST / 2 - 1));
            fs::create_dir_all(&path).unwrap();
            let used = SystemTime::now() - Duration::from_secs(age);
            let _ = File::open(path).and_then(|it| it.set_modified(used));
        }
        let begun = cache.folder.join("new-now");
        fs::create_dir_all(&begun).unwrap();
        cache.prune().unwrap();
        let left = |name: &str| cache.folder.join(format!("{name}-{}", MOST / 2 - 1)).exists();
        assert_eq!(["a", "b", "c"].map(left), [false, true, true]);
        assert!(begun.exists());
    }

    #[cfg(unix)]
    #[test]
    fn refusal_a_folder_that_others_can_write_to() {
        use std::os::unix::fs::PermissionsExt as _;
        let place = tempfile::tempdir().unwrap();
        let (archive, cache) = (place.path().join("a.fmu"), cache(place.path()));
        fs::write(&archive, "a").unwrap();
        fs::create_dir(&cache.folder).unwrap();
        fs::set_permissions(&cache.folder, fs::Permissions::from_mode(0o777)).unwrap();
        let unpacked = place.path().join("unpacked");
        let slot = cache.slot(&archive, files(&unpacked, 1), true).unwrap().unwrap();
        assert_eq!(slot.keep(&unpacked).unwrap_err().kind(), io::ErrorKind::PermissionDenied);
    }

    #[test]
    fn analytic_the_place_follows_the_environment() {
        let place = |pairs: &[(&str, &str)], mac, windows| {
            let find =
                |name: &str| pairs.iter().find(|pair| pair.0 == name).map(|pair| pair.1.into());
            Cache::chosen(find, mac, windows).map(|cache| cache.folder)
        };
        let home = ("HOME", "/home/u");
        assert_eq!(place(&[home], false, false), Some("/home/u/.cache/maglev".into()));
        assert_eq!(
            place(&[home, ("XDG_CACHE_HOME", "/c")], false, false),
            Some("/c/maglev".into())
        );
        assert_eq!(place(&[home], true, false), Some("/home/u/Library/Caches/maglev".into()));
        assert_eq!(place(&[home, (VARIABLE, "/own")], false, false), Some("/own".into()));
        assert_eq!(place(&[home, (VARIABLE, "off")], false, false), None);
        assert_eq!(place(&[("XDG_CACHE_HOME", "relative")], false, false), None);
        assert_eq!(place(&[], false, false), None);
    }
}
