//! How a stage declares its parameters: value, range, unit and reason in one
//! place, from which the struct, its default, its check and the reference
//! table are made.

use super::AssignError;

/// One parameter as the reference table shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamInfo {
    /// The stage, as the configuration file names its table.
    pub stage: &'static str,
    /// The field.
    pub name: &'static str,
    /// The unit; "1" for a plain number.
    pub unit: &'static str,
    /// Value in the `guarded` profile.
    pub default: f64,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// What it does and why it has this default.
    pub doc: &'static str,
}

/// One parameter, or one relation between parameters, that does not hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Violation {
    /// The stage.
    pub stage: &'static str,
    /// The field, or the relation that fails.
    pub name: &'static str,
    /// The value found.
    pub value: f64,
    /// Least value allowed.
    pub min: f64,
    /// Greatest value allowed.
    pub max: f64,
}

impl core::fmt::Display for Violation {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(
            f,
            "{}.{} is {}, allowed is {} to {}",
            self.stage, self.name, self.value, self.min, self.max
        )
    }
}

/// Every violation of a parameter set.
#[derive(Clone, Debug, PartialEq)]
pub struct Violations {
    found: [Option<Violation>; Self::CAPACITY],
    count: usize,
}

impl Violations {
    /// Room for every parameter and relation to be wrong at once.
    pub const CAPACITY: usize = 192;

    pub(super) const fn none() -> Self {
        Self {
            found: [None; Self::CAPACITY],
            count: 0,
        }
    }

    pub(super) fn push(&mut self, violation: Violation) {
        if let Some(slot) = self.found.get_mut(self.count) {
            *slot = Some(violation);
            self.count += 1;
        }
    }

    /// Notes `violation` unless `holds`.
    pub(super) fn require(
        &mut self,
        holds: bool,
        stage: &'static str,
        name: &'static str,
        value: f64,
    ) {
        if !holds {
            self.push(Violation {
                stage,
                name,
                value,
                min: f64::NAN,
                max: f64::NAN,
            });
        }
    }

    /// The violations, in the order of declaration.
    pub fn iter(&self) -> impl Iterator<Item = &Violation> {
        self.found.iter().flatten()
    }

    /// How many there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.count
    }

    /// True if there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }
}

impl core::fmt::Display for Violations {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (i, violation) in self.iter().enumerate() {
            if i > 0 {
                f.write_str("; ")?;
            }
            if violation.min.is_nan() {
                write!(
                    f,
                    "{}: {} ({})",
                    violation.stage, violation.name, violation.value
                )?;
            } else {
                write!(f, "{violation}")?;
            }
        }
        Ok(())
    }
}

impl core::error::Error for Violations {}

/// A number that a parameter may hold.
pub(super) trait Number: Copy + core::str::FromStr {
    fn as_f64(self) -> f64;
}

impl Number for f64 {
    fn as_f64(self) -> f64 {
        self
    }
}

impl Number for u32 {
    fn as_f64(self) -> f64 {
        f64::from(self)
    }
}

/// Puts the number that `text` says into `slot`.
pub(super) fn assign_number<T: Number>(slot: &mut T, text: &str) -> Result<(), AssignError> {
    *slot = text.parse().map_err(|_| AssignError::NotAValue)?;
    Ok(())
}

/// Declares the parameters of a stage.
macro_rules! stage {
    ($(#[doc = $sdoc:literal])+ $stage:ident $table:literal {
        $($(#[doc = $doc:literal])+ $field:ident: $type:ty = $default:literal in $min:literal..=$max:literal, $unit:literal;)+
    }) => {
        $(#[doc = $sdoc])+
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
        pub struct $stage {
            $($(#[doc = $doc])+
            #[doc = concat!("\n\nUnit: ", $unit, ". Range: ", stringify!($min), " to ", stringify!($max), ". Default: ", stringify!($default), ".")]
            pub $field: $type,)+
        }

        impl Default for $stage {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        impl $stage {
            /// The parameters of this stage, for reference tables.
            pub const TABLE: &[$crate::params::ParamInfo] = &[$($crate::params::ParamInfo {
                stage: $table,
                name: stringify!($field),
                unit: $unit,
                default: $default as f64,
                min: $min as f64,
                max: $max as f64,
                doc: concat!($($doc,)+),
            },)+];

            pub(super) fn assign(
                &mut self,
                name: &str,
                text: &str,
            ) -> Result<(), $crate::params::AssignError> {
                match name {
                    $(stringify!($field) => {
                        $crate::params::stage::assign_number(&mut self.$field, text)
                    })+
                    _ => Err($crate::params::AssignError::UnknownKey),
                }
            }

            pub(super) fn check(&self, found: &mut $crate::params::Violations) {
                $(
                    let value = $crate::params::stage::Number::as_f64(self.$field);
                    let (min, max) = ($min as f64, $max as f64);
                    // Written so that a NaN is outside.
                    if !(value >= min && value <= max) {
                        found.push($crate::params::Violation {
                            stage: $table, name: stringify!($field), value, min, max,
                        });
                    }
                )+
            }
        }
    };
}
pub(super) use stage;
