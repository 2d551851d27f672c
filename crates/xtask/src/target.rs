//! The systems that units are built for: cargo's names, FMI's names, and how cargo builds each.

use std::{
    env,
    ffi::OsString,
    path::{Path, PathBuf},
    str::FromStr,
};

use anyhow::{Context, Result, bail};

use crate::{python, windows, workspace};

/// Runs on every Linux of the last decade: needs glibc 2.17 (2012) at most.
pub const PORTABLE: &str = "x86_64-unknown-linux-gnu.2.17";

/// Packages from PyPI that build against an old glibc.
const ZIG: &str = "crates/xtask/zig-requirements.txt";

/// One system to build for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// Cargo's name; none for the system that this program runs on.
    triple: Option<String>,
    /// Oldest glibc to support, such as `2.17`; zig is then the compiler and linker.
    pub glibc: Option<String>,
    os: &'static str,
    arch: &'static str,
}

impl FromStr for Target {
    type Err = String;

    /// Reads a target triple; one of Linux may end in a glibc version, `….2.17`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (triple, glibc) = match text.split_once('.') {
            Some((triple, version)) => (triple, Some(version.to_owned())),
            None => (text, None),
        };
        let os = if triple.ends_with("apple-darwin") {
            "macos"
        } else if triple.contains("-windows-") {
            "windows"
        } else if triple.contains("-linux-") {
            "linux"
        } else {
            return Err(format!(
                "unsupported system {triple}: use Linux, Windows or macOS (apple-darwin)"
            ));
        };
        if glibc.is_some() && !triple.ends_with("-linux-gnu") {
            return Err(format!(
                "{text}: only targets that end in -linux-gnu have a glibc version"
            ));
        }
        let arch = match triple.split('-').next().unwrap_or_default() {
            "x86_64" => "x86_64",
            "i586" | "i686" => "x86",
            "aarch64" => "aarch64",
            other => {
                return Err(format!("{triple}: FMI 2.0 has no name for the processor {other}"));
            }
        };
        Ok(Self { triple: Some(triple.to_owned()), glibc, os, arch })
    }
}

impl Target {
    /// The system that this program runs on.
    pub fn host() -> Self {
        use std::env::consts::{ARCH, OS};
        Self { triple: None, glibc: None, os: OS, arch: ARCH }
    }

    /// The folder's name under `binaries/`.
    pub fn platform(&self) -> Result<&'static str> {
        fmi2_package::platform(self.os, self.arch)
            .with_context(|| format!("FMI 2.0 has no name for {} on {}", self.os, self.arch))
    }

    /// Whether this system can run what is built for it.
    pub fn runs_here(&self) -> bool {
        let host = Self::host();
        (self.os, self.arch) == (host.os, host.arch)
    }

    /// The processor, in the words of [`std::env::consts`].
    pub fn arch(&self) -> &'static str {
        self.arch
    }

    /// Where cargo puts the library of the unit crate `fmu-{identifier}`.
    pub fn library(&self, identifier: &str) -> PathBuf {
        let name = match self.os {
            "windows" => format!("fmu_{identifier}.dll"),
            "macos" => format!("libfmu_{identifier}.dylib"),
            _ => format!("libfmu_{identifier}.so"),
        };
        self.folder().join(name)
    }

    /// Where cargo puts the command `maglev`.
    pub fn maglev(&self) -> PathBuf {
        self.folder().join(if self.os == "windows" { "maglev.exe" } else { "maglev" })
    }

    fn folder(&self) -> PathBuf {
        let folder = workspace::target_dir();
        self.triple.as_ref().map_or(folder.clone(), |triple| folder.join(triple)).join("release")
    }

    /// Builds packages in release mode.
    pub fn build(&self, packages: &[&str]) -> Result<()> {
        let mut args: Vec<&str> = Vec::new();
        args.push(if self.glibc.is_some() { "zigbuild" } else { "build" });
        args.push("--release");
        for package in packages {
            args.extend(["--package", package]);
        }
        let spelt = self.to_string();
        if self.triple.is_some() {
            args.extend(["--target", &spelt]);
        }
        let mut variables = Vec::new();
        if self.triple.is_some() {
            variables.push(("RUSTFLAGS", self.flags()?));
        }
        if self.glibc.is_some() {
            variables.push(("PATH", with_zig()?));
        }
        let mut variables: Vec<_> = variables.iter().map(|(k, v)| (*k, v.as_os_str())).collect();
        let mut cargo = workspace::cargo();
        if self.triple.as_deref() == Some(windows::TRIPLE)
            && let Some(debian) = windows::toolchain()
        {
            cargo = debian.cargo;
            args.extend(debian.arguments);
            variables.extend(debian.variables);
        }
        workspace::run_with(cargo, &args, &variables)
            .with_context(|| format!("building for {spelt}: {}", self.advice()))
    }

    /// Flags that keep this machine's folders out of the binary; on Windows, also link the C runtime
    /// statically.
    fn flags(&self) -> Result<OsString> {
        let mut flags = env::var("RUSTFLAGS").unwrap_or_default();
        let registry = match env::var_os("CARGO_HOME") {
            Some(home) => Some(PathBuf::from(home)),
            None => env::home_dir().map(|home| home.join(".cargo")),
        };
        for (path, name) in [(Some(workspace::root()), "maglev"), (registry, "cargo")] {
            if let Some(path) = path.filter(|path| !path.to_string_lossy().contains(' ')) {
                flags += &format!(" --remap-path-prefix={}={name}", path.display());
            }
        }
        if self.os == "windows" {
            flags += " -Ctarget-feature=+crt-static";
        }
        Ok(flags.into())
    }

    fn advice(&self) -> String {
        match (&self.triple, &self.glibc) {
            (None, _) => "see the messages above".to_owned(),
            (Some(triple), None) => {
                format!("install its standard library (`rustup target add {triple}`) and a linker")
            }
            (Some(_), Some(_)) => format!("see the messages above; zig comes from {ZIG}"),
        }
    }
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.triple.as_deref().unwrap_or("this system"))?;
        self.glibc.iter().try_for_each(|version| write!(f, ".{version}"))
    }
}

