//! Location of the unit's resources: from the importer, or relative to the library itself.

use std::path::{Path, PathBuf};

use percent_encoding::percent_decode_str;

/// The folder of the resources: from the importer's `fmuResourceLocation` if that folder exists,
/// otherwise `<unit>/resources` relative to this library, `<unit>/binaries/<platform>/<library>`.
/// If neither exists the importer's path is used, so that the error of reading a resource names a
/// path that the user can recognise.
pub(crate) fn resources(location: Option<&str>) -> PathBuf {
    let given = location.and_then(|text| path_of_uri(text, cfg!(windows)));
    if let Some(given) = &given
        && given.is_dir()
    {
        return given.clone();
    }
    let own = library().and_then(|library| beside(&library));
    match (given, own) {
        (_, Some(own)) if own.is_dir() => own,
        (Some(given), _) => given,
        (None, Some(own)) => own,
        (None, None) => PathBuf::from("resources"),
    }
}

/// The path of a URI: `file:/x`, `file:///x`, `file://localhost/x`, percent-encoded UTF-8, on
/// Windows `file:///C:/x` and `file://server/share`. A plain path is taken as it is.
fn path_of_uri(text: &str, windows: bool) -> Option<PathBuf> {
    let text = text.trim();
    if text.is_empty() {
        return None;
    }
    let Some(rest) = strip_scheme(text) else {
        // One letter before the colon is a drive, not a scheme.
        let scheme = text.split_once(':').map_or("", |(scheme, _)| scheme);
        let foreign = scheme.len() > 1 && scheme.chars().all(|c| c.is_ascii_alphanumeric());
        return (!foreign).then(|| PathBuf::from(text));
    };
    let (server, path) = match rest.strip_prefix("//") {
        None => ("", rest),
        Some(rest) => rest.split_at(rest.find('/')?),
    };
    // A `?` or `#` must be encoded in a path, so the path ends before it.
    let path = path.split(['?', '#']).next().unwrap_or_default();
    let path = percent_decode_str(path).decode_utf8().ok()?;
    if path.contains('\0') {
        return None;
    }
    let local = server.is_empty() || server.eq_ignore_ascii_case("localhost");
    match (local, windows) {
        (true, false) => Some(PathBuf::from(&*path)),
        (true, true) => Some(PathBuf::from(without_slash_before_drive(&path))),
        (false, true) => Some(PathBuf::from(format!("//{server}{path}"))),
        (false, false) => None,
    }
}

fn strip_scheme(text: &str) -> Option<&str> {
    let (scheme, rest) = text.split_once(':')?;
    scheme.eq_ignore_ascii_case("file").then_some(rest)
}

fn without_slash_before_drive(path: &str) -> &str {
    let bytes = path.as_bytes();
    let has_drive = bytes.len() >= 3
        && bytes[0] == b'/'
        && bytes[1].is_ascii_alphabetic()
        && matches!(bytes[2], b':' | b'|');
    if has_drive { &path[1..] } else { path }
}

/// `<unit>/resources` of a library `<unit>/binaries/<platform>/<library>`.
fn beside(library: &Path) -> Option<PathBuf> {
    let binaries = library.parent()?.parent()?;
    (binaries.file_name()? == "binaries").then(|| binaries.with_file_name("resources"))
}

/// The library file that contains this code.
#[cfg(unix)]
fn library() -> Option<PathBuf> {
    use std::os::unix::ffi::OsStrExt as _;

    let mut info = std::mem::MaybeUninit::<libc::Dl_info>::zeroed();
    let own = library as fn() -> Option<PathBuf>;
    // SAFETY: any address is permitted; `info` is written if the result is not 0, and is valid
    // (null pointers) otherwise.
    let (found, info) = unsafe {
        (libc::dladdr(own as *const libc::c_void, info.as_mut_ptr()), info.assume_init())
    };
    if found == 0 || info.dli_fname.is_null() {
        return None;
    }
    // SAFETY: the loader's name of a loaded library is a C string that lives as long as it.
    let name = unsafe { std::ffi::CStr::from_ptr(info.dli_fname) };
    Some(PathBuf::from(std::ffi::OsStr::from_bytes(name.to_bytes())))
}

/// The library file that contains this code.
#[cfg(windows)]
fn library() -> Option<PathBuf> {
    use std::os::windows::ffi::OsStringExt as _;
    use windows_sys::Win32::System::LibraryLoader::{
        GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS, GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
        GetModuleFileNameW, GetModuleHandleExW,
    };

    let own = library as fn() -> Option<PathBuf>;
    let flags =
        GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT;
    let mut module = std::ptr::null_mut();
    // SAFETY: with this flag the name is any address inside a module.
    if unsafe { GetModuleHandleExW(flags, own as *const u16, &mut module) } == 0 {
        return None;
    }
    // The longest path of Windows.
    let mut name = vec![0_u16; 32_768];
    // SAFETY: the length is that of the buffer.
    let length = unsafe { GetModuleFileNameW(module, name.as_mut_ptr(), name.len() as u32) };
    let name = name.get(..length as usize).filter(|name| !name.is_empty())?;
    Some(PathBuf::from(std::ffi::OsString::from_wide(name)))
}

#[cfg(not(any(unix, windows)))]
fn library() -> Option<PathBuf> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_every_form_of_a_resource_location_is_understood() {
        let unix = |text| path_of_uri(text, false).map(|path| path.to_str().unwrap().to_owned());
        for text in ["file:/a/b c", "file:///a/b%20c", "file://localhost/a/b%20c", "/a/b c"] {
            assert_eq!(unix(text).as_deref(), Some("/a/b c"), "{text}");
        }
        assert_eq!(unix("FILE:///gr%C3%BC%C3%9Fe/").as_deref(), Some("/grüße/"));
        assert_eq!(unix("file:///grüße/100%25").as_deref(), Some("/grüße/100%"));
        assert_eq!(unix("file:///a%00b"), None);
        assert_eq!(unix("file:///a%FFb"), None);
        assert_eq!(unix("file://server/share"), None);
        assert_eq!(unix("file://nothing"), None);
        assert_eq!(unix("http://a/b"), None);
        assert_eq!(unix("  "), None);
        let windows = |text| path_of_uri(text, true).map(|path| path.to_str().unwrap().to_owned());
        assert_eq!(windows("file:///C:/a%20b").as_deref(), Some("C:/a b"));
        assert_eq!(windows("file:/C:/a").as_deref(), Some("C:/a"));
        assert_eq!(windows("file://server/share/a").as_deref(), Some("//server/share/a"));
        assert_eq!(windows("C:\\a b").as_deref(), Some("C:\\a b"));
    }

    #[test]
    fn issue_resources_lie_beside_the_library() {
        let library = Path::new("/units/x y/binaries/linux64/x.so");
        assert_eq!(beside(library), Some(PathBuf::from("/units/x y/resources")));
        assert_eq!(beside(Path::new("/usr/lib/x.so")), None);
        // Here the test program takes the place of the library.
        assert!(super::library().unwrap().is_file());
    }

    #[test]
    fn issue_unusable_locations_keep_a_path_to_name() {
        assert_eq!(resources(Some("file:///no/such/place")), PathBuf::from("/no/such/place"));
        assert_eq!(resources(None), PathBuf::from("resources"));
    }
}
