//! Stdout for a document of the command alone, whatever the units print.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

use maglev::Error;

/// The stdout that the command started with. Everything else that is printed there from now on, by
/// units in this process or by their own processes, goes to stderr.
pub struct Reserved(File);

impl Reserved {
    /// Reserves stdout for the rest of the process.
    pub fn new() -> Result<Self, Error> {
        reserve().map(Self).map_err(failed)
    }

    /// Prints a text. It is no error if the reader has closed the pipe.
    pub fn print(mut self, text: &str) -> Result<(), Error> {
        self.write(text.as_bytes())
    }

    /// The file behind it.
    pub fn file(&mut self) -> &mut File {
        &mut self.0
    }

    fn write(&mut self, text: &[u8]) -> Result<(), Error> {
        match self.0.write_all(text) {
            Err(source) if source.kind() != io::ErrorKind::BrokenPipe => Err(failed(source)),
            _ => Ok(()),
        }
    }

    /// Prints a file. It is no error if the reader has closed the pipe.
    pub fn print_file(mut self, path: &Path) -> Result<(), Error> {
        let read = |source| Error::Output { path: path.into(), running: true, source };
        let document = fs::read(path).map_err(read)?;
        self.write(&document)
    }
}

fn failed(source: io::Error) -> Error {
    Error::Write { path: super::STDOUT.into(), source }
}

#[cfg(unix)]
fn reserve() -> io::Result<File> {
    use std::os::fd::AsFd as _;
    let stdout = io::stdout().as_fd().try_clone_to_owned()?;
    rustix::stdio::dup2_stdout(io::stderr())?;
    Ok(File::from(stdout))
}

#[cfg(windows)]
fn reserve() -> io::Result<File> {
    use std::os::windows::io::AsHandle as _;
    io::stdout().as_handle().try_clone_to_owned().map(File::from)
}
