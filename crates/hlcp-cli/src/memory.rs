/// Refuses to begin what takes this many bytes for each of so many unknowns, or more, where there
/// is no such memory; Rust's own answer would be to abort.
pub(crate) fn check(unknowns: usize, each: usize, way_out: &str) -> Result<(), String> {
    let bytes = unknowns.saturating_mul(each);
    if Vec::<u8>::new().try_reserve_exact(bytes).is_ok() {
        return Ok(());
    }
    let size = bytes as f64 * 1e-9;
    Err(format!(
        "{unknowns} unknowns take {size:.1} GB of memory or more, which cannot be had; {way_out}"
    ))
}
