//! scratch
mod common;
use common::*;
use glam::DVec3;
use std::path::PathBuf;
use threadlight::brdf::Brdf;
use threadlight::environment::Environment;
use threadlight::evaluate::reference::*;
use threadlight::output::read_image;
use threadlight::scene::Camera;

#[test]
#[ignore]
fn subset() {
    let folder = PathBuf::from("../shared/reference");
    let conductor = |alpha: f64| {
        Brdf::from_parameters(
            "conductor",
            format!("distribution = 'ggx'\nalpha = {alpha}\neta = [0.2, 0.924, 1.102]\nk = [3.912, 2.448, 2.142]")
                .parse()
                .unwrap(),
        )
        .unwrap()
    };
    let diffuse = Brdf::from_parameters("lambert", "reflectance = [0.8, 0.5, 0.2]".parse().unwrap()).unwrap();
    let mix = Brdf::load(std::path::Path::new("/tmp/mix.binary")).unwrap();
    let stride: usize = std::env::var("STRIDE").map_or(7, |s| s.parse().unwrap());
    let tol: f64 = std::env::var("TOL").map_or(2e-4, |s| s.parse().unwrap());
    for (name, brdf, env) in [
        ("diffuse__proc_nosun", diffuse, "proc_nosun"),
        ("ggx02__proc_nosun", conductor(0.2), "proc_nosun"),
        ("ggx02__proc_sun", conductor(0.2), "proc_sun"),
        ("ggx005__proc_sun", conductor(0.05), "proc_sun"),
        ("merl_mix_tri__sunset", mix, "sunset"),
    ] {
        let env = Environment::load(&folder.join(format!("env/{env}.exr"))).unwrap();
        let start = std::time::Instant::now();
        let integrator = Integrator::new(&env, 1.0, [&brdf], 1);
        let setup = start.elapsed().as_secs_f64();
        let picture = read_image(&folder.join(format!("images/{name}.exr"))).unwrap();
        let camera = Camera { eye: DVec3::new(1.5, 1.0, 3.5), target: DVec3::ZERO, up: DVec3::Y, fov_y_deg: 36.0 };
        let display = Display { exposure: 1.0, gamma: 2.2 };
        let start = std::time::Instant::now();
        let (mut sq, mut n, mut evals, mut est, mut max, mut worst) = (0.0, 0, 0, 0.0, 0.0f64, (0.0f64, 0, 0));
        let mut bias = DVec3::ZERO;
        for y in (0..480).step_by(stride) {
            for x in (0..640).step_by(stride) {
                let d = camera.ray(x as f64, y as f64, 640, 480);
                let b = camera.eye.dot(d);
                let impact = (camera.eye.length_squared() - b * b).sqrt();
                if impact > 0.985 {
                    continue;
                }
                let t = -b - (1.0 - impact * impact).sqrt();
                let p = (camera.eye + t * d).normalize();
                let e = integrator.pixel(&[Point::new(p, -d, 0)], tol, display);
                evals += e.evaluations;
                for c in 0..3 {
                    let a = e.radiance[c].clamp(0.0, 1.0).powf(1.0 / 2.2);
                    let r = f64::from(picture.rgba[y * 640 + x][c]).clamp(0.0, 1.0).powf(1.0 / 2.2);
                    sq += (a - r).powi(2);
                    n += 1;
                    bias[c] += a - r;
                    if (a - r).abs() > worst.0 {
                        worst = ((a - r).abs(), x, y);
                    }
                    est += e.display_error[c].powi(2);
                    max = max.max(e.display_error[c]);
                }
            }
        }
        let s = start.elapsed().as_secs_f64();
        let px = n / 3;
        println!(
            "{name}: rms {:.2e} est {:.2e} max {max:.2e} worst {worst:?} bias {:?} evals/px {} {:.2} ms/px setup {setup:.2} ns/eval {:.0}",
            (sq / n as f64).sqrt(),
            (est / n as f64).sqrt(),
            (bias / px as f64).to_array().map(|b| (b * 1e6).round() / 1e6),
            evals / px as u64,
            s * 1e3 / px as f64,
            s * 1e9 / evals as f64
        );
    }
}

