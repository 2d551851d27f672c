//! Macros that make a call and write it to the trace.

/// Makes a call. If there is a trace, it gets a line before the call and one after it.
macro_rules! traced {
    ($self:ident, $call:expr, $arguments:expr, $run:expr) => {
        traced!($self, $call, $arguments, $run, |_| {})
    };
    ($self:ident, $call:expr, $arguments:expr, $run:expr, $results:expr) => {
        match &$self.trace {
            None => $run,
            Some(trace) => {
                let begin = trace.before($call, $arguments);
                let answer = $run;
                trace.after(answer, begin, $results);
                answer
            }
        }
    };
}

/// A call for which the trace gets the arguments in words.
macro_rules! request {
    ($self:ident, $field:ident, $call:ident, [$($words:tt)*] $(, $argument:expr)* $(,)?) => {
        traced!(
            $self,
            Call::$call,
            |it| it.item(format_args!($($words)*)),
            invoke!($self, $field, $call $(, $argument)*)
        )
    };
}

/// Calls a function of the library, or answers that the library lacks it.
macro_rules! invoke {
    ($self:ident, $field:ident, $call:ident $(, $argument:expr)* $(,)?) => {{
        use std::sync::atomic::Ordering::Relaxed;

        use crate::activity::Activity;
        use crate::answer::{Answer, Outcome};

        match $self.functions.$field {
            Some(function) => {
                $self.mark.store(Call::$call as u32, Relaxed);
                // SAFETY: the same library's fmi2Instantiate returned the component; pointers come
                // from slices of the length that is passed with them, or from variables of the
                // right type, and outlive the call
                let status = unsafe { function($self.pointer $(, $argument)*) };
                $self.mark.store(Activity::IDLE, Relaxed);
                Answer::new(Call::$call, status)
            }
            None => Answer { call: Call::$call, outcome: Outcome::Lacks },
        }
    }};
}
