//! Lines on standard output, for all programs here.

use std::{
    fmt::Display,
    io::{self, ErrorKind, Write},
};

/// Prints a line. A reader that has gone away, as `head` does, ends the program with status 0.
///
/// `println!` would panic. No file may be half written when this is called.
pub(crate) fn line(line: impl Display) -> io::Result<()> {
    match writeln!(io::stdout(), "{line}") {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        done => done,
    }
}
