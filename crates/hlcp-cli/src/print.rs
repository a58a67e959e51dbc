//! Lines on standard output, and the numbers in them.

use std::{
    fmt::Display,
    io::{self, ErrorKind, Write},
};

use hlcp_verify::decimal;

/// Prints a line. A reader that has gone away, as `head` does, ends the program with status 0.
///
/// `println!` would panic. No file may be half written when this is called.
pub(crate) fn line(line: impl Display) -> io::Result<()> {
    match writeln!(io::stdout(), "{line}") {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => std::process::exit(0),
        done => done,
    }
}

/// Returns the ends of a proved interval, rounded outwards, with as many digits as they have in
/// common and one more.
pub(crate) fn ends([lower, upper]: [f64; 2]) -> [String; 2] {
    let digits = (lower.abs().max(upper.abs()) / (upper - lower)).log10().clamp(2.0, 16.0);
    [(lower, false), (upper, true)].map(|(end, up)| decimal(end, digits as usize, up))
}
