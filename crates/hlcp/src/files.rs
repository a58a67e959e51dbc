//! Files that are written whole or not at all, and text from files as it may be printed.
//!
//! [`check_output`] says before a long computation whether its answer could be written, and
//! [`write_together`] replaces files only once all are written. Both replace regular files only: a
//! directory, a FIFO, a device, a socket and a symbolic link are refused. A symbolic link among the
//! folders of a path is followed.

use std::{
    fmt::Display,
    fs::{self, File, Metadata, OpenOptions},
    io::{self, BufWriter, ErrorKind, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
};

use thiserror::Error;

/// A file that cannot be read or written, and why.
///
/// Its message is one line: what does not print in a file's name is escaped, as by [`printable`].
///
/// ```
/// use hlcp::files::FileError;
///
/// let (path, reason) = ("a\u{1b}[2J.csv".into(), "the gap h = 0 is not positive".to_owned());
/// let error = FileError { path, line: Some(3), reason };
/// assert_eq!(error.to_string(), r"a\u{1b}[2J.csv, line 3: the gap h = 0 is not positive");
/// ```
#[derive(Debug, Error)]
#[error("{}{}: {reason}", printable(path.display()),
    line.map_or(String::new(), |line| format!(", line {line}")))]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// The line, counted from 1, where one is at fault.
    pub line: Option<usize>,
    /// The fault, with the numbers.
    pub reason: String,
}

impl FileError {
    pub(crate) fn new(path: &Path, reason: impl Display) -> Self {
        Self { path: path.to_owned(), line: None, reason: reason.to_string() }
    }

    fn unwritable(path: &Path, error: &io::Error) -> Self {
        Self::new(path, format!("cannot be written: {error}"))
    }
}

/// Returns the text with all that does not print escaped: control characters, line ends, invisible
/// characters and those that turn the direction of writing.
///
/// Quotes and backslashes stay as they are, so that escaped text is not escaped again.
///
/// ```
/// use hlcp::files::printable;
///
/// assert_eq!(printable("é = 'x'\r\n"), r"é = 'x'\r\n");
/// assert_eq!(printable("\u{1b}]0;new title\u{7}"), r"\u{1b}]0;new title\u{7}");
/// assert_eq!(printable("\u{2028}\u{202e}"), r"\u{2028}\u{202e}");
/// assert_eq!(printable(r"C:\new\u{7}"), r"C:\new\u{7}");
/// ```
pub fn printable(text: impl Display) -> String {
    let escaped = text.to_string().escape_debug().to_string();
    escaped.replace(r"\'", "'").replace(r#"\""#, "\"").replace(r"\\", r"\")
}

/// Returns at most 60 characters of the [`printable`] text, and an ellipsis for the others.
///
/// ```
/// use hlcp::files::excerpt;
///
/// assert_eq!(excerpt("1.5\t2"), r"1.5\t2");
/// assert_eq!(excerpt(&"7".repeat(61)), "7".repeat(60) + "…");
/// ```
pub fn excerpt(text: &str) -> String {
    let text = printable(text);
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// Says of bytes that begin as a binary file of a known kind what they are, and the way out.
pub(crate) fn binary(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x1f, 0x8b, ..] => Some("is compressed by gzip; unpack it with gunzip"),
        [b'P', b'K', 3, 4, ..] => Some("is a ZIP archive, as NPZ is; unpack it with unzip"),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => {
            Some("is an NPY file; write text instead, in NumPy savetxt(path, v)")
        }
        _ => None,
    }
}

/// Tells whether two paths lead to one file: through `.`, `..`, symbolic links and, on Unix, by
/// hard links.
///
/// A file that does not exist yet is known by its folder and its name.
///
/// ```
/// use hlcp::files::same_file;
///
/// assert!(same_file("z".as_ref(), "./z".as_ref()));
/// assert!(!same_file("z".as_ref(), "r".as_ref()));
/// ```
pub fn same_file(one: &Path, other: &Path) -> bool {
    let resolved = |path: &Path| fs::canonicalize(path).or_else(|_| place(path)).ok();
    let resolves_alike = resolved(one).is_some_and(|path| Some(path) == resolved(other));
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let identity = |path| fs::metadata(path).ok().map(|file| (file.dev(), file.ino()));
        resolves_alike || identity(one).is_some_and(|file| Some(file) == identity(other))
    }
    #[cfg(not(unix))]
    resolves_alike
}

/// Refuses a path that [`write_together`] could not write to now.
///
/// A temporary file is made beside it and removed again; a file that exists is opened for writing
/// and left as it is.
///
/// # Errors
///
/// [`FileError`] for what exists and is not a regular file, also for a symbolic link; for a file or
/// a folder that cannot be written to, with the operating system's reason; for a path that ends in
/// no name.
///
/// ```
/// use hlcp::files::check_output;
///
/// let folder = std::env::temp_dir();
/// check_output(&folder.join(format!("hlcp-{}-new.txt", std::process::id())))?;
/// let error = check_output(&folder).unwrap_err();
/// assert_eq!(error.reason, "is a directory; an output is a new file or a regular one");
/// # Ok::<(), hlcp::files::FileError>(())
/// ```
pub fn check_output(path: &Path) -> Result<(), FileError> {
    let target = target(path)?;
    create(&target).map(drop).map_err(|e| FileError::unwritable(path, &e))
}

