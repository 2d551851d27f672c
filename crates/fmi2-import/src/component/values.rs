//! Values of variables and their derivatives.

use std::ffi::{CStr, CString, c_void};
use std::ptr::null;
use std::sync::atomic::Ordering;

use fmi2_sys as sys;
use sys::fmi2Status as Status;

use super::{Boolean, Component, Integer, Numeric, Real};
use crate::activity::Activity;
use crate::answer::{Answer, Outcome};
use crate::functions::Call;
use crate::per_type::CType;
use crate::request::{Data, Reply, Values};

impl Component {
    /// Reads values of one type.
    #[inline]
    pub(crate) fn get<K: Numeric>(
        &mut self,
        references: &[u32],
        values: &mut [K::Value],
    ) -> Answer {
        let n = references.len().min(values.len());
        traced!(
            self,
            K::GET,
            |it| it.variables(K::TYPE, references),
            self.transfer(K::GET, K::getter(&self.functions), |component, get| {
                // SAFETY: a live component; both pointers are good for n values
                unsafe { get(component, references.as_ptr(), n, values.as_mut_ptr()) }
            }),
            |it| it.values(K::TYPE, references, values)
        )
    }

    /// Sets values of one type.
    #[inline]
    pub(crate) fn set<K: Numeric>(&mut self, references: &[u32], values: &[K::Value]) -> Answer {
        let n = references.len().min(values.len());
        traced!(
            self,
            K::SET,
            |it| it.values(K::TYPE, references, values),
            self.transfer(K::SET, K::setter(&self.functions), |component, set| {
                // SAFETY: a live component; both pointers are good for n values
                unsafe { set(component, references.as_ptr(), n, values.as_ptr()) }
            })
        )
    }

    #[inline]
    fn transfer<F>(
        &self,
        call: Call,
        function: Option<F>,
        run: impl FnOnce(*mut c_void, F) -> Status,
    ) -> Answer {
        let Some(function) = function else { return Answer { call, outcome: Outcome::Lacks } };
        self.mark.store(call as u32, Ordering::Relaxed);
        let status = run(self.pointer, function);
        self.mark.store(Activity::IDLE, Ordering::Relaxed);
        Answer::new(call, status)
    }

    /// Reads one String; null reads as empty.
    pub(crate) fn get_string(&mut self, reference: u32) -> (Answer, CString) {
        let mut pointer: sys::fmi2String = null();
        let answer = traced!(
            self,
            Call::fmi2GetString,
            |it| it.variables(CType::String, &[reference]),
            invoke!(self, get_string, fmi2GetString, &raw const reference, 1, &raw mut pointer),
            |it| if !pointer.is_null() {
                // SAFETY: not null; the standard keeps the string alive until the next call
                it.values(CType::String, &[reference], &[unsafe { CStr::from_ptr(pointer) }]);
            }
        );
        if pointer.is_null() || !answer.can_continue() {
            return (answer, CString::default());
        }
        // SAFETY: not null; the standard keeps the string alive until the next call
        (answer, unsafe { CStr::from_ptr(pointer) }.to_owned())
    }

    /// Sets one String.
    pub(crate) fn set_string(&mut self, reference: u32, value: &CStr) -> Answer {
        let pointer = value.as_ptr();
        traced!(
            self,
            Call::fmi2SetString,
            |it| it.values(CType::String, &[reference], &[value]),
            invoke!(self, set_string, fmi2SetString, &raw const reference, 1, &raw const pointer)
        )
    }

    /// Sets derivatives of inputs for the next step.
    #[inline]
    pub(crate) fn set_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Answer {
        let n = references.len().min(orders.len()).min(values.len());
        traced!(
            self,
            Call::fmi2SetRealInputDerivatives,
            |it| it.derivatives(references, orders, values),
            invoke!(
                self,
                set_real_input_derivatives,
                fmi2SetRealInputDerivatives,
                references.as_ptr(),
                n,
                orders.as_ptr(),
                values.as_ptr()
            )
        )
    }

    /// Reads derivatives of outputs at the end of the last step.
    #[inline]
    pub(crate) fn get_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Answer {
        let n = references.len().min(orders.len()).min(values.len());
        traced!(
            self,
            Call::fmi2GetRealOutputDerivatives,
            |it| it.derivatives(references, orders, &[]),
            invoke!(
                self,
                get_real_output_derivatives,
                fmi2GetRealOutputDerivatives,
                references.as_ptr(),
                n,
                orders.as_ptr(),
                values.as_mut_ptr()
            ),
            |it| it.derivatives(references, orders, values)
        )
    }

    /// Directional derivative of unknowns by knowns.
    pub(crate) fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Answer {
        traced!(
            self,
            Call::fmi2GetDirectionalDerivative,
            |it| {
                it.variables(CType::Real, unknowns);
                it.item(format_args!("along"));
                it.values(CType::Real, knowns, seed);
            },
            invoke!(
                self,
                get_directional_derivative,
                fmi2GetDirectionalDerivative,
                unknowns.as_ptr(),
                unknowns.len().min(out.len()),
                knowns.as_ptr(),
                knowns.len().min(seed.len()),
                seed.as_ptr(),
                out.as_mut_ptr()
            ),
            |it| it.values(CType::Real, unknowns, out)
        )
    }

    pub(super) fn get_any(&mut self, kind: CType, references: &[u32]) -> Reply {
        fn read<K: Numeric>(component: &mut Component, references: &[u32]) -> Reply {
            let mut values = vec![K::Value::default(); references.len()];
            let answer = component.get::<K>(references, &mut values);
            Reply { answer, data: Data::Values(K::wrap(values)) }
        }
        match kind {
            CType::Real => read::<Real>(self, references),
            CType::Integer => read::<Integer>(self, references),
            CType::Boolean => read::<Boolean>(self, references),
            CType::String => {
                let mut worst = Answer::good(Call::fmi2GetString);
                let mut texts = Vec::with_capacity(references.len());
                for &reference in references {
                    let (answer, text) = self.get_string(reference);
                    worst = worst.or_worse(answer);
                    texts.push(text);
                    if !worst.can_continue() {
                        break;
                    }
                }
                Reply { answer: worst, data: Data::Values(Values::String(texts)) }
            }
        }
    }

    pub(super) fn set_any(&mut self, references: &[u32], values: &Values) -> Answer {
        match values {
            Values::Real(values) => self.set::<Real>(references, values),
            Values::Integer(values) => self.set::<Integer>(references, values),
            Values::Boolean(values) => self.set::<Boolean>(references, values),
            Values::String(values) => {
                let mut worst = Answer::good(Call::fmi2SetString);
                for (&reference, value) in references.iter().zip(values) {
                    worst = worst.or_worse(self.set_string(reference, value));
                    if !worst.can_continue() {
                        break;
                    }
                }
                worst
            }
        }
    }
}
