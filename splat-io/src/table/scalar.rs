//! The eight number types of PLY, under both their spellings.

/// A number type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub const ALL: [Self; 8] =
        [Self::I8, Self::U8, Self::I16, Self::U16, Self::I32, Self::U32, Self::F32, Self::F64];

    /// The original spelling and the one with sizes.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            Self::I8 => ["char", "int8"],
            Self::U8 => ["uchar", "uint8"],
            Self::I16 => ["short", "int16"],
            Self::U16 => ["ushort", "uint16"],
            Self::I32 => ["int", "int32"],
            Self::U32 => ["uint", "uint32"],
            Self::F32 => ["float", "float32"],
            Self::F64 => ["double", "float64"],
        }
    }

    /// The type of that name.
    pub fn from_name(name: &[u8]) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.names().iter().any(|known| known.as_bytes() == name))
    }

    /// Size in a binary file, in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Least and greatest value of an integer type; `None` for floats.
    pub fn range(self) -> Option<(i64, i64)> {
        match self {
            Self::I8 => Some((i8::MIN.into(), i8::MAX.into())),
            Self::U8 => Some((0, u8::MAX.into())),
            Self::I16 => Some((i16::MIN.into(), i16::MAX.into())),
            Self::U16 => Some((0, u16::MAX.into())),
            Self::I32 => Some((i32::MIN.into(), i32::MAX.into())),
            Self::U32 => Some((0, u32::MAX.into())),
            Self::F32 | Self::F64 => None,
        }
    }

    /// The number in the first bytes of a row's rest, which must be long enough; exact, since every type fits
    /// `f64`.
    #[inline]
    pub fn decode<const BIG: bool>(self, bytes: &[u8]) -> f64 {
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(little::<2, BIG>(bytes))),
            Self::U16 => f64::from(u16::from_le_bytes(little::<2, BIG>(bytes))),
            Self::I32 => f64::from(i32::from_le_bytes(little::<4, BIG>(bytes))),
            Self::U32 => f64::from(u32::from_le_bytes(little::<4, BIG>(bytes))),
            Self::F32 => f64::from(f32::from_le_bytes(little::<4, BIG>(bytes))),
            Self::F64 => f64::from_le_bytes(little::<8, BIG>(bytes)),
        }
    }

    /// The number that a word of an ASCII file spells, or what was expected instead.
    ///
    /// Integers may be written as whole floats ("255.0"), as some programs do. Not-a-number and infinity are
    /// known in C's and Microsoft's spellings too.
    #[inline]
    pub fn parse(self, word: &[u8]) -> Result<f64, String> {
        match self.range() {
            None => parse_float(word).ok_or_else(|| "a number".to_owned()),
            Some((least, greatest)) => {
                let value = parse_digits(word).or_else(|| parse_float(word).filter(|v| v.fract() == 0.0));
                value
                    .filter(|&value| value >= least as f64 && value <= greatest as f64)
                    .ok_or_else(|| format!("a whole number, {least} to {greatest}"))
            }
        }
    }
}

/// The first N bytes, the least significant one first.
#[inline]
fn little<const N: usize, const BIG: bool>(bytes: &[u8]) -> [u8; N] {
    let mut little = [0; N];
    little.copy_from_slice(&bytes[..N]);
    if BIG {
        little.reverse();
    }
    little
}

/// A plain whole number of at most 18 digits.
#[inline]
fn parse_digits(word: &[u8]) -> Option<f64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value: i64 = 0;
    for digit in digits {
        value = value * 10 + i64::from(digit.checked_sub(b'0').filter(|&digit| digit < 10)?);
    }
    Some(if negative { -value } else { value } as f64)
}

#[inline]
fn parse_float(word: &[u8]) -> Option<f64> {
    let text = str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| parse_not_finite(text))
}

/// What C and Microsoft's libraries print for what is not finite, beyond the plain `nan` and `inf`.
#[cold]
fn parse_not_finite(text: &str) -> Option<f64> {
    let text = text.strip_prefix(['-', '+']).unwrap_or(text).to_ascii_lowercase();
    match text.as_str() {
        "1.#inf" => Some(f64::INFINITY),
        "1.#nan" | "1.#qnan" | "1.#snan" | "1.#ind" => Some(f64::NAN),
        _ if text.starts_with("nan(") && text.ends_with(')') => Some(f64::NAN),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_type_decode_from_either_endian() {
        for kind in Scalar::ALL {
            let value: f64 = if kind.range().is_some() { 100.0 } else { -0.5 };
            let bytes = crate::ply::tests::encode(kind, value, false);
            assert_eq!(bytes.len(), kind.bytes());
            assert_eq!(kind.decode::<false>(&bytes), value);
            assert_eq!(kind.decode::<true>(&crate::ply::tests::encode(kind, value, true)), value);
        }
    }

    #[test]
    fn whole_numbers_must_fit_their_type() {
        assert_eq!(Scalar::U8.parse(b"255"), Ok(255.0));
        assert_eq!(Scalar::U8.parse(b"+7"), Ok(7.0));
        assert_eq!(Scalar::U8.parse(b"254.0"), Ok(254.0));
        assert_eq!(Scalar::I8.parse(b"-128"), Ok(-128.0));
        for word in ["256", "-1", "1.5", "nan", "inf", "", "-", "99999999999999999999999"] {
            let error = Scalar::U8.parse(word.as_bytes()).unwrap_err();
            assert_eq!(error, "a whole number, 0 to 255", "{word}");
        }
    }

    #[test]
    fn floats_may_be_not_finite_in_many_spellings() {
        assert_eq!(Scalar::F32.parse(b"-1.5e-3"), Ok(-1.5e-3));
        assert_eq!(Scalar::F64.parse(b"1e999"), Ok(f64::INFINITY));
        for word in
            ["nan", "NaN", "-nan", "-nan(ind)", "nan(0x1)", "inf", "-Inf", "infinity", "1.#INF", "-1.#IND"]
        {
            assert!(!Scalar::F32.parse(word.as_bytes()).unwrap().is_finite(), "{word}");
        }
        for word in ["", "x", "1,5", "0x10", "1.0f", "--1", "nanny", "\u{ff11}"] {
            assert_eq!(Scalar::F32.parse(word.as_bytes()), Err("a number".to_owned()), "{word}");
        }
    }
}
