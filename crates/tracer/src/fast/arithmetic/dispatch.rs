//! Dispatch from an instruction set, known at run time, to the code that was compiled for it.

/// Compiles an expression for every instruction set that has kernels, and evaluates the one for `level`.
///
/// The crate's own tests are compiled for the narrowest set alone, which every machine has: the wider ones take most of
/// the time to compile. The tests in `tests/` use all of them.
#[cfg(target_arch = "x86_64")]
macro_rules! on {
    (narrow $level:expr, $simd:ident => $work:expr) => {{
        #[cfg(feature = "narrow")]
        {
            if let Some($simd) = $level.as_sse4_2() {
                on!(@ $simd => $work)
            } else {
                unreachable!("asked for kernels that this machine has not")
            }
        }
        #[cfg(not(feature = "narrow"))]
        {
            unreachable!("asked for kernels that this build has not")
        }
    }};
    ($level:expr, $simd:ident => $work:expr) => {{
        #[cfg(all(test, feature = "narrow"))]
        {
            on!(narrow $level, $simd => $work)
        }
        #[cfg(not(all(test, feature = "narrow")))]
        on!(every $level, $simd => $work)
    }};
    (every $level:expr, $simd:ident => $work:expr) => {{
        #[cfg(feature = "avx512")]
        let wide = $level.as_avx512();
        #[cfg(not(feature = "avx512"))]
        let wide = $level.as_avx2();
        if let Some($simd) = wide {
            on!(@ $simd => $work)
        } else if let Some($simd) = $level.as_avx2() {
            on!(@ $simd => $work)
        } else {
            on!(narrow $level, $simd => $work)
        }
    }};
    (@ $simd:ident => $work:expr) => {
        fearless_simd::Simd::vectorize(
            $simd,
            #[inline(always)]
            || $work,
        )
    };
}

#[cfg(not(target_arch = "x86_64"))]
macro_rules! on {
    ($level:expr, $simd:ident => $work:expr) => {
        fearless_simd::dispatch!($level, $simd => $work)
    };
}

pub(crate) use on;
