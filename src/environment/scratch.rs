use super::*;
#[test]
fn scratch() {
    let view = |name: &str, width: u32, height: u32, ray: &dyn Fn(f64, f64) -> DVec3, f: &dyn Fn(DVec3) -> DVec3| {
        let mut bytes = Vec::new();
        for i in 0..width * height {
            let c = f(ray((i % width) as f64, (i / width) as f64));
            bytes.extend(c.to_array().map(|v| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0 + 0.5) as u8));
            bytes.push(255);
        }
        crate::output::write_png(std::path::Path::new(name), width, height, &bytes, false).unwrap();
    };
    for name in builtin_names() {
        let t = std::time::Instant::now();
        let env = Environment::builtin(name).unwrap();
        println!("{name} made in {:?} mean {} max {}", t.elapsed(), env.mean_radiance(), env.max_radiance());
        let t = std::time::Instant::now();
        let p = Pyramid::box_filtered(&env);
        println!("  pyramid {} in {:?}, scale {}", p.face_size, t.elapsed(), p.radiance_scale());
        if *name == "white" {
            continue;
        }
        let map = environment_rays(768, 384);
        view(&format!("/tmp/scene_{name}_map.png"), 768, 384, &map, &|d| env.radiance(d));
        let cam = |x: f64, y: f64| {
            let e = DVec3::new(1.5, 1.0, 3.5);
            let f = -e.normalize();
            let r = f.cross(DVec3::Y).normalize();
            let u = r.cross(f);
            let t = 18f64.to_radians().tan();
            f + (2.0 * (x + 0.5) / 640.0 - 1.0) * t * 640.0 / 480.0 * r + (1.0 - 2.0 * (y + 0.5) / 480.0) * t * u
        };
        // mirror-ish sphere, glossy by level
        for (tag, level) in [("mirror", 0.0f32), ("rough", 4.0)] {
            view(&format!("/tmp/scene_{name}_{tag}.png"), 640, 480, &cam, &|d| {
                let e = DVec3::new(1.5, 1.0, 3.5);
                let d = d.normalize();
                let b = e.dot(d);
                let disc = b * b - (e.length_squared() - 1.0);
                if disc < 0.0 {
                    return env.radiance(d);
                }
                let t = -b - disc.sqrt();
                let n = e + t * d;
                let r = d - 2.0 * d.dot(n) * n;
                DVec3::new(1.0, 0.78, 0.4) * p.lookup(r.as_vec3(), level).as_dvec3()
            });
        }
    }
    for name in ["env/lebombo_1k.hdr", "env/studio_small_03_1k.hdr"] {
        let path = format!("../shared/data/{name}");
        let t = std::time::Instant::now();
        let env = Environment::load(std::path::Path::new(&path)).unwrap();
        println!("{name} loaded in {:?} mean {} max {}", t.elapsed(), env.mean_radiance(), env.max_radiance());
        let t = std::time::Instant::now();
        let p = Pyramid::box_filtered(&env);
        println!("  pyramid {} in {:?}, scale {}", p.face_size, t.elapsed(), p.radiance_scale());
    }
    let mut big = Environment::builtin("white").unwrap();
    for w in [2048usize, 4096, 8192] {
        big.width = w;
        big.height = w / 2;
        big.texels = vec![[1.0; 3]; w * w / 2];
        let t = std::time::Instant::now();
        let p = Pyramid::box_filtered(&big);
        println!("{w}  pyramid {} in {:?}, scale {}", p.face_size, t.elapsed(), p.radiance_scale());
    }
}
#[test]
fn coarse() {
    for n in [64usize, 32] {
        for (column, row) in
            [(200, 90), (64, 63), (32, 40), (77, 52), (128, 64), (180, 30), (190, 31), (201, 20), (16, 100)]
        {
            let map = tests::environment(256, 128, |x, y| [if (x, y) == (column, row) { 1e6 } else { 0.0 }; 3]);
            let level = pyramid::finest_level(&map, n);
            let mean = level
                .iter()
                .enumerate()
                .map(|(i, t)| cube::exact_texel_solid_angle(n, i % n, i / n % n) * t[0] as f64)
                .sum::<f64>()
                / 4.0
                / PI;
            println!("coarse {n} {column} {row} {:e}", mean / map.mean_radiance().x - 1.0);
        }
    }
}
fn environment_rays(w: usize, h: usize) -> impl Fn(f64, f64) -> DVec3 {
    let e = tests::environment(w, h, |_, _| [0.0; 3]);
    move |x, y| e.direction(x, y)
}
