"""Writes tests/picture_by_mitsuba.csv: the picture of a brushed metal sphere by Mitsuba 3, which tests/reference.rs compares with ours.

    pip install mitsuba==3.9.1 numpy && python3 tests/picture_by_mitsuba.py

Made with Mitsuba 3.9.1, variant scalar_rgb, in a minute. The unit sphere, `roughconductor` with alpha_u around +y and alpha_v across it, under a smooth environment that both compute by `radiance`; direct
light only, one ray through the centre of each pixel, SAMPLES of each of two strategies. A line is a pixel's column and row, its linear radiance,
and the standard error of the mean of its three channels. Left out are pixels that see the sphere by more than 75 degrees from the normal, where
a mesh is not a sphere.
"""

import csv
import pathlib

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")

WIDTH, HEIGHT = 32, 24
SAMPLES, ROUNDS = 4096, 4
EYE = numpy.array([1.5, 1.0, 3.5])
FOV_Y_DEG = 36.0
LIGHTS = [
    ([0.6, 0.64, 0.48], 12.0, [1.2, 0.96, 0.6]),
    ([-0.48, 0.36, 0.8], 25.0, [0.8, 1.4, 2.0]),
]


def radiance(d):
    """Of directions (..., 3): a gradient and two soft lights."""
    x, y, z = numpy.moveaxis(d, -1, 0)
    sum = numpy.stack([0.25 + 0.15 * y, 0.3 + 0.1 * x, 0.35 - 0.1 * z], -1)
    for towards, sharpness, colour in LIGHTS:
        sum = sum + numpy.exp(sharpness * (d @ numpy.array(towards) - 1.0))[..., None] * numpy.array(colour)
    return sum


def environment(width=2048, height=1024):
    """A map of it. In Mitsuba the first and last rows are the poles, and columns have their centres as everywhere."""
    phi = 2 * numpy.pi * (numpy.arange(width) + 0.5) / width
    theta = numpy.pi * numpy.arange(height)[:, None] / (height - 1)
    d = numpy.stack([numpy.sin(theta) * numpy.sin(phi), numpy.cos(theta) + 0 * phi, -numpy.sin(theta) * numpy.cos(phi)], -1)
    return {"type": "envmap", "bitmap": mitsuba.Bitmap(radiance(d).astype(numpy.float32))}


def check(scene):
    """That Mitsuba's environment is `radiance`."""
    d = numpy.random.default_rng(3).normal(size=(10000, 3))
    d /= numpy.linalg.norm(d, axis=-1, keepdims=True)
    surface = mitsuba.SurfaceInteraction3f()
    worst = 0
    for towards in d:
        surface.wi = mitsuba.Vector3f(-towards)
        worst = max(worst, numpy.abs(numpy.array(scene.environment().eval(surface)).ravel() - radiance(towards)).max())
    print(f"environment: {worst:.1e} at most")
    assert worst < 1e-4, worst


def rays():
    """Directions through the centres of pixels, row by row, and those pixels, that see the sphere well."""
    forward = -EYE / numpy.linalg.norm(EYE)
    right = numpy.cross(forward, [0, 1, 0])
    right /= numpy.linalg.norm(right)
    up = numpy.cross(right, forward)
    row, column = numpy.mgrid[0:HEIGHT, 0:WIDTH].reshape(2, -1)
    tangent = numpy.tan(numpy.radians(FOV_Y_DEG / 2))
    x = (2 * (column + 0.5) / WIDTH - 1) * tangent * WIDTH / HEIGHT
    y = (1 - 2 * (row + 0.5) / HEIGHT) * tangent
    d = forward + x[:, None] * right + y[:, None] * up
    d /= numpy.linalg.norm(d, axis=-1, keepdims=True)
    # The cosine at which the unit sphere is met.
    cos2 = 1 - (EYE @ EYE - (d @ EYE) ** 2)
    seen = cos2 > numpy.cos(numpy.radians(75)) ** 2
    return d[seen], column[seen], row[seen]


def main():
    metal = {name: {"type": "rgb", "value": value} for name, value in (("eta", [0.143, 0.375, 1.442]), ("k", [3.983, 2.386, 1.603]))}
    scene = mitsuba.load_dict({
        "type": "scene",
        "environment": environment(),
        # Its poles are on z: turned to y.
        "sphere": {
            "type": "sphere",
            "to_world": mitsuba.ScalarTransform4f().rotate([1, 0, 0], -90),
            "bsdf": {"type": "roughconductor", "distribution": "ggx", "alpha_u": 0.1, "alpha_v": 0.4, **metal},
        },
    })
    check(scene)
    d, column, row = rays()
    integrator = mitsuba.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 1})
    film = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}, "component_format": "float32", "pixel_format": "rgb"}
    mean, error = [], []
    for towards in d:
        eye = {"type": "radiancemeter", "origin": EYE.tolist(), "direction": towards.tolist(), "film": film}
        sensor = mitsuba.load_dict({**eye, "sampler": {"type": "multijitter", "sample_count": SAMPLES}})
        picture = lambda seed: numpy.array(mitsuba.render(scene, sensor=sensor, integrator=integrator, seed=seed)).ravel()
        found = numpy.array([picture(seed) for seed in range(ROUNDS)])
        mean.append(found.mean(axis=0))
        error.append(found.mean(axis=1).std(ddof=1) / numpy.sqrt(ROUNDS))
    mean, error = numpy.array(mean), numpy.array(error)
    print(f"standard error: {error.mean():.1e}, {error.max():.1e} at most")
    with open(pathlib.Path(__file__).with_suffix(".csv"), "w", newline="") as file:
        write = csv.writer(file, lineterminator="\n").writerow
        write("column row r g b standard_error".split())
        for pixel in zip(column, row, mean, error):
            write([pixel[0], pixel[1], *(f"{value:.6g}" for value in pixel[2]), f"{pixel[3]:.1e}"])


if __name__ == "__main__":
    main()
