use std::borrow::Cow;

use thiserror::Error;

/// Input that cannot be solved as it stands, with the numbers that are wrong.
///
/// In all of them `what` names the thing that is wrong. An iteration that ends without converging
/// is *not* an error; it is an outcome.
///
/// ```
/// use hlcp_core::{Error, Rhs};
///
/// let error = Rhs::new(&[1.0, f64::NAN]).unwrap_err();
/// assert!(matches!(error, Error::NotFinite { what: "q", index: 1, .. }));
/// assert_eq!(error.to_string(), "q[1] is NaN, which is not a finite number");
/// ```
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// The problem has no unknowns.
    #[error("{what} has order 0, but a problem needs at least one unknown")]
    Empty {
        /// The name of the empty thing.
        what: &'static str,
    },
    /// A grid has no points, or more than an array can hold.
    #[error(
        "the grid has {nx} x {ny} points, but it needs at least one, and at most as many as an array can hold"
    )]
    Grid {
        /// The points in a row.
        nx: usize,
        /// The rows.
        ny: usize,
    },
    /// A matrix is not square.
    #[error("{what} has {rows} rows and {columns} columns, but it must be square")]
    NotSquare {
        /// The operator that the matrix is given for.
        what: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// An operator is a sum of operators of two orders.
    #[error(
        "{what} is a sum of operators of orders {} and {}, but these must agree",
        orders[0],
        orders[1]
    )]
    Summands {
        /// The operator that the sum is given for.
        what: &'static str,
        /// The orders of the two.
        orders: [usize; 2],
    },
    /// A row has an entry that no five-point operator on the grid has.
    #[error(
        "row {row} has an entry in column {column}, which is no neighbour of point {row} on a grid \
         of {nx} x {ny} points, numbered from 0 row by row"
    )]
    OffGrid {
        /// The row.
        row: usize,
        /// The column of the entry.
        column: usize,
        /// The points in a row of the grid.
        nx: usize,
        /// The rows of the grid.
        ny: usize,
    },
    /// An offset or a column is not that of a square matrix with sorted rows.
    #[error("{what}[{index}] is {value}, but it must be {must}")]
    Index {
        /// The array.
        what: &'static str,
        /// The place in it.
        index: usize,
        /// The number there.
        value: i64,
        /// What it must be.
        must: &'static str,
    },
    /// A row of an operator has an entry in no column.
    #[error(
        "{what}[{row}] has an entry in column {column}, but the order is {order}; \
         hlcp_core::check_operator says what else an operator contradicts"
    )]
    Outside {
        /// The operator's rows.
        what: &'static str,
        /// The row.
        row: usize,
        /// The column.
        column: usize,
        /// The operator's order.
        order: usize,
    },
    /// Two things that must share an order do not.
    #[error("{what} has order {found}, but the problem has order {expected}")]
    Order {
        /// The name of the thing with the wrong order.
        what: &'static str,
        /// Its order.
        found: usize,
        /// The order of the rest of the problem.
        expected: usize,
    },
    /// An entry is NaN or infinite.
    #[error("{what}[{index}] is {value}, which is not a finite number")]
    NotFinite {
        /// The vector or list of coefficients.
        what: &'static str,
        /// The index of the entry.
        index: usize,
        /// The entry.
        value: f64,
    },
    /// An entry that must be positive and finite is not: of Ω, or of a diagonal that is divided by.
    #[error("{what}[{index}] is {}, but it must be positive and finite{}", number(*value), way_out(what, *value))]
    NotPositive {
        /// The vector or diagonal.
        what: &'static str,
        /// The index of the entry.
        index: usize,
        /// The entry.
        value: f64,
    },
    /// An operator does not answer [`as_five_point`](crate::LinearOperator::as_five_point), or not
    /// on the grid of the other one.
    #[error(
        "{what} is not known as a five-point operator on the grid of the other one, which this \
         method needs; build it as one, or take a method that needs no grid, such as AUTO or AMG"
    )]
    NotFivePoint {
        /// The operator.
        what: &'static str,
    },
    /// An operator contradicts itself, as [`check_operator`](crate::check_operator) finds out.
    #[error(
        "{what} is {found} in row {row}, but the row that visit_row visits makes it {expected}"
    )]
    Contradiction {
        /// What contradicts the operator's rows.
        what: &'static str,
        /// The row.
        row: usize,
        /// What was found.
        found: f64,
        /// What the row makes it.
        expected: f64,
    },
    /// An operator refuses itself, in its own words.
    #[error("{what}: {why}")]
    Operator {
        /// The operator.
        what: &'static str,
        /// The reason.
        why: Cow<'static, str>,
    },
    /// A method, or an order of its sweeps, that one rank alone can work with.
    #[error(
        "{what} works on one rank, but {ranks} share the problem; take AUTO, multigrid, adaptive \
         SOR, Anderson or a method of the paper on five-point operators, or one rank"
    )]
    OneRank {
        /// What works on one rank.
        what: &'static str,
        /// How many there are.
        ranks: usize,
    },
    /// Another rank was refused.
    #[error("on rank {rank}, {error}")]
    Rank {
        /// The rank.
        rank: usize,
        /// Its error.
        error: String,
    },
    /// The ranks were given different things.
    #[error("{what} differ between the ranks, but each must be given the same")]
    Differ {
        /// What differs.
        what: &'static str,
    },
    /// A method would need more memory or time than it may.
    #[error(
        "{what} might take {needed:.1e} {unit}, but at most {most:.1e} are allowed; take a method \
         that stores no factors, such as AUTO or AMG"
    )]
    TooLarge {
        /// What would be that large.
        what: &'static str,
        /// How many it would take.
        needed: f64,
        /// How many are allowed.
        most: f64,
        /// What is counted.
        unit: &'static str,
    },
    /// A parameter is outside its range.
    #[error("{name} is {}, but it must be {range}", number(*value))]
    Parameter {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The condition that it must meet.
        range: &'static str,
    },
}

