//! Starting a worker process.

use std::fs::File;
use std::io;
use std::os::fd::AsRawFd as _;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt as _;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use rustix::fs::MemfdFlags;

use super::{NAPS, WORKERS, Worker};
use crate::activity::Activity;
use crate::exchange::StepLayout;
use crate::fault::{FmuError, FmuFault, causes};
use crate::functions::Functions;
use crate::isolate::memory::{Area, control};
use crate::isolate::protocol::{Order, Report};
use crate::isolate::{ARGUMENT, Isolation, PROGRAM};
use crate::library::LibraryError;
use crate::package::Package;
use crate::request::Identity;

impl Worker {
    /// Starts a process that loads the package's binary and creates an instance.
    pub(crate) fn start(
        package: &Arc<Package>,
        isolation: &Isolation,
        identity: &Identity,
        name: &str,
    ) -> Result<Self, FmuError> {
        let instance = || name.to_owned();
        Functions::check_presence(package).map_err(|error| unloadable(name, &error))?;
        let mut worker = Self::spawn(isolation, name)
            .map_err(|source| FmuFault::NoProcess { instance: instance(), source })?;
        let order = Order::Start {
            unit: package.path().to_owned(),
            binary: package.binary(),
            identity: identity.clone(),
            memory: isolation.memory,
        };
        let report = worker.converse(&order, isolation.call_limit());
        if matches!(report, Some(Report::Done)) {
            return Ok(worker);
        }
        let messages = worker.take_messages(package.description());
        match report {
            Some(Report::Unloadable(causes)) => {
                Err(FmuFault::Unloadable { instance: instance(), causes }.into())
            }
            Some(_) => Err(FmuFault::Refused { instance: instance(), messages }.into()),
            None => Err(worker.loss(name, None, messages).into()),
        }
    }

    fn spawn(isolation: &Isolation, name: &str) -> io::Result<Self> {
        let memory = File::from(rustix::fs::memfd_create("isolated-unit", MemfdFlags::CLOEXEC)?);
        let map = control(&memory)?;
        let area = Area::map(&memory, &StepLayout::default())?;
        let (socket, theirs) = UnixStream::pair()?;
        let program = match isolation.program.as_ref().or_else(|| PROGRAM.get()) {
            Some(program) => program.clone(),
            None => std::env::current_exe()?,
        };
        let mut command = Command::new(&program);
        // Ctrl-C is for the master, which ends its workers
        command.process_group(0).stdin(Stdio::null());
        // other processes that this one starts do not inherit them
        let (shared, end) = (memory.try_clone()?, theirs);
        let numbers = [shared.as_raw_fd(), end.as_raw_fd()];
        command
            .arg(ARGUMENT)
            .args(numbers.map(|number| number.to_string()))
            .arg(std::process::id().to_string())
            .arg(name);
        let keep = move || {
            rustix::io::fcntl_setfd(&shared, rustix::io::FdFlags::empty())?;
            rustix::io::fcntl_setfd(&end, rustix::io::FdFlags::empty())?;
            Ok(())
        };
        // SAFETY: between fork and exec, only two fcntl are called
        let child = unsafe { command.pre_exec(keep) }.spawn().map_err(|error| {
            io::Error::new(error.kind(), format!("{}: {error}", program.display()))
        })?;
        // the command holds the other end of the socket, which must close when the worker ends
        drop(command);
        WORKERS.fetch_add(1, Ordering::Relaxed);
        let worker = Self {
            child,
            socket,
            memory,
            map,
            area,
            isolation: isolation.clone(),
            stroke: 0,
            waiting: 0,
            begun: false,
            fresh: false,
            loss: None,
            lost_in: Activity::None,
        };
        worker.control().mark.store(Activity::LOADING, Ordering::Relaxed);
        worker.socket.set_read_timeout(Some(NAPS[1]))?;
        worker.socket.set_write_timeout(Some(NAPS[1]))?;
        Ok(worker)
    }
}

fn unloadable(name: &str, error: &LibraryError) -> FmuError {
    FmuFault::Unloadable { instance: name.to_owned(), causes: causes(error) }.into()
}
