//! Writes gathered records within half a second, whatever the program is busy with, and at once when
//! the process is about to die by the fault of a unit.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use crate::spool::Spool;

/// Longest time that a record waits in memory.
const INTERVAL: Duration = Duration::from_millis(400);

/// The files that grow in this process.
struct WatchedFiles {
    spools: Vec<Weak<Spool>>,
    /// whether there is a thread that looks after them
    kept: bool,
}

static WATCHED: Mutex<WatchedFiles> = Mutex::new(WatchedFiles { spools: Vec::new(), kept: false });

fn watched() -> MutexGuard<'static, WatchedFiles> {
    WATCHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Looks after a file until it is dropped.
pub(super) fn watch(spool: &Arc<Spool>) {
    let mut watched = watched();
    watched.spools.retain(|it| it.strong_count() > 0);
    watched.spools.push(Arc::downgrade(spool));
    if !watched.kept {
        // without a thread records wait until there are many
        let thread = std::thread::Builder::new().name("keeper".to_owned()).spawn(keep);
        watched.kept = thread.is_ok();
    }
}

/// Writes what is gathered from time to time, as long as there are files.
fn keep() {
    loop {
        std::thread::sleep(INTERVAL);
        let spools: Vec<Arc<Spool>> = {
            let mut watched = watched();
            watched.spools.retain(|it| it.strong_count() > 0);
            watched.kept = !watched.spools.is_empty();
            if !watched.kept {
                return;
            }
            watched.spools.iter().filter_map(Weak::upgrade).collect()
        };
        spools.iter().for_each(|spool| spool.drain_aside());
    }
}

/// Writes all that is gathered, for a process that is about to die. It takes no lock that another
/// holds and neither allocates nor frees memory, so that it may be called in a signal handler.
pub fn write_now() {
    let Ok(watched) = WATCHED.try_lock() else { return };
    for spool in watched.spools.iter().filter_map(Weak::upgrade) {
        spool.drain_aside();
        // the last owner would free it
        std::mem::forget(spool);
    }
}
