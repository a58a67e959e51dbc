//! The two-dimensional bearing is its balance, keeps it, and has the published loads.

use std::f64::consts::{PI, TAU};

use crate::{
    Balance,
    common::{assembled, by_tmgs, problem, scattered},
    proved, solved,
};
use approx::assert_abs_diff_eq;
use hlcp_core::{Aor, Diagonal};
use hlcp_verify::{Bearing2d, Convergence, Proof, convergence};
use nalgebra::DVector;

fn face_by_face(scene: Bearing2d) -> Balance {
    let Bearing2d { nx, ny, ecc, aspect, groove } = scene;
    let (hx, hy) = (TAU / (nx + 1) as f64, 2.0 / (ny + 1) as f64);
    let gap = |points: f64| 1.0 + ecc * f64::cos(groove + points * hx);
    let mut balance = Balance::new(nx * ny);
    // Points are counted from 1; 0, nx + 1 and ny + 1 are the boundary.
    let cell = |i: usize, j: usize| {
        ((1..=nx).contains(&i) && (1..=ny).contains(&j)).then(|| (j - 1) * nx + i - 1)
    };
    for (i, j) in (0..=nx).flat_map(|i| (0..=ny).map(move |j| (i, j))) {
        let h = gap(i as f64 + 0.5);
        if j > 0 {
            let face = [cell(i, j), cell(i + 1, j)];
            balance.drive(face, h.powi(3) * hy / hx);
            balance.carry(face, h * hy);
        }
        if i > 0 {
            let conductance = gap(i as f64).powi(3) * hx / hy / (aspect * aspect);
            balance.drive([cell(i, j), cell(i, j + 1)], conductance);
        }
    }
    balance
}

#[test]
fn the_bearing_is_its_balance_of_oil() {
    let scene = Bearing2d { nx: 6, ny: 4, ecc: 0.7, aspect: 0.8, groove: 1.1 };
    let (a, b, q) = scene.pose::<f64>().unwrap();
    let Balance { a: dense_a, b: dense_b, q: dense_q } = face_by_face(scene);
    assert!((assembled(&a) - &dense_a).amax() <= 8.0 * f64::EPSILON * dense_a.amax());
    assert!((assembled(&b) - &dense_b).amax() <= 8.0 * f64::EPSILON * dense_b.amax());
    assert!((DVector::from_vec(q) - &dense_q).amax() <= 8.0 * f64::EPSILON);
    // What all cells together lose, for any z and r, is what is drawn less what returns and what
    // the ends take.
    let any = |seed: f64| DVector::from_vec(scattered(24, seed));
    let (z, r) = (any(12.9898), any(78.233));
    let lost = (&dense_a * &z - &dense_b * &r + &dense_q).sum();
    let [drawn, returned, ends] = scene.flows(z.as_slice(), r.as_slice());
    // 24 cells with seven terms each.
    let rounding = 168.0 * f64::EPSILON * dense_a.amax();
    assert_abs_diff_eq!(returned + ends - drawn, lost, epsilon = rounding);
    // Through the faces beside the groove.
    let (hx, hy) = (TAU / 7.0, 2.0 / 5.0);
    let [first, last] = [0.5, 6.5].map(|points| 1.0 + 0.7 * f64::cos(1.1 + points * hx));
    let passed = (0..4).fold([0.0; 2], |[into, out], j| {
        let carried = (1.0 - r[6 * j + 5]) * last;
        let pushed = [-first.powi(3) * z[6 * j] / hx, last.powi(3) * z[6 * j + 5] / hx];
        [into + hy * (first + pushed[0]), out + hy * (carried + pushed[1])]
    });
    assert_abs_diff_eq!(drawn, passed[0], epsilon = rounding);
    assert_abs_diff_eq!(returned, passed[1], epsilon = rounding);
    let (narrow, _, _) = scene.pose::<f32>().unwrap();
    for i in 0..24 {
        let (narrow, wide) = (f64::from(narrow.diagonal_entry(i)), dense_a[(i, i)]);
        assert_abs_diff_eq!(narrow, wide, epsilon = f64::from(f32::EPSILON) * wide);
    }
}

/// Ocvirk's short bearing, L/D → 0, where circumferential pressure flow does not matter.
#[test]
fn the_short_bearing_is_ocvirks() {
    let (ecc, aspect) = (0.5_f64, 0.02);
    let scene = Bearing2d { nx: 63, ny: 31, ecc, aspect, groove: 0.0 };
    let (a, b, q) = scene.pose::<f64>().unwrap();
    let [z, _] = by_tmgs(a, b, &q);
    let root = (1.0 - ecc * ecc).sqrt();
    let attitude = (PI * root / (4.0 * ecc)).atan().to_degrees();
    let bow = (PI * PI * root * root + 16.0 * ecc * ecc).sqrt();
    let sommerfeld = root.powi(4) / (PI * ecc * bow * aspect * aspect);
    // (L/D)² and h² of each.
    assert_abs_diff_eq!(scene.attitude(&z), attitude, epsilon = 0.2);
    assert_abs_diff_eq!(scene.sommerfeld(&z) / sommerfeld, 1.0, epsilon = 0.005);
}

