//! The decoder of GPS times, version 2 of their compression.
//!
//! Nobody asks for the times, but what follows them in the stream can only be found by decoding them. The crate's decoder
//! calls itself whenever the stream says that a time belongs to another of four sequences, and a few bytes can say so
//! a hundred thousand times over: the stack would overflow. So this one goes around a loop, and no more often than a
//! writer has reason to. The times themselves are not kept: the stream can be followed without them.

use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::FieldDecompressor;
use std::io::{self, Read};

/// Sequences of times that a stream can have under way.
const SEQUENCES: usize = 4;

/// The symbols from 0 to this one are multiples of the last difference.
const MOST_MULTIPLE: i32 = 500;

/// The negative multiples follow, down to this one.
const LEAST_MULTIPLE: i32 = -10;

/// The time is the last one again.
const UNCHANGED: i32 = MOST_MULTIPLE - LEAST_MULTIPLE + 1;

/// A new sequence begins; greater symbols say by how many sequences to go on.
const NEW: i32 = UNCHANGED + 1;

/// Number of symbols where the last difference was not zero.
const SYMBOLS: u32 = NEW as u32 + SEQUENCES as u32;

/// After so many extreme multiples in turn the difference is taken anew.
const MOST_EXTREMES: u32 = 3;

/// The times of a chunk.
pub(super) struct GpsTimes {
    /// What follows a difference of zero: 0 the same time, 1 a difference, 2 a new sequence, 3 to 5 another one.
    after_zero: ArithmeticModel,
    after_other: ArithmeticModel,
    integers: IntegerDecompressor,
    /// The sequence of the last time, and the newest.
    last: usize,
    newest: usize,
    differences: [i32; SEQUENCES],
    extremes: [u32; SEQUENCES],
}

impl GpsTimes {
    pub fn new() -> Self {
        Self {
            after_zero: ArithmeticModelBuilder::new(6).build(),
            after_other: ArithmeticModelBuilder::new(SYMBOLS).build(),
            integers: IntegerDecompressorBuilder::new().bits(32).contexts(9).build_initialized(),
            last: 0,
            newest: 0,
            differences: [0; SEQUENCES],
            extremes: [0; SEQUENCES],
        }
    }

    /// Decodes a symbol and what belongs to it. Says whether that was a time; else another sequence is the last now.
    fn step<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> io::Result<bool> {
        let difference = self.differences[self.last];
        if difference == 0 {
            match decoder.decode_symbol(&mut self.after_zero)? {
                0 => {}
                1 => {
                    self.differences[self.last] = self.integers.decompress(decoder, 0, 0)?;
                    self.extremes[self.last] = 0;
                }
                2 => self.begin(decoder)?,
                further => {
                    self.last = (self.last + further as usize - 2) % SEQUENCES;
                    return Ok(false);
                }
            }
            return Ok(true);
        }
        let symbol = decoder.decode_symbol(&mut self.after_other)? as i32;
        let (multiple, context, is_extreme) = match symbol {
            0 => (0, 7, true),
            1 => (1, 1, false),
            2..10 => (symbol, 2, false),
            10..MOST_MULTIPLE => (symbol, 3, false),
            MOST_MULTIPLE => (symbol, 4, true),
            UNCHANGED => return Ok(true),
            NEW => return self.begin(decoder).map(|()| true),
            _ if symbol > NEW => {
                self.last = (self.last + (symbol - NEW) as usize) % SEQUENCES;
                return Ok(false);
            }
            _ if MOST_MULTIPLE - symbol > LEAST_MULTIPLE => (MOST_MULTIPLE - symbol, 5, false),
            _ => (LEAST_MULTIPLE, 6, true),
        };
        let found = self.integers.decompress(decoder, multiple.wrapping_mul(difference), context)?;
        if is_extreme {
            self.extremes[self.last] += 1;
            if self.extremes[self.last] > MOST_EXTREMES {
                self.differences[self.last] = found;
                self.extremes[self.last] = 0;
            }
        } else if symbol == 1 {
            self.extremes[self.last] = 0;
        }
        Ok(true)
    }

    /// Begins a sequence with a time of its own.
    fn begin<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> io::Result<()> {
        self.integers.decompress(decoder, 0, 8)?;
        decoder.read_int()?;
        self.newest = (self.newest + 1) % SEQUENCES;
        self.last = self.newest;
        self.differences[self.last] = 0;
        self.extremes[self.last] = 0;
        Ok(())
    }
}

impl<R: Read> FieldDecompressor<R> for GpsTimes {
    fn size_of_field(&self) -> usize {
        size_of::<f64>()
    }

    fn decompress_first(&mut self, source: &mut R, first: &mut [u8]) -> io::Result<()> {
        source.read_exact(first)
    }

    fn decompress_with(&mut self, decoder: &mut ArithmeticDecoder<R>, _time: &mut [u8]) -> io::Result<()> {
        // A writer goes on to another sequence at most once a point.
        for _ in 0..SEQUENCES {
            if self.step(decoder)? {
                return Ok(());
            }
        }
        Err(io::Error::new(io::ErrorKind::InvalidData, "a GPS time that goes from sequence to sequence"))
    }
}
