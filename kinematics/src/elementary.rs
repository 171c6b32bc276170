//! Elementary functions that give the same bits on every machine.
//!
//! Everything here is built from correctly rounded operations (`+ - * /` and `sqrt`), or comes
//! from `libm`. The platform's own trigonometry is never called: its last bits differ between
//! machines, and a replay has to agree bit for bit.

use libm::sqrt as root;

/// Square root, correctly rounded; NaN for a negative argument.
#[inline]
#[must_use]
pub fn sqrt(x: f64) -> f64 {
    root(x)
}

/// Square root of the positive part: 0 for a negative argument, which rounding can produce where
/// the exact value is 0 or slightly above. NaN gives 0.
#[inline]
#[must_use]
pub fn sqrt_pos(x: f64) -> f64 {
    root(x.max(0.0))
}

/// Angles taken at once.
const LANES: usize = 2;
/// 2/pi.
const TWO_OVER_PI: f64 = core::f64::consts::FRAC_2_PI;
/// Adding and subtracting 1.5 * 2^52 rounds to the nearest integer, ties to even.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
// pi/2 in two parts. The first has 33 significant bits, so that `n * PIO2_1` is exact for
// |n| < 2^20; the second is the rest (FreeBSD msun, e_rem_pio2.c, public constants).
const PIO2_1: f64 = 1.570_796_326_734_125_6;
const PIO2_1T: f64 = 6.077_100_506_506_192e-11;
/// Largest magnitude that the short argument reduction serves; beyond it `libm` is called.
pub(crate) const SHORT_REDUCTION_MAX: f64 = 1.0e6;

// Minimax polynomials on [-pi/4, pi/4] (FreeBSD msun, k_sin.c and k_cos.c, public constants).
const S1: f64 = -1.666_666_666_666_663_2e-1;
const S2: f64 = 8.333_333_333_322_49e-3;
const S3: f64 = -1.984_126_982_985_795e-4;
const S4: f64 = 2.755_731_370_707_007e-6;
const S5: f64 = -2.505_076_025_340_686_3e-8;
const S6: f64 = 1.589_690_995_211_55e-10;
const C1: f64 = 4.166_666_666_666_66e-2;
const C2: f64 = -1.388_888_888_887_411e-3;
const C3: f64 = 2.480_158_728_947_673e-5;
const C4: f64 = -2.755_731_435_139_066_3e-7;
const C5: f64 = 2.087_572_321_298_175e-9;
const C6: f64 = -1.135_964_755_778_819_5e-11;

/// Applies `f` to every lane.
#[inline(always)]
fn lanes<const L: usize>(f: impl Fn(usize) -> f64) -> [f64; L] {
    let mut out = [0.0; L];
    for (l, x) in out.iter_mut().enumerate() {
        *x = f(l);
    }
    out
}

/// Sines and cosines of `L` angles in radians, each of at most [`SHORT_REDUCTION_MAX`]. Written
/// step by step over all lanes, so that the processor's vectors take several at once.
#[inline(always)]
fn sincos_lanes<const L: usize>(x: [f64; L]) -> ([f64; L], [f64; L]) {
    let shifted: [f64; L] = lanes(|l| x[l] * TWO_OVER_PI + ROUNDER);
    let n: [f64; L] = lanes(|l| shifted[l] - ROUNDER);
    let r: [f64; L] = lanes(|l| (x[l] - n[l] * PIO2_1) - n[l] * PIO2_1T);
    let z: [f64; L] = lanes(|l| r[l] * r[l]);
    let w: [f64; L] = lanes(|l| z[l] * z[l]);
    let s: [f64; L] = lanes(|l| {
        let (z, w) = (z[l], w[l]);
        let tail = (S1 + z * S2) + w * ((S3 + z * S4) + w * (S5 + z * S6));
        r[l] + (z * r[l]) * tail
    });
    let c: [f64; L] = lanes(|l| {
        let (z, w) = (z[l], w[l]);
        let tail = (C1 + z * C2) + w * ((C3 + z * C4) + w * (C5 + z * C6));
        1.0 - (0.5 * z - w * tail)
    });
    // The integer sits in the low bits of the significand. Odd quadrants exchange sine and
    // cosine; the signs follow bit 1 of n and of n + 1.
    let (mut sines, mut cosines) = ([0.0; L], [0.0; L]);
    for l in 0..L {
        let quadrant = shifted[l].to_bits();
        let swap = (quadrant & 1).wrapping_neg();
        let mix = (s[l].to_bits() ^ c[l].to_bits()) & swap;
        let sin_sign = (quadrant & 2) << 62;
        let cos_sign = (quadrant.wrapping_add(1) & 2) << 62;
        sines[l] = f64::from_bits((s[l].to_bits() ^ mix) ^ sin_sign);
        cosines[l] = f64::from_bits((c[l].to_bits() ^ mix) ^ cos_sign);
    }
    (sines, cosines)
}

