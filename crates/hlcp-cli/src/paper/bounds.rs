//! Table 2: the upper bound of α in (16).

use std::error::Error;

use hlcp_core::{Hlcp, Omega};
use hlcp_verify::{alpha_bound, fixed};

use super::{GRIDS, Grid, table::Table};

/// Proved brackets of 1/ρ[(D_A + D_BΩ)⁻¹(D_BΩ + |C_A|)], for the paper's two τ.
pub(crate) fn table_2(ms: &[usize]) -> Result<Table, Box<dyn Error>> {
    let head = ["m", "τ"].map(String::from).into_iter().chain(GRIDS.map(|grid| grid.name()));
    let title = "Table 2: upper bounds of α in (16), between proved limits";
    let mut table = Table::new("table2", title, head);
    for &m in ms {
        for tau in [1.2, 1.0] {
            let bound = |grid: &Grid| -> Result<String, Box<dyn Error>> {
                let scene = grid.example(m).pose::<f64>()?;
                let omega = Omega::diagonal_ratio(tau, &scene.a, &scene.b)?;
                let [lower, upper] = alpha_bound(&Hlcp::new(scene.a, scene.b, omega)?).reciprocal();
                // Further digits depend on the processor.
                Ok(format!("{} … {}", fixed(lower, 6, false), fixed(upper, 6, true)))
            };
            let cells = GRIDS.iter().map(bound).collect::<Result<Vec<_>, _>>()?;
            table.row([m.to_string(), format!("{tau:.1}")].into_iter().chain(cells));
        }
    }
    Ok(table)
}
