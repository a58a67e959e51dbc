//! Decimal numbers on the proved side of a bound.

/// Writes `value` as `1.23e-4`, with `digits` digits after the point, rounded towards +∞ if `up`
/// and towards −∞ if not.
///
/// As a real number the decimal one is not below `value`, or not above it, so what is proved of the
/// one holds for what a reader sees. `{:.2e}` rounds to nearest, and shows half of all bounds too
/// small.
///
/// ```
/// use hlcp_verify::decimal;
///
/// let bound = 6.2926e-4;
/// assert_eq!(format!("{bound:.2e}"), "6.29e-4"); // below the bound
/// assert_eq!(decimal(bound, 2, true), "6.30e-4");
/// assert_eq!(decimal(-bound, 2, true), "-6.29e-4");
/// assert_eq!(decimal(9.991, 2, true), "1.00e1");
/// assert_eq!(decimal(0.25, 1, false), "2.5e-1"); // as it is
/// ```
pub fn decimal(value: f64, digits: usize, up: bool) -> String {
    // All digits: a double has 767 at most.
    let exact = format!("{:.*e}", digits.max(766), value.abs());
    let Some((mantissa, exponent)) = exact.split_once('e') else { return format!("{value}") };
    let sign = if value < 0.0 { "-" } else { "" };
    let text = rounded(mantissa, digits, up == (value > 0.0));
    match (text.strip_prefix("10"), exponent.parse::<i32>()) {
        (Some(zeros), Ok(exponent)) => format!("{sign}1{zeros}e{}", exponent + 1),
        _ => format!("{sign}{text}e{exponent}"),
    }
}

/// Writes `value` as `0.000123`, else as [`decimal`] does.
///
/// ```
/// use hlcp_verify::fixed;
///
/// assert_eq!(fixed(0.1234, 2, true), "0.13");
/// assert_eq!(fixed(-99.96, 1, false), "-100.0");
/// ```
pub fn fixed(value: f64, digits: usize, up: bool) -> String {
    // The last bit of the smallest double is 2⁻¹⁰⁷⁴.
    let exact = format!("{:.*}", digits.max(1074), value.abs());
    let sign = if value < 0.0 { "-" } else { "" };
    format!("{sign}{}", rounded(&exact, digits, up == (value > 0.0)))
}

/// The decimal number `exact` with `digits` digits after the point, away from zero or towards it.
fn rounded(exact: &str, digits: usize, away: bool) -> String {
    let point = exact.find('.').unwrap_or(exact.len());
    let end = if digits == 0 { point } else { (point + 1 + digits).min(exact.len()) };
    let (kept, rest) = exact.split_at(end);
    if !(away && rest.contains(|c| matches!(c, '1'..='9'))) {
        return kept.to_owned();
    }
    // One more in the last place that has room for it.
    let Some(last) = kept.rfind(|c| matches!(c, '0'..='8')) else {
        return format!("1{}", kept.replace('9', "0"));
    };
    let digit = char::from(kept.as_bytes()[last] + 1);
    format!("{}{digit}{}", &kept[..last], kept[last + 1..].replace('9', "0"))
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;

    use super::*;
    use crate::families::Random;

    /// The exact value of a decimal number.
    fn exactly(text: &str) -> BigRational {
        let (mantissa, exponent) = text.split_once('e').unwrap_or((text, "0"));
        let places = mantissa.split_once('.').map_or(0, |(_, places)| places.len()) as i32;
        let whole: BigRational = mantissa.replace('.', "").parse().unwrap();
        let ten = BigRational::from_float(10.0).unwrap();
        whole * ten.pow(exponent.parse::<i32>().unwrap() - places)
    }

    /// Doubles of all sizes, ones next to short decimal numbers, and these themselves: on the side
    /// that was asked for, and less than a unit of the last digit away.
    #[test]
    fn a_printed_number_is_on_its_side() {
        let mut random = Random(1);
        let mut values =
            vec![0.0, -0.0, f64::MAX, f64::from_bits(1), f64::MIN_POSITIVE, 9.995, 1.0];
        for k in 0..1000 {
            let short = (random.next() >> 50) as f64 * 10.0_f64.powi(k % 30 - 15);
            values.extend([f64::from_bits(random.next()), short.next_up(), short.next_down()]);
            values.extend([short, -short]);
        }
        let mut nearest = 0;
        for value in values.into_iter().filter(|value| value.is_finite()) {
            let exact = BigRational::from_float(value).unwrap();
            for (digits, up) in
                [(0, true), (2, true), (6, true), (0, false), (1, false), (6, false)]
            {
                let wide = value.abs() < 1e-20 || value.abs() > 1e20;
                let both = [decimal(value, digits, up), fixed(value, digits, up)];
                for text in both.iter().take(if wide { 1 } else { 2 }) {
                    let (mantissa, exponent) = text.split_once('e').unwrap_or((text, "0"));
                    let places = mantissa.split_once('.').map_or(0, |(_, places)| places.len());
                    assert_eq!(places, digits, "{value:e}: {text}");
                    let off = if up { exactly(text) - &exact } else { &exact - exactly(text) };
                    let unit =
                        exactly(&format!("1e{}", exponent.parse::<i32>().unwrap() - digits as i32));
                    let zero = BigRational::from_float(0.0).unwrap();
                    assert!(off >= zero && off < unit, "{value:e}, {digits} digits, {up}: {text}");
                }
                let plain = exactly(&format!("{value:.digits$e}"));
                nearest += usize::from(if up { plain < exact } else { plain > exact });
            }
        }
        assert!(nearest > 5_000, "{nearest} rounded to nearest are on the other side");
    }

    #[test]
    fn what_is_no_number_is_no_number() {
        for up in [false, true] {
            assert_eq!(decimal(f64::NAN, 2, up), "NaN");
            assert_eq!(decimal(f64::INFINITY, 2, up), "inf");
            assert_eq!(decimal(f64::NEG_INFINITY, 2, up), "-inf");
            assert_eq!(fixed(f64::INFINITY, 2, up), "inf");
        }
    }
}
