//! The result of a point.

use criteria::{Outcome, Verdict};
use serde::{Deserialize, Serialize};

/// How a point ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// It reached its stop time.
    Finished,
    /// A stop condition ended it.
    Stopped,
    /// A unit ended it with fmi2Terminated.
    Terminated,
    /// It could not start, or failed: its figures are missing.
    Failed,
    /// Its process crashed in every try.
    Crashed,
    /// It took longer than the study allows.
    TimedOut,
}

impl Status {
    /// Its name in the results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Stopped => "stopped",
            Self::Terminated => "terminated",
            Self::Failed => "failed",
            Self::Crashed => "crashed",
            Self::TimedOut => "timed-out",
        }
    }

    /// Whether the run itself ended regularly.
    #[must_use]
    pub fn is_regular(self) -> bool {
        matches!(self, Self::Finished | Self::Stopped | Self::Terminated)
    }
}

/// Whether a point keeps all limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limits {
    /// All of them.
    Passed,
    /// At least one is exceeded.
    Failed,
    /// None is exceeded, and one could not be judged.
    NotJudged,
}

impl Limits {
    /// Its name in the results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::NotJudged => "not-judged",
        }
    }

    /// The verdict on all limits. `None` without limits.
    pub(crate) fn of(verdicts: &[Verdict]) -> Option<Self> {
        let limits = || verdicts.iter().filter(|it| it.max.is_some() || it.min.is_some());
        limits().next()?;
        let any = |test: fn(&Verdict) -> bool| limits().any(test);
        Some(if any(|it| it.outcome == Outcome::Failed) {
            Self::Failed
        } else if any(|it| it.outcome == Outcome::NotJudged && !it.optional) {
            Self::NotJudged
        } else {
            Self::Passed
        })
    }
}

/// The result of a point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name that follows from the content of the point.
    pub run: String,
    /// How it ended.
    pub status: Status,
    /// Whether it keeps all limits. `None` without limits, or if it did not end regularly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// Last time that it reached (s), if that is known.
    pub reached: Option<f64>,
    /// Its figures in the order of [`Study::columns`](crate::Study::columns); `None` where one is not known.
    pub metrics: Vec<Option<f64>>,
    /// Why it failed or ended early, or why figures are missing.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub message: String,
}

impl Row {
    /// The row of a point that has not been computed to its end.
    pub(crate) fn without_figures(run: String, status: Status, message: String) -> Self {
        Self { run, status, limits: None, reached: None, metrics: Vec::new(), message }
    }
}
