//! A trace: every C call to every FMU, in order, in a text file.
//!
//! There is a line before each call, with its arguments, and one after it, with its status, duration and
//! results. Nothing is buffered, so the last line of an instance that crashed is the call that it crashed
//! in. Lines of instances that step at the same time are interleaved; each names its instance. Isolated
//! instances write to the same file from their processes.

use std::collections::HashMap;
use std::fmt::{Debug, Write as _};
use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use fmi2_sys::fmi2Status;
use serde::{Deserialize, Serialize};

use crate::answer::{Answer, Outcome};
use crate::description::ModelDescription;
use crate::functions::Call;
use crate::per_type::CType;

/// First line of the file.
const HEADER: &str = "# calls of the units' functions: seconds since the start, instance, call with its \
arguments (variables by name and #reference); once it has returned, its status\n";

/// The trace of a run.
#[derive(Debug, Clone)]
pub struct Trace {
    path: PathBuf,
    file: Arc<File>,
    begin: Duration,
}

impl Trace {
    /// Begins a trace in a file. An existing file is overwritten.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        let path = absolute(path)?;
        // emptied first, since lines of several processes stay whole only in append mode
        File::create(&path)?;
        let mut file = OpenOptions::new().append(true).open(&path)?;
        file.write_all(HEADER.as_bytes())?;
        Ok(Self { path, file: Arc::new(file), begin: now() })
    }

    /// What an instance needs to write to the trace, in this process or another one.
    pub(crate) fn of(&self, instance: &str, description: &ModelDescription) -> Traced {
        let names = description.variables.iter().rev();
        Traced {
            path: self.path.clone(),
            begin: self.begin,
            instance: instance.to_owned(),
            // the first of several aliases, as in messages
            names: names
                .map(|it| ((it.kind.c_type(), it.value_reference), it.name.clone()))
                .collect(),
            file: Some(Arc::clone(&self.file)),
        }
    }
}

/// What an instance needs to write to a trace.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Traced {
    path: PathBuf,
    /// since 1970, the only clock that processes share
    begin: Duration,
    instance: String,
    names: Names,
    /// open in the process of the master only
    #[serde(skip)]
    file: Option<Arc<File>>,
}

type Names = HashMap<(CType, u32), String>;

fn now() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

/// Writes the lines of one instance.
pub(crate) struct Tracer {
    file: Arc<File>,
    instance: String,
    names: Names,
    /// when the run began, and how long it had been running then
    epoch: (Instant, Duration),
}

impl Tracer {
    /// Opens the file if this process has not opened it yet.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub(crate) fn open(traced: &Traced) -> io::Result<Self> {
        let file = match &traced.file {
            Some(file) => Arc::clone(file),
            None => Arc::new(OpenOptions::new().append(true).open(&traced.path)?),
        };
        Ok(Self {
            file,
            instance: traced.instance.clone(),
            names: traced.names.clone(),
            epoch: (Instant::now(), now().saturating_sub(traced.begin)),
        })
    }

    /// Writes a line before a call.
    #[cold]
    #[inline(never)]
    pub(crate) fn before(&self, call: Call, arguments: impl FnOnce(&mut Line<'_>)) -> Instant {
        let mut line = self.line(call);
        line.text.push('(');
        arguments(&mut line);
        line.text.push(')');
        self.write(line);
        Instant::now()
    }

    /// Writes a line after a call.
    #[cold]
    #[inline(never)]
    pub(crate) fn after(
        &self,
        answer: Answer,
        begin: Instant,
        results: impl FnOnce(&mut Line<'_>),
    ) {
        let taken = 1e6 * begin.elapsed().as_secs_f64();
        let mut line = self.line(answer.call);
        let has_no_status = [Call::fmi2Instantiate, Call::fmi2FreeInstance].contains(&answer.call);
        let status = match answer.outcome {
            _ if has_no_status => "returned".to_owned(),
            Outcome::Status(status) => fmi2Status(status).to_string(),
            Outcome::Lacks => "the unit has no such function".to_owned(),
            Outcome::Lost => "the process has ended".to_owned(),
        };
        line.add(format_args!(" = {status} in {taken:.1} us"));
        let length = line.text.len();
        line.text.push_str(": ");
        results(&mut line);
        if line.text.len() == length + 2 {
            line.text.truncate(length);
        }
        self.write(line);
    }

    fn line(&self, call: Call) -> Line<'_> {
        let time = (self.epoch.1 + self.epoch.0.elapsed()).as_secs_f64();
        let text = format!("{time:.6} {} {}", self.instance, call.name());
        Line { text, names: &self.names, first: true }
    }

    fn write(&self, line: Line<'_>) {
        // one write for each line keeps it whole; the run does not fail if the trace cannot be written
        let _ = (&*self.file).write_all((line.text + "\n").as_bytes());
    }
}

/// A line that is being written.
pub(crate) struct Line<'a> {
    text: String,
    names: &'a Names,
    first: bool,
}

impl Line<'_> {
    /// Adds an item to the list.
    pub(crate) fn item(&mut self, item: std::fmt::Arguments<'_>) {
        if !std::mem::take(&mut self.first) {
            self.text.push_str(", ");
        }
        self.add(item);
    }

    fn add(&mut self, what: std::fmt::Arguments<'_>) {
        // writing to a String cannot fail
        let _ = self.text.write_fmt(what);
    }

    fn name(&self, kind: CType, reference: u32) -> String {
        match self.names.get(&(kind, reference)) {
            Some(name) => format!("{name} #{reference}"),
            None => format!("#{reference}"),
        }
    }

    /// Adds variables.
    pub(crate) fn variables(&mut self, kind: CType, references: &[u32]) {
        for &reference in references {
            let name = self.name(kind, reference);
            self.item(format_args!("{name}"));
        }
    }

    /// Adds variables with their values.
    pub(crate) fn values<T: Debug>(&mut self, kind: CType, references: &[u32], values: &[T]) {
        for (&reference, value) in references.iter().zip(values) {
            let name = self.name(kind, reference);
            self.item(format_args!("{name} = {value:?}"));
        }
    }

    /// Adds derivatives of Reals, with their values if there are any.
    pub(crate) fn derivatives(&mut self, references: &[u32], orders: &[i32], values: &[f64]) {
        for (k, (&reference, order)) in references.iter().zip(orders).enumerate() {
            let name = self.name(CType::Real, reference);
            match values.get(k) {
                Some(value) => self.item(format_args!("{name} order {order} = {value:?}")),
                None => self.item(format_args!("{name} order {order}")),
            }
        }
    }
}
