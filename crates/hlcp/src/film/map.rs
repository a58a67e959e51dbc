use std::{fs, path::Path};

use crate::files::{FileError, binary, excerpt};

/// Numbers in rows of the same length, from and for files: CSV, and NumPy's NPY of any version.
///
/// ```
/// use hlcp::film::Map;
///
/// let map = Map::parse("gap.csv".as_ref(), "# µm\n40, 30, 20 # west\n40, 30, 20\n")?;
/// assert_eq!(([map.columns, map.rows], map.values[2]), ([3, 2], 20.0));
/// assert_eq!(map.csv(), b"40,30,20\n40,30,20\n");
/// assert_eq!(map.npy().len(), 128 + 6 * 8);
/// # Ok::<(), hlcp::files::FileError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// The numbers in a row.
    pub columns: usize,
    /// The rows.
    pub rows: usize,
    /// Row after row.
    pub values: Vec<f64>,
}

impl Map {
    /// Reads a file, as NPY if it begins as such.
    ///
    /// # Errors
    ///
    /// [`FileError`] for a file that cannot be read; rows of different lengths or none, and what is
    /// not a finite number; decimal commas; NPY files of other numbers, of more dimensions or cut
    /// short.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let fault = |reason| FileError::new(path, reason);
        let bytes = fs::read(path).map_err(|e| fault(e.to_string()))?;
        if let Some(rest) = bytes.strip_prefix(b"\x93NUMPY") {
            return npy(rest).map_err(fault);
        }
        if let Some(what) = binary(&bytes) {
            return Err(fault(what.into()));
        }
        let text = String::from_utf8(bytes);
        let text = text.map_err(|_| fault("neither an NPY file nor text".into()))?;
        Self::parse(path, &text)
    }

    /// Reads a text in columns, which is that of the file `path`.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read).
    pub fn parse(path: &Path, text: &str) -> Result<Self, FileError> {
        let fault = |line, reason| FileError { path: path.to_owned(), line, reason };
        let mut map = Self { columns: 0, rows: 0, values: vec![] };
        for (number, line) in data(text) {
            map.add(line).map_err(|reason| fault(Some(number), reason))?;
        }
        if map.rows == 0 { Err(fault(None, "there are no numbers".into())) } else { Ok(map) }
    }

    /// Adds a row from a line.
    fn add(&mut self, line: &str) -> Result<(), String> {
        if has_decimal_commas(line) {
            return Err("a comma within numbers; write decimals with a point".into());
        }
        let (words, wanted) = (cells(line)?, self.columns);
        for (column, word) in (1..).zip(&words) {
            let hint = if self.rows == 0 { "; begin a heading with #" } else { "" };
            let value = word.parse().ok().filter(|value: &f64| value.is_finite());
            self.values.push(value.ok_or_else(|| {
                format!("column {column}: '{}' is not a finite number{hint}", excerpt(word))
            })?);
        }
        let found = words.len();
        if self.rows > 0 && found != wanted {
            return Err(format!("{found} columns where {wanted} are wanted"));
        }
        (self.columns, self.rows) = (found, self.rows + 1);
        Ok(())
    }

    /// Reads a map that has no other to compare its columns with.
    ///
    /// # Errors
    ///
    /// As [`read`](Self::read), and for two columns of whole numbers, which may be one with decimal
    /// commas.
    pub fn read_gap(path: &Path) -> Result<Self, FileError> {
        let map = Self::read(path)?;
        let Ok(text) = fs::read_to_string(path) else { return Ok(map) };
        let digits =
            |word: &str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit());
        let is_pair = |line: &str| matches!(line.trim().split_once(','), Some((a, b)) if digits(a) && digits(b));
        if map.columns == 2 && data(&text).all(|(_, line)| is_pair(line)) {
            let reason = "two columns of whole numbers, or one with decimal commas? Separate columns \
                      by semicolons, and write decimals with a point";
            return Err(FileError::new(path, reason));
        }
        Ok(map)
    }

    /// Returns the map as CSV, a row in each line.
    pub fn csv(&self) -> Vec<u8> {
        let line =
            |row: &[f64]| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
        self.values.chunks(self.columns).map(line).collect::<String>().into_bytes()
    }

    /// Returns the map as NPY, version 1.0.
    pub fn npy(&self) -> Vec<u8> {
        let Self { rows, columns, values } = self;
        let header =
            format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
        // The data begin at a multiple of 64 bytes; the header ends with a line feed.
        let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        bytes
    }
}

/// The lines of a text that hold more than a comment, which begins with #, without it; each with
/// its number.
fn data(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.trim_start_matches('\u{feff}').lines();
    let data = lines.map(|line| line.split_once('#').map_or(line, |(data, _)| data.trim_end()));
    (1..).zip(data).filter(|(_, line)| !line.trim().is_empty())
}

