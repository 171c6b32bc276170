//! The floating-point state of the host.
//!
//! A host may flush subnormals, round otherwise or trap. The core's results
//! would then differ in their last bits from those of every other host. So the
//! state is noticed, set to IEEE 754's default for the time of a call, and put
//! back as it was.

/// Results that are subnormal become zero (x86: MXCSR.FTZ; Arm: FPCR.FZ).
pub const FITMAC_FLOAT_FLUSH_TO_ZERO: u32 = 1;
/// Operands that are subnormal count as zero (x86: MXCSR.DAZ).
pub const FITMAC_FLOAT_DENORMALS_ZERO: u32 = 1 << 1;
/// Rounding is not to nearest.
pub const FITMAC_FLOAT_ROUNDING: u32 = 1 << 2;
/// Floating-point exceptions trap.
pub const FITMAC_FLOAT_TRAPS: u32 = 1 << 3;

/// How the calling thread computes: bits of `FITMAC_FLOAT_*`, 0 for IEEE 754's
/// default. Calls compute by the default in any case and put this state back.
#[unsafe(no_mangle)]
pub extern "C" fn fitmac_float_state() -> u32 {
    register::deviations(register::read())
}

/// Sets the default state as long as it lives.
pub(crate) struct DefaultState {
    host: register::Value,
    deviations: u32,
}

impl DefaultState {
    pub(crate) fn enter() -> Self {
        let host = register::read();
        let deviations = register::deviations(host);
        if deviations != 0 {
            register::write(register::defaulted(host));
        }
        Self { host, deviations }
    }

    /// What the host had that is not the default.
    pub(crate) const fn deviations(&self) -> u32 {
        self.deviations
    }
}

impl Drop for DefaultState {
    fn drop(&mut self) {
        if self.deviations != 0 {
            register::write(self.host);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod register {
    //! MXCSR (Intel SDM volume 1, section 10.2.3).
    use core::arch::asm;

    pub(super) type Value = u32;

    const FLUSH: u32 = 1 << 15;
    const ROUNDING: u32 = 0b11 << 13;
    const MASKS: u32 = 0b11_1111 << 7;
    const DENORMALS_ZERO: u32 = 1 << 6;

    pub(super) fn read() -> Value {
        let mut value = 0_u32;
        // SAFETY: stores four bytes to a local.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack, preserves_flags)) };
        value
    }

    pub(super) fn write(value: Value) {
        // SAFETY: the value was read from this register; only defined control
        // bits were changed. The default state is the one that Rust assumes.
        unsafe {
            asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack, preserves_flags))
        };
    }

    pub(super) const fn deviations(value: Value) -> u32 {
        let mut found = 0;
        if value & FLUSH != 0 {
            found |= super::FITMAC_FLOAT_FLUSH_TO_ZERO;
        }
        if value & DENORMALS_ZERO != 0 {
            found |= super::FITMAC_FLOAT_DENORMALS_ZERO;
        }
        if value & ROUNDING != 0 {
            found |= super::FITMAC_FLOAT_ROUNDING;
        }
        if value & MASKS != MASKS {
            found |= super::FITMAC_FLOAT_TRAPS;
        }
        found
    }

    pub(super) const fn defaulted(value: Value) -> Value {
        value & !(FLUSH | ROUNDING | DENORMALS_ZERO) | MASKS
    }
}

#[cfg(target_arch = "aarch64")]
mod register {
    //! FPCR (Arm ARM, section C5.2.8).
    use core::arch::asm;

    pub(super) type Value = u64;

    const FLUSH: u64 = 1 << 24 | 1 << 19;
    const ROUNDING: u64 = 0b11 << 22;
    const TRAPS: u64 = 0b1_1111 << 8 | 1 << 15;

    pub(super) fn read() -> Value {
        let value: u64;
        // SAFETY: reads a register.
        unsafe { asm!("mrs {}, fpcr", out(reg) value, options(nomem, nostack, preserves_flags)) };
        value
    }

    pub(super) fn write(value: Value) {
        // SAFETY: the value was read from this register; only defined control
        // bits were changed. The default state is the one that Rust assumes.
        unsafe { asm!("msr fpcr, {}", in(reg) value, options(nostack, preserves_flags)) };
    }

    pub(super) const fn deviations(value: Value) -> u32 {
        let mut found = 0;
        if value & FLUSH != 0 {
            found |= super::FITMAC_FLOAT_FLUSH_TO_ZERO;
        }
        if value & ROUNDING != 0 {
            found |= super::FITMAC_FLOAT_ROUNDING;
        }
        if value & TRAPS != 0 {
            found |= super::FITMAC_FLOAT_TRAPS;
        }
        found
    }

    pub(super) const fn defaulted(value: Value) -> Value {
        value & !(FLUSH | ROUNDING | TRAPS)
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
mod register {
    //! No known register: the host is taken to compute by the default.
    pub(super) type Value = ();

    pub(super) fn read() -> Value {}

    pub(super) fn write((): Value) {}

    pub(super) const fn deviations((): Value) -> u32 {
        0
    }

    pub(super) const fn defaulted((): Value) -> Value {}
}
