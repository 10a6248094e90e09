//! `threadlight materials evaluate`: values of a BRDF at directions that are read from standard input.
use super::Named;
use crate::cli::unless_unheard;
use glam::{DVec3, dvec3};
use std::io::{BufRead, Read, Write};
use threadlight::{Error, Result};

const EXAMPLES: &str = "\
Examples:
  echo 30 30 180 | threadlight materials evaluate gold
  echo 0.6 0 0.8 -0.6 0 0.8 | threadlight materials evaluate gold --directions";

/// Reads pairs of directions, a line each, and writes f for red, green and blue in 1/sr, linear Rec. 709.
///
/// A line is `theta_i theta_o phi` in degrees: the angles of light and view to the normal and the azimuth between them, so that 30 30 180 is a
/// mirror direction. Of an anisotropic material a fourth number is the azimuth of the view, counter-clockwise from the tangent; 0 if it is
/// left out. Empty lines, and what begins with #, are passed over.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Evaluate {
    #[command(flatten)]
    named: Named,
    /// A line is two unit vectors instead, `w_i w_o` towards light and view, six numbers; z is the normal, x the tangent.
    #[arg(long)]
    directions: bool,
}

impl Evaluate {
    pub fn run(self) -> anyhow::Result<()> {
        let brdf = self.named.load()?;
        let parse = if self.directions { of_vectors } else { of_angles };
        let mut out = std::io::BufWriter::new(std::io::stdout().lock());
        let mut input = std::io::BufReader::new(std::io::stdin());
        for number in 1.. {
            // Whoever waits for an answer before the next line has it.
            let answered = if input.buffer().is_empty() { out.flush() } else { Ok(()) };
            // Where nobody listens any more, nothing more is read.
            if answered.is_err() {
                return Ok(unless_unheard(answered)?);
            }
            let Some(line) = next_line(&mut input).map_err(|error| within_line(error, number))? else { break };
            if line.trim().is_empty() || line.trim_start().starts_with('#') {
                continue;
            }
            let (w_i, w_o) = parse(&line).map_err(|error| within_line(error, number))?;
            let f = brdf.evaluate(w_i, w_o);
            let printed = writeln!(out, "{} {} {}", f.x, f.y, f.z);
            if printed.is_err() {
                return Ok(unless_unheard(printed)?);
            }
        }
        Ok(unless_unheard(out.flush())?)
    }
}

/// Longest line, in bytes: what is read may have no end.
const MAX_LINE: u64 = 1 << 12;

fn within_line(error: Error, number: usize) -> Error {
    error.within(format!("standard input, line {number}"))
}

/// The next line of `input`, if there is one.
fn next_line(input: &mut impl BufRead) -> Result<Option<String>> {
    let unusable = |problem: String| Error::input("the line", problem, "give numbers as text");
    let mut bytes = Vec::new();
    let read = input.take(MAX_LINE).read_until(b'\n', &mut bytes);
    match read.map_err(|cause| unusable(format!("cannot be read ({cause})")))? as u64 {
        0 => Ok(None),
        MAX_LINE if bytes.last() != Some(&b'\n') => Err(unusable(format!("has more than {MAX_LINE} bytes"))),
        _ => {
            String::from_utf8(bytes).map(Some).map_err(|cause| unusable(format!("is no text ({})", cause.utf8_error())))
        }
    }
}

/// The `N` numbers of a line.
fn numbers<const N: usize>(line: &str, form: &str) -> Result<[f64; N]> {
    let numbers: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
    let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
    let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
    numbers.ok_or_else(|| {
        Error::input(format!("\"{}\"", line.trim()), format!("is not {N} numbers"), format!("give {form}"))
    })
}

fn of_angles(line: &str) -> Result<(DVec3, DVec3)> {
    const FORM: &str = "theta_i theta_o phi, in degrees, and of an anisotropic material the azimuth of the view";
    let [theta_i, theta_o, phi, phi_o] = match line.split_whitespace().count() {
        4 => numbers(line, FORM)?,
        _ => numbers::<3>(line, FORM).map(|[theta_i, theta_o, phi]| [theta_i, theta_o, phi, 0.0])?,
    };
    if !(0.0..=180.0).contains(&theta_i) || !(0.0..=180.0).contains(&theta_o) {
        return Err(Error::input(line.trim(), "has an angle to the normal out of range", "use 0 to 180 degrees"));
    }
    let direction = |theta: f64, phi: f64| {
        let (sin_theta, cos_theta) = theta.to_radians().sin_cos();
        let (sin_phi, cos_phi) = phi.to_radians().sin_cos();
        dvec3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    };
    Ok((direction(theta_i, phi + phi_o), direction(theta_o, phi_o)))
}

fn of_vectors(line: &str) -> Result<(DVec3, DVec3)> {
    let [a, b, c, d, e, f] = numbers(line, "two unit vectors, w_i and w_o")?;
    let pair = [dvec3(a, b, c), dvec3(d, e, f)];
    if pair.iter().any(|w| (w.length() - 1.0).abs() > 1e-3) {
        return Err(Error::input(line.trim(), "has a vector whose length is not 1", "give unit vectors, w_i and w_o"));
    }
    Ok((pair[0].normalize(), pair[1].normalize()))
}
