//! `.spz` files (Niantic): six streams of bytes. Version 2 and 3 are one gzip file; in version 4 each stream is a
//! Zstandard frame of its own.
//!
//! The header, little endian: the letters NGSP, version and number of splats (4 bytes each), degree of the harmonics,
//! fractional bits of positions, flags (1: trained with anti-aliasing; 2: extensions follow). Version 4 goes on with the number of
//! streams (a byte), the place of their table (4 bytes) and 12 bytes that are not used; the table has the compressed and
//! the true size of each stream, 8 bytes each, and the streams follow it. For each splat the streams have:
//!
//! | stream | bytes | meaning |
//! |---|---|---|
//! | positions | 9 | x, y, z: 24-bit integers over 2^(fractional bits) |
//! | opacities | 1 | over 255 |
//! | colours | 3 | r, g, b: a constant term of (value/255 - 1/2)/0.15 |
//! | scales | 3 | exp(value/16 - 10) |
//! | rotations | 3 | version 2: x, y, z over 127.5, less 1; w is positive |
//! | | 4 | else: which of x, y, z, w is the greatest (2 bits), the others, sign and 9 bits each, up to sqrt(1/2) |
//! | harmonics | 0, 9, 24, 45 | r, g, b of every further term: (value - 128)/128 |
//!
//! Axes are x right, y up, z back; they are turned to those of the other formats, y down, z forward.

use super::{Gaussian, Gaussians};
use crate::error::quoted;
use crate::whole_file::{read_rest, read_whole, sha256};
use crate::{ElementReport, Error, Import, ImportReport, Place, PropertyReport, Usage};
use flate2::read::GzDecoder;
use glam::{DVec3, Vec3};
use ruzstd::decoding::StreamingDecoder;
use splat_core::harmonics::{MAX_DEGREE, terms};
use std::f64::consts::FRAC_1_SQRT_2;
use std::io::Read;
use std::path::Path;

/// The first bytes of a gzip file.
pub(crate) const GZIP: [u8; 2] = [0x1f, 0x8b];

/// The first bytes of the header.
pub(crate) const MAGIC: &[u8] = b"NGSP";

/// How many times as large as its file the data may be, beyond the first [`FREE_BYTES`]: far more than what is trained shrinks
/// by, and a tenth of what gzip can do. Claims beyond that are refused.
const MOST_RATIO: u64 = 100;

/// Data of this size are accepted from a file of any size.
const FREE_BYTES: u64 = 1 << 20;

/// Size of the header of version 2 and 3, in bytes, and the first part of that of version 4.
const HEADER_BYTES: usize = 16;

/// Bytes of a stream in the table of version 4.
const ENTRY_BYTES: usize = 16;

/// Names of the streams in messages.
const STREAMS: [&str; 6] = ["positions", "opacities", "colours", "scales", "rotations", "harmonics"];

/// The sign of each term of the harmonics when y and z are reversed.
const TURNED: [f32; 16] =
    [1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0];

/// Reads trained splats from an `.spz` file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Unsupported`] for other versions than 2 to 4, for extensions, and for what is no regular file;
/// [`Error::Invalid`] for anything malformed, truncated, or claiming more than such a file can hold; [`Error::Limit`] for
/// 2^32 - 1 splats or more, or more than memory.
pub fn read_spz(path: &Path) -> Result<Import, Error> {
    let check = |head: &[u8], path: &Path| match head.starts_with(&GZIP) {
        true => Ok(()),
        false => File { bytes: head, path }.check_magic(),
    };
    import(&read_whole(path, check)?, path)
}

/// Reads trained splats from the `size` bytes of an `.spz` file that `reader` yields; `path` is its name in messages.
///
/// # Errors
/// As [`read_spz`].
pub fn read_spz_from(reader: impl Read, size: u64, path: &Path) -> Result<Import, Error> {
    import(&read_rest(Vec::new(), reader, size, path)?, path)
}

/// Reads trained splats from the bytes of a file.
fn import(bytes: &[u8], path: &Path) -> Result<Import, Error> {
    let file = File { bytes, path };
    let (header, streams) = file.read()?;
    let gaussians = file.gaussians(&header, &streams)?;
    let mut assumptions = gaussians.assumptions(false);
    assumptions.push("y is up and z back in the file: turned to y down, z forward".to_owned());
    let report = ImportReport {
        path: path.to_owned(),
        format: format!("spz, version {}", header.version),
        bytes: bytes.len() as u64,
        sha256: sha256(bytes),
        elements: vec![header.element()],
        assumptions,
        losses: Vec::new(),
    };
    Ok(Import { cloud: gaussians.finish(), report })
}

