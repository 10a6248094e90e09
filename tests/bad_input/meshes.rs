//! Mesh files.
use crate::{noise, refuses, render, workplace};
use std::fs;

#[test]
fn hostile_meshes_are_refused() {
    let folder = workplace();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
    for (name, text) in [
        ("empty.obj", String::new()),
        ("no_faces.obj", triangle.into()),
        ("line.obj", format!("{triangle}l 1 2 3\nf 1 2\n")),
        ("flat.obj", format!("{triangle}f 1 1 2\n")),
        ("beyond.obj", format!("{triangle}f 1 2 4\n")),
        ("zero.obj", format!("{triangle}f 1 2 0\n")),
        ("behind.obj", format!("{triangle}f 1 2 -4\n")),
        ("absurd.obj", format!("{triangle}f 1 2 -9223372036854775808\n")),
        ("endless.obj", format!("{triangle}f 1 2 99999999999999999999\n")),
        ("normal.obj", format!("{triangle}f 1//1 2//1 3//2\n")),
        ("absurd_normal.obj", format!("{triangle}f 1//1 2//1 3//9223372036854775807\n")),
        ("nan.obj", format!("{triangle}v 1 nan 0\nf 1 2 4\n")),
        ("infinite.obj", format!("{triangle}v 1 1e99 0\nf 1 2 4\n")),
        ("short.obj", format!("{triangle}v 1 2\nf 1 2 3\n")),
        ("words.obj", format!("{triangle}v one two three\nf 1 2 3\n")),
        ("huge.obj", "v 1e38 1e38 0\nv -1e38 0 3e38\nv 0 1e38 1e38\nf 1 2 3\n".into()),
        ("distant.obj", "v 1e20 0 0\nv 0 0 0\nv 0 1e20 0\nf 1 2 3\n".into()),
        ("mesh.ply", "ply\n".into()),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        refuses(&folder, &render(&format!("--mesh {name}")), &[name]);
    }
    for (name, reason) in [
        ("beyond.obj", "line 5: there is no vertex 4"),
        ("words.obj", "line 5: `v` is not followed by three numbers"),
        ("distant.obj", "is 1.41e20 in size and reaches 1.41e20"),
    ] {
        refuses(&folder, &render(&format!("--mesh {name}")), &[name, reason]);
    }
    for (name, mark) in [("little_endian.obj", [0xff, 0xfe]), ("big_endian.obj", [0xfe, 0xff])] {
        fs::write(folder.path().join(name), [&mark[..], b"v\0"].concat()).unwrap();
        refuses(&folder, &render(&format!("--mesh {name}")), &[name, "UTF-16"]);
    }
    fs::create_dir(folder.path().join("folder.obj")).unwrap();
    fs::write(folder.path().join("noise.obj"), noise(4096)).unwrap();
    for name in ["folder.obj", "missing.obj", "noise.obj"] {
        refuses(&folder, &render(&format!("--mesh {name}")), &[name]);
    }
}
