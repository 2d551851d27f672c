//! Texts and units of measure of the table, which the kit wants to live as long as the library.

use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

use bundle_table::Measure;
use fmi2_export::{DisplayUnit, UnitOfMeasure};

/// A text that lives as long as the library. Equal texts share their memory, so repeated instances take no more.
pub(crate) fn lasting(text: &str) -> &'static str {
    static TEXTS: Mutex<Option<HashSet<&'static str>>> = Mutex::new(None);
    let mut texts = TEXTS.lock().unwrap_or_else(PoisonError::into_inner);
    let texts = texts.get_or_insert_default();
    if let Some(known) = texts.get(text) {
        return known;
    }
    let new: &'static str = Box::leak(text.to_owned().into_boxed_str());
    texts.insert(new);
    new
}

/// A list of units for display that lives as long as the library.
fn displays(list: &[(String, f64, f64)]) -> &'static [DisplayUnit] {
    type Known = Vec<(Vec<(String, f64, f64)>, &'static [DisplayUnit])>;
    static LISTS: Mutex<Known> = Mutex::new(Vec::new());
    let mut lists = LISTS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, known)) = lists.iter().find(|(it, _)| it == list) {
        return known;
    }
    let new: Vec<DisplayUnit> = list
        .iter()
        .map(|(name, factor, offset)| DisplayUnit::new(lasting(name), *factor).offset(*offset))
        .collect();
    let new: &'static [DisplayUnit] = Box::leak(new.into_boxed_slice());
    lists.push((list.to_vec(), new));
    new
}

/// A unit of measure for the kit.
pub(crate) fn measure(it: &Measure) -> UnitOfMeasure {
    let [kg, m, s, a, k, mol, cd, rad] = it.exponents;
    UnitOfMeasure::new(lasting(&it.name))
        .kg(kg)
        .m(m)
        .s(s)
        .a(a)
        .k(k)
        .mol(mol)
        .cd(cd)
        .rad(rad)
        .factor(it.factor)
        .offset(it.offset)
        .displays(displays(&it.displays))
}