/// The bytes of a file.
struct File<'a> {
    bytes: &'a [u8],
    path: &'a Path,
}

/// The data of each of [`STREAMS`].
type Streams = [Vec<u8>; 6];

struct Header {
    version: u32,
    count: usize,
    /// Degree of the harmonics in the file.
    degree: usize,
    fractional_bits: u8,
}

impl Header {
    /// Size of each stream, in bytes.
    fn sizes(&self) -> [u64; 6] {
        let rotation = if self.version == 2 { 3 } else { 4 };
        [9, 1, 3, 3, rotation, 3 * (terms(self.degree) as u64 - 1)].map(|bytes| bytes * self.count as u64)
    }

    /// What is said of the streams.
    fn element(&self) -> ElementReport {
        let usages =
            [Usage::Position, Usage::Opacity, Usage::Color, Usage::Size, Usage::Rotation, Usage::Harmonic];
        let properties = STREAMS.into_iter().zip(usages).zip(self.sizes()).filter(|(_, size)| *size > 0);
        ElementReport {
            name: "splat".to_owned(),
            count: self.count as u64,
            is_points: true,
            properties: properties
                .map(|((name, usage), size)| PropertyReport {
                    name: name.to_owned(),
                    kind: format!("{} uchar", size / self.count as u64),
                    usage,
                })
                .collect(),
        }
    }
}

