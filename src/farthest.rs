//! How large a vector is, in tests that must not take what is no number for a small one: comparisons with NaN are false, and the greatest of
//! three numbers need not be it.
use glam::{DVec3, Vec3, Vec4};

/// How far a vector is from none.
pub trait Farthest<T> {
    /// The greatest part, without signs. Fails where one is no number.
    fn farthest(self) -> T;
}

macro_rules! farthest {
    ($($Vector:ty: $Number:ty),*) => { $(
        impl Farthest<$Number> for $Vector {
            fn farthest(self) -> $Number {
                assert!(self.is_finite(), "{self}");
                self.abs().max_element()
            }
        }
    )* };
}
farthest!(Vec3: f32, Vec4: f32, DVec3: f64);
