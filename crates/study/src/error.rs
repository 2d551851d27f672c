//! Why a study cannot be used.

use std::path::PathBuf;

use in_memory::accuracy::AccuracyError;
use scenario::ScenarioError;
use thiserror::Error;

/// Why a study cannot be read, checked or computed.
#[derive(Debug, Error)]
pub enum StudyError {
    /// The study file cannot be read.
    #[error("cannot read the study {path}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// The study file is invalid by itself.
    #[error("invalid study")]
    File(#[source] ScenarioError),
    /// A key of the study file has a value that is not allowed.
    #[error("{path}: at {at}: {problem}")]
    Key {
        /// Path of the file.
        path: PathBuf,
        /// JSON path.
        at: String,
        /// What is wrong and what is allowed.
        problem: String,
    },
    /// The base scenario cannot be read.
    #[error("cannot use the scenario of the study")]
    Scenario(#[source] ScenarioError),
    /// A table of points cannot be read.
    #[error("cannot read the table of points {path}: {problem}")]
    Table {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, and where.
        problem: String,
    },
    /// A file that the points depend on cannot be read.
    #[error("cannot read {path}, which the points depend on")]
    Input {
        /// Path of the file.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// There is no point of that number.
    #[error("there is no point {number}: the study has the points 1 to {count}")]
    NoPoint {
        /// The number.
        number: u64,
        /// Number of points.
        count: u64,
    },
    /// A point does not make a valid scenario.
    #[error("point {number}: {problem}")]
    Point {
        /// Its number.
        number: u64,
        /// What is wrong.
        problem: String,
    },
    /// The scenario of the first point does not fit its units.
    #[error("the scenario of point {number} is invalid")]
    Setup {
        /// Its number.
        number: u64,
        /// What is wrong.
        #[source]
        source: master::Error,
    },
    /// No step could be chosen for the accuracy that the scenario asks for.
    #[error("cannot choose the step of all points at point {number}")]
    Accuracy {
        /// Number of the point that was tried.
        number: u64,
        /// Why not.
        #[source]
        source: AccuracyError,
    },
    /// Points cannot be computed from a results folder.
    #[error("{path} is the study of a results folder, which cannot be computed here")]
    ResultsOnly {
        /// Path of its study.json.
        path: PathBuf,
    },
    /// A file in the results folder cannot be read or written.
    #[error("cannot write the results of the study to {folder}")]
    Output {
        /// The results folder.
        folder: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// Another process computes the same points.
    #[error("another process computes these points: it holds {journal}")]
    Busy {
        /// The journal.
        journal: PathBuf,
    },
    /// Folders are of different studies.
    #[error("{folder} has points of another scenario, other units or other figures than {from}")]
    Differs {
        /// The folder that does not fit.
        folder: PathBuf,
        /// The folder that it should be merged into.
        from: PathBuf,
    },
    /// A process that computes points cannot be started.
    #[error("cannot start a process that computes points")]
    Spawn(#[source] std::io::Error),
    /// A process that computes points does not begin its work.
    #[error("a process that computes points ended before its first point: {reason}")]
    Worker {
        /// How it ended, and what it said.
        reason: String,
    },
}

impl StudyError {
    /// Whether a second try can succeed without a change of the study.
    #[must_use]
    pub fn can_try_again(&self) -> bool {
        use std::io::ErrorKind::{NotADirectory, PermissionDenied, ReadOnlyFilesystem};
        match self {
            // a full disk may have room later, a read-only one stays so
            Self::Output { source, .. } => {
                !matches!(source.kind(), NotADirectory | PermissionDenied | ReadOnlyFilesystem)
            }
            Self::Busy { .. } | Self::Spawn(_) => true,
            _ => false,
        }
    }

    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Read { .. } => "give the path of a study file (.json)",
            Self::File(error) | Self::Scenario(error) => return error.help(),
            Self::Key { .. } => {
                "docs/studies.md explains the format; `maglev schema study` prints its schema"
            }
            Self::Table { .. } => "give a CSV or Parquet file with a column for each factor",
            Self::Input { .. } | Self::Point { .. } => return None,
            Self::NoPoint { .. } => "`maglev study points` lists the points",
            Self::Setup { source, .. } => return source.help(),
            Self::Accuracy { source, .. } => return source.help(),
            Self::ResultsOnly { .. } => "give the study file that it was made from",
            Self::Output { .. } => {
                "free space on the disk, then run the study again: it continues where it ended"
            }
            Self::Busy { .. } => "wait until it ends, or choose another folder with --out",
            Self::Differs { .. } => "merge only folders of one study with the same units",
            Self::Spawn(_) => "run the study again when the machine has room for processes",
            Self::Worker { .. } => "run one point with `maglev run` to see what happens",
        })
    }

    /// The messages of this error and of its sources, outermost first.
    #[must_use]
    pub fn chain(&self) -> Vec<String> {
        results::causes(self)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Error, ErrorKind};

    use super::StudyError;

    /// A script that tries again would do so for ever on a read-only disk.
    #[test]
    fn issue_only_a_full_disk_is_worth_a_second_try() {
        for (kind, again) in [
            (ErrorKind::StorageFull, true),
            (ErrorKind::ReadOnlyFilesystem, false),
            (ErrorKind::PermissionDenied, false),
        ] {
            let source = Error::from(kind);
            let error = StudyError::Output { folder: "results".into(), source };
            assert_eq!(error.can_try_again(), again, "{kind}");
        }
    }
}
