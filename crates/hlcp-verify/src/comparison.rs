//! The comparison matrices of the theorems, row by row from the operators.

use hlcp_core::{Error, Hlcp, Rows, Scalar, check_orders};

use crate::{
    perron::{Comparison, positive},
    rounding::{larger, mul_down, mul_up},
};

/// Walks row `i` in double precision.
///
/// An infinite entry comes as NaN, of which nothing is proved: infinity rounds down to a number.
pub(crate) fn visit<T: Scalar>(a: &impl Rows<T>, i: usize, mut each: impl FnMut(usize, f64)) {
    a.visit_row(i, &mut |j, v| each(j, if v.is_finite() { v.wide() } else { f64::NAN }));
}

/// Overwrites `row` with `(j, [aᵢⱼ, bᵢⱼ])` by increasing `j`, for every `j` that row `i` of either
/// operator has; what it has not is zero.
pub(crate) fn merge<T: Scalar>(
    (a, b): (&impl Rows<T>, &impl Rows<T>),
    i: usize,
    row: &mut Vec<(usize, [f64; 2])>,
) {
    row.clear();
    visit(a, i, |j, a| row.push((j, [a, 0.0])));
    let mut next = 0;
    visit(b, i, |j, b| {
        while next < row.len() && row[next].0 < j {
            next += 1;
        }
        match row.get_mut(next) {
            Some((column, entries)) if *column == j => entries[1] = b,
            _ => row.insert(next, (j, [0.0, b])),
        }
    });
}

/// Refuses operators that are no pair, or have an entry in no column.
pub(crate) fn check_pair<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> Result<(), Error> {
    a.check("A")?;
    b.check("B")?;
    let order = a.order();
    check_orders(order, &[("B", b.order())])?;
    let mut beyond = Ok(());
    for row in 0..order {
        let mut see = |what, column| {
            if column >= order && beyond.is_ok() {
                beyond = Err(Error::Outside { what, row, column, order });
            }
        };
        a.visit_row(row, &mut |column, _| see("row of A", column));
        b.visit_row(row, &mut |column, _| see("row of B", column));
    }
    beyond
}

/// Ω = D_A D_B⁻¹, rounded, if both diagonals are positive and so is it.
pub(crate) fn ratio<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> Option<Vec<f64>> {
    let ratio = |i| {
        let [a, b] = [a.diagonal_entry(i).wide(), b.diagonal_entry(i).wide()];
        positive(&[a, b, a / b]).then_some(a / b)
    };
    (0..a.order()).map(ratio).collect()
}

/// ⟨A⟩: `D = |D_A|`, `G = |C_A|`.
pub(crate) struct Modulus<'a, T>(pub(crate) &'a dyn Rows<T>);

impl<T: Scalar> Comparison for Modulus<'_, T> {
    fn order(&self) -> usize {
        self.0.order()
    }

    fn row(&self, _: usize, i: usize, g: &mut Vec<(usize, f64)>) -> f64 {
        g.clear();
        let mut d = 0.0;
        visit(&self.0, i, |j, a| if i == j { d = a.abs() } else { g.push((j, a.abs())) });
        d
    }
}

/// The matrix that `D = D_A + D_BΩ` is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Against {
    /// `G = D_BΩ + |C_A|`, as in (16).
    Paper,
    /// `G = max(D_A, D_BΩ) + |C_A|`: with `D − G = min(D_A, D_BΩ) − |C_A|`, condition (8).
    Condition8,
    /// `G = max(D_A, D_BΩ) + max(|C_A|, |C_B|Ω)`: with `D − G = C`, the relaxed theorem and the
    /// certificate.
    Pair,
}

/// `D_A + D_BΩ − G` for a pair with positive diagonals.
///
/// A diagonal entry that is not positive makes the row's `D` NaN: nothing is proved of it.
pub(crate) struct Coupled<'a, T> {
    pub(crate) a: &'a dyn Rows<T>,
    pub(crate) b: &'a dyn Rows<T>,
    /// The diagonal of Ω.
    pub(crate) omega: Vec<f64>,
    pub(crate) against: Against,
}

