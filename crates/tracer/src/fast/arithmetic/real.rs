//! The two number types that the kernels are written for, and packets of them.
//!
//! A kernel is generic over the number (`f32`, `f64`) and over the instruction set. Every lane of a packet goes through
//! the same operations at any width; products are added by [`Fused`]. So pictures are equal bit for bit between widths: a
//! kernel reduces across lanes only to decide which work can be skipped.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, SimdFloatElement};

/// A packet of numbers, as many as a register of the instruction set `S` holds.
pub(crate) type Lanes<S, E> = <E as SimdFloatElement>::Native<S>;

/// A mask of the lanes of a packet.
pub(crate) type Mask<S, E> = <Lanes<S, E> as SimdBase<S>>::Mask;

/// A number type of the kernels: `f32` or `f64`.
pub(crate) trait Real:
    SimdFloatElement
    + core::ops::Add<Output = Self>
    + core::ops::Sub<Output = Self>
    + core::ops::Mul<Output = Self>
    + core::ops::AddAssign
    + Send
    + Sync
    + 'static
{
    /// Whether it is `f64`. Code for features that are drawn only in `f64` is left out of the `f32` kernels.
    const IS_DOUBLE: bool;

    /// The largest relative error of one rounding.
    const ROUNDOFF: f64;

    /// A distance beyond everything in a scene of unit size, and small enough that products with it are finite.
    const FAR: f64;

    /// The numbers from 0 on, one per lane.
    const COUNT: [Self; 16];

    /// Returns the nearest number of this type.
    fn narrow(x: f64) -> Self;

    fn widen(self) -> f64;

    /// Converts a number that holds an index.
    fn to_index(self) -> usize;

    /// Packs channels that are whole numbers in `0..=255`, as `r | g << 8 | b << 16`.
    fn pack<S: Simd>(channels: [Lanes<S, Self>; 3], into: &mut [u32]);
}

impl Real for f32 {
    const IS_DOUBLE: bool = false;
    const ROUNDOFF: f64 = f32::EPSILON as f64 / 2.0;
    const FAR: f64 = 1e18;
    const COUNT: [Self; 16] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

    #[inline(always)]
    fn narrow(x: f64) -> Self {
        x as f32
    }

    #[inline(always)]
    fn widen(self) -> f64 {
        self.into()
    }

    #[inline(always)]
    fn to_index(self) -> usize {
        self as u32 as usize
    }

    #[inline(always)]
    fn pack<S: Simd>(channels: [Lanes<S, f32>; 3], into: &mut [u32]) {
        let [r, g, b] = channels;
        let (r, g, b) = (r.to_int::<S::u32s>(), g.to_int::<S::u32s>(), b.to_int::<S::u32s>());
        (r | (g << 8) | (b << 16)).store_slice(&mut into[..Lanes::<S, f32>::LEN]);
    }
}

impl Real for f64 {
    const IS_DOUBLE: bool = true;
    const ROUNDOFF: f64 = f64::EPSILON / 2.0;
    const FAR: f64 = 1e140;
    const COUNT: [Self; 16] = [0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., 11., 12., 13., 14., 15.];

    #[inline(always)]
    fn narrow(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn widen(self) -> f64 {
        self
    }

    #[inline(always)]
    fn to_index(self) -> usize {
        self as u32 as usize
    }

    #[inline(always)]
    fn pack<S: Simd>(channels: [Lanes<S, f64>; 3], into: &mut [u32]) {
        for (lane, packed) in into[..Lanes::<S, f64>::LEN].iter_mut().enumerate() {
            let [r, g, b] = channels;
            let (r, g, b) = (r[lane] as u32, g[lane] as u32, b[lane] as u32);
            *packed = r | (g << 8) | (b << 16);
        }
    }
}

/// Products that are added and rounded once, on every machine.
#[allow(clippy::disallowed_methods, reason = "where they round once")]
pub(crate) trait Fused<S: Simd>: SimdFloat<S> {
    /// Returns `self · factor + other`.
    #[inline(always)]
    fn fused_mul_add(self, factor: Self, other: Self) -> Self {
        if has_fused::<S, Self>() { self.mul_add(factor, other) } else { emulated(self, factor, other) }
    }