/// Returns the way out of an entry that is not positive.
fn way_out(what: &str, value: f64) -> &'static str {
    match what {
        "diagonal of B" if value < 0.0 => {
            "; the problem is A z − B r + q = 0, so that of A z + B r + q = 0 takes −B; where B is \
             meant, Ω must be given, as 1"
        }
        "diagonal of A" | "diagonal of B" if value <= 0.0 => {
            "; AUTO and PIVOTING need no such pivots"
        }
        "diagonal of M" if value <= 0.0 => {
            "; it is made of those of A and BΩ: a larger Ω helps where that of B is positive; elsewhere \
             exchange rows or change their signs, of A, B and q alike, or take PIVOTING or AUTO"
        }
        "diagonal of M" | "1/diagonal of M" => {
            "; scale the row, of A, B and q alike, or take another Ω"
        }
        _ => "",
    }
}

/// Returns the shortest text of a number: with an exponent where it is very small or very large.
#[doc(hidden)]
pub fn number(value: f64) -> String {
    let is_long = value != 0.0 && value.is_finite() && !(1e-5..1e17).contains(&value.abs());
    if is_long { format!("{value:e}") } else { value.to_string() }
}

/// Panics, and names the vector, unless vectors of these lengths have an entry for each unknown.
#[doc(hidden)]
#[track_caller]
pub fn assert_lengths<const K: usize>(order: usize, vectors: [(&str, usize); K]) {
    for (what, found) in vectors {
        assert!(found == order, "{what} has length {found}, but it must have length {order}");
    }
}

/// Refuses what has another order than is expected.
#[doc(hidden)]
pub fn check_orders(expected: usize, orders: &[(&'static str, usize)]) -> Result<(), Error> {
    let wrong = orders.iter().find(|(_, found)| *found != expected);
    wrong.map_or(Ok(()), |&(what, found)| Err(Error::Order { what, found, expected }))
}

/// Refuses a parameter that is not positive and finite.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<(), Error> {
    let wrong = Error::Parameter { name, value, range: "positive and finite" };
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(wrong) }
}
