//! Anisotropic models: limits, energy, hostile directions, and what turning the material does.
use super::*;

fn brdf(model: &str, parameters: &str) -> Brdf {
    let table = parameters.replace(';', "\n").parse().unwrap();
    Brdf::from_parameters(model, table).unwrap_or_else(|error| panic!("{model}: {parameters}: {error}"))
}

fn direction(theta_deg: f64, phi_deg: f64) -> DVec3 {
    let (sin_theta, cos_theta) = theta_deg.to_radians().sin_cos();
    (DVec2::from_angle(phi_deg.to_radians()) * sin_theta).extend(cos_theta)
}

/// Pairs of directions all over the hemisphere, half of them near mirror directions.
fn pairs() -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..400).map(f64::from).flat_map(|t| {
        let (w_i, w_o) = (direction((t * 7.31) % 89.9, t * 31.7), direction((t * 3.77) % 89.9, t * 11.3));
        let near = (dvec3(-w_o.x, -w_o.y, w_o.z) + 0.01 * w_i).normalize();
        [(w_i, w_o), (near, w_o)]
    })
}

#[test]
fn equal_roughness_along_both_axes_is_the_isotropic_model() {
    for alpha in [0.0011, 0.02, 0.3, 1.0] {
        // One unit in the last place apart, so that the formulas are the anisotropic ones.
        let other = f64::from_bits(f64::to_bits(alpha) - 1);
        for (model, rest) in [
            ("conductor", "distribution = 'ggx'; metal = 'Au'"),
            ("conductor", "distribution = 'beckmann'; metal = 'Au'"),
            ("plastic", "distribution = 'ggx'; ior = 1.5; diffuse = 0.5"),
            ("plastic", "distribution = 'beckmann'; ior = 1.5; diffuse = 0"),
        ] {
            let isotropic = brdf(model, &format!("{rest}; alpha = {alpha}"));
            let same = brdf(model, &format!("{rest}; alpha_x = {alpha}; alpha_y = {alpha}; rotation_deg = 20"));
            let next = brdf(model, &format!("{rest}; alpha_x = {alpha}; alpha_y = {other:?}; rotation_deg = 20"));
            assert_eq!(isotropic.fingerprint(), same.fingerprint());
            for (w_i, w_o) in pairs() {
                let f = isotropic.evaluate(w_i, w_o);
                assert_eq!(f, same.evaluate(w_i, w_o));
                let difference = (next.evaluate(w_i, w_o) - f).abs().max_element();
                // Far out on a Beckmann lobe the exponent, some hundreds, multiplies the last digit.
                assert!(difference <= 1e-12 * f.max_element(), "{next:?} {w_i} {w_o}: {difference} of {f}");
            }
        }
    }
}
