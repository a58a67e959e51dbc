//! The dam is its balance of water, and has the discharge and the free boundary that are known.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::{Balance, bearing2d::bisect, common::assembled, proved, solved};
use hlcp_core::Aor;
use hlcp_verify::{Dam, Proof};
use nalgebra::DVector;

fn face_by_face(dam: Dam) -> Balance {
    let Dam { nx, ny, length, tail, layer } = dam;
    let (hx, hy) = (length / (nx + 1) as f64, 1.0 / ny as f64);
    let mut balance = Balance::new(nx * ny);
    // Columns are counted from 1; 0 and nx + 1 are the faces of the dam.
    let cell = |i: usize, j: usize| (1..=nx).contains(&i).then(|| j * nx + i - 1);
    let soil = |j: usize| if 1.0 - (j as f64 + 0.5) * hy < 0.5 { layer } else { 1.0 };
    for (i, j) in (0..=nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
        let (height, side) = (1.0 - (j as f64 + 0.5) * hy, soil(j) * hy / hx);
        balance.drive([cell(i, j), cell(i + 1, j)], side);
        if i == 0 {
            balance.q[j * nx] -= side * (1.0 - height);
        }
        let Some(k) = cell(i, j) else { continue };
        if i == nx {
            balance.q[k] -= side * f64::max(tail - height, 0.0);
        }
        // Through the floor, of which the base alone has nothing.
        if j + 1 == ny {
            balance.b[(k, k)] += soil(j) * hx;
        } else {
            let drive = hx / (hy / 2.0 / soil(j) + hy / 2.0 / soil(j + 1));
            let floor = [Some(k), cell(i, j + 1)];
            balance.drive(floor, drive);
            balance.carry(floor, drive * hy);
        }
    }
    balance
}

/// Both soils, and a length that is not 1.
pub(crate) const LAYERED: Dam = Dam { nx: 5, ny: 6, length: 1.7, tail: 0.4, layer: 3.0 };

#[test]
fn the_dam_is_its_balance_of_water() {
    let (a, b, q) = LAYERED.pose::<f64>().unwrap();
    let balance = face_by_face(LAYERED);
    // Sums of at most six terms, each rounded a few times.
    let rounding = 32.0 * f64::EPSILON * balance.a.amax();
    assert!((assembled(&a) - balance.a).amax() <= rounding);
    assert!((assembled(&b) - balance.b).amax() <= rounding);
    assert!((DVector::from_vec(q) - balance.q).amax() <= rounding);
    assert_eq!(proved(&a, &b, &[Aor::gauss_seidel().accelerated()]), Proof::Columns);
}

/// Between reservoirs of one height the water rests: its pressure is its depth, whatever the soil.
#[test]
fn water_at_rest_is_exact() {
    for (layer, ny) in [(0.05, 8), (3.0, 15)] {
        let dam = Dam { ny, layer, tail: 1.0, ..LAYERED };
        let [z, r] = solved(dam.pose().unwrap(), "AMG", 1e-12);
        for (k, (z, r)) in z.into_iter().zip(r).enumerate() {
            let depth = ((k / dam.nx) as f64 + 0.5) / ny as f64;
            // The least eigenvalue of A is above 1e-3.
            assert!((z - depth).abs() <= 1e-8 && r == 0.0, "{layer}, {k}: {z} for {depth}");
        }
    }
}

/// For one soil and for two, whatever the method; the base is wet, and no cell is drier than dry.
#[test]
fn the_discharge_is_exact_on_every_grid() {
    let coarse = Dam { nx: 7, ny: 20, ..LAYERED };
    for (dam, methods) in [
        (coarse, &["AUTO", "AMG", "NEWTON", "ADAPTIVE", "MGS", "AMGS", "TMGS", "ANDERSON"][..]),
        (Dam { layer: 0.05, ..coarse }, &["AUTO", "AMG"]),
        (Dam { nx: 60, layer: 1.0, tail: 0.75, ..coarse }, &["AUTO", "AMG"]),
        (Dam { tail: 0.0, ..coarse }, &["AUTO", "AMG"]),
    ] {
        for method in methods {
            let [z, r] = solved(dam.pose().unwrap(), method, 1e-12);
            let error = dam.discharge(&z) - dam.exact_discharge();
            // A residual δ of all cells is as much water made or lost, and its norm is at most
            // 1e-12 ‖q‖ < 1e-12 n max |q|.
            let q = dam.pose::<f64>().unwrap().2;
            let largest = q.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
            let lost = 1e-12 * q.len() as f64 * largest * (q.len() as f64).sqrt();
            assert!(error.abs() <= lost, "{method} on {dam:?}: off by {error:e}");
            assert!(z[(dam.ny - 1) * dam.nx..].iter().all(|&z| z > 0.0));
            assert!(r.iter().all(|&r| r <= 1.0 + 1e-9));
        }
    }
}

