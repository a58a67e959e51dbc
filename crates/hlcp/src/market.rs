//! Matrices and vectors in Matrix Market files, read by a reader that believes nothing.
//!
//! What a header declares is checked against the file's length before anything is allocated, and
//! every entry against the header. Read are matrices in the `coordinate` or `array` format, `real`
//! or `integer`, `general`, `symmetric` or `skew-symmetric`; vectors in the same formats, as a
//! column or a row, or as plain numbers, one a line.

use std::{
    any::type_name,
    fs,
    path::Path,
    str::{FromStr, SplitWhitespace},
};

use hlcp_core::{Csr, Scalar, number};

pub use crate::files::FileError;
use crate::files::{self, excerpt};

/// Reads a square matrix.
///
/// # Errors
///
/// [`FileError`] for a file that cannot be opened, or is no regular one; a banner other than the
/// ones above; lines that are not UTF-8, too long or end in CRLF; sizes that are not numbers, not
/// square, more entries than the file can hold or fewer than rows; entries that are out of range,
/// above the diagonal of a symmetric matrix, or on that of a skew one, given twice or not finite;
/// and for fewer or more entries than declared.
///
/// # Cost
///
/// Time linear in the file but for sorting within rows; the file and about 50 bytes per entry.
///
/// ```
/// use hlcp::{Diagonal, market};
///
/// let path = std::env::temp_dir().join(format!("hlcp-{}.mtx", std::process::id()));
/// let text = "%%MatrixMarket matrix coordinate integer symmetric\n2 2 3\n1 1 4\n2 2 3\n2 1 -1\n";
/// std::fs::write(&path, text)?;
/// let matrix = market::read_matrix::<f64>(&path)?;
/// assert_eq!((matrix.nnz(), matrix.diagonal_entry(1)), (4, 3.0));
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_matrix<T: Scalar>(path: impl AsRef<Path>) -> Result<Csr<'static, T>, FileError> {
    let path = path.as_ref();
    let bytes = content(path)?;
    let mut lines = Lines::new(path, &bytes);
    let banner = lines.expect(|| "the banner %%MatrixMarket".into())?;
    let lowered = kind_of(banner);
    lines.is_whole = lowered.contains("integer");
    // What entries below the diagonal are multiplied by above it.
    let (is_array, mirrored) = match lowered.split_whitespace().collect::<Vec<_>>()[..] {
        [
            "%%matrixmarket",
            "matrix",
            format @ ("coordinate" | "array"),
            "real" | "integer",
            symmetry @ ("general" | "symmetric" | "skew-symmetric"),
        ] => {
            let mirrored = match symmetry {
                "general" => None,
                "symmetric" => Some(T::one()),
                _ => Some(-T::one()),
            };
            (format == "array", mirrored)
        }
        _ => {
            return Err(lines.fault(format!(
                "'{}' is not '%%MatrixMarket matrix coordinate|array real|integer general|symmetric|skew-symmetric'",
                excerpt(banner)
            )));
        }
    };
    let sizes = lines.expect_data(|| "the sizes".into())?;
    let mut sizes = sizes.split_whitespace();
    let wanted = if is_array { "rows columns" } else { "rows columns entries" };
    let [rows, columns] = lines.numbers(&mut sizes, wanted)?;
    let [declared] = if is_array { [0] } else { lines.numbers(&mut sizes, wanted)? };
    lines.no_more(&mut sizes)?;
    if rows != columns || rows == 0 {
        return Err(lines.fault(format!("{rows} × {columns} is not a square matrix")));
    }
    // Columns of an array have their rows from this one on.
    let top = |j: usize| mirrored.map_or(1, |factor| j + usize::from(factor < T::zero()));
    let entries = match mirrored {
        _ if !is_array => declared,
        None => rows.saturating_mul(rows),
        Some(_) => rows.saturating_mul(rows.saturating_add(3) - 2 * top(1)) / 2,
    };
    lines.holds(entries, if is_array { 2 } else { 6 })?;
    if entries > u32::MAX as usize / 2 {
        return Err(lines.fault(format!("{entries} entries are more than are read, 2³¹")));
    }
    let most = if mirrored.is_some() { 2 * entries } else { entries };
    if most < rows {
        return Err(lines.fault(format!("{rows} rows have {most} entries, but each needs one")));
    }
    let mut triplets = Vec::with_capacity(most);
    let mut next = [top(1), 1];
    for k in 0..entries {
        let found = if is_array { None } else { lines.entry() };
        let (i, j, value) = match found {
            Some((i, j, value)) => (i, j, lines.finite(value)?),
            None => {
                let line = lines.expect_data(|| format!("entry {} of {entries}", k + 1))?;
                let mut words = line.split_whitespace();
                let [i, j] =
                    if is_array { next } else { lines.numbers(&mut words, "row column value")? };
                (i, j, lines.value(&mut words)?)
            }
        };
        if is_array {
            next = if i < rows { [i + 1, j] } else { [top(j + 1), j + 1] };
            if value == T::zero() && i != j {
                continue;
            }
        }
        if !(1..=rows).contains(&i) || !(1..=rows).contains(&j) {
            return Err(lines.fault(format!("entry ({i}, {j}) is outside 1..={rows}")));
        }
        if mirrored.is_some() && j > i {
            let above = format!("entry ({i}, {j}) of a symmetric matrix is above the diagonal");
            return Err(lines.fault(above));
        }
        if mirrored == Some(-T::one()) && j == i {
            let on = format!("entry ({i}, {j}) of a skew-symmetric matrix is on the diagonal");
            return Err(lines.fault(on));
        }
        let [i, j] = [i, j].map(|k| k as u32 - 1);
        triplets.push((i, j, value));
        if let Some(factor) = mirrored.filter(|_| i != j) {
            triplets.push((j, i, factor * value));
        }
    }
    lines.expect_end()?;
    assemble(rows, triplets).map_err(|(i, j)| {
        // What is stored of a symmetric matrix is on the diagonal and below it.
        let place = if mirrored.is_some() { [i.max(j), i.min(j)] } else { [i, j] }.map(|k| k + 1);
        let is_there = |line: &[u8]| {
            let mut words = str::from_utf8(line).unwrap_or_default().split_whitespace();
            place.iter().all(|k| words.next().and_then(|word| word.parse().ok()) == Some(*k))
        };
        let [i, j] = place;
        let reason = format!(
            "entry ({i}, {j}) is given twice; add such entries up, in SciPy A.sum_duplicates()"
        );
        let lines = (1..).zip(bytes.split(|&byte| byte == b'\n'));
        let line = lines.filter(|(_, line)| is_there(line)).last().map(|(number, _)| number);
        FileError { path: path.to_owned(), line, reason }
    })
}

