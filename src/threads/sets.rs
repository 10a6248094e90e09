//! The threads of a material that a pixel chooses between.
use super::Threads;
use crate::brdf::Brdf;

/// One thing for each of the two sets of threads by which fitted threads shade, so that `count` threads are `count` lookups a pixel: the
/// partition of the paper's section 4.2, for threads of which a part alone would be no BRDF.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ThreadSets<T> {
    /// Of a pixel whose sub-pixels share one sum.
    pub pixel: T,
    /// Of each sub-pixel of another pixel: fewer by the number of sub-pixels, but at least one. The paper's threads, which sub-pixels
    /// share out among themselves, are the same as the pixel's.
    pub subpixel: T,
}

impl<T> ThreadSets<T> {
    /// The same for references.
    pub fn as_ref(&self) -> ThreadSets<&T> {
        ThreadSets { pixel: &self.pixel, subpixel: &self.subpixel }
    }

    /// `f` of each.
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> ThreadSets<U> {
        ThreadSets { pixel: f(self.pixel), subpixel: f(self.subpixel) }
    }

    /// `f` of each, or the first error.
    ///
    /// # Errors
    /// That of `f`.
    pub fn try_map<U, E>(self, mut f: impl FnMut(T) -> Result<U, E>) -> Result<ThreadSets<U>, E> {
        Ok(ThreadSets { pixel: f(self.pixel)?, subpixel: f(self.subpixel)? })
    }

    /// Both.
    pub fn both(self) -> [T; 2] {
        [self.pixel, self.subpixel]
    }
}

/// A BRDF, and the threads by which it is shaded, for methods that have any.
pub type WithThreads<'a> = (&'a Brdf, Option<ThreadSets<&'a Threads>>);