impl<'a> File<'a> {
    fn read(&self) -> Result<(Header, Streams), Error> {
        if self.bytes.starts_with(&GZIP) {
            return self.read_in_turn(GzDecoder::new(self.bytes));
        }
        let version = self.bytes.get(4..8).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes);
        if self.bytes.starts_with(MAGIC) && version == Some(4) {
            return self.read_frames();
        }
        self.read_in_turn(self.bytes)
    }

    /// Reads the header, and the streams one after the other: version 2 and 3, once unpacked.
    fn read_in_turn(&self, mut data: impl Read) -> Result<(Header, Streams), Error> {
        let header = self.header(&self.exactly(&mut data, HEADER_BYTES as u64, "a header of 16 bytes")?)?;
        if header.version == 4 {
            return Err(self.invalid("version 4 in a gzip file", "version 2 or 3"));
        }
        let mut streams = Streams::default();
        for ((stream, size), name) in streams.iter_mut().zip(header.sizes()).zip(STREAMS) {
            *stream = self.exactly(&mut data, size, name)?;
        }
        self.at_end(data)?;
        Ok((header, streams))
    }

    /// Reads version 4.
    fn read_frames(&self) -> Result<(Header, Streams), Error> {
        let header = self.header(self.bytes)?;
        let cut_off = || self.invalid("the end of the file", "a table of streams");
        let integer = |at: usize| {
            let bytes = self.bytes.get(at..at.checked_add(8)?)?;
            Some(u64::from_le_bytes(bytes.try_into().ok()?))
        };
        let table = integer(HEADER_BYTES).ok_or_else(cut_off)? as u32 as usize;
        let sizes = header.sizes();
        let wanted = sizes.iter().filter(|&&size| size > 0).count();
        let count = usize::from(self.bytes[HEADER_BYTES - 1]);
        if count < wanted || count > STREAMS.len() {
            return Err(self.invalid(format!("{count} streams"), format!("{wanted} for this degree")));
        }
        let mut place = table.checked_add(count * ENTRY_BYTES).ok_or_else(cut_off)?;
        let mut streams = Streams::default();
        for (index, (stream, size)) in streams.iter_mut().zip(sizes).enumerate().take(count) {
            let entry = table + index * ENTRY_BYTES;
            let (packed, claimed) = integer(entry).zip(integer(entry + 8)).ok_or_else(cut_off)?;
            if claimed != size {
                let found = format!("{claimed} bytes of {}", STREAMS[index]);
                return Err(self.invalid(found, format!("{size} for {} splats", header.count)));
            }
            let end = usize::try_from(packed).ok().and_then(|packed| place.checked_add(packed));
            let frame = end.and_then(|end| self.bytes.get(place..end)).ok_or_else(|| {
                let found = format!("{packed} bytes of packed {}", STREAMS[index]);
                self.invalid(found, format!("at most the {} bytes that the file has", self.bytes.len()))
            })?;
            place += frame.len();
            if size > 0 {
                let data =
                    StreamingDecoder::new(frame).map_err(|cause| self.damaged(&cause, STREAMS[index]))?;
                let mut data = Box::new(data);
                *stream = self.exactly(&mut data, size, STREAMS[index])?;
                self.at_end(data)?;
            }
        }
        Ok((header, streams))
    }

    /// Checks the first bytes of what is not packed.
    fn check_magic(&self) -> Result<(), Error> {
        match self.bytes {
            bytes if bytes.starts_with(MAGIC) => Ok(()),
            bytes if bytes.len() < MAGIC.len() => {
                Err(self.invalid("the end of the file", "a header of 16 bytes"))
            }
            bytes => Err(self.invalid(quoted(&bytes[..4]), "`NGSP`, the first bytes of an .spz file")),
        }
    }

    /// Understands the first bytes of a header and holds what it claims against the file's size.
    fn header(&self, bytes: &[u8]) -> Result<Header, Error> {
        let Some(bytes) = bytes.first_chunk::<HEADER_BYTES>() else {
            return Err(self.invalid("the end of the file", "a header of 16 bytes"));
        };
        File { bytes, path: self.path }.check_magic()?;
        let [_, version, count, _] = *bytes.as_chunks::<4>().0 else {
            return Err(self.invalid("the end of the file", "a header of 16 bytes"));
        };
        let (version, count) = (u32::from_le_bytes(version), u32::from_le_bytes(count));
        let [degree, fractional_bits, flags] = [bytes[12], bytes[13], bytes[14]];
        if !(2..=4).contains(&version) {
            let found = format!("version {version} of .spz");
            return Err(Error::unsupported(self.path, found, "version 2, 3 or 4"));
        }
        if flags & !1 != 0 {
            let found = format!("an .spz file with extensions (flags {flags})");
            return Err(Error::unsupported(self.path, found, "one without"));
        }
        if degree > 4 || fractional_bits > 24 {
            let found = format!("degree {degree} and {fractional_bits} fractional bits");
            return Err(self.invalid(found, "a degree of 0 to 4 and at most 24 bits"));
        }
        let header = Header { version, count: count as usize, degree: degree.into(), fractional_bits };
        if count == u32::MAX {
            return Err(self.too_many(header.count, "4294967294 splats"));
        }
        let claimed: u64 = header.sizes().iter().sum();
        let most = FREE_BYTES + MOST_RATIO * self.bytes.len() as u64;
        if claimed > most {
            let found = format!("{count} splats, {claimed} bytes");
            let expected = format!("at most {most} bytes from a file of {}", self.bytes.len());
            return Err(self.invalid(found, expected));
        }
        Ok(header)
    }

    /// The next bytes of some data.
    fn exactly(&self, data: &mut impl Read, size: u64, what: &str) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        let room = usize::try_from(size).ok().and_then(|size| bytes.try_reserve_exact(size).ok());
        room.ok_or_else(|| Error::limit(self.path, format!("{size} bytes"), "this machine's memory"))?;
        data.take(size).read_to_end(&mut bytes).map_err(|cause| self.damaged(&cause, what))?;
        if (bytes.len() as u64) < size {
            let found = format!("the end of the data after {} bytes", bytes.len());
            return Err(self.invalid(found, format!("{what}, {size} bytes")));
        }
        Ok(bytes)
    }

    /// Checks that there is no more data (and so, that the checksum is right).
    fn at_end(&self, mut data: impl Read) -> Result<(), Error> {
        match data.read(&mut [0]).map_err(|cause| self.damaged(&cause, "the end of the data"))? {
            0 => Ok(()),
            _ => Err(self.invalid("more data than the splats have", "the end")),
        }
    }

    /// The splats.
    fn gaussians(&self, header: &Header, streams: &Streams) -> Result<Gaussians, Error> {
        let degree = header.degree.min(MAX_DEGREE);
        let mut gaussians = Gaussians::with_room(header.count, degree)
            .map_err(|_| self.too_many(header.count, "this machine's memory"))?;
        let [positions, opacities, colors, scales, rotations, harmonics] = streams;
        let unit = 1.0 / f64::from(1 << header.fractional_bits);
        let (further, rotation_bytes) =
            (3 * (terms(header.degree) - 1), rotations.len() / header.count.max(1));
        let mut coefficients = vec![Vec3::ZERO; terms(degree)];
        for (index, &opacity) in opacities.iter().enumerate() {
            let triple =
                |stream: &[u8]| -> [f64; 3] { std::array::from_fn(|i| stream[3 * index + i].into()) };
            let position = positions[9 * index..][..9].as_chunks::<3>().0;
            let [x, y, z] = std::array::from_fn(|axis| fixed_point(position[axis]) * unit);
            let [w, qx, qy, qz] = quaternion(&rotations[rotation_bytes * index..][..rotation_bytes]);
            let gaussian = Gaussian {
                position: DVec3::new(x, -y, -z),
                scales: triple(scales).map(|value| libm::exp(value / 16.0 - 10.0)),
                rotation: [w, qx, -qy, -qz],
                opacity: f64::from(opacity) / 255.0,
            };
            let constant = triple(colors).map(|value| (value / 255.0 - 0.5) / 0.15);
            coefficients[0] = DVec3::from_array(constant).as_vec3();
            let rgb = harmonics[further * index..][..further].as_chunks::<3>().0;
            for (term, rgb) in rgb.iter().enumerate().take(terms(degree) - 1) {
                let value = rgb.map(|byte| (f32::from(byte) - 128.0) / 128.0);
                coefficients[term + 1] = TURNED[term + 1] * Vec3::from_array(value);
            }
            gaussians.push(&gaussian, &coefficients);
        }
        Ok(gaussians)
    }

    fn invalid(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        Error::invalid(self.path, Place::File, found, expected)
    }

    fn damaged(&self, cause: &dyn std::fmt::Display, what: &str) -> Error {
        self.invalid(format!("damaged data ({cause})"), what)
    }

    fn too_many(&self, count: usize, limit: &str) -> Error {
        Error::limit(self.path, format!("a cloud of {count} splats"), limit)
    }
}