/// The banner in lower case; unsigned entries are read as any.
fn kind_of(banner: &str) -> String {
    banner.to_ascii_lowercase().replace("unsigned-integer", "integer")
}

/// The matrix of the triplets, or the place of the first one that comes twice.
fn assemble<T: Scalar>(
    order: usize,
    mut triplets: Vec<(u32, u32, T)>,
) -> Result<Csr<'static, T>, (u32, u32)> {
    let place = |&(i, j, _): &(u32, u32, T)| (i, j);
    triplets.sort_unstable_by_key(place);
    if let Some(twice) = triplets.windows(2).find(|pair| place(&pair[0]) == place(&pair[1])) {
        return Err(place(&twice[0]));
    }
    let mut offsets = vec![0_u32; order + 1];
    triplets.iter().for_each(|&(i, ..)| offsets[i as usize + 1] += 1);
    (0..order).for_each(|i| offsets[i + 1] += offsets[i]);
    let columns: Vec<u32> = triplets.iter().map(|&(_, j, _)| j).collect();
    let values: Vec<T> = triplets.iter().map(|&(.., value)| value).collect();
    Ok(Csr::new(offsets, columns, values).expect("sorted rows of finite numbers"))
}

/// Reads a vector of length `order`.
///
/// # Errors
///
/// [`FileError`], as for [`read_matrix`], and for a length other than `order`.
///
/// ```
/// use hlcp::market;
///
/// let path = std::env::temp_dir().join(format!("hlcp-{}.txt", std::process::id()));
/// std::fs::write(&path, "1.5\n-2\n")?;
/// assert_eq!(market::read_vector::<f32>(&path, 2)?, [1.5, -2.0]);
/// assert!(market::read_vector::<f32>(&path, 3).is_err());
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_vector<T: Scalar>(path: impl AsRef<Path>, order: usize) -> Result<Vec<T>, FileError> {
    let path = path.as_ref();
    let bytes = content(path)?;
    let mut lines = Lines::new(path, &bytes);
    let mut first = lines.expect(|| "a banner or a number".into())?;
    if is_filler(first) && !first.starts_with("%%") {
        first = lines.expect_data(|| "a number".into())?;
    }
    let banner = kind_of(first);
    lines.is_whole = banner.contains("integer");
    let (coordinate, plain) = match banner.split_whitespace().collect::<Vec<_>>()[..] {
        ["%%matrixmarket", "matrix", "array", "real" | "integer", "general"] => (false, false),
        ["%%matrixmarket", "matrix", "coordinate", "real" | "integer", "general"] => (true, false),
        // A single number is a symmetric matrix, too, and SciPy says so.
        ["%%matrixmarket", "matrix", "array", "real" | "integer", "symmetric"] if order == 1 => {
            (false, false)
        }
        [number] if !number.starts_with('%') => (false, true),
        _ => {
            return Err(lines.fault(format!(
                "'{}' is neither '%%MatrixMarket matrix array|coordinate real|integer general' nor a number",
                excerpt(first)
            )));
        }
    };
    let (mut entries, mut is_row) = (order, false);
    if !plain {
        let sizes = lines.expect_data(|| "the sizes".into())?;
        let mut words = sizes.split_whitespace();
        let [rows, columns] = lines.numbers(&mut words, "rows columns")?;
        if coordinate {
            [entries] = lines.numbers(&mut words, "rows columns entries")?;
        }
        lines.no_more(&mut words)?;
        is_row = rows == 1 && order != 1;
        if (rows, columns) != (order, 1) && (rows, columns) != (1, order) {
            return Err(lines.fault(format!("{rows} × {columns} where {order} × 1 is wanted")));
        }
    }
    lines.holds(entries, 2)?;
    let mut vector = vec![if coordinate { T::zero() } else { T::nan() }; order];
    let mut given = vec![false; if coordinate { order } else { 0 }];
    for k in 0..entries {
        let line = if plain && k == 0 {
            first
        } else {
            let of = if plain { ", one for each row of the matrix," } else { "" };
            lines.expect_data(|| format!("entry {} of {entries}{of}", k + 1))?
        };
        let mut words = line.split_whitespace();
        let mut at = k;
        if coordinate {
            let wanted = if is_row { "1 column value" } else { "row 1 value" };
            let [i, j] = lines.numbers(&mut words, wanted)?;
            let (along, across) = if is_row { (j, i) } else { (i, j) };
            if !(1..=order).contains(&along) || across != 1 {
                let of = if is_row { format!("1 × {order}") } else { format!("{order} × 1") };
                return Err(lines.fault(format!("entry ({i}, {j}) is outside {of}")));
            }
            at = along - 1;
            if std::mem::replace(&mut given[at], true) {
                return Err(lines.fault(format!("entry ({i}, {j}) is given twice")));
            }
        }
        vector[at] = lines.value(&mut words)?;
    }
    lines.expect_end()?;
    Ok(vector)
}

