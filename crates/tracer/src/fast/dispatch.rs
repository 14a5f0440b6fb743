//! From a level of instructions, known when the program runs, to code that was compiled for it.

/// Compiles an expression for every instruction set that has kernels, and evaluates the one for `level`.
#[cfg(target_arch = "x86_64")]
macro_rules! on {
    (narrow $level:expr, $simd:ident => $work:expr) => {
        if let Some($simd) = $level.as_sse4_2() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $work,
            )
        } else {
            unreachable!("asked for kernels that this machine has not")
        }
    };
    ($level:expr, $simd:ident => $work:expr) => {
        if let Some($simd) = $level.as_avx512() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $work,
            )
        } else if let Some($simd) = $level.as_avx2() {
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $work,
            )
        } else {
            on!(narrow $level, $simd => $work)
        }
    };
}

#[cfg(not(target_arch = "x86_64"))]
macro_rules! on {
    ($level:expr, $simd:ident => $work:expr) => {
        fearless_simd::dispatch!($level, $simd => $work)
    };
}

pub(super) use on;
