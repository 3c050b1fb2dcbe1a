//! Lanes in 512-bit registers of x86-64, for two cells at once.
//!
//! Soundness: as for [`super::avx2`]: a value of type [`Avx512`] is only ever made by code under [`run`].

#![expect(unsafe_code, reason = "intrinsics; see the module's documentation")]

use super::avx2::Avx2;
use super::{Eight, Kernel, LANES, Lanes};
use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Sixteen lanes.
#[derive(Clone, Copy)]
pub struct Avx512(__m512);

/// Whether the processor has the parts of AVX-512 that all of its processors but the first have.
pub fn is_available() -> bool {
    super::avx2::is_available()
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512vl")
}

/// Runs a kernel on these lanes, or on portable ones if the processor does not have the instructions.
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    #[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx512>()
    }
    if is_available() {
        // SAFETY: the processor has the instructions.
        unsafe { with_avx512(kernel) }
    } else {
        kernel.run::<wide::f32x8>()
    }
}

/// Implements an operator by an intrinsic.
macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Avx512 {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the module's documentation.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

operator!(Add, add, _mm512_add_ps);
operator!(Sub, sub, _mm512_sub_ps);
operator!(Mul, mul, _mm512_mul_ps);
operator!(Div, div, _mm512_div_ps);
operator!(BitAnd, bitand, _mm512_and_ps);
operator!(BitOr, bitor, _mm512_or_ps);

impl Avx512 {
    /// A cell, in both.
    #[inline(always)]
    fn twice(cell: Avx2) -> Self {
        let cell = cell.into_register();
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_insertf32x8::<1>(_mm512_castps256_ps512(cell), cell) })
    }

    /// The lanes of the first cell.
    #[inline(always)]
    fn first_cell(self) -> Avx2 {
        // SAFETY: see the module's documentation.
        Avx2::from_register(unsafe { _mm512_castps512_ps256(self.0) })
    }

    /// The vector whose lanes are all ones where the processor's mask is set.
    #[inline(always)]
    fn from_mask(mask: __mmask16) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_castsi512_ps(_mm512_movm_epi32(mask)) })
    }

    /// The lanes' highest bits as the processor's mask.
    #[inline(always)]
    fn to_mask(self) -> __mmask16 {
        // SAFETY: see the module's documentation.
        unsafe { _mm512_movepi32_mask(_mm512_castps_si512(self.0)) }
    }
}

impl Lanes for Avx512 {
    const CELLS: usize = 2;
    type Index = __m512i;
    type Single = Avx2;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_set1_ps(value) })
    }

    #[inline(always)]
    fn splat_cells(first: f32, second: f32) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_mask_broadcastss_ps(_mm512_set1_ps(first), 0xff00, _mm_set_ss(second)) })
    }

    #[inline(always)]
    fn load_cells(first: &Eight, second: &Eight) -> Self {
        // SAFETY: see the module's documentation; each array is as long as half of the register.
        unsafe {
            let low = _mm512_castps256_ps512(_mm256_loadu_ps(first.as_ptr()));
            Self(_mm512_insertf32x8::<1>(low, _mm256_loadu_ps(second.as_ptr())))
        }
    }

    #[inline(always)]
    fn store_cell<const CELL: usize>(self, to: &mut Eight) {
        // SAFETY: see the module's documentation; the array is as long as half of the register.
        unsafe {
            let half =
                if CELL == 0 { _mm512_castps512_ps256(self.0) } else { _mm512_extractf32x8_ps::<1>(self.0) };
            _mm256_storeu_ps(to.as_mut_ptr(), half);
        }
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self::from_mask(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self::from_mask(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn not_less(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self::from_mask(unsafe { _mm512_cmp_ps_mask::<_CMP_NLT_UQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn not_less_or_equal(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self::from_mask(unsafe { _mm512_cmp_ps_mask::<_CMP_NLE_UQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn least(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn greatest(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn select(self, yes: Self, no: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_mask_blend_ps(self.to_mask(), no.0, yes.0) })
    }

    #[inline(always)]
    fn and_not(self, mask: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_andnot_ps(mask.0, self.0) })
    }

    #[inline(always)]
    fn or_not(self, mask: Self) -> Self {
        // SAFETY: see the module's documentation.
        unsafe {
            let ones = _mm512_castsi512_ps(_mm512_set1_epi32(-1));
            Self(_mm512_or_ps(self.0, _mm512_xor_ps(mask.0, ones)))
        }
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.to_mask())
    }

    #[inline(always)]
    fn mask(bits: u32) -> Self {
        Self::from_mask(bits as __mmask16)
    }

    #[inline(always)]
    fn square_root(self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn round_down(self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0) })
    }

    #[inline(always)]
    fn to_index(self) -> __m512i {
        // SAFETY: see the module's documentation.
        unsafe { _mm512_cvttps_epi32(self.0) }
    }

    #[inline(always)]
    fn look_up(table: &Eight, index: __m512i) -> Self {
        // SAFETY: see the module's documentation; the table stands in both halves, so that any four bits of an index find
        // an entry.
        unsafe {
            let half = _mm256_loadu_ps(table.as_ptr());
            let entries = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(half), half);
            Self(_mm512_permutexvar_ps(index, entries))
        }
    }

    #[inline(always)]
    fn load_pairs(pairs: [&[f32; 2]; 4]) -> Self {
        Self::twice(Avx2::load_pairs(pairs))
    }

    #[inline(always)]
    fn load_halves(halves: [&[f32; 4]; 2]) -> Self {
        Self::twice(Avx2::load_halves(halves))
    }

    #[inline(always)]
    fn pack(self, lanes: u8) -> Self {
        Self::twice(self.first_cell().pack(lanes))
    }

    #[inline(always)]
    fn whole(self) -> [i32; LANES] {
        self.first_cell().whole()
    }

    #[inline(always)]
    fn sums([a, b, c, d]: [Self; 4]) -> [f32; 4] {
        Avx2::sums([a.first_cell(), b.first_cell(), c.first_cell(), d.first_cell()])
    }
}
