//! The worker's side: makes the calls that the master orders.

use std::fs::File;
use std::io;
use std::os::fd::{FromRawFd as _, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::parent_id;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use fmi2_sys::fmi2Status as Status;
use rustix::process::{Resource, Rlimit, Signal};

use super::ARGUMENT;
use super::memory::{Area, Control, control, control_in, part};
use super::protocol::{Order, Report, read_frame, write_frame};
use crate::answer::{Answer, Outcome};
use crate::component::Component;
use crate::exchange::StepLayout;
use crate::functions::{Call, Functions};
use crate::logger::Sink;

/// How long a worker sleeps before it checks that its master still lives.
const NAP: Duration = Duration::from_secs(1);

/// Turns this program into a worker if a master started it as one. Returns the status to exit with when
/// the master no longer needs it. Call this first in `main`.
#[must_use]
pub fn serve_if_worker() -> Option<ExitCode> {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next()? != ARGUMENT {
        return None;
    }
    let mut number = || arguments.next()?.to_str()?.parse::<i32>().ok();
    let (memory, socket, master) = (number()?, number()?, number()?);
    if memory < 3 || socket < 3 || memory == socket {
        return None;
    }
    // SAFETY: the master left these two open for this process, and nothing else uses them
    let (memory, socket) = unsafe { (OwnedFd::from_raw_fd(memory), OwnedFd::from_raw_fd(socket)) };
    let served = serve(File::from(memory), UnixStream::from(socket), master.cast_unsigned());
    // an error means that the master has ended
    Some(if served.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn serve(memory: File, mut socket: UnixStream, master: u32) -> io::Result<()> {
    rustix::process::set_parent_process_death_signal(Some(Signal::KILL))?;
    // when memory runs out, Linux shall kill this process rather than the master; it works without
    let _ = std::fs::write("/proc/self/oom_score_adj", "1000");
    let map: &'static _ = Box::leak(Box::new(control(&memory)?));
    // SAFETY: the mapping stays as long as this process, and is a Control
    let control: &'static Control = unsafe { &*control_in(map) };
    let mut worker = Served {
        control,
        area: Area::map(&memory, &StepLayout::default())?,
        memory,
        layout: StepLayout::default(),
        component: None,
        dead: Arc::default(),
    };
    let mut stroke = 0_u32;
    loop {
        stroke = stroke.wrapping_add(1);
        let watch = Duration::from_micros(control.watch.load(Ordering::Relaxed).into());
        if !control.to_worker.watch(stroke, watch) {
            while !control.to_worker.sleep(stroke, NAP) {
                if parent_id() != master {
                    return Err(io::ErrorKind::BrokenPipe.into());
                }
            }
        }
        match control.parts.load(Ordering::Relaxed) {
            0 => {
                let order = read_frame(&mut socket)?;
                let last = matches!(order, Order::Free);
                write_frame(&mut socket, &worker.obey(order)?)?;
                if last {
                    return Ok(());
                }
            }
            parts => {
                control.set_answer(worker.exchange(parts));
                control.to_master.ring(stroke);
            }
        }
    }
}

/// The instance that this process is for.
struct Served {
    control: &'static Control,
    memory: File,
    area: Area,
    layout: StepLayout,
    component: Option<Component>,
    dead: Arc<AtomicBool>,
}

impl Served {
    fn obey(&mut self, order: Order) -> io::Result<Report> {
        Ok(match order {
            Order::Start { unit, binary, identity, memory } => {
                if let Some(bytes) = memory {
                    let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
                    rustix::process::setrlimit(Resource::As, limit)?;
                }
                let functions = match Functions::open(&unit, &binary, None) {
                    Ok(functions) => functions,
                    Err(error) => return Ok(Report::Unloadable(crate::fault::causes(&error))),
                };
                let name = identity.name.to_string_lossy();
                let sink = Sink::into_ring(&name, &self.control.ring);
                let mark = &self.control.mark;
                self.component = Component::new(functions, &self.dead, &identity, &sink, mark);
                if self.component.is_some() { Report::Done } else { Report::Refused }
            }
            Order::LayOut(layout) => {
                self.area = Area::map(&self.memory, &layout)?;
                self.layout = layout;
                Report::Done
            }
            Order::Perform(request) => match &mut self.component {
                Some(component) => {
                    let reply = component.perform(&request);
                    self.note(reply.answer);
                    Report::Reply(reply)
                }
                None => Report::Refused,
            },
            Order::Free => {
                self.component = None;
                Report::Done
            }
        })
    }

    /// After a fatal error no function may be called any more, not even to free the instance.
    fn note(&self, answer: Answer) {
        if answer.is(Status::fmi2Fatal) {
            self.dead.store(true, Ordering::Relaxed);
        }
    }

    fn exchange(&mut self, parts: u32) -> Answer {
        let Some(component) = &mut self.component else {
            return Answer { call: Call::fmi2Instantiate, outcome: Outcome::Lacks };
        };
        let mut worst = Answer::good(Call::fmi2DoStep);
        if parts & part::SEND != 0 {
            worst = worst.or_worse(component.send(&self.layout, &self.area.sent()));
        }
        if parts & part::SAVE != 0 && worst.can_continue() {
            let slot = self.control.slot.load(Ordering::Relaxed) as usize;
            worst = worst.or_worse(component.save_state(slot));
        }
        if parts & part::STEP != 0 && worst.can_continue() {
            let (time, size) = self.control.step();
            worst = worst.or_worse(component.do_step(time, size));
        }
        if parts & part::RECEIVE != 0 && worst.can_continue() {
            worst = worst.or_worse(component.receive(&self.layout, &mut self.area.received()));
        }
        self.note(worst);
        worst
    }
}