/// The complete elliptic integral K of the parameter m = k², by the arithmetic-geometric mean, for
/// 1 − m.
fn elliptic(rest: f64) -> f64 {
    let (mut a, mut g) = (1.0, rest.sqrt());
    while (a - g).abs() > 1e-15 * a {
        (a, g) = ((a + g) / 2.0, (a * g).sqrt());
    }
    PI / (2.0 * a)
}

/// ∫ f from 0 to `end`; t = s³ makes what is singular at 0 smooth enough for the midpoint rule.
fn integral(end: f64, f: impl Fn(f64) -> f64) -> f64 {
    const PARTS: usize = 20_000;
    let top = end.cbrt();
    let term = |k: usize| {
        let s = (k as f64 + 0.5) / PARTS as f64 * top;
        3.0 * s * s * f(s.powi(3))
    };
    (0..PARTS).map(term).sum::<f64>() * top / PARTS as f64
}

/// Polubarinova-Kochina's dam for the parameters α and β: its length and tailwater over the depth
/// upstream, and the free boundary as `x ↦ y`, by bisection of its parameter.
fn polubarinova_kochina(alpha: f64, beta: f64) -> ([f64; 2], impl Fn(f64) -> f64) {
    let sin2 = |t: f64| t.sin().powi(2);
    let of_face = move |t: f64| (1.0 - alpha * sin2(t)) * (1.0 - beta * sin2(t));
    let length = integral(FRAC_PI_2, |t| {
        let m = alpha + (beta - alpha) * sin2(t);
        elliptic(1.0 - m) / (1.0 - m).sqrt()
    });
    let tail = integral(FRAC_PI_2, |t| {
        let m = alpha * sin2(t);
        alpha.sqrt() * elliptic(1.0 - m) * t.sin() / ((1.0 - m) * (beta - m)).sqrt()
    });
    let seeping = integral(FRAC_PI_2, |t| {
        let under = (1.0 - (1.0 - alpha) * sin2(t)) * (1.0 - (1.0 - beta) * sin2(t));
        elliptic(sin2(t)) * t.sin() * t.cos() / under.sqrt()
    });
    let rise = move |end: f64| integral(end, |t| elliptic(sin2(t)) * t.sin() / of_face(t).sqrt());
    // Singular at π/2, where the substitution is turned round.
    let run = move |end: f64| {
        let f = |t: f64| elliptic(t.cos().powi(2)) * t.sin() / of_face(t).sqrt();
        let from_end = |end: f64| integral(end, |t| f(FRAC_PI_2 - t));
        from_end(FRAC_PI_2) - from_end(FRAC_PI_2 - end)
    };
    let whole = tail + seeping + rise(FRAC_PI_2);
    let boundary = move |x: f64| {
        let at = bisect(0.0, FRAC_PI_2, |t| (length - run(t)) / whole - x);
        (tail + seeping + rise(at)) / whole
    };
    ([length / whole, tail / whole], boundary)
}

/// The published square dam with tailwater of half the depth, and the one of 16 by 24 with 4.
#[test]
fn the_free_boundary_is_polubarinova_kochinas() {
    for (length, tail, [alpha, beta]) in [
        (1.0, 0.5, [0.937_659_133_932_445_8, 0.986_225_435_477_297_4]),
        (2.0 / 3.0, 1.0 / 6.0, [0.095_283_828_901_406_67, 0.465_881_284_199_431]),
    ] {
        let (found, boundary) = polubarinova_kochina(alpha, beta);
        assert!((found[0] - length).abs() < 1e-6 && (found[1] - tail).abs() < 1e-6, "{found:?}");
        for ny in [48, 96] {
            let dam = Dam { nx: ny - 1, ny, length, tail, layer: 1.0 };
            let [_, r] = solved(dam.pose().unwrap(), "AUTO", 1e-12);
            let heights = dam.heights(&r);
            for share in [4, 2] {
                let exact = boundary(length / share as f64);
                let error = heights[ny / share - 1] - exact;
                // A front is as wide as a cell.
                assert!(error.abs() <= 1.0 / ny as f64, "{dam:?} at 1/{share}: off by {error}");
            }
        }
    }
}
