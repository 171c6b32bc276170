//! Parameters.

use fitmac_core::{ValidParams, params::AssignError, params::Params};
use pyo3::{
    exceptions::{PyKeyError, PyTypeError, PyValueError},
    prelude::*,
};

/// Parameters of a controller.
#[pyclass]
#[derive(Clone)]
pub(crate) struct Config {
    params: Params,
}

impl Config {
    pub(crate) fn valid(&self) -> PyResult<ValidParams> {
        let valid = self.params.validate();
        valid.map_err(|violations| PyValueError::new_err(violations.to_string()))
    }
}

#[pymethods]
impl Config {
    /// The parameters of a profile: "guarded" or "paper".
    #[new]
    fn new(profile: &str) -> PyResult<Self> {
        let params = match profile {
            "guarded" => Params::guarded(),
            "paper" => Params::paper(),
            _ => {
                return Err(PyValueError::new_err(format!(
                    "profile is {profile:?}, allowed are \"guarded\" and \"paper\""
                )));
            }
        };
        Ok(Self { params })
    }

    /// Sets the parameter `key` to the value that `text` says.
    fn assign(&mut self, key: &str, text: &str) -> PyResult<()> {
        self.params.assign(key, text).map_err(|error| match error {
            AssignError::UnknownKey => PyKeyError::new_err(format!("there is no parameter {key}")),
            AssignError::NotAValue => {
                PyTypeError::new_err(format!("{key} cannot be {text}: {error}"))
            }
        })
    }

    /// Raises a `ValueError` that names every parameter that does not hold.
    fn check(&self) -> PyResult<()> {
        self.valid().map(|_| ())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.params == other.params
    }
}

/// Every numeric parameter: key, unit, default, least, greatest, what it does.
#[pyfunction]
pub(crate) fn parameters() -> Vec<(String, &'static str, f64, f64, f64, &'static str)> {
    let all = Params::TABLES.iter().copied().flatten();
    all.map(|p| {
        let key = format!("{}.{}", p.stage, p.name);
        (key, p.unit, p.default, p.min, p.max, p.doc.trim())
    })
    .collect()
}
