//! A folder for the files of one test, and matrices in them.

use std::{
    fs,
    path::{Path, PathBuf},
};

use hlcp::Rows;

/// A folder of its own for one test, removed at the end.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("hlcp-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub(crate) fn write(&self, name: impl AsRef<Path>, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).unwrap();
        path
    }
}

/// The entries of a matrix with their rows and columns.
pub(crate) fn entries(matrix: &impl Rows<f64>) -> Vec<(usize, usize, f64)> {
    let mut entries = vec![];
    for i in 0..matrix.order() {
        matrix.visit_row(i, &mut |j, value| entries.push((i, j, value)));
    }
    entries
}

/// Writes entries, counted from 0, as a Matrix Market file.
pub(crate) fn market_text(order: usize, entries: &[(usize, usize, f64)]) -> String {
    let head = "%%MatrixMarket matrix coordinate real general";
    let lines = entries.iter().map(|(i, j, value)| format!("{} {} {value:e}\n", i + 1, j + 1));
    format!("{head}\n{order} {order} {}\n{}", entries.len(), lines.collect::<String>())
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
