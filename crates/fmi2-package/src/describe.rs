//! Asks a built library for its description.

use std::ffi::{CString, c_char};
use std::path::Path;

use libloading::Library;

use crate::Error;

/// The extra symbol of `fmi2-export`: writes the description, or the reason of a failure, into a
/// buffer. Returns the length of the description, 0 on failure.
type Describe = unsafe extern "C" fn(*const c_char, *mut c_char, usize) -> usize;

/// `modelDescription.xml` as the library prints it with the files in `resources`.
///
/// The library is loaded, so it must be built for the system that this program runs on.
///
/// # Errors
/// It cannot be loaded, is not made with `fmi2-export`, or the resources are invalid.
pub fn describe(library: &Path, resources: Option<&Path>) -> Result<String, Error> {
    let path = library.canonicalize().map_err(Error::at(library))?;
    let folder = resources.unwrap_or(Path::new(""));
    let folder = CString::new(folder.to_string_lossy().as_bytes())
        .map_err(|_| Error::Name(folder.to_path_buf()))?;
    // SAFETY: a library made with fmi2-export has no initialisers of its own, and the caller chose it.
    let loaded = unsafe { Library::new(&path) };
    let loaded = loaded.map_err(|source| Error::Load { path: path.clone(), source })?;
    // SAFETY: fmi2-export defines the symbol with this type.
    let describe = unsafe { loaded.get::<Describe>(b"fmi2_export_describe\0") };
    let describe = describe.map_err(|_| Error::NotAUnit { path: path.clone() })?;
    let mut buffer = vec![0_u8; 1 << 16];
    loop {
        // SAFETY: a NUL-terminated path, and a buffer with its actual capacity.
        let length = unsafe { describe(folder.as_ptr(), buffer.as_mut_ptr().cast(), buffer.len()) };
        if length == 0 {
            let end = buffer.iter().position(|&byte| byte == 0).unwrap_or(buffer.len());
            let message = String::from_utf8_lossy(&buffer[..end]).into_owned();
            return Err(Error::Refused { path, message });
        }
        if length < buffer.len() {
            buffer.truncate(length);
            return String::from_utf8(buffer)
                .map_err(|error| Error::Description(error.to_string()));
        }
        buffer.resize(length + 1, 0);
    }
}
