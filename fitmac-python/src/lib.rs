//! The Python extension `fitmac._fitmac`: the core's calls with messages as
//! bytes. The Python package around it gives them names, arrays and words.
#![allow(unsafe_code)]

mod arm;
mod config;
mod controller;
mod motion;
mod words;

#[pyo3::pymodule]
mod _fitmac {
    #[pymodule_export]
    use super::arm::{panda_constants, panda_forward, panda_inverse, panda_jacobian};
    #[pymodule_export]
    use super::config::{Config, parameters};
    #[pymodule_export]
    use super::controller::{Controller, Snapshot, sizes};
    #[pymodule_export]
    use super::motion::Motion;
    #[pymodule_export]
    use super::words::{bits, vocabularies};
}
