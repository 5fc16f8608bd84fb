//! Exact maps of the group of rotations with translations, SE_k(3), by which orientation, velocity, position and contact
//! points are one state (Hartley et al. 2019, arXiv 1904.09251, section II and appendix A).
//!
//! All of them are the series gamma_m(phi) = sum_n [phi]x^n / (n + m)!: gamma_0 is the rotation, gamma_1 SO(3)'s left Jacobian,
//! gamma_2 what a turning acceleration does to a position. Summed directly, so that small angles need no case of their own;
//! to machine precision up to a turn.

use nalgebra::{Matrix3, Vector3};

/// The matrix `[v]x` with `skew(v) * w = v x w`.
#[must_use]
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// gamma_`order` of the rotation vector `phi` (rad).
#[must_use]
pub fn gamma(order: u32, phi: &Vector3<f64>) -> Matrix3<f64> {
    let mut term = (1..=order).fold(1.0, |product, n| product / f64::from(n));
    let constant = term;
    let square = phi.norm_squared();
    // [phi]x^3 = -|phi|^2 [phi]x leaves two scalar series, of odd and of even powers.
    let (mut odd, mut even) = (0.0, 0.0);
    let mut n = order;
    loop {
        n += 1;
        term /= f64::from(n);
        odd += term;
        n += 1;
        term /= f64::from(n);
        even += term;
        term *= -square;
        if term.abs() <= 1e-18 * constant || !term.is_finite() || n > 60 {
            break;
        }
    }
    let k = skew(phi);
    Matrix3::from_diagonal_element(constant) + k * odd + k * k * even
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, SMatrix};
    use proptest::prelude::*;

    use super::*;

    fn vector(limit: f64) -> impl Strategy<Value = Vector3<f64>> {
        [-limit..limit, -limit..limit, -limit..limit].prop_map(Vector3::from)
    }

    proptest! {
        /// The first row of exp [[phi]x I 0; 0 0 I; 0 0 0] holds gamma 0, 1 and 2: nalgebra's Padé exponential is the oracle.
        #[test]
        fn gammas_are_blocks_of_a_dense_matrix_exponential(phi in vector(1.8)) {
            let mut a = SMatrix::<f64, 9, 9>::zeros();
            a.fixed_view_mut::<3, 3>(0, 0).copy_from(&skew(&phi));
            a.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
            a.fixed_view_mut::<3, 3>(3, 6).fill_with_identity();
            let exact = a.exp();
            for order in 0..3 {
                let block = exact.fixed_view::<3, 3>(0, 3 * order);
                prop_assert!((gamma(order as u32, &phi) - block).norm() < 1e-11);
            }
        }

        #[test]
        fn gamma_zero_is_the_rotation(phi in vector(3.0)) {
            prop_assert!((gamma(0, &phi) - Rotation3::new(phi).matrix()).norm() < 1e-11);
        }

        #[test]
        fn rotations_about_one_axis_add(phi in vector(1.0), share in 0.0..1.0) {
            let product = gamma(0, &(phi * share)) * gamma(0, &(phi * (1.0 - share)));
            prop_assert!((product - gamma(0, &phi)).norm() < 1e-12);
        }

        /// d/dt exp(t phi) by central differences: exp(-phi) d exp = gamma_1(-phi) d.
        #[test]
        fn gamma_one_is_the_jacobian_of_the_exponential(phi in vector(1.5), turn in vector(1.0)) {
            let step = 1e-5;
            let change = (gamma(0, &(phi + turn * step)) - gamma(0, &(phi - turn * step))) / (2.0 * step);
            prop_assert!((change - skew(&(gamma(1, &phi) * turn)) * gamma(0, &phi)).norm() < 1e-8);
        }
    }
}