/// `∫ (H − J)/H³` by Simpson's rule.
fn rise(ecc: f64, flux: f64, from: f64, to: f64) -> f64 {
    let slope = |x: f64| {
        let h = 1.0 + ecc * x.cos();
        (h - flux) / h.powi(3)
    };
    let panels = 2000;
    let step = (to - from) / (2 * panels) as f64;
    let inner = |k: usize| slope(from + k as f64 * step) * if k % 2 == 1 { 4.0 } else { 2.0 };
    step / 3.0 * (slope(from) + slope(to) + (1..2 * panels).map(inner).sum::<f64>())
}

pub(crate) fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let sign = f(low) > 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == sign { low = middle } else { high = middle }
    }
    low
}

/// Against the long bearing's film with the flux J, full between two angles: the largest error of z
/// in units of the largest z, that of r where both films are broken and stay so, and the length on
/// which one film is full and the other is not.
fn long_bearing(cells: usize, groove: f64, flux: f64, full: [f64; 2]) -> [f64; 3] {
    let ecc = 0.6;
    let scene = Bearing2d { nx: cells - 1, ny: 1, ecc, aspect: 1e6, groove };
    let [z, r] = solved(scene.pose().unwrap(), "PIVOTING", 1e-11);
    let h = TAU / cells as f64;
    let (mut peak, mut off_z, mut off_r, mut length) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0);
    for i in 0..cells - 1 {
        let x = groove + (i + 1) as f64 * h;
        let inside = full[0] < x && x < full[1];
        let exact = if inside { rise(ecc, flux, full[0], x) } else { 0.0 };
        peak = peak.max(exact);
        off_z = off_z.max((z[i] - exact).abs());
        if inside != (z[i] > 0.0) {
            length += h;
        } else if !inside && z.get(i + 1).is_none_or(|&z| z == 0.0) {
            // The void of a cell is carried through the face after it; a cell before a film fills
            // up.
            off_r = off_r.max((r[i] - 1.0 + flux / (1.0 + ecc * (x + 0.5 * h).cos())).abs());
        }
    }
    [off_z / peak, off_r, length]
}

/// L/D → ∞ with the groove at the widest gap: rupture where Sommerfeld's integral says, z and r to
/// second order.
#[test]
fn the_long_bearing_ruptures_where_it_should() {
    let end = bisect(PI, TAU, |end| rise(0.6, 1.0 + 0.6 * f64::cos(end), 0.0, end));
    let flux = 1.0 + 0.6 * f64::cos(end);
    let coarse = long_bearing(48, 0.0, flux, [0.0, end]);
    let fine = long_bearing(192, 0.0, flux, [0.0, end]);
    assert!(coarse[2] <= TAU / 48.0 * 1.01 && fine[2] <= TAU / 192.0 * 1.01, "{coarse:?} {fine:?}");
    for k in [0, 1] {
        // Four times as fine: sixteenths, give or take where the film ends within a cell.
        let order = (coarse[k] / fine[k]).log2() / 2.0;
        assert!((1.5..2.8).contains(&order) && fine[k] < 1e-3, "{coarse:?} {fine:?}");
    }
}

/// L/D → ∞ with the groove where the gap widens: the film breaks up at once and forms again where
/// it can end at the groove. To first order: the groove's flux is that of the face half a cell
/// after it.
#[test]
fn the_long_bearings_film_forms_again() {
    let groove = 3.8;
    let flux = 1.0 + 0.6 * f64::cos(groove);
    let end = groove + TAU;
    // Between the groove and where the gap is J again on the way to the narrowest.
    let start = bisect(groove, 2.0 * TAU - groove, |start| rise(0.6, flux, start, end));
    let [coarse, fine] = [96, 384].map(|cells| long_bearing(cells, groove, flux, [start, end]));
    for k in 0..3 {
        let order = (coarse[k] / fine[k]).log2() / 2.0;
        assert!((0.7..1.6).contains(&order), "{coarse:?} {fine:?}");
    }
    assert!(fine[1] < 0.01, "{fine:?}");
}

/// One solution for every q is proved, and that accelerated Gauss–Seidel forward and backward finds
/// it; of plain Gauss–Seidel it is not.
#[test]
fn the_bearings_solution_is_proved_unique() {
    for groove in [0.0, 3.8] {
        let scene = Bearing2d { nx: 31, ny: 9, ecc: 0.6, aspect: 1.0, groove };
        let (a, b, _) = scene.pose::<f64>().unwrap();
        let (plain, fast) = (Aor::gauss_seidel(), Aor::gauss_seidel().accelerated());
        assert_eq!(proved(&a, &b, &[fast, fast.backward()]), Proof::Columns);
        let found = convergence(&problem(1.0, a, b), &[plain]);
        assert!(matches!(found, Convergence::NotProved(_)));
    }
}