    /// Returns `self · factor - other`.
    #[inline(always)]
    fn fused_mul_sub(self, factor: Self, other: Self) -> Self {
        if has_fused::<S, Self>() { self.mul_sub(factor, other) } else { emulated(self, factor, -other) }
    }
}

impl<S: Simd, T: SimdFloat<S>> Fused<S> for T {}

/// Returns whether the instruction set has a fused multiply-add. Of those with packets of 128 bits, Arm's has one, and
/// so has WebAssembly's relaxed one, on machines where a test has shown that it is fused.
#[inline(always)]
fn has_fused<S: Simd, T: SimdFloat<S>>() -> bool {
    cfg!(any(target_arch = "aarch64", target_feature = "relaxed-simd")) || size_of::<T>() > 16
}

// Out of line: it takes some forty instructions.
#[inline(never)]
fn emulated<S: Simd, T: SimdFloat<S>>(x: T, factor: T, other: T) -> T {
    x.token().vectorize(
        #[inline(always)]
        || x.mul_add_precise(factor, other),
    )
}

/// Returns a packet with the same number in every lane.
#[inline(always)]
pub(crate) fn splat<S: Simd, E: Real>(simd: S, x: E) -> Lanes<S, E> {
    Lanes::<S, E>::splat(simd, x)
}

/// Returns a packet with the same constant in every lane.
#[inline(always)]
pub(crate) fn constant<S: Simd, E: Real>(simd: S, x: f64) -> Lanes<S, E> {
    Lanes::<S, E>::splat(simd, E::narrow(x))
}

/// Three packets: a point, a direction or a colour in every lane.
#[derive(Clone, Copy)]
pub(crate) struct Vec3<S: Simd, E: Real> {
    pub(crate) x: Lanes<S, E>,
    pub(crate) y: Lanes<S, E>,
    pub(crate) z: Lanes<S, E>,
}

impl<S: Simd, E: Real> Vec3<S, E> {
    #[inline(always)]
    pub(crate) fn new(x: Lanes<S, E>, y: Lanes<S, E>, z: Lanes<S, E>) -> Self {
        Self { x, y, z }
    }

    #[inline(always)]
    pub(crate) fn splat(simd: S, [x, y, z]: [E; 3]) -> Self {
        Self { x: splat(simd, x), y: splat(simd, y), z: splat(simd, z) }
    }

    #[inline(always)]
    pub(crate) fn zero(simd: S) -> Self {
        let zero = constant::<S, E>(simd, 0.0);
        Self { x: zero, y: zero, z: zero }
    }

    #[inline(always)]
    pub(crate) fn load(simd: S, from: &[impl AsRef<[E]>; 3], at: usize) -> Self {
        let end = at + Lanes::<S, E>::LEN;
        let [x, y, z] = from;
        Self {
            x: Lanes::<S, E>::from_slice(simd, &x.as_ref()[at..end]),
            y: Lanes::<S, E>::from_slice(simd, &y.as_ref()[at..end]),
            z: Lanes::<S, E>::from_slice(simd, &z.as_ref()[at..end]),
        }
    }

    #[inline(always)]
    pub(crate) fn store(self, into: &mut [impl AsMut<[E]>; 3], at: usize) {
        let [x, y, z] = into;
        self.x.store_slice(&mut x.as_mut()[at..at + Lanes::<S, E>::LEN]);
        self.y.store_slice(&mut y.as_mut()[at..at + Lanes::<S, E>::LEN]);
        self.z.store_slice(&mut z.as_mut()[at..at + Lanes::<S, E>::LEN]);
    }

    #[inline(always)]
    pub(crate) fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline(always)]
    pub(crate) fn mul(self, other: Self) -> Self {
        Self { x: self.x * other.x, y: self.y * other.y, z: self.z * other.z }
    }

    #[inline(always)]
    pub(crate) fn scale(self, factor: Lanes<S, E>) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    /// Returns `self · factor + other`.
    #[inline(always)]
    pub(crate) fn scale_add(self, factor: Lanes<S, E>, other: Self) -> Self {
        Self {
            x: self.x.fused_mul_add(factor, other.x),
            y: self.y.fused_mul_add(factor, other.y),
            z: self.z.fused_mul_add(factor, other.z),
        }
    }

    /// Returns `self · factor - other`.
    #[inline(always)]
    pub(crate) fn scale_sub(self, factor: Lanes<S, E>, other: Self) -> Self {
        Self {
            x: self.x.fused_mul_sub(factor, other.x),
            y: self.y.fused_mul_sub(factor, other.y),
            z: self.z.fused_mul_sub(factor, other.z),
        }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Lanes<S, E> {
        self.x.fused_mul_add(other.x, self.y.fused_mul_add(other.y, self.z * other.z))
    }

    /// Returns `self · other + start`.
    #[inline(always)]
    pub(crate) fn dot_add(self, other: Self, start: Lanes<S, E>) -> Lanes<S, E> {
        self.x.fused_mul_add(other.x, self.y.fused_mul_add(other.y, self.z.fused_mul_add(other.z, start)))
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y.fused_mul_sub(other.z, self.z * other.y),
            y: self.z.fused_mul_sub(other.x, self.x * other.z),
            z: self.x.fused_mul_sub(other.y, self.y * other.x),
        }
    }

    /// Returns the vector scaled to length 1.
    #[inline(always)]
    pub(crate) fn normalize(self, simd: S) -> Self {
        self.scale(constant::<S, E>(simd, 1.0) / self.dot(self).sqrt())
    }

    #[inline(always)]
    pub(crate) fn select(mask: Mask<S, E>, if_true: Self, if_false: Self) -> Self {
        Self {
            x: mask.select(if_true.x, if_false.x),
            y: mask.select(if_true.y, if_false.y),
            z: mask.select(if_true.z, if_false.z),
        }
    }
}
