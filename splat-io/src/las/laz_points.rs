//! Compressed points.
//!
//! The arithmetic decoder is the crate `laz`'s. It takes sizes from the file on trust: the length of the table of chunks
//! (64 GB in a few bytes), the layers of a chunk (4 GB each), the chunk that a point lies in (a panic). So the layout is
//! checked here, and each chunk goes to a decoder of its own that sees no byte of another. GPS times of LAS 1.4 are
//! passed over: nobody asks for them, and the decoder calls itself for each change of sequence.
//!
//! Two things are left to the crate. It could still panic on what it decodes, which ends in an error all the same
//! ([`catch_unwind`]); nothing of the kind was ever seen. And the same recursion is in the older compression of GPS times,
//! where nothing can be passed over: a file made for the purpose could exhaust the stack.

use super::bytes_at;
use super::gps_time::GpsTimes;
use super::header::Header;
use super::points::Points;
use crate::{Error, Place};
use laz::laszip::ChunkTable;
use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use laz::{DecompressionSelection, LazItem, LazItemRecordBuilder, LazItemType, LazVlr};
use std::io::Cursor;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// How many points get room at a time: their number is a claim that only decoding proves.
const ROOM: u64 = 1 << 16;

/// A file has at most so many points a byte, beyond the first [`FREE_POINTS`]. Surveys have less than one; points that the
/// decoder can foretell take next to nothing, so that a few bytes could go on for hours.
const MOST_POINTS_A_BYTE: u64 = 100;

/// So many points are accepted from a file of any size.
const FREE_POINTS: u64 = 1 << 20;

/// Reads the compressed points.
pub(super) fn read(bytes: &[u8], header: &Header, points: &mut Points, path: &Path) -> Result<(), Error> {
    let record = header.record(bytes, b"laszip encoded", LazVlr::RECORD_ID);
    let Some(record) = record else {
        let expected = "the record of user `laszip encoded` that says how they are";
        return Err(Error::invalid(path, Place::File, "compressed points", expected));
    };
    if header.count == 0 {
        return Ok(());
    }
    let most = FREE_POINTS + MOST_POINTS_A_BYTE * bytes.len() as u64;
    if header.count > most {
        let found = format!("a header that claims {} compressed points", header.count);
        let expected = format!("at most {most} in a file of {} bytes", bytes.len());
        return Err(Error::invalid(path, Place::File, found, expected));
    }
    let layout = Layout::read(record, header, path)?;
    let chunks = layout.chunks(bytes, header, path)?;
    for Chunk { range, points: most } in chunks {
        let left = header.count - points.len() as u64;
        let place = range.start;
        let chunk = &bytes[range];
        let decoded =
            catch_unwind(AssertUnwindSafe(|| layout.decode(chunk, most.min(left), points, header, path)));
        match decoded {
            Ok(Ok(())) => {}
            Ok(Err(Failure::Decoder(reason))) => return Err(damaged(path, place, points, header, &reason)),
            Ok(Err(Failure::Memory(error))) => return Err(error),
            Err(_) => return Err(damaged(path, place, points, header, "nonsense")),
        }
    }
    if (points.len() as u64) < header.count {
        return Err(damaged(path, bytes.len(), points, header, "no further chunk"));
    }
    Ok(())
}

fn damaged(path: &Path, byte: usize, points: &Points, header: &Header, reason: &str) -> Error {
    let found = format!("{reason} after {} points", points.len());
    let expected = format!("{} compressed points", header.count);
    Error::invalid(path, Place::Byte(byte as u64), found, expected)
}

/// Why a chunk was not decoded.
enum Failure {
    Decoder(String),
    Memory(Error),
}

/// How points are compressed.
struct Layout {
    /// `None`: one chunk with all points.
    chunk_points: Option<ChunkPoints>,
    /// Whether each attribute has a layer of its own, as in LAS 1.4.
    is_layered: bool,
    items: Vec<LazItem>,
    record: LazVlr,
}

/// Number of points of a chunk.
#[derive(Clone, Copy)]
enum ChunkPoints {
    Fixed(u64),
    InTable,
}

/// A chunk: where it lies, and how many points it has at most.
struct Chunk {
    range: Range<usize>,
    points: u64,
}

impl Layout {
    /// Reads the record that says how points are compressed, and holds it against their format.
    fn read(record: &[u8], header: &Header, path: &Path) -> Result<Self, Error> {
        let unsupported =
            |found: String| Err(Error::unsupported(path, found, "LAZ as LASzip 2 and 3 write it"));
        let vlr = match LazVlr::from_buffer(record) {
            Ok(vlr) => vlr,
            Err(error) => return unsupported(format!("a compression that cannot be understood ({error})")),
        };
        // Fits: a point has less than 65536 bytes.
        let extra = header.extra_bytes() as u16;
        let expected = LazItemRecordBuilder::default_for_point_format_id(header.format, extra);
        let expected = expected.map_err(|error| Error::unsupported(path, error.to_string(), "LAZ"))?;
        let what = |item: &LazItem| (item.item_type(), item.size());
        let items = vlr.items().clone();
        let is_layered = header.is_extended();
        let versions = if is_layered { 3..=4 } else { 1..=2 };
        if !items.iter().map(what).eq(expected.iter().map(what))
            || !items.iter().all(|item| versions.contains(&item.version()))
        {
            let (format, size) = (header.format, header.record_bytes);
            return unsupported(format!(
                "a compression that does not fit point format {format} of {size} bytes"
            ));
        }
        let compressor = record.first().copied().unwrap_or_default();
        let chunk_points = match compressor {
            1 if !is_layered => None,
            2 | 3 if vlr.uses_variable_size_chunks() => Some(ChunkPoints::InTable),
            2 | 3 => Some(ChunkPoints::Fixed(vlr.chunk_size().into())),
            _ => return unsupported(format!("compressor {compressor}")),
        };
        Ok(Self { chunk_points, is_layered, items, record: vlr })
    }

