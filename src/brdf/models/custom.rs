//! BRDFs that a user of the crate defines.
//!
//! ```
//! use glam::DVec3;
//! use threadlight::{Brdf, CustomBrdf};
//!
//! struct Chalk(f64);
//!
//! impl CustomBrdf for Chalk {
//!     fn name(&self) -> &str {
//!         "chalk"
//!     }
//!     fn key(&self) -> Vec<u8> {
//!         self.0.to_le_bytes().to_vec()
//!     }
//!     fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
//!         DVec3::splat(self.0 * (0.3 + 0.1 * (w_i.z + w_o.z)))
//!     }
//! }
//!
//! let f = Brdf::custom(Chalk(0.5)).evaluate(DVec3::Z, DVec3::Z);
//! assert!((f.x - 0.25).abs() < 1e-12);
//! ```
//!
//! [`MaterialSource::Custom`](crate::scene::MaterialSource::Custom) puts it into a scene.
//!
//! On the CPU, and so in threads, pdfs and the reference, the BRDF is the function itself. Where a shader evaluates BRDFs it looks
//! them up in a table that is made of the function, as it does for models without a form in GLSL. So the function has to be reciprocal there, and
//! if it is isotropic the same in a mirror. The table is as fine as the function's lobe needs. Its error, as the integral of |difference| cos
//! over that of f cos, is found when it is made, and logged. For isotropic GGX, by roughness and view angle:
//!
//! | alpha | 0 to 60 degrees | 80 degrees | 87 degrees |
//! |---|---|---|---|
//! | 0.3 | 0.09 % | 0.14 % | 0.16 % |
//! | 0.03 | 0.05 % | 0.08 % | 0.43 % |
//! | 0.01 | 0.06 % | 0.08 % | 0.34 % |
//! | 0.001 | 0.08 % | 0.11 % | 0.35 % |
use std::sync::Arc;

use glam::DVec3;

use crate::brdf::{Brdf, Model, Parameters};
use crate::error::{Error, Result};

/// What a user of the crate has to give.
///
/// ```
/// use glam::DVec3;
/// use threadlight::{Custom, CustomBrdf, Renderer, Scene};
///
/// /// Lambert's, half as bright at grazing angles.
/// struct Dusty;
///
/// impl CustomBrdf for Dusty {
///     fn name(&self) -> &str {
///         "dusty"
///     }
///     fn key(&self) -> Vec<u8> {
///         vec![1]
///     }
///     fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
///         DVec3::splat(0.2 * (0.5 + 0.5 * w_i.z * w_o.z))
///     }
/// }
///
/// let scene = Scene::default().with_material(Custom::new(Dusty)).with_environment("white").with_size(32, 24).with_threads(4);
/// let picture = Renderer::new()?.render(&scene)?;
/// // A white furnace: the ball is darker than the light behind it.
/// let [middle, corner] = [12 * 32 + 16, 0].map(|pixel| picture.radiance()[pixel][0]);
/// assert!(middle > 0.3 && middle < 0.7 && corner > 0.99, "{middle} {corner}");
/// # Ok::<(), threadlight::Error>(())
/// ```
pub trait CustomBrdf: Send + Sync {
    /// What to call it.
    fn name(&self) -> &str;

    /// Bytes that stand for all values: of equal name and key are only equal BRDFs, today and in the next run. Caches go by them.
    fn key(&self) -> Vec<u8>;

    /// f(w_i, w_o) in 1/sr, linear Rec. 709, for unit vectors with both z positive; z is the normal, x the tangent. Reciprocal, and if it is
    /// isotropic the same in a mirror. A channel that is negative, infinite or NaN counts as 0.
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3;
}

/// A BRDF that a user of the crate defines. Cheap to clone.
#[derive(Clone)]
pub struct Custom {
    function: Arc<dyn CustomBrdf>,
}

impl Custom {
    /// The BRDF of these values.
    pub fn new(function: impl CustomBrdf + 'static) -> Self {
        Self { function: Arc::new(function) }
    }

    /// What to call it.
    pub fn name(&self) -> &str {
        self.function.name()
    }
}

impl Brdf {
    /// A BRDF that a user of the crate defines: see [`custom`](crate::brdf::custom).
    pub fn custom(function: impl CustomBrdf + 'static) -> Self {
        Self::Custom(Custom::new(function))
    }
}

impl std::fmt::Debug for Custom {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Custom").field("name", &self.name()).finish_non_exhaustive()
    }
}

impl PartialEq for Custom {
    fn eq(&self, other: &Self) -> bool {
        (self.name(), self.function.key()) == (other.name(), other.function.key())
    }
}

impl Model for Custom {
    const HAS_PARAMETERS: bool = false;

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let sound = |f: f64| if f > 0.0 && f.is_finite() { f } else { 0.0 };
        let DVec3 { x, y, z } = self.function.evaluate(w_i, w_o);
        DVec3::new(sound(x), sound(y), sound(z))
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        Err(Error::input("model `custom`", "is defined by a program", "choose another model"))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        for bytes in [self.name().as_bytes(), &self.function.key()] {
            hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::tests::samples::of_model;
    use crate::brdf::{half_vector_width, lobe_radius, reflect, tabulate};
    use crate::farthest::Farthest;
    use glam::{DVec2, dvec3};
    use std::f64::consts::{FRAC_PI_2, PI};

    /// Another BRDF in the place of a user's function.
    struct Wrapped(Brdf);

    impl CustomBrdf for Wrapped {
        fn name(&self) -> &str {
            "wrapped"
        }

        fn key(&self) -> Vec<u8> {
            self.0.fingerprint().as_bytes().to_vec()
        }

        fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
            self.0.evaluate(w_i, w_o)
        }
    }

