//! Parameters of the core.

/// Every parameter of the core, nested by stage.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Params {}

/// Parameters that were checked: the only kind a controller takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidParams(Params);

impl Params {
    /// Checks every parameter.
    ///
    /// # Errors
    /// Every violation at once.
    pub fn validate(self) -> Result<ValidParams, core::convert::Infallible> {
        Ok(ValidParams(self))
    }
}