    /// Reads the table of chunks, and checks that they lie in the file.
    fn chunks(&self, bytes: &[u8], header: &Header, path: &Path) -> Result<Vec<Chunk>, Error> {
        let Some(chunk_points) = self.chunk_points else {
            return Ok(vec![Chunk { range: header.data..bytes.len(), points: header.count }]);
        };
        let invalid = |at: usize, found: String, expected: &str| {
            Error::invalid(path, Place::Byte(at as u64), found, expected)
        };
        let first = header.data + 8;
        let claimed = bytes_at(bytes, header.data).map_or(-1, i64::from_le_bytes);
        // A writer that cannot go back leaves the place of the table at the end of the file.
        let last =
            bytes.len().checked_sub(8).and_then(|at| bytes_at(bytes, at)).map_or(-1, i64::from_le_bytes);
        let is_possible =
            |at: &usize| *at >= first && at.checked_add(8).is_some_and(|end| end <= bytes.len());
        let place = |claim: i64| usize::try_from(claim).ok().filter(is_possible);
        let Some(table) = place(claimed).or_else(|| place(last)) else {
            let expected = format!("a table of chunks between bytes {first} and {}", bytes.len());
            return Err(invalid(header.data, format!("a table of chunks at byte {claimed}"), &expected));
        };
        let room = (table - first) / header.record_bytes;
        let count = u32::from_le_bytes(bytes_at(bytes, table + 4).unwrap_or_default());
        if count as usize > room {
            let expected = format!("at most {room}: each begins with a whole point");
            return Err(invalid(table + 4, format!("{count} chunks"), &expected));
        }
        let with_points = matches!(chunk_points, ChunkPoints::InTable);
        let entries = catch_unwind(|| ChunkTable::read(&mut Cursor::new(&bytes[table..]), with_points));
        let Ok(Ok(entries)) = entries else {
            return Err(invalid(table, "a damaged table of chunks".to_owned(), "where each chunk begins"));
        };
        let mut start = first;
        let mut chunks = Vec::with_capacity(entries.len());
        for entry in &entries {
            let end = usize::try_from(entry.byte_count).ok().and_then(|bytes| start.checked_add(bytes));
            let Some(end) = end.filter(|&end| end <= table) else {
                let found = format!("a chunk of {} bytes", entry.byte_count);
                return Err(invalid(start, found, &format!("chunks up to byte {table}")));
            };
            let points = match chunk_points {
                ChunkPoints::Fixed(points) => points,
                ChunkPoints::InTable => entry.point_count,
            };
            chunks.push(Chunk { range: start..end, points });
            start = end;
        }
        Ok(chunks)
    }

    /// Decodes a chunk.
    fn decode(
        &self,
        chunk: &[u8],
        count: u64,
        points: &mut Points,
        header: &Header,
        path: &Path,
    ) -> Result<(), Failure> {
        if self.is_layered && !self.layers_fit(chunk, header.record_bytes) {
            return Err(Failure::Decoder("layers longer than their chunk".to_owned()));
        }
        let source = Cursor::new(chunk);
        let failure = |error: laz::LasZipError| Failure::Decoder(error.to_string());
        let mut decoder: Box<dyn RecordDecompressor<Cursor<&[u8]>>> = if self.is_layered {
            let mut decoder = LayeredPointRecordDecompressor::new(source);
            decoder.set_fields_from(self.record.items()).map_err(failure)?;
            Box::new(decoder)
        } else {
            let mut decoder = SequentialPointRecordDecompressor::new(source);
            for item in self.record.items() {
                match (item.item_type(), item.version()) {
                    (LazItemType::GpsTime, 2) => decoder.add_field_decompressor(GpsTimes::new()),
                    _ => decoder.set_fields_from(&vec![*item]).map_err(failure)?,
                }
            }
            Box::new(decoder)
        };
        decoder.set_selection(
            DecompressionSelection::all().skip_gps_time().skip_wavepacket().skip_extra_bytes(),
        );
        let mut record = vec![0; header.record_bytes];
        for index in 0..count {
            if index % ROOM == 0 {
                points.reserve(ROOM.min(count - index), path).map_err(Failure::Memory)?;
            }
            let decoded = decoder.decompress_next(&mut record);
            decoded.map_err(|error| Failure::Decoder(error.to_string()))?;
            points.push(&record);
        }
        Ok(())
    }

    /// Whether the layers of a chunk are no longer than it: behind the first point and the number of points stand their
    /// sizes.
    fn layers_fit(&self, chunk: &[u8], record_bytes: usize) -> bool {
        let layers: usize = self
            .items
            .iter()
            .map(|item| match item.item_type() {
                LazItemType::Point14 => 9,
                LazItemType::RGBNIR14 => 2,
                LazItemType::Byte14(bytes) => usize::from(bytes),
                _ => 1,
            })
            .sum();
        let sizes = chunk.get(record_bytes + 4..record_bytes + 4 + 4 * layers);
        sizes.is_some_and(|sizes| {
            let sizes =
                sizes.chunks_exact(4).map(|size| u32::from_le_bytes([size[0], size[1], size[2], size[3]]));
            sizes.map(u64::from).sum::<u64>() <= chunk.len() as u64
        })
    }
}