/// Sine and cosine of an angle in radians, for |x| up to [`SHORT_REDUCTION_MAX`].
#[inline(always)]
fn sincos_short(x: f64) -> (f64, f64) {
    let ([s], [c]) = sincos_lanes([x]);
    (s, c)
}

/// Sine and cosine of an angle in radians, in this order.
///
/// Absolute error below 2.3e-16 for |x| up to 1e6 rad; `libm` beyond; NaN for NaN and infinity.
#[inline]
#[must_use]
pub fn sincos(x: f64) -> (f64, f64) {
    if x.abs() <= SHORT_REDUCTION_MAX {
        sincos_short(x)
    } else {
        libm::sincos(x)
    }
}

/// Sines and cosines of `N` angles of at most [`SHORT_REDUCTION_MAX`]; without a branch.
#[inline(always)]
pub(crate) fn sincos_each_short<const N: usize>(angles: &[f64; N]) -> ([f64; N], [f64; N]) {
    let mut sines = [0.0; N];
    let mut cosines = [0.0; N];
    let (pairs, rest) = angles.as_chunks();
    let (sine_pairs, sine_rest) = sines.as_chunks_mut();
    let (cosine_pairs, cosine_rest) = cosines.as_chunks_mut();
    for ((x, s), c) in pairs.iter().zip(sine_pairs).zip(cosine_pairs) {
        (*s, *c) = sincos_lanes::<LANES>(*x);
    }
    for ((x, s), c) in rest.iter().zip(sine_rest).zip(cosine_rest) {
        (*s, *c) = sincos_short(*x);
    }
    (sines, cosines)
}

/// Sines and cosines of `N` angles in radians: the same bits as [`sincos`], in less time.
#[inline]
#[must_use]
pub fn sincos_each<const N: usize>(angles: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sines, mut cosines) = sincos_each_short(angles);
    let largest = angles.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest > SHORT_REDUCTION_MAX {
        for ((x, s), c) in angles.iter().zip(&mut sines).zip(&mut cosines) {
            (*s, *c) = sincos(*x);
        }
    }
    (sines, cosines)
}

/// Angle of the vector (`x`, `y`) in radians, in (-pi, pi].
#[inline]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Arc cosine in radians; arguments outside [-1, 1] are clamped to it.
#[inline]
#[must_use]
pub fn acos_clamped(x: f64) -> f64 {
    libm::acos(x.clamp(-1.0, 1.0))
}

/// Arc sine in radians; arguments outside [-1, 1] are clamped to it.
#[inline]
#[must_use]
pub fn asin_clamped(x: f64) -> f64 {
    libm::asin(x.clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sincos_agrees_with_libm() {
        let mut x = -9.0e5;
        let mut worst = 0.0_f64;
        while x < 9.0e5 {
            let (s, c) = sincos(x);
            let (ls, lc) = libm::sincos(x);
            worst = worst.max((s - ls).abs()).max((c - lc).abs());
            x += 1.234_567 + 1e-3 * x.abs();
            x += 0.001 * (x * 7.0) % 1.0;
        }
        for i in -40_000..40_000 {
            let x = f64::from(i) * 2.5e-4;
            let (s, c) = sincos(x);
            let (ls, lc) = libm::sincos(x);
            worst = worst.max((s - ls).abs()).max((c - lc).abs());
        }
        assert!(worst < 2.3e-16, "worst {worst:e}");
    }

    #[test]
    fn sincos_each_gives_the_bits_of_sincos() {
        for angles in [[0.0, 1.0, -3.0, 1e9], [f64::NAN, 0.5, f64::INFINITY, -7.25]] {
            let (s, c) = sincos_each(&angles);
            for i in 0..4 {
                let (es, ec) = sincos(angles[i]);
                if angles[i].is_finite() {
                    assert_eq!(
                        (s[i].to_bits(), c[i].to_bits()),
                        (es.to_bits(), ec.to_bits())
                    );
                } else {
                    assert!(s[i].is_nan() && c[i].is_nan() && es.is_nan() && ec.is_nan());
                }
            }
        }
    }
}