/// Writes each vector to its file, in the `array` format with every digit, so that it is the same
/// numbers in `f64`, too.
///
/// A regular file that exists is replaced, once all are written.
///
/// # Errors
///
/// [`FileError`] as for [`write_together`](files::write_together): for a file that could not be
/// written, for two vectors to one file, and for what is no regular file, such as a symbolic link.
///
/// ```
/// use hlcp::market;
///
/// let path = std::env::temp_dir().join(format!("hlcp-{}-z.mtx", std::process::id()));
/// market::write_vectors(&[(&path, &[0.1, 0.0])])?;
/// assert_eq!(market::read_vector::<f64>(&path, 2)?, [0.1, 0.0]);
/// market::write_vectors(&[(&path, &[0.1_f32])])?;
/// assert_eq!(market::read_vector::<f64>(&path, 1)?, [f64::from(0.1_f32)]);
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_vectors<T: Scalar>(vectors: &[(&Path, &[T])]) -> Result<(), FileError> {
    files::write_together(vectors, |vector, file| {
        writeln!(file, "%%MatrixMarket matrix array real general\n{} 1", vector.len())?;
        vector.iter().try_for_each(|value| writeln!(file, "{:e}", value.wide()))
    })
}

/// The longest line a file may have, in bytes.
const LONGEST: usize = 1 << 16;

