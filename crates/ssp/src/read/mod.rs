//! The files of the standard as values: descriptions (SSD), parameter sets (SSV), parameter mappings (SSM) and signal
//! dictionaries (SSB).

mod common;
mod description;
mod dictionary;
mod mapping;
mod reader;
mod values;

pub(crate) use common::{Items, Kind, Linear, SignalType, Transformation};
pub(crate) use description::{
    Base, Binding, Component, Connection, Connector, Contents, Description, Element, End, Origin,
    System,
};
pub(crate) use dictionary::SignalDictionary;
pub(crate) use mapping::ParameterMapping;
pub(crate) use values::{Number, ParameterSet, ParameterValue};