/// Splits a line into its cells, without the quotes that a cell is in: at semicolons, or else at
/// commas, at tabs or at blanks.
fn cells(line: &str) -> Result<Vec<&str>, String> {
    let words: Vec<&str> =
        match [';', ',', '\t'].into_iter().find(|&mark| line.trim().contains(mark)) {
            Some(mark) => line.trim_matches(' ').split(mark).map(str::trim).collect(),
            None => line.split_whitespace().collect(),
        };
    if let Some(at) = words.iter().position(|word| word.is_empty()) {
        return Err(format!("column {} is empty; write a number there", at + 1));
    }
    let bare = |word| str::strip_prefix(word, '"').and_then(|word| word.strip_suffix('"'));
    Ok(words.into_iter().map(|word| bare(word).unwrap_or(word)).collect())
}

/// Whether commas stand within what semicolons or blanks separate.
fn has_decimal_commas(line: &str) -> bool {
    let separated = |c: char| c == ';' || c.is_whitespace();
    let words = || line.split(separated).filter(|word| !word.is_empty());
    let within = words().any(|word| word.trim_matches(',').contains(','));
    // 1,2, 3 has them between numbers, some with a blank.
    let between = words().any(|word| word.starts_with(',') || word.ends_with(','));
    words().count() > 1 && within && (line.contains(';') || !between)
}

/// What follows the magic word of an NPY file.
fn npy(bytes: &[u8]) -> Result<Map, String> {
    let cut = || "the NPY header is cut short".to_owned();
    let (&version, rest) = bytes.split_first().ok_or_else(cut)?;
    let wide = if version == 1 { 2 } else { 4 };
    let length = rest.get(1..=wide).ok_or_else(cut)?;
    let length = length.iter().rev().fold(0, |sum, &byte| sum * 256 + usize::from(byte));
    let rest = &rest[1 + wide..];
    let header = rest.get(..length).ok_or_else(cut)?;
    let (header, data) = (String::from_utf8_lossy(header), &rest[length..]);
    // The header is a Python dictionary with three keys.
    let after = |key: &str| {
        let found = header.split_once(&format!("'{key}':")).map(|(_, rest)| rest.trim_start());
        found.ok_or_else(|| format!("the NPY header has no '{key}'"))
    };
    let kind = after("descr")?.trim_start_matches('\'').split('\'').next().unwrap_or_default();
    let by_columns = after("fortran_order")?.starts_with("True");
    let shape = after("shape")?.trim_start_matches('(').split(')').next().unwrap_or_default();
    let sizes: Result<Vec<usize>, _> =
        shape.split(',').map(str::trim).filter(|s| !s.is_empty()).map(str::parse).collect();
    let (rows, columns) = match sizes.as_deref() {
        Ok(&[columns]) => (1, columns),
        Ok(&[rows, columns]) => (rows, columns),
        _ => return Err(format!("the shape ({}) is not that of a map", excerpt(shape))),
    };
    let (big, kind) = (kind.starts_with('>'), kind.trim_start_matches(['<', '>', '=', '|']));
    let (size, number): (usize, fn([u8; 8]) -> f64) = match kind {
        "f8" => (8, f64::from_le_bytes),
        "f4" => (4, |[a, b, c, d, ..]| f32::from_le_bytes([a, b, c, d]).into()),
        "i8" => (8, |word| i64::from_le_bytes(word) as f64),
        "i4" => (4, |[a, b, c, d, ..]| i32::from_le_bytes([a, b, c, d]).into()),
        "i2" => (2, |[a, b, ..]| i16::from_le_bytes([a, b]).into()),
        _ => {
            let kind = excerpt(kind);
            return Err(format!(
                "the numbers are of the type '{kind}'; f8, f4, i8, i4 or i2 are read"
            ));
        }
    };
    if rows == 0 || columns == 0 {
        return Err(format!("the array has the shape ({rows}, {columns}), and so no numbers"));
    }
    let count = rows.checked_mul(columns);
    if count.and_then(|count| count.checked_mul(size)) != Some(data.len()) {
        let found = data.len();
        return Err(format!(
            "the shape is ({rows}, {columns}) of {size} bytes each, but the data have {found} bytes"
        ));
    }
    let word = |bytes: &[u8]| {
        let mut word = [0; 8];
        word[..size].copy_from_slice(bytes);
        if big {
            word[..size].reverse();
        }
        number(word)
    };
    let mut values: Vec<f64> = data.chunks_exact(size).map(word).collect();
    if by_columns {
        values = (0..values.len()).map(|k| values[k / columns + k % columns * rows]).collect();
    }
    if let Some(at) = values.iter().position(|v: &f64| !v.is_finite()) {
        let (row, column) = (at / columns + 1, at % columns + 1);
        return Err(format!("row {row}, column {column}: {} is not a finite number", values[at]));
    }
    Ok(Map { columns, rows, values })
}