/// A signed integer of three bytes, the least significant one first.
fn fixed_point([a, b, c]: [u8; 3]) -> f64 {
    f64::from(i32::from_le_bytes([0, a, b, c]) >> 8)
}

/// The quaternion w, x, y, z of 3 bytes (version 2) or 4.
fn quaternion(bytes: &[u8]) -> [f64; 4] {
    let rest = |sum: f64| (1.0 - sum).max(0.0).sqrt();
    if let Some(bytes) = bytes.first_chunk() {
        let packed = u32::from_le_bytes(*bytes);
        let greatest = (packed >> 30) as usize;
        // x, y, z, w without the greatest, the first of them in the most significant bits.
        let mut values = [0.0; 4];
        let others = (0..4).filter(|&component| component != greatest);
        for (component, shift) in others.zip([20, 10, 0]) {
            let value = FRAC_1_SQRT_2 * f64::from(packed >> shift & 511) / 511.0;
            values[component] = if packed >> shift & 512 == 0 { value } else { -value };
        }
        values[greatest] = rest(values.iter().map(|value| value * value).sum());
        let [x, y, z, w] = values;
        return [w, x, y, z];
    }
    let [x, y, z] = std::array::from_fn(|i| bytes.get(i).map_or(0.0, |&byte| f64::from(byte) / 127.5 - 1.0));
    [rest(x * x + y * y + z * z), x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::harmonics::basis;

    #[test]
    fn turned_harmonics_are_the_same_in_turned_directions() {
        for direction in [Vec3::new(0.3, -0.8, 0.5), Vec3::new(-0.1, 0.2, 0.9)].map(Vec3::normalize) {
            let turned = basis(Vec3::new(direction.x, -direction.y, -direction.z));
            for ((value, turned), sign) in basis(direction).into_iter().zip(turned).zip(TURNED) {
                assert!((value - sign * turned).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn integers_of_three_bytes_have_a_sign() {
        let cases =
            [([0, 0, 0], 0.0), ([1, 2, 0], 513.0), ([255, 255, 255], -1.0), ([0, 0, 128], -8_388_608.0)];
        for (bytes, value) in cases {
            assert_eq!(fixed_point(bytes), value);
        }
    }

    #[test]
    fn quaternions_by_their_three_smaller_components() {
        let near = |found: [f64; 4], expected: [f64; 4]| {
            let close = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 4e-3);
            assert!(close, "{found:?} {expected:?}");
        };
        near(quaternion(&(3_u32 << 30).to_le_bytes()), [1.0, 0.0, 0.0, 0.0]);
        near(quaternion(&0_u32.to_le_bytes()), [0.0, 1.0, 0.0, 0.0]);
        // The greatest is y; x = -1/2, z = 1/2, w = -1/2.
        let half: u32 = 361;
        let packed = 1 << 30 | (512 | half) << 20 | half << 10 | (512 | half);
        near(quaternion(&packed.to_le_bytes()), [-0.5, -0.5, 0.5, 0.5]);
        near(quaternion(&[255, 128, 128]), [0.0, 1.0, 0.0, 0.0]);
    }
}
