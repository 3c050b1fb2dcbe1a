//! The compression LZF (Marc Lehmann's LibLZF), in which every size is checked.
//!
//! A byte below 32 is the length less one of literal bytes that follow. Any other begins a copy of earlier output: its
//! upper three bits are the length less two (if all are set, the next byte is added to it), its lower five and a further
//! byte the distance less one.

/// Greatest growth: a copy of 264 bytes takes three.
const MOST_GROWTH: usize = 88;

/// Decompresses to exactly `size` bytes, or `None` if the bytes are damaged.
pub(super) fn decompress(mut packed: &[u8], size: usize) -> Option<Vec<u8>> {
    if size / MOST_GROWTH > packed.len() {
        return None;
    }
    let mut out = Vec::new();
    out.try_reserve_exact(size).ok()?;
    while let Some((&control, rest)) = packed.split_first() {
        let control = usize::from(control);
        if control < 32 {
            let (literal, rest) = rest.split_at_checked(control + 1)?;
            out.extend_from_slice(literal);
            packed = rest;
        } else {
            let (more, rest) = if control >> 5 == 7 { rest.split_first()? } else { (&0, rest) };
            let (&low, rest) = rest.split_first()?;
            let length = (control >> 5) + usize::from(*more) + 2;
            let distance = ((control & 31) << 8) + usize::from(low) + 1;
            let from = out.len().checked_sub(distance)?;
            // The copy may run into what it writes.
            (from..from + length).for_each(|at| out.push(out[at]));
            packed = rest;
        }
        if out.len() > size {
            return None;
        }
    }
    (out.len() == size).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_copies_that_run_into_themselves() {
        // "ab", then 5 bytes from 2 back; then 1 + 9 from 1 back.
        let packed = [1, b'a', b'b', 3 << 5, 1, 7 << 5, 1, 0];
        assert_eq!(decompress(&packed, 17).unwrap(), b"abababaaaaaaaaaaa");
        assert_eq!(decompress(&packed, 16), None);
        assert_eq!(decompress(&packed, 18), None);
        assert_eq!(decompress(&packed, usize::MAX), None);
        assert_eq!(decompress(&[], 0).unwrap(), b"");
    }

    #[test]
    fn damage_is_found() {
        for packed in [&[5, b'a'][..], &[32, 0], &[0, b'a', 32], &[0, b'a', 7 << 5, 9], &[0, b'a', 32, 1]] {
            assert_eq!(decompress(packed, 3), None, "{packed:?}");
        }
    }
}
