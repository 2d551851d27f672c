//! The FMI 2.0 C API, generated with bindgen