    struct Constant(DVec3);

    impl CustomBrdf for Constant {
        fn name(&self) -> &str {
            "constant"
        }

        fn key(&self) -> Vec<u8> {
            vec![]
        }

        fn evaluate(&self, _: DVec3, _: DVec3) -> DVec3 {
            self.0
        }
    }

    fn ggx(alpha: f64) -> Brdf {
        let parameters = format!("distribution = 'ggx'\nalpha = {alpha}\neta = 0.2\nk = 3.9");
        of_model("conductor", &parameters)
    }

    /// The integral of |f - g| cos over that of f cos, of the view angle `theta_o_deg`; points as in [`Brdf::albedo`].
    fn relative_error(f: &Brdf, g: &Brdf, theta_o_deg: f64) -> f64 {
        let (sin, cos) = theta_o_deg.to_radians().sin_cos();
        let w_o = dvec3(sin, 0.0, cos);
        let [mut sum, mut difference] = [0.0; 2];
        for i in 0..400 {
            let x = (f64::from(i) + 0.5) / 400.0;
            let (sin_theta_h, cos_theta_h) = (FRAC_PI_2 * x * x).sin_cos();
            for j in 0..91 {
                let h = (DVec2::from_angle(2.0 * PI * f64::from(j) / 91.0) * sin_theta_h).extend(cos_theta_h);
                let cos_theta_d = w_o.dot(h);
                let w_i = reflect(w_o, h);
                if cos_theta_d > 0.0 && w_i.z > 0.0 {
                    let weight = w_i.z * cos_theta_d * sin_theta_h * x;
                    let (f, g) = (f.evaluate(w_i, w_o).x, g.evaluate(w_i, w_o).x);
                    sum += f * weight;
                    difference += (f - g).abs() * weight;
                }
            }
        }
        difference / sum
    }

    #[test]
    fn the_table_of_a_function_errs_as_documented() {
        for (alpha, bounds) in [
            (0.3, [0.001, 0.001, 0.0016, 0.002]),
            (0.03, [0.0007, 0.0007, 0.001, 0.005]),
            (0.01, [0.0008, 0.0008, 0.001, 0.004]),
            (0.001, [0.0009, 0.001, 0.0013, 0.004]),
        ] {
            let custom = Brdf::custom(Wrapped(ggx(alpha)));
            let table = tabulate(&custom).0;
            for (theta_o_deg, bound) in [0.0, 60.0, 80.0, 87.0].into_iter().zip(bounds) {
                let error = relative_error(&custom, &table, theta_o_deg);
                println!("alpha {alpha}, {theta_o_deg} degrees: {:.2} %", 100.0 * error);
                assert!(error < bound, "alpha {alpha}, {theta_o_deg} degrees: {error}");
            }
        }
    }

    #[test]
    fn a_custom_brdf_is_its_function_with_the_same_lobe() {
        let (custom, wrapped) = (Brdf::custom(Wrapped(ggx(0.1))), ggx(0.1));
        let (w_i, w_o) = (dvec3(0.6, 0.0, 0.8), dvec3(-0.48, 0.36, 0.8));
        assert_eq!(custom.evaluate(w_i, w_o), wrapped.evaluate(w_i, w_o));
        assert_eq!(custom.evaluate(-w_i, w_o), DVec3::ZERO);
        assert_eq!(half_vector_width(&custom), half_vector_width(&wrapped));
        assert_eq!(lobe_radius(&custom, 0.0), lobe_radius(&wrapped, 0.0));
        assert_ne!(custom.fingerprint(), Brdf::custom(Wrapped(ggx(0.2))).fingerprint());
        assert_eq!(custom.fingerprint(), Brdf::custom(Wrapped(ggx(0.1))).fingerprint());
    }

    #[test]
    fn values_that_are_no_reflectance_count_as_none() {
        let brdf = Brdf::custom(Constant(dvec3(f64::NAN, -1.0, f64::INFINITY)));
        assert_eq!(brdf.evaluate(DVec3::Z, DVec3::Z), DVec3::ZERO);
        assert!(
            tabulate(&brdf)
                .0
                .made_table()
                .unwrap()
                .texels()
                .iter()
                .all(|texel| texel[..3].iter().all(|value| value.to_f32() == 0.0))
        );
        assert_eq!((half_vector_width(&brdf), lobe_radius(&brdf, 0.0)), (FRAC_PI_2, FRAC_PI_2));
        let brdf = Brdf::custom(Constant(dvec3(0.1, f64::NAN, 0.3)));
        let table = tabulate(&brdf).0;
        assert!((table.evaluate(DVec3::Z, DVec3::Z) - dvec3(0.1, 0.0, 0.3)).farthest() < 1e-7);
    }
}
