//! Operations on numbers that take a single instruction, or a few, on every processor: set-up is full of them.

/// The greater of two numbers; `b` if one of them is not a number. (What [`f64::max`] knows of such costs four instructions
/// more.)
#[inline(always)]
pub fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The lesser of two numbers; `b` if one of them is not a number.
#[inline(always)]
pub fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greatest integer not above a number, within [-2^31 + 2, 2^31 - 2]; 0 of what is not a number. (`f64::floor` is a call
/// where the processor's oldest ancestors lack it, and a conversion has to ask for all that does not fit.)
#[inline(always)]
pub fn floor(value: f64) -> i32 {
    /// Numbers near this one are integers, which stand in their lowest bits.
    const INTEGERS: f64 = 1.5 * (1u64 << 52) as f64;
    const GREATEST: f64 = (i32::MAX - 1) as f64;
    let value = greater(-GREATEST, lesser(GREATEST, value));
    let sum = value + INTEGERS;
    sum.to_bits() as i32 - i32::from(sum - INTEGERS > value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_are_those_of_the_library() {
        let near = |value: f64| [value.next_down(), value, value.next_up()];
        let integers = (-40..40).chain([1 << 20, -(1 << 30), i32::MAX - 2, i32::MIN + 3]).map(f64::from);
        for value in integers.flat_map(|integer| [integer, integer + 0.5]).flat_map(near) {
            assert_eq!(f64::from(floor(value)), libm::floor(value), "{value}");
        }
        for (value, expected) in [(f64::NAN, 0), (1e300, i32::MAX - 1), (-f64::INFINITY, 1 - i32::MAX)] {
            assert_eq!(floor(value), expected, "{value}");
        }
    }
}
