//! The arithmetic of [`Vec3`](crate::Vec3) on bare arrays.

use crate::Vec3 as V;

/// x, y, z.
pub type Vec3 = [f64; 3];

/// a + b.
#[inline]
pub fn add(a: impl Into<V>, b: impl Into<V>) -> Vec3 {
    (a.into() + b.into()).0
}

/// a − b.
#[inline]
pub fn sub(a: impl Into<V>, b: impl Into<V>) -> Vec3 {
    (a.into() - b.into()).0
}

/// s a.
#[inline]
pub fn scaled(a: impl Into<V>, s: f64) -> Vec3 {
    (a.into() * s).0
}

/// a · b.
#[inline]
pub fn dot(a: impl Into<V>, b: impl Into<V>) -> f64 {
    a.into().dot(b.into())
}

/// a × b.
#[inline]
pub fn cross(a: impl Into<V>, b: impl Into<V>) -> Vec3 {
    a.into().cross(b.into()).0
}

/// a · a.
#[inline]
pub fn squared(a: impl Into<V>) -> f64 {
    a.into().squared()
}

/// The length of a.
#[inline]
pub fn norm(a: impl Into<V>) -> f64 {
    a.into().norm()
}

/// The unit vector along `a`; zero for zero.
#[inline]
pub fn unit(a: impl Into<V>) -> Vec3 {
    a.into().unit().0
}
