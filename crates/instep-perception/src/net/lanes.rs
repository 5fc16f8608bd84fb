//! Sixteen numbers at a time: AVX-512 where it is there, else arrays that the compiler vectorises.

/// Sixteen single-precision numbers.
pub(super) trait Lanes: Copy {
    /// # Safety
    /// Sixteen numbers can be read there, and the processor has what the type is made for; so for all functions here.
    unsafe fn load(from: *const f32) -> Self;
    /// # Safety
    /// As [`Lanes::load`], written.
    unsafe fn store(self, to: *mut f32);
    /// # Safety
    /// As [`Lanes::load`].
    unsafe fn splat(value: f32) -> Self;
    /// `self * factor + sum`.
    ///
    /// # Safety
    /// As [`Lanes::load`].
    unsafe fn times_plus(self, factor: Self, sum: Self) -> Self;
    /// # Safety
    /// As [`Lanes::load`].
    unsafe fn plus(self, other: Self) -> Self;
    /// The greater of `self` and `self * factor`.
    ///
    /// # Safety
    /// As [`Lanes::load`].
    unsafe fn leaky(self, factor: f32) -> Self;
    /// # Safety
    /// As [`Lanes::load`].
    unsafe fn sum(self) -> f32;
}

/// Numbers in a vector.
pub(super) const LANES: usize = 16;

/// Arrays, with or without fused multiplication and addition.
#[derive(Clone, Copy)]
pub(super) struct Plain<const FUSED: bool>([f32; LANES]);

impl<const FUSED: bool> Lanes for Plain<FUSED> {
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller's.
        Plain(unsafe { from.cast::<[f32; LANES]>().read_unaligned() })
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller's.
        unsafe { to.cast::<[f32; LANES]>().write_unaligned(self.0) }
    }

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Plain([value; LANES])
    }

    #[inline(always)]
    unsafe fn times_plus(self, factor: Self, sum: Self) -> Self {
        Plain(std::array::from_fn(|k| {
            if FUSED { self.0[k].mul_add(factor.0[k], sum.0[k]) } else { self.0[k] * factor.0[k] + sum.0[k] }
        }))
    }

    #[inline(always)]
    unsafe fn plus(self, other: Self) -> Self {
        Plain(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }

    #[inline(always)]
    unsafe fn leaky(self, factor: f32) -> Self {
        Plain(self.0.map(|x| x.max(factor * x)))
    }

    #[inline(always)]
    unsafe fn sum(self) -> f32 {
        self.0.iter().sum()
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::Lanes;
    use std::arch::x86_64::{
        __m512, _mm512_add_ps, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_max_ps, _mm512_mul_ps, _mm512_reduce_add_ps,
        _mm512_set1_ps, _mm512_storeu_ps,
    };

    impl Lanes for __m512 {
        #[inline(always)]
        unsafe fn load(from: *const f32) -> Self {
            // SAFETY: the caller's; so below.
            unsafe { _mm512_loadu_ps(from) }
        }

        #[inline(always)]
        unsafe fn store(self, to: *mut f32) {
            // SAFETY: see `load`.
            unsafe { _mm512_storeu_ps(to, self) }
        }

        #[inline(always)]
        unsafe fn splat(value: f32) -> Self {
            // SAFETY: see `load`.
            unsafe { _mm512_set1_ps(value) }
        }

        #[inline(always)]
        unsafe fn times_plus(self, factor: Self, sum: Self) -> Self {
            // SAFETY: see `load`.
            unsafe { _mm512_fmadd_ps(self, factor, sum) }
        }

        #[inline(always)]
        unsafe fn plus(self, other: Self) -> Self {
            // SAFETY: see `load`.
            unsafe { _mm512_add_ps(self, other) }
        }

        #[inline(always)]
        unsafe fn leaky(self, factor: f32) -> Self {
            // SAFETY: see `load`.
            unsafe { _mm512_max_ps(self, _mm512_mul_ps(self, _mm512_set1_ps(factor))) }
        }

        #[inline(always)]
        unsafe fn sum(self) -> f32 {
            // SAFETY: see `load`.
            unsafe { _mm512_reduce_add_ps(self) }
        }
    }
}

/// A function of one argument, compiled for what processors have; the best that is there is used.
macro_rules! for_the_processor {
    ($name:ident, $body:ident, $job:ty) => {
        fn $name(job: $job) {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx2,fma")]
                fn widest(job: $job) {
                    // SAFETY: compiled for it.
                    unsafe { $body::<std::arch::x86_64::__m512>(job) }
                }
                #[target_feature(enable = "avx2,fma")]
                fn wide(job: $job) {
                    // SAFETY: compiled for it.
                    unsafe { $body::<super::lanes::Plain<true>>(job) }
                }
                if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("fma") {
                    // SAFETY: the processor has what the function is compiled for.
                    return unsafe { widest(job) };
                }
                if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
                    // SAFETY: the processor has what the function is compiled for.
                    return unsafe { wide(job) };
                }
            }
            // SAFETY: arrays need nothing of the processor.
            unsafe { $body::<super::lanes::Plain<false>>(job) }
        }
    };
}
pub(super) use for_the_processor;