/// Writes the content of each file by `write`, and puts all files in their places.
///
/// All are written to temporary files in the folders of their paths first and then renamed. So a
/// content that cannot be written leaves every file as it was; if a rename fails, which nothing but
/// a change of the folders meanwhile explains, the files renamed before it stay. A file that is
/// replaced hands its permissions on, and its other hard links keep the old content.
///
/// # Errors
///
/// [`FileError`] as for [`check_output`], for two paths to one file, and for what could not be
/// written; no temporary file is left. A process that is killed while it writes leaves files named
/// `.hlcp-….partial`.
///
/// # Cost
///
/// Room for the old and the new files at once, and one wait for the disc per file.
///
/// ```
/// use hlcp::files::write_together;
///
/// let path = |name| std::env::temp_dir().join(format!("hlcp-{}-{name}", std::process::id()));
/// let (one, two) = (path("one.txt"), path("two.txt"));
/// write_together(&[(&one, 1), (&two, 2)], |number, file| writeln!(file, "{number}"))?;
/// assert_eq!(std::fs::read_to_string(&two)?, "2\n");
/// # std::fs::remove_file(one)?;
/// # std::fs::remove_file(two)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_together<C>(
    outputs: &[(&Path, C)],
    write: impl Fn(&C, &mut dyn Write) -> io::Result<()>,
) -> Result<(), FileError> {
    let mut written = Vec::with_capacity(outputs.len());
    for (k, (path, content)) in outputs.iter().enumerate() {
        if let Some((other, _)) = outputs[..k].iter().find(|(other, _)| same_file(path, other)) {
            let other = printable(other.display());
            return Err(FileError::new(path, format!("is the same file as the output {other}")));
        }
        let target = target(path)?;
        let fill = || {
            let (temporary, file) = create(&target)?;
            let mut file = BufWriter::new(file);
            write(content, &mut file)?;
            file.into_inner()?.sync_all()?;
            Ok(temporary)
        };
        let temporary = fill().map_err(|e| FileError::unwritable(path, &e))?;
        written.push((path, temporary, target));
    }
    written.iter().try_for_each(|(path, temporary, target)| {
        fs::rename(&temporary.0, target).map_err(|e| FileError::unwritable(path, &e))
    })
}

/// The file that an output's path stands for, if it can be replaced or made.
fn target(path: &Path) -> Result<PathBuf, FileError> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_file() => {
            let opened = OpenOptions::new().write(true).open(path);
            opened.map_err(|e| FileError::unwritable(path, &e))?;
        }
        Ok(found) => {
            let to = fs::read_link(path).map(|to| format!(" to {}", printable(to.display())));
            let (kind, to) = (kind(&found), to.unwrap_or_default());
            let reason = format!("is {kind}{to}; an output is a new file or a regular one");
            return Err(FileError::new(path, reason));
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(FileError::unwritable(path, &error)),
    }
    place(path).map_err(|e| FileError::unwritable(path, &e))
}

/// The name of a file in its folder, the folder without symbolic links.
fn place(path: &Path) -> io::Result<PathBuf> {
    let is_folder = path.to_string_lossy().ends_with(std::path::is_separator);
    let Some(name) = path.file_name().filter(|_| !is_folder) else {
        return Err(io::Error::new(ErrorKind::InvalidInput, "the path ends in no file's name"));
    };
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    Ok(fs::canonicalize(folder.unwrap_or(Path::new(".")))?.join(name))
}

/// The kind of a file that is not a regular one.
pub(crate) fn kind(file: &Metadata) -> &'static str {
    let kind = file.file_type();
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "a FIFO";
        } else if kind.is_socket() {
            return "a socket";
        } else if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
    }
    match (kind.is_dir(), kind.is_symlink()) {
        (true, _) => "a directory",
        (_, true) => "a symbolic link",
        _ => "a special file",
    }
}

/// A file that is removed when this is dropped; where it has been renamed there is none to remove.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.0);
    }
}

/// The number in the next temporary file's name. No name comes twice: what a dropped [`Temporary`]
/// removes is never the file of another.
static NEXT: AtomicUsize = AtomicUsize::new(0);

/// A new file beside `target`, with the permissions of `target`.
fn create(target: &Path) -> io::Result<(Temporary, File)> {
    loop {
        let (process, number) = (std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        let path = target.with_file_name(format!(".hlcp-{process}-{number}.partial"));
        let file = match File::create_new(&path) {
            // Left by a process that was killed.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
            made => made?,
        };
        let temporary = Temporary(path);
        if let Ok(found) = fs::metadata(target) {
            file.set_permissions(found.permissions())?;
        }
        return Ok((temporary, file));
    }
}
