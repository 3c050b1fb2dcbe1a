//! Lanes in 256-bit registers of x86-64. With its sibling for 512 bits the only module with unsafe code: the intrinsics.
//!
//! Soundness: a value of type [`Avx2`] is only ever made by code under [`run`], which asks the processor first; so
//! whoever holds one may use the instructions. The methods are `#[inline(always)]`, so that they become instructions of the
//! `target_feature` function that they are inlined into, never calls.

#![expect(unsafe_code, reason = "intrinsics; see the module's documentation")]

use super::{Eight, Kernel, LANES, Lanes, SET_BITS};
use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Sub};

/// Eight lanes.
#[derive(Clone, Copy)]
pub struct Avx2(__m256);

impl Avx2 {
    /// Lanes from a register, for its sibling, which is only ever there where these are.
    #[inline(always)]
    pub(super) fn from_register(register: __m256) -> Self {
        Self(register)
    }

    /// The register.
    #[inline(always)]
    pub(super) fn into_register(self) -> __m256 {
        self.0
    }
}

/// Whether the processor has AVX2, and the bit instructions that came with it.
pub fn is_available() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// Runs a kernel on these lanes, or on portable ones if the processor does not have the instructions.
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx2>()
    }
    if is_available() {
        // SAFETY: the processor has the instructions.
        unsafe { with_avx2(kernel) }
    } else {
        kernel.run::<wide::f32x8>()
    }
}

/// Asks the processor to fetch what it will soon need: all cache lines of an item.
#[inline(always)]
pub fn prefetch<T>(item: &T) {
    let bytes: *const i8 = std::ptr::from_ref(item).cast();
    for offset in (0..size_of::<T>()).step_by(64).chain([size_of::<T>().max(1) - 1]) {
        // SAFETY: every x86-64 processor has the instruction, and it never faults.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(bytes.wrapping_add(offset)) }
    }
}

/// Implements an operator by an intrinsic.
macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Avx2 {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the module's documentation.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

operator!(Add, add, _mm256_add_ps);
operator!(Sub, sub, _mm256_sub_ps);
operator!(Mul, mul, _mm256_mul_ps);
operator!(Div, div, _mm256_div_ps);
operator!(BitAnd, bitand, _mm256_and_ps);
operator!(BitOr, bitor, _mm256_or_ps);

impl Lanes for Avx2 {
    const CELLS: usize = 1;
    type Index = __m256i;
    type Single = Self;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_set1_ps(value) })
    }

    #[inline(always)]
    fn splat_cells(first: f32, _: f32) -> Self {
        Self::splat(first)
    }

    #[inline(always)]
    fn load_cells(first: &Eight, _: &Eight) -> Self {
        // SAFETY: see the module's documentation; the array is as long as the register.
        Self(unsafe { _mm256_loadu_ps(first.as_ptr()) })
    }

    #[inline(always)]
    fn store_cell<const CELL: usize>(self, to: &mut Eight) {
        // SAFETY: see the module's documentation; the array is as long as the register.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn less_or_equal(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn not_less(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_cmp_ps::<_CMP_NLT_UQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn not_less_or_equal(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_cmp_ps::<_CMP_NLE_UQ>(self.0, other.0) })
    }

    #[inline(always)]
    fn least(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn greatest(self, other: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn select(self, yes: Self, no: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_blendv_ps(no.0, yes.0, self.0) })
    }

    #[inline(always)]
    fn and_not(self, mask: Self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_andnot_ps(mask.0, self.0) })
    }

    #[inline(always)]
    fn or_not(self, mask: Self) -> Self {
        // SAFETY: see the module's documentation.
        unsafe {
            let ones = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
            Self(_mm256_or_ps(self.0, _mm256_xor_ps(mask.0, ones)))
        }
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: see the module's documentation.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }

    #[inline(always)]
    fn mask(bits: u32) -> Self {
        // SAFETY: see the module's documentation.
        unsafe {
            let place = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), place);
            Self(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, place)))
        }
    }

    #[inline(always)]
    fn square_root(self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }

    #[inline(always)]
    fn round_down(self) -> Self {
        // SAFETY: see the module's documentation.
        Self(unsafe { _mm256_floor_ps(self.0) })
    }

    #[inline(always)]
    fn to_index(self) -> __m256i {
        // SAFETY: see the module's documentation.
        unsafe { _mm256_cvttps_epi32(self.0) }
    }

    #[inline(always)]
    fn look_up(table: &Eight, index: __m256i) -> Self {
        // SAFETY: see the module's documentation; the permutation reads three bits of each index.
        Self(unsafe { _mm256_permutevar8x32_ps(_mm256_loadu_ps(table.as_ptr()), index) })
    }

    #[inline(always)]
    fn load_pairs([a, b, c, d]: [&[f32; 2]; 4]) -> Self {
        // SAFETY: see the module's documentation; each pair is as long as half of a register of 128 bits.
        unsafe {
            let low = _mm_loadh_pd(_mm_load_sd(a.as_ptr().cast()), b.as_ptr().cast());
            let high = _mm_loadh_pd(_mm_load_sd(c.as_ptr().cast()), d.as_ptr().cast());
            Self(_mm256_castpd_ps(_mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(low), high)))
        }
    }

    #[inline(always)]
    fn load_halves([a, b]: [&[f32; 4]; 2]) -> Self {
        // SAFETY: see the module's documentation; each array is as long as half of the register.
        unsafe {
            let low = _mm256_castps128_ps256(_mm_loadu_ps(a.as_ptr()));
            Self(_mm256_insertf128_ps::<1>(low, _mm_loadu_ps(b.as_ptr())))
        }
    }

    #[inline(always)]
    fn pack(self, lanes: u8) -> Self {
        // SAFETY: see the module's documentation; the array is as long as half of a register of 128 bits.
        unsafe {
            let numbers = _mm_loadl_epi64(SET_BITS[usize::from(lanes)].as_ptr().cast());
            Self(_mm256_permutevar8x32_ps(self.0, _mm256_cvtepu8_epi32(numbers)))
        }
    }

    #[inline(always)]
    fn whole(self) -> [i32; LANES] {
        let mut whole = [0; LANES];
        // SAFETY: see the module's documentation; the array is as long as the register.
        unsafe { _mm256_storeu_si256(whole.as_mut_ptr().cast(), _mm256_cvttps_epi32(self.0)) }
        whole
    }

    #[inline(always)]
    fn sums([a, b, c, d]: [Self; 4]) -> [f32; 4] {
        let mut sums = [0.0; 4];
        // SAFETY: see the module's documentation; the array is as long as half of the register.
        unsafe {
            let halves = _mm256_hadd_ps(_mm256_hadd_ps(a.0, b.0), _mm256_hadd_ps(c.0, d.0));
            let sum = _mm_add_ps(_mm256_castps256_ps128(halves), _mm256_extractf128_ps::<1>(halves));
            _mm_storeu_ps(sums.as_mut_ptr(), sum);
        }
        sums
    }
}
