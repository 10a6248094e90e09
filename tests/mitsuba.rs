//! Rough metals and coats against Mitsuba 3, isotropic and anisotropic: tests/mitsuba_values.csv, which tests/mitsuba_values.py makes. Needs
//! no device.
use glam::{DVec3, dvec3};
use threadlight::Brdf;

const METAL: &str = "eta = [0.143, 0.375, 1.442]\nk = [3.983, 2.386, 1.603]";
const COAT: &str = "ior = 1.5\ndiffuse = 0";

/// A line of the table: the BRDF, both directions, Mitsuba's value.
fn row(line: &str) -> (Brdf, [DVec3; 2], DVec3) {
    let words: Vec<&str> = line.split(',').collect();
    let number = |column: usize| words[column].parse::<f64>().expect("a number");
    let vector = |column: usize| dvec3(number(column), number(column + 1), number(column + 2));
    let (model, distribution, rest) = (words[0], words[1], if words[0] == "conductor" { METAL } else { COAT });
    let roughness = match number(2) == number(3) {
        true => format!("alpha = {}", number(2)),
        false => format!("alpha_x = {}\nalpha_y = {}\nrotation_deg = {}", number(2), number(3), number(4)),
    };
    let parameters = format!("distribution = '{distribution}'\n{roughness}\n{rest}").parse().expect("TOML");
    let brdf = Brdf::from_parameters(model, parameters).expect("a BRDF");
    (brdf, [vector(5), vector(8)], vector(11))
}

#[test]
fn rough_metals_and_coats_have_the_values_of_mitsuba() {
    let rows = include_str!("mitsuba_values.csv").lines().skip(1);
    let (mut worst, mut count, mut bright) = (0.0f64, 0, 0);
    for line in rows {
        let (brdf, [w_i, w_o], expected) = row(line);
        let f = brdf.evaluate(w_i, w_o);
        // Far out on a Beckmann lobe Mitsuba's single precision takes values for 0.
        let error = ((f - expected).abs() / (expected + 1e-6)).max_element();
        assert!(f.is_finite() && error < TOLERANCE, "{f}, Mitsuba has {expected}: {line}");
        (worst, count, bright) = (worst.max(error), count + 1, bright + usize::from(f.max_element() > 0.1));
    }
    println!("{count} values, {bright} of them above 0.1 / sr: {worst:.1e} at most");
    assert!(count == 400 && bright > 150);
}

/// Relative. What single precision leaves of half vectors in the narrowest lobe, 0.02, is below 2e-5.
const TOLERANCE: f64 = 1e-4;
