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

    /// Writes matrices and q; returns the options that name the files, for which the matrices are
    /// named.
    pub(crate) fn problem(&self, matrices: &[(&str, &dyn Rows<f64>)], q: &[f64]) -> String {
        let q = q.iter().map(|q| format!("{q:e}\n")).collect::<String>();
        let mut options = format!("--q {}", self.write("q.txt", q).display());
        for (name, matrix) in matrices {
            let path = self.write(format!("{name}.mtx"), text_of(*matrix));
            options += &format!(" --{name} {}", path.display());
        }
        options
    }
}

/// The entries of a matrix with their rows and columns.
pub(crate) fn entries(matrix: &dyn Rows<f64>) -> Vec<(usize, usize, f64)> {
    let mut entries = vec![];
    for i in 0..matrix.order() {
        matrix.visit_row(i, &mut |j, value| entries.push((i, j, value)));
    }
    entries
}

/// Writes a matrix as a Matrix Market file.
pub(crate) fn text_of(matrix: &dyn Rows<f64>) -> String {
    market_text(matrix.order(), &entries(matrix))
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
