//! Numbers from bytes. Where the bytes end, all further ones are zero: so any bytes mean something.

use crate::textures::REMARKABLE;
use glam::{DVec3, Vec2, Vec3};

/// The bytes that are left.
pub(super) struct Bytes<'a>(pub &'a [u8]);

impl Bytes<'_> {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut array = [0; N];
        let count = self.0.len().min(N);
        array[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        array
    }

    pub fn byte(&mut self) -> u8 {
        self.array::<1>()[0]
    }

    /// A number below `count`, which is at most 256.
    pub fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count
    }

    pub fn flag(&mut self) -> bool {
        self.byte() & 1 == 1
    }

    pub fn pick<T: Clone>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())].clone()
    }

    /// From 0 to 1, ends included.
    pub fn unit(&mut self) -> f64 {
        f64::from(u16::from_le_bytes(self.array())) / 65535.0
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Any bits, remarkable ones, or an ordinary number.
    pub fn any(&mut self) -> f32 {
        match self.byte() % 4 {
            0 => f32::from_bits(u32::from_le_bytes(self.array())),
            1 => self.pick(&REMARKABLE),
            _ => self.range(-4.0, 4.0) as f32,
        }
    }

    /// Mostly ordinary, now and then anything.
    pub fn number(&mut self, low: f64, high: f64) -> f32 {
        if self.byte() >= 250 { self.any() } else { self.range(low, high) as f32 }
    }

    pub fn any2(&mut self) -> Vec2 {
        Vec2::new(self.any(), self.any())
    }

    pub fn any3(&mut self) -> DVec3 {
        DVec3::new(self.any().into(), self.any().into(), self.any().into())
    }

    pub fn vector(&mut self, low: f64, high: f64) -> Vec3 {
        Vec3::new(self.number(low, high), self.number(low, high), self.number(low, high))
    }
}