#[test]
#[ignore]
fn negatives() {
    let folder = PathBuf::from("../shared/reference");
    let mix = Brdf::load(std::path::Path::new("/tmp/mix.binary")).unwrap();
    let env = Environment::load(&folder.join("env/sunset.exr")).unwrap();
    let raw = read_image(&folder.join("env/sunset.exr")).unwrap();
    let raw: Vec<[f32; 3]> = raw.rgba.iter().map(|t| [t[0], t[1], t[2]]).collect();
    let with = |texels: Vec<[f32; 3]>| Environment { texels, ..env.clone() };
    let plus = with(raw.iter().map(|t| t.map(|v| v.max(0.0))).collect());
    let minus = with(raw.iter().map(|t| t.map(|v| (-v).max(0.0))).collect());
    let mut moved = raw.clone();
    let (w, h) = (env.width as isize, env.height as isize);
    for p in 0..raw.len() {
        for c in 0..3 {
            if raw[p][c] < 0.0 {
                let mut deficit = -raw[p][c];
                moved[p][c] = 0.0;
                let (x, y) = (p as isize % w, p as isize / w);
                let mut radius = 1;
                while deficit > 1e-6 && radius < 4 {
                    let near: Vec<usize> = (-radius..=radius)
                        .flat_map(|dy| (-radius..=radius).map(move |dx| (dx, dy)))
                        .filter(|(_, dy)| (0..h).contains(&(y + dy)))
                        .map(|(dx, dy)| ((y + dy) * w + (x + dx).rem_euclid(w)) as usize)
                        .collect();
                    let total: f32 = near.iter().map(|&q| moved[q][c].max(0.0)).sum();
                    let share = (deficit / total.max(1e-30)).min(1.0);
                    for q in near {
                        let v = moved[q][c].max(0.0) * share;
                        moved[q][c] -= v;
                        deficit -= v;
                    }
                    radius += 1;
                }
            }
        }
    }
    for t in &mut moved {
        *t = t.map(|v| v.max(0.0));
    }
    let moved = with(moved);
    let picture = read_image(&folder.join("images/merl_mix_tri__sunset.exr")).unwrap();
    let camera = Camera { eye: DVec3::new(1.5, 1.0, 3.5), target: DVec3::ZERO, up: DVec3::Y, fov_y_deg: 36.0 };
    let display = Display { exposure: 1.0, gamma: 2.2 };
    let all: Vec<_> = [&plus, &minus, &moved].map(|env| Integrator::new(env, 1.0, [&mix], 1)).into_iter().collect();
    let mut sq = [0.0; 3];
    let mut n = 0;
    let mut worst = [0f64; 3];
    for y in (0..480).step_by(17) {
        for x in (0..640).step_by(17) {
            let d = camera.ray(x as f64, y as f64, 640, 480);
            let b = camera.eye.dot(d);
            let impact = (camera.eye.length_squared() - b * b).sqrt();
            if impact > 0.985 {
                continue;
            }
            let t = -b - (1.0 - impact * impact).sqrt();
            let p = (camera.eye + t * d).normalize();
            let [e, m, v] = [0, 1, 2].map(|i| all[i].pixel(&[Point::new(p, -d, 0)], 2e-4, display).radiance);
            for (k, l) in [e, e - m, v].into_iter().enumerate() {
                for c in 0..3 {
                    let a = l[c].clamp(0.0, 1.0).powf(1.0 / 2.2);
                    let r = f64::from(picture.rgba[y * 640 + x][c]).clamp(0.0, 1.0).powf(1.0 / 2.2);
                    sq[k] += (a - r).powi(2);
                    n += 1;
                    worst[k] = worst[k].max((a - r).abs());
                }
            }
        }
    }
    println!("clamped, signed, moved: {:?} worst {worst:?}", sq.map(|s| (s / (n as f64 / 3.0)).sqrt()));
}
