//! A table in three formats.

use std::{collections::BTreeMap, fs, path::Path};

use hlcp::files::FileError;

use crate::{Fallible, chart::save};

/// Rows of cells, the first of which is the head.
pub(crate) struct Table(Vec<Vec<String>>);

impl Table {
    /// A table without rows. The cells of the head stand between `|`.
    pub(crate) fn new(head: &str) -> Self {
        let mut table = Self(vec![]);
        table.row(head);
        table
    }

    /// Adds a row, whose cells stand between `|`.
    pub(crate) fn row(&mut self, cells: &str) {
        self.push(cells.split('|').map(|cell| cell.trim().to_owned()).collect());
    }

    /// Adds a row of cells, as many as the head has.
    pub(crate) fn push(&mut self, cells: Vec<String>) {
        assert!(self.0.first().is_none_or(|head| head.len() == cells.len()), "{cells:?}");
        self.0.push(cells);
    }

    /// Returns aligned columns.
    pub(crate) fn text(&self) -> String {
        let width = |k: usize| self.0.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.0[0].len()).map(width).collect();
        let aligned = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:>width$}"));
            cells.collect::<Vec<_>>().join("  ") + "\n"
        };
        self.0.iter().map(aligned).collect()
    }

    pub(crate) fn markdown(&self) -> String {
        let line = |row: &Vec<String>| format!("| {} |\n", row.join(" | "));
        let rule = format!("|{}\n", "---|".repeat(self.0[0].len()));
        line(&self.0[0]) + &rule + &self.0[1..].iter().map(line).collect::<String>()
    }

    /// Returns the table with commas between its cells; those that have one are in quotes.
    fn csv(&self) -> String {
        let quoted = |cell: &String| match cell.contains(',') {
            true => format!("\"{cell}\""), // no cell has quotes of its own
            false => cell.clone(),
        };
        let line = |row: &Vec<String>| row.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n";
        self.0.iter().map(line).collect()
    }

    /// Writes the table as `path`.csv.
    pub(crate) fn write_csv(&self, path: &Path) -> Fallible<()> {
        save(&path.with_extension("csv"), &self.csv())
    }

    /// Writes what a file in two columns is to keep of a name, in the place of what it has of it.
    pub(crate) fn keep(path: &Path, columns: &str, name: &str, words: String) -> Fallible<()> {
        let mut rows = Self::kept(path, columns)?;
        rows.insert(name.to_owned(), words);
        let mut table = Self::new(columns);
        rows.into_iter().for_each(|(name, words)| table.push(vec![name, words]));
        table.write_csv(path)
    }

    /// Returns what a file in two columns keeps, by names: nothing if it is not there.
    pub(crate) fn kept(path: &Path, columns: &str) -> Result<BTreeMap<String, String>, FileError> {
        let rows = if path.exists() { Self::rows_of(path, columns)? } else { vec![] };
        Ok(rows.into_iter().map(|(_, row)| row.into()).collect())
    }

    /// Returns the rows of a file with these columns, which stand between `|`, between commas, with
    /// the numbers of their lines; a comma between quotes is part of its cell.
    pub(crate) fn rows_of<const N: usize>(
        path: &Path,
        columns: &str,
    ) -> Result<Vec<(usize, [String; N])>, FileError> {
        let fault = |line, reason| FileError { path: path.to_owned(), line, reason };
        let text = fs::read_to_string(path).map_err(|error| fault(None, error.to_string()))?;
        let mut rows = vec![];
        for (number, line) in (1..).zip(text.lines()) {
            let cells = cells(line);
            if line.trim().is_empty() || cells.iter().eq(columns.split('|')) {
                continue;
            }
            let row = cells.try_into().map_err(|cells: Vec<String>| {
                let head = columns.replace('|', ",");
                let reason = format!("{} columns where there must be {N}: {head}", cells.len());
                fault(Some(number), reason)
            })?;
            rows.push((number, row));
        }
        Ok(rows)
    }
}

/// The cells of a line; a comma between quotes is part of its cell.
fn cells(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    for (k, part) in line.split('"').enumerate() {
        let mut pieces =
            if k % 2 == 1 { vec![part] } else { part.split(',').collect() }.into_iter();
        let last = cells.len() - 1;
        cells[last] += pieces.next().unwrap_or_default();
        cells.extend(pieces.map(String::from));
    }
    cells
}
