//! `cargo xtask merge`: joins what was packed on several systems.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use fmi2_package::Archive;

/// Joins .fmu files of one unit into one with all their libraries; given folders, each file in them with those
/// of the same name.
pub fn merge(out: &Path, parts: &[PathBuf]) -> Result<()> {
    match parts.iter().filter(|part| part.is_dir()).count() {
        0 => files(out, parts),
        count if count == parts.len() => folders(out, parts),
        _ => bail!("cannot merge files with folders: give either"),
    }
}

/// Joins .fmu files of one unit, or the libraries of bundles.
fn files(out: &Path, parts: &[PathBuf]) -> Result<()> {
    let [first, others @ ..] = parts else { bail!("nothing to merge") };
    let mut merged = Archive::open(first)?;
    for part in others {
        let other = Archive::open(part)?;
        for (name, content) in other.files() {
            let there =
                merged.files().find(|(known, _)| *known == name).map(|(_, content)| content);
            match there {
                Some(known) if known == content => {}
                // what does not describe the unit may differ: a picture's last bits, for instance
                Some(_) if !name.starts_with("binaries/") && !decides(name) => {}
                Some(_) => bail!(
                    "{}: {name} differs from that of {}: build both from the same commit, \
                     and each system once",
                    part.display(),
                    first.display()
                ),
                None => drop(merged.file(name, content)?),
            }
        }
    }
    merged.write(out)?;
    Ok(())
}

/// Whether a file decides what a unit computes. The units in a bundle are resources of it.
fn decides(name: &str) -> bool {
    name == "modelDescription.xml" || name.starts_with("resources/")
}

/// Joins the units and the libraries of bundles in several folders; copies what is for one system only.
fn folders(out: &Path, parts: &[PathBuf]) -> Result<()> {
    fs::create_dir_all(out).with_context(|| format!("creating {}", out.display()))?;
    let mut names = BTreeSet::new();
    for part in parts {
        for entry in fs::read_dir(part).with_context(|| format!("reading {}", part.display()))? {
            names.insert(entry?.file_name());
        }
    }
    for name in names {
        let found: Vec<_> =
            parts.iter().map(|part| part.join(&name)).filter(|path| path.is_file()).collect();
        let target = out.join(&name);
        if target.extension().is_some_and(|end| end == "fmu" || end == "zip") {
            if found.len() < parts.len() {
                let lacks = parts.iter().find(|part| !part.join(&name).is_file());
                let lacks = lacks.map(|part| part.display().to_string()).unwrap_or_default();
                bail!(
                    "{} is missing in {lacks}: pack the same units on all systems",
                    name.display()
                );
            }
            files(&target, &found)?;
        } else {
            match found.as_slice() {
                [] => {}
                [only] => {
                    fs::copy(only, &target)
                        .with_context(|| format!("copying {}", only.display()))?;
                }
                _ => bail!("{} is in several folders, and is not an archive", name.display()),
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An archive in a folder of its own.
    fn unit(folder: &Path, name: &str, guid: &str, files: &[(&str, &str)]) -> PathBuf {
        let xml = format!(
            r#"<fmiModelDescription guid="{guid}"><CoSimulation modelIdentifier="one"/></fmiModelDescription>"#
        );
        let mut archive = Archive::new(&xml).unwrap();
        for (file, content) in files {
            archive.file(file, *content).unwrap();
        }
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        archive.write(&path).unwrap();
        path
    }

    fn names(file: &Path) -> Vec<String> {
        Archive::open(file).unwrap().files().map(|(name, _)| name.to_owned()).collect()
    }

    #[test]
    fn merged_units_hold_the_libraries_of_all_systems() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let linux = unit(folder, "a.fmu", "1", &[("binaries/linux64/one.so", "elf")]);
        let windows = unit(folder, "b.fmu", "1", &[("binaries/win64/one.dll", "pe")]);
        let other = unit(folder, "c.fmu", "2", &[("binaries/darwin64/one.dylib", "macho")]);
        let twice = unit(folder, "d.fmu", "1", &[("binaries/linux64/one.so", "another")]);
        let out = folder.join("all.fmu");
        merge(&out, &[linux.clone(), windows]).unwrap();
        let expected =
            ["binaries/linux64/one.so", "binaries/win64/one.dll", "modelDescription.xml"];
        assert_eq!(names(&out), expected);
        for wrong in [other, twice] {
            let error = merge(&out, &[linux.clone(), wrong]).unwrap_err().to_string();
            assert!(error.contains("differs"), "{error}");
        }
        let error = merge(&out, &[linux, folder.to_owned()]).unwrap_err().to_string();
        assert!(error.contains("folders"), "{error}");
    }

    #[test]
    fn issue_21_folders_merge_units_bundles_and_the_library_of_bundles() {
        let folder = tempfile::tempdir().unwrap();
        let systems = [("linux64", "so"), ("win64", "dll"), ("darwin64", "dylib")];
        let parts = systems.map(|(platform, end)| {
            let part = folder.path().join(platform);
            let binary = format!("binaries/{platform}/one.{end}");
            let inner = format!("resources/units/ems/{binary}");
            let shared = ("resources/scenario.json", "{}");
            unit(&part, "ems.fmu", "1", &[(&binary, end)]);
            unit(&part, "train.fmu", "2", &[(&binary, end), (&inner, end), shared]);
            unit(&part, "bundle-library.zip", "3", &[(&binary, end)]);
            fs::write(part.join(format!("maglev-{platform}-x86_64")), end).unwrap();
            part
        });
        let out = folder.path().join("all");
        merge(&out, &parts).unwrap();
        for (platform, end) in systems {
            let binary = format!("binaries/{platform}/one.{end}");
            for file in ["ems.fmu", "train.fmu", "bundle-library.zip"] {
                assert!(names(&out.join(file)).contains(&binary), "{file} lacks {binary}");
            }
            let inner = format!("resources/units/ems/{binary}");
            assert!(names(&out.join("train.fmu")).contains(&inner), "{inner}");
            assert!(out.join(format!("maglev-{platform}-x86_64")).is_file());
        }
        // a unit that one system lacks
        unit(&parts[1], "vehicle.fmu", "4", &[]);
        let error = merge(&out, &parts).unwrap_err().to_string();
        assert!(error.contains("vehicle.fmu") && error.contains("linux64"), "{error}");
        fs::remove_file(parts[1].join("vehicle.fmu")).unwrap();
        // a bundle of another scenario
        unit(&parts[2], "train.fmu", "2", &[("resources/scenario.json", "{ }")]);
        let error = merge(&out, &parts).unwrap_err().to_string();
        assert!(error.contains("scenario.json"), "{error}");
    }
}
