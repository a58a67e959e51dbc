//! The membranes on published obstacles are what their equations say.

use crate::{common::assembled, proved, solved};
use hlcp_core::Aor;
use hlcp_verify::Membrane;
use nalgebra::{DMatrix, DVector};

/// Bessel's J₀ by its power series, whose terms are at most 2e7 for x ≤ 20.
fn bessel(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..80 {
        term *= -x * x / 4.0 / f64::from(k * k);
        sum += term;
    }
    sum
}

/// The obstacle and the load on it, by place.
fn obstacle(spiral: bool, x: f64, y: f64) -> [f64; 2] {
    if !spiral {
        return [(bessel(20.0 * x) + 1.0) * (bessel(20.0 * y) + 1.0), 100.0];
    }
    let (rho, theta) = ((x * x + y * y).sqrt(), f64::atan2(y, x));
    let coil = f64::sin(2.0 * std::f64::consts::PI / rho + std::f64::consts::FRAC_PI_2 - theta);
    [coil + rho * (rho + 1.0) / (rho - 2.0) - 3.0 * rho + 3.6, 0.0]
}

/// In heights `u`: −Δu = load off the obstacle, and u on its side of it.
#[test]
fn a_membrane_is_free_or_on_its_obstacle() {
    for spiral in [true, false] {
        let m = 14; // no node is the spiral's centre
        let scene = Membrane { spiral, m };
        let (a, b, q) = scene.pose::<f64>().unwrap();
        let n = m * m;
        let dense = DMatrix::from_fn(n, n, |k, l| {
            let far = (k % m).abs_diff(l % m) + (k / m).abs_diff(l / m);
            [4.0, -1.0].get(far).copied().unwrap_or(0.0)
        });
        assert_eq!(assembled(&a), dense);
        assert_eq!(assembled(&b), DMatrix::identity(n, n));
        proved(&a, &b, &[Aor::gauss_seidel()]);

        let [z, r] = solved((a, b, q), "AMGS", 1e-12);
        let r = DVector::from_vec(r);
        let u = DVector::from_vec(scene.membrane(&z));
        let [low, side] = if spiral { [-1.0, 2.0] } else { [0.0, 1.0] };
        let h = side / (m + 1) as f64;
        let at = |k: usize| {
            let place = |i: usize| low + (i + 1) as f64 * h;
            obstacle(spiral, place(k % m), place(k / m))
        };
        let sign = if spiral { 1.0 } else { -1.0 };
        // The series loses eight digits, and the solve is to 1e-12 ‖q‖.
        for k in 0..n {
            assert!((sign * (u[k] - at(k)[0]) - z[k]).abs() < 1e-7);
        }
        let load = DVector::from_fn(n, |k, _| at(k)[1] * h * h);
        assert!((&dense * u - load - sign * &r).amax() < 1e-9);
        assert!(z.contains(&0.0) && r.iter().any(|&r| r == 0.0), "some contact and some not");
    }
}