/// Reads a regular file.
fn content(path: &Path) -> Result<Vec<u8>, FileError> {
    // To open a FIFO is to wait for its writer.
    let found = fs::metadata(path).map_err(|e| FileError::new(path, e))?;
    if !found.is_file() {
        let kind = files::kind(&found);
        return Err(FileError::new(path, format!("is {kind}; give a regular file instead")));
    }
    let bytes = fs::read(path).map_err(|e| FileError::new(path, e))?;
    files::binary(&bytes).map_or(Ok(bytes), |what| Err(FileError::new(path, what)))
}

/// The lines of a file, counted.
struct Lines<'f> {
    path: &'f Path,
    length: usize,
    rest: &'f [u8],
    number: usize,
    /// The banner says that the numbers are whole.
    is_whole: bool,
}

impl<'f> Lines<'f> {
    fn new(path: &'f Path, bytes: &'f [u8]) -> Self {
        Self { path, length: bytes.len(), rest: bytes, number: 0, is_whole: false }
    }

    fn fault(&self, reason: impl ToString) -> FileError {
        let line = Some(self.number);
        FileError { path: self.path.to_owned(), line, reason: reason.to_string() }
    }

    /// Refuses a count of entries, of at least `bytes` each, that the file is too short for.
    fn holds(&self, entries: usize, bytes: usize) -> Result<(), FileError> {
        // The last entry may lack its line's end.
        if entries > (self.length + 1) / bytes {
            let length = self.length;
            return Err(self.fault(format!(
                "{entries} entries are wanted, more than {length} bytes can hold"
            )));
        }
        Ok(())
    }