/// The search path with `cargo-zigbuild` and its Python in front.
pub fn with_zig() -> Result<OsString> {
    let python = python::environment("zig", Path::new(ZIG))?;
    let folder = python.parent().map(Path::to_path_buf);
    let rest = env::var_os("PATH").unwrap_or_default();
    Ok(env::join_paths(folder.into_iter().chain(env::split_paths(&rest)))?)
}

/// Refuses two targets whose libraries have the same path in an .fmu.
pub fn distinct(targets: &[Target]) -> Result<()> {
    for (k, target) in targets.iter().enumerate() {
        for other in &targets[..k] {
            if target.platform()? == other.platform()? && !target.joins(other) {
                bail!(
                    "FMI 2.0 has one name, {}, for {other} and {target}: pack them into two .fmu files",
                    target.platform()?
                );
            }
        }
    }
    Ok(())
}

impl Target {
    /// Whether one file can hold both: Apple's universal binaries do.
    fn joins(&self, other: &Self) -> bool {
        self.os == "macos" && other.os == "macos" && self.arch != other.arch
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(text: &str) -> Target {
        text.parse().unwrap()
    }

    #[test]
    fn platforms_have_the_names_of_the_standard() {
        for (triple, name) in [
            ("x86_64-unknown-linux-gnu", "linux64"),
            (PORTABLE, "linux64"),
            ("i686-unknown-linux-gnu", "linux32"),
            ("aarch64-unknown-linux-gnu", "linux64"),
            ("x86_64-pc-windows-msvc", "win64"),
            ("x86_64-pc-windows-gnu", "win64"),
            ("i686-pc-windows-msvc", "win32"),
            ("x86_64-apple-darwin", "darwin64"),
            ("aarch64-apple-darwin", "darwin64"),
        ] {
            assert_eq!(target(triple).platform().unwrap(), name, "{triple}");
        }
        assert_eq!(target(PORTABLE).to_string(), PORTABLE);
        assert_eq!(target(PORTABLE).glibc.as_deref(), Some("2.17"));
    }

    #[test]
    fn issue_what_fmi_has_no_name_for_is_refused() {
        for triple in ["riscv64gc-unknown-linux-gnu", "x86_64-unknown-freebsd"] {
            assert!(triple.parse::<Target>().is_err(), "{triple}");
        }
        let error = "x86_64-apple-darwin.2.17".parse::<Target>().unwrap_err();
        assert!(error.contains("glibc"), "{error}");
    }

    #[test]
    fn issue_two_binaries_for_one_folder_are_refused() {
        let pair = |a: &str, b: &str| distinct(&[target(a), target(b)]);
        let error = pair("x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu").unwrap_err();
        assert!(error.to_string().contains("linux64"), "{error}");
        assert!(pair("x86_64-unknown-linux-gnu", "x86_64-unknown-linux-gnu").is_err());
        pair("x86_64-unknown-linux-gnu", "x86_64-pc-windows-gnu").unwrap();
        pair("x86_64-apple-darwin", "aarch64-apple-darwin").unwrap();
    }
}
