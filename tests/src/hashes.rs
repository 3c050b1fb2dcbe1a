//! Hashes of pictures: one number that is the same on every machine, or something has changed.

use crate::analytic::film_bits;
use splat_core::Film;

/// The variable that makes what is drawn now the expected: `SPLAT_ACCEPT=1`.
pub const ACCEPT: &str = "SPLAT_ACCEPT";

/// Whether what is drawn now is to be kept as the expected.
pub fn accepts() -> bool {
    std::env::var_os(ACCEPT).is_some_and(|value| value == "1")
}

/// FNV-1a (Fowler, Noll, Vo), 64 bits, over the bytes of some numbers, the lowest first.
pub fn fnv(numbers: impl Iterator<Item = u32>) -> u64 {
    numbers
        .flat_map(u32::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// The hash of all bits of a film: its window, what was subtracted from positions, and each channel that is there.
pub fn film_hash(film: &Film) -> u64 {
    let window = [film.window.x0, film.window.y0, film.window.x1, film.window.y1];
    let origin = film.position_origin.to_array().map(f64::to_bits);
    let head = window.into_iter().map(|side| side as u32);
    let head = head.chain(origin.into_iter().flat_map(|bits| [bits as u32, (bits >> 32) as u32]));
    fnv(head.chain(film_bits(film).into_iter().flatten()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{AovSelection, PixelRect};

    #[test]
    fn the_hash_is_the_published_one() {
        // Of eight bytes 0, and of nothing.
        assert_eq!(fnv([0, 0].into_iter()), 0xa8c7_f832_281a_39c5);
        assert_eq!(fnv(std::iter::empty()), 0xcbf2_9ce4_8422_2325);
    }

    #[test]
    fn every_bit_of_a_film_counts() {
        let film = Film::new([4, 3], PixelRect::new(1, 0, 4, 3), AovSelection::ALL);
        let changes: [fn(&mut Film); 8] = [
            // -0 is another number than 0 here.
            |film| film.rgba[6][2] = -0.0,
            |film| film.depth.as_mut().unwrap()[8] = 1.0,
            |film| film.variance.as_mut().unwrap()[0].z = f32::from_bits(1),
            |film| film.id.as_mut().unwrap()[3] = 7,
            |film| film.normal.as_mut().unwrap()[3].y = -0.0,
            |film| film.position_origin.x = f64::from_bits(1),
            |film| film.window = PixelRect::new(0, 0, 3, 3),
            |film| film.layers = None,
        ];
        let mut hashes = vec![film_hash(&film)];
        for change in changes {
            let mut other = film.clone();
            change(&mut other);
            hashes.push(film_hash(&other));
        }
        hashes.sort_unstable();
        hashes.dedup();
        assert_eq!(hashes.len(), changes.len() + 1);
    }
}
