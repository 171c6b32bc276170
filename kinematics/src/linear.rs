//! Small symmetric systems.

use crate::elementary::sqrt;

/// The lower factor `L` of a symmetric positive definite matrix `L L^T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cholesky<const M: usize> {
    lower: [[f64; M]; M],
}

#[expect(
    clippy::needless_range_loop,
    reason = "triangular loops read best as in the textbook"
)]
impl<const M: usize> Cholesky<M> {
    /// Factors a symmetric matrix; `None` where it is not positive definite to working precision,
    /// or not finite.
    pub(crate) fn of(matrix: &[[f64; M]; M]) -> Option<Self> {
        let mut lower = [[0.0; M]; M];
        let largest = (0..M).fold(0.0_f64, |m, i| m.max(matrix[i][i]));
        for i in 0..M {
            for j in 0..=i {
                let mut sum = matrix[i][j];
                for k in 0..j {
                    sum -= lower[i][k] * lower[j][k];
                }
                if i == j {
                    // Written so that NaN fails too.
                    let definite = sum > largest * 1e-15 && sum.is_finite();
                    if !definite {
                        return None;
                    }
                    lower[i][i] = sqrt(sum);
                } else {
                    lower[i][j] = sum / lower[j][j];
                }
            }
        }
        Some(Self { lower })
    }

    /// The solution `x` of `L L^T x = b`.
    pub(crate) fn solve(&self, b: &[f64; M]) -> [f64; M] {
        let mut x = *b;
        for i in 0..M {
            for k in 0..i {
                x[i] -= self.lower[i][k] * x[k];
            }
            x[i] /= self.lower[i][i];
        }
        for i in (0..M).rev() {
            for k in i + 1..M {
                x[i] -= self.lower[k][i] * x[k];
            }
            x[i] /= self.lower[i][i];
        }
        x
    }

    /// Square root of the determinant.
    pub(crate) fn root_determinant(&self) -> f64 {
        (0..M).fold(1.0, |d, i| d * self.lower[i][i])
    }
}
