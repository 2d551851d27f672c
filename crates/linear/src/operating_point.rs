//! Where a system is linearised: the time, and the inputs of its units.

use indexmap::IndexMap;
use results::modes::InputFamily;

use super::error::LinearError;
use master::participant::Participant;

/// The inputs of one participant.
pub(super) fn inputs(participant: &mut Participant) -> Result<Vec<InputFamily>, LinearError> {
    let inputs = participant.variables().inputs.reals.clone();
    let instance = participant.instance_mut();
    let name = instance.name().to_owned();
    let variables: Vec<(String, u32, Option<String>)> = inputs
        .iter()
        .map(|&(k, _)| &instance.package().description().variables[k])
        .map(|it| (it.name.clone(), it.value_reference, it.unit.clone()))
        .collect();
    let references: Vec<u32> = variables.iter().map(|it| it.1).collect();
    let mut values = vec![0.0; references.len()];
    instance
        .get_real(&references, &mut values)
        .map_err(|source| LinearError::Inputs { instance: name, source })?;
    let mut families: IndexMap<String, InputFamily> = IndexMap::new();
    for ((name, _, unit), value) in variables.into_iter().zip(values) {
        let key = family(&name);
        let new = || InputFamily { name: key.clone(), count: 0, min: value, max: value, unit };
        let it = families.entry(key.clone()).or_insert_with(new);
        it.count += 1;
        it.min = it.min.min(value);
        it.max = it.max.max(value);
    }
    Ok(families.into_values().collect())
}

/// A name with `#` for its last number.
fn family(name: &str) -> String {
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    if stem.len() == name.len() { name.to_owned() } else { format!("{stem}#") }
}