    /// The next line, without its end; none at the end of the file.
    fn next(&mut self) -> Result<Option<&'f str>, FileError> {
        self.number += 1;
        if self.rest.is_empty() {
            return Ok(None);
        }
        let reach = &self.rest[..self.rest.len().min(LONGEST)];
        let end = reach.iter().position(|&byte| byte == b'\n');
        let line = &reach[..end.unwrap_or(reach.len())];
        self.rest = &self.rest[self.rest.len().min(line.len() + 1)..];
        if end.is_none() && reach.len() == LONGEST || line.len() + 1 == LONGEST {
            return Err(self.fault(format!("the line is longer than {LONGEST} bytes")));
        }
        if line.last() == Some(&b'\r') {
            return Err(self.fault("the line ends in CRLF; convert the file to plain line ends, for example with dos2unix"));
        }
        str::from_utf8(line)
            .map(Some)
            .map_err(|_| self.fault("the line is not UTF-8; expected a text file"))
    }

    /// The next line, if it is an entry in its usual form: three words, one blank between them.
    ///
    /// Any other line is left for [`next`](Self::next), which knows all forms and all faults.
    fn entry(&mut self) -> Option<(usize, usize, f64)> {
        let (i, rest) = digits(self.rest)?;
        let (j, rest) = digits(rest.strip_prefix(b" ")?)?;
        let rest = rest.strip_prefix(b" ")?;
        let end = rest.iter().take(LONGEST).position(|byte| !byte.is_ascii_graphic())?;
        let (word, rest) = (&rest[..end], rest[end..].strip_prefix(b"\n")?);
        let (sign, whole) = word.strip_prefix(b"-").map_or((1.0, word), |whole| (-1.0, whole));
        let value = match digits(whole) {
            // No fraction and no exponent, and few enough digits to be exact.
            Some((v, [])) if whole.len() < 16 => sign * v as f64,
            _ => str::from_utf8(word).ok()?.parse().ok()?,
        };
        (self.rest, self.number) = (rest, self.number + 1);
        Some((i, j, value))
    }

    fn expect(&mut self, what: impl Fn() -> String) -> Result<&'f str, FileError> {
        self.next()?.ok_or_else(|| self.fault(format!("the file ends where {} should be", what())))
    }

    /// The next line that is neither blank nor a comment.
    fn expect_data(&mut self, what: impl Fn() -> String) -> Result<&'f str, FileError> {
        loop {
            let line = self.expect(&what)?;
            if !is_filler(line) {
                return Ok(line);
            }
        }
    }

    fn expect_end(&mut self) -> Result<(), FileError> {
        while let Some(line) = self.next()? {
            if !is_filler(line) {
                return Err(
                    self.fault(format!("'{}' comes after the last entry wanted", excerpt(line)))
                );
            }
        }
        Ok(())
    }

    fn numbers<const K: usize>(
        &self,
        words: &mut SplitWhitespace<'_>,
        wanted: &str,
    ) -> Result<[usize; K], FileError> {
        let mut numbers = [0; K];
        for number in &mut numbers {
            *number = self.number(words.next(), wanted)?;
        }
        Ok(numbers)
    }

    fn number<N: FromStr>(&self, word: Option<&str>, wanted: &str) -> Result<N, FileError> {
        let word = word.ok_or_else(|| self.fault(format!("'{wanted}' is wanted")))?;
        let fault = || {
            let hint = if word.contains(',') {
                "; write decimals with a point, one number per line"
            } else {
                ""
            };
            self.fault(format!("'{}' is no number for '{wanted}'{hint}", excerpt(word)))
        };
        word.parse().map_err(|_| fault())
    }

    /// The value that ends a line.
    fn value<T: Scalar>(&self, words: &mut SplitWhitespace<'_>) -> Result<T, FileError> {
        let value: f64 = self.number(words.next(), "value")?;
        self.no_more(words)?;
        self.finite(value)
    }

    fn finite<T: Scalar>(&self, value: f64) -> Result<T, FileError> {
        let found = T::of(value);
        if self.is_whole && value.fract() != 0.0 && value.is_finite() {
            let value = number(value);
            Err(self.fault(format!(
                "{value} is not a whole number, as the banner's 'integer' says; write 'real' there"
            )))
        } else if found.is_finite() {
            Ok(found)
        } else if value.is_finite() {
            Err(self.fault(format!("{value:e} does not fit {}; take f64", type_name::<T>())))
        } else {
            Err(self.fault(format!("{value} is not a finite number")))
        }
    }

    fn no_more(&self, words: &mut SplitWhitespace<'_>) -> Result<(), FileError> {
        match words.next() {
            Some(word) => Err(self.fault(format!("'{}' is one word too many", excerpt(word)))),
            None => Ok(()),
        }
    }
}

/// A number of at most 18 digits, which cannot overflow, at the beginning of a text, and the rest.
fn digits(text: &[u8]) -> Option<(usize, &[u8])> {
    let (mut number, mut length) = (0, 0);
    while let Some(digit) = text.get(length).filter(|byte| byte.is_ascii_digit()) {
        number = 10 * number + u64::from(digit - b'0');
        length += 1;
        if length > 18 {
            return None;
        }
    }
    let number = usize::try_from(number).ok()?;
    (length > 0).then_some((number, &text[length..]))
}

fn is_filler(line: &str) -> bool {
    line.trim_start().starts_with('%') || line.trim().is_empty()
}
