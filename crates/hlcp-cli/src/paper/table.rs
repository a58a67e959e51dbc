//! A table in three formats.

use std::{error::Error, path::Path};

use crate::chart::save;

/// A head and rows of the same length.
#[derive(Debug)]
pub(crate) struct Table {
    name: String,
    title: String,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows; `name` is its file's.
    pub(crate) fn new<S: Into<String>>(
        name: &str,
        title: &str,
        head: impl IntoIterator<Item = S>,
    ) -> Self {
        let head = head.into_iter().map(Into::into).collect();
        Self { name: name.to_owned(), title: title.to_owned(), head, rows: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Panics
    ///
    /// Unless it is as long as the head.
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let row: Vec<String> = cells.into_iter().collect();
        assert_eq!(row.len(), self.head.len(), "{}", self.title);
        self.rows.push(row);
    }

    fn lines(&self) -> impl Iterator<Item = &Vec<String>> {
        std::iter::once(&self.head).chain(&self.rows)
    }

    /// Aligned columns under the title.
    pub(crate) fn text(&self) -> String {
        let width =
            |k: usize| self.lines().map(|line| line[k].chars().count()).max().unwrap_or_default();
        let widths: Vec<usize> = (0..self.head.len()).map(width).collect();
        let aligned = |line: &Vec<String>| {
            let cells = line.iter().zip(&widths).map(|(cell, &width)| format!("{cell:>width$}"));
            cells.collect::<Vec<_>>().join("  ") + "\n"
        };
        format!("{}\n\n{}", self.title, self.lines().map(aligned).collect::<String>())
    }

    fn markdown(&self) -> String {
        let line = |cells: &Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = format!("|{}\n", "---|".repeat(self.head.len()));
        let rows = self.rows.iter().map(line).collect::<String>();
        format!("## {}\n\n{}{rule}{rows}", self.title, line(&self.head))
    }

    fn csv(&self) -> String {
        let quoted = |cell: &String| match cell.contains(',') {
            true => format!("\"{cell}\""), // no cell has quotes of its own
            false => cell.clone(),
        };
        let line =
            |cells: &Vec<String>| cells.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
        self.lines().map(line).collect()
    }
}

/// Writes `tables.txt`, `tables.md` and a CSV file for each table.
pub(crate) fn write(folder: &Path, tables: &[Table]) -> Result<(), Box<dyn Error>> {
    let all =
        |format: fn(&Table) -> String| tables.iter().map(format).collect::<Vec<_>>().join("\n");
    save(&folder.join("tables.txt"), &all(Table::text))?;
    let introduction = "# Tables\n\nWritten by `cargo run --release -- paper --out docs/results`; \
                        [../results.md](../results.md#the-papers-tables) reads them.\n\n";
    save(&folder.join("tables.md"), &(introduction.to_owned() + &all(Table::markdown)))?;
    tables.iter().try_for_each(|t| save(&folder.join(format!("{}.csv", t.name)), &t.csv()))
}
