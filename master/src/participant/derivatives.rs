//! The derivatives of inputs and outputs that are exchanged, and their places in the calls.
//!
//! Derivatives of inputs are sent in one call per order, since some units ignore a call that mixes
//! orders. Units that declare it in their annotation get a single call.

use super::Participant;
use crate::system::VariableIndex;
use fmi2_import::instance::{FmuError, Offer, Refusal};

impl Participant {
    /// Lays out the calls.
    pub(super) fn lay_out_derivatives(&mut self) {
        let variables = &self.instance.package().description().variables;
        let of = |variable: VariableIndex| variables[variable].value_reference;
        let inputs = &self.variables.inputs.reals;
        let mut sent: Vec<(usize, usize)> = Vec::new();
        for (k, &(_, highest)) in inputs.iter().enumerate() {
            sent.extend((1..=highest.min(5)).map(|order| (k, order)));
        }
        if !self.variables.one_call {
            // stable: the inputs keep their order
            sent.sort_by_key(|&(_, order)| order);
        }
        self.places = vec![[0; 5]; inputs.len()];
        for (place, &(k, order)) in sent.iter().enumerate() {
            self.places[k][order - 1] = place;
        }
        let layout = &mut self.layout;
        layout.set_derivatives.references = sent.iter().map(|&(k, _)| of(inputs[k].0)).collect();
        layout.set_derivatives.orders = (0..sent.len()).map(|place| whole(sent[place].1)).collect();
        let ends = (1..=sent.len()).filter(|&end| {
            sent.get(end).is_none_or(|next| !self.variables.one_call && next.1 != sent[end - 1].1)
        });
        layout.set_derivative_calls = ends.collect();
        let outputs = self.variables.outputs.reals.iter();
        (layout.get_derivatives.references, layout.get_derivatives.orders) = outputs
            .flat_map(|&(variable, highest)| {
                (1..=highest.min(3)).map(move |order| (of(variable), whole(order)))
            })
            .unzip();
        self.sent.derivatives = vec![0.0; layout.set_derivatives.references.len()];
        self.received.derivatives = vec![0.0; layout.get_derivatives.references.len()];
        self.laid_out = false;
    }

    /// Whether the unit has refused derivatives of inputs but still gets them.
    pub(crate) fn refuses_derivatives(&self) -> bool {
        self.instance.warnings().refusal().is_some() && !self.held
    }

    /// Sends values only from now on, after the unit has refused derivatives of inputs.
    pub(crate) fn hold_inputs(&mut self) {
        self.variables.inputs.reals.iter_mut().for_each(|(_, highest)| *highest = 0);
        self.held = true;
        self.lay_out_derivatives();
    }

    /// Whether the unit gets values only, since it has refused derivatives of inputs.
    #[must_use]
    pub fn holds_inputs(&self) -> bool {
        self.held
    }

    /// The refusal of derivatives of inputs, when first called after it.
    pub fn take_refusal(&mut self) -> Option<Refusal> {
        let refusal = self.instance.warnings().refusal();
        let reported = std::mem::replace(&mut self.refusal_reported, refusal.is_some());
        refusal.filter(|_| !reported)
    }

    /// Reads the output derivatives that are wanted and declared once, if the description does not say
    /// which outputs have them. Only those that the unit returns are used from then on. To be called
    /// between initialization and the first inputs. Returns the highest order per Real output.
    ///
    /// A derivative counts as missing if the unit leaves it unwritten, or returns it with a warning or
    /// `fmi2Discard`. It is then computed from history.
    ///
    /// # Errors
    /// `fmi2Error` and worse: the instance can no longer be used.
    pub fn probe_output_derivatives(&mut self) -> Result<Vec<usize>, FmuError> {
        let annotated = self.instance.package().description().derivatives.is_some();
        let offers = self.instance.offers(Offer::OutputDerivatives);
        let mut outputs = std::mem::take(&mut self.variables.outputs.reals);
        for (variable, highest) in &mut outputs {
            if annotated && offers {
                break;
            }
            let reference =
                self.instance.package().description().variables[*variable].value_reference;
            let wanted = std::mem::take(highest);
            let wanted = if offers { wanted } else { 0 };
            for order in 1..=whole(wanted) {
                if !self.returns(reference, order)? {
                    self.withholds_outputs = true;
                    break;
                }
                *highest += 1;
            }
        }
        let offered = outputs.iter().map(|(_, highest)| *highest).collect();
        self.variables.outputs.reals = outputs;
        self.lay_out_derivatives();
        Ok(offered)
    }

    /// Whether the unit did not return a derivative of an output that it declares.
    #[must_use]
    pub fn withholds_outputs(&self) -> bool {
        self.withholds_outputs
    }

    fn returns(&mut self, reference: u32, order: i32) -> Result<bool, FmuError> {
        let mut value = [f64::NAN];
        let warnings = self.instance.warnings().count();
        let answer = self.instance.get_real_output_derivatives(&[reference], &[order], &mut value);
        let given = self.instance.unless_refused(answer)?;
        Ok(given && self.instance.warnings().count() == warnings && value[0].is_finite())
    }
}

/// Orders are 0 to 5.
#[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "0 to 5")]
const fn whole(order: usize) -> i32 {
    order as i32
}