impl<'a, T: Scalar> Coupled<'a, T> {
    pub(crate) fn of(problem: &'a Hlcp<T, impl Rows<T>, impl Rows<T>>, against: Against) -> Self {
        let omega = (0..problem.order()).map(|i| problem.omega().entry(i).wide()).collect();
        Self { a: problem.a(), b: problem.b(), omega, against }
    }
}

impl<T: Scalar> Comparison for Coupled<'_, T> {
    fn order(&self) -> usize {
        self.a.order()
    }

    fn row(&self, _: usize, i: usize, g: &mut Vec<(usize, f64)>) -> f64 {
        // The diagonal entries, that of `B` rounded down.
        let ([mut a, mut b_omega], mut row) = ([0.0; 2], vec![]);
        merge((&self.a, &self.b), i, &mut row);
        g.clear();
        for (j, [of_a, of_b]) in row {
            let omega = self.omega[j];
            if i == j {
                (a, b_omega) = (of_a, mul_down(of_b, omega));
            } else if self.against == Against::Pair && of_b != 0.0 {
                g.push((j, larger(mul_up(of_b.abs(), omega), of_a.abs())));
            } else if of_a != 0.0 {
                g.push((j, of_a.abs()));
            }
        }
        if !(a > 0.0 && b_omega > 0.0) {
            return f64::NAN;
        }
        // One rounding of each: `d − g` in place of the exact minimum may be off, so `d` and `g`
        // give way.
        let part = match self.against {
            Against::Paper => b_omega.next_up().next_up(),
            Against::Condition8 | Against::Pair => a.max(b_omega.next_up().next_up()),
        };
        g.push((i, part));
        (a + b_omega).next_down()
    }
}

/// ⟨A⟩ᵀ and ⟨B⟩ᵀ, stored by columns because operators are walked by rows.
pub(crate) struct Transposed {
    columns: [Vec<Column>; 2],
}

#[derive(Clone, Default)]
struct Column {
    diagonal: f64,
    /// The moduli of the other entries, with their rows.
    off: Vec<(usize, f64)>,
    /// True if one of these entries is positive, or an entry no number.
    mixed: bool,
}

impl Transposed {
    pub(crate) fn new<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>) -> Self {
        Self { columns: [columns(a), columns(b)] }
    }

    /// Returns whether every entry is a finite number.
    pub(crate) fn is_finite(&self) -> bool {
        let is_sound = |column: &Column| {
            column.diagonal.is_finite() && column.off.iter().all(|(_, entry)| entry.is_finite())
        };
        self.columns.iter().flatten().all(is_sound)
    }

    /// Returns whether no entry of column `j` of A, or of B if `k` is 1, is positive beside the
    /// diagonal.
    pub(crate) fn is_z(&self, k: usize, j: usize) -> bool {
        !self.columns[k][j].mixed
    }
}

fn columns<T: Scalar>(a: &impl Rows<T>) -> Vec<Column> {
    let mut columns = vec![Column::default(); a.order()];
    for i in 0..a.order() {
        visit(a, i, |j, a| {
            let column = &mut columns[j];
            column.mixed |= a.is_nan() || i != j && a > 0.0;
            if i == j {
                column.diagonal = a;
            } else if a != 0.0 {
                column.off.push((i, a.abs()));
            }
        });
    }
    columns
}

impl Comparison for Transposed {
    fn order(&self) -> usize {
        self.columns[0].len()
    }

    fn row(&self, k: usize, i: usize, g: &mut Vec<(usize, f64)>) -> f64 {
        let Column { diagonal, off, .. } = &self.columns[k][i];
        g.clone_from(off);
        *diagonal
    }
}
