//! A thread that writes buffered records within half a second, and a function that writes them at once
//! when a unit is about to crash the process.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

use crate::spool::Spool;

/// Longest time that a record stays in memory.
const INTERVAL: Duration = Duration::from_millis(400);

/// The growing files of this process.
struct WatchedFiles {
    spools: Vec<Weak<Spool>>,
    /// whether the thread is running
    kept: bool,
}

static WATCHED: Mutex<WatchedFiles> = Mutex::new(WatchedFiles { spools: Vec::new(), kept: false });

fn watched() -> MutexGuard<'static, WatchedFiles> {
    WATCHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Watches a file until it is dropped.
pub(super) fn watch(spool: &Arc<Spool>) {
    let mut watched = watched();
    watched.spools.retain(|it| it.strong_count() > 0);
    watched.spools.push(Arc::downgrade(spool));
    if !watched.kept {
        // without a thread, records are written when the buffer is full
        let thread = std::thread::Builder::new().name("keeper".to_owned()).spawn(keep);
        watched.kept = thread.is_ok();
    }
}

/// Writes all buffers at intervals, as long as there are files.
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

/// Writes all buffers of a process that is about to die. It waits for no lock and neither allocates nor
/// frees memory, so that a signal handler may call it.
pub fn write_now() {
    let Ok(watched) = WATCHED.try_lock() else { return };
    for spool in watched.spools.iter().filter_map(Weak::upgrade) {
        spool.drain_aside();
        // dropping it could free memory
        std::mem::forget(spool);
    }
}
