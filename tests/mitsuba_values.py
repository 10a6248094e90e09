"""Writes tests/mitsuba_values.csv: values of BRDFs by Mitsuba 3, which tests/mitsuba.rs compares with ours.

    pip install mitsuba && python3 tests/mitsuba_values.py

Made with Mitsuba 3.9.1, variant scalar_rgb: single precision, unpolarised. Mitsuba's eval() has the cosine of the light, which is divided out.
Its alpha_u is along the tangent and alpha_v across it, as alpha_x and alpha_y are here; both are used as they are, not squared. Facets shadow
separably, G1 G1, with Walter's rational form for Beckmann, the same as here.

What is not compared, since the definitions differ: `roughplastic`, whose base scatters between coat and base and whose coat is averaged over
its microfacets (ours is of the smooth interface and scatters once), and the lobe of the base of `principled`, which has Disney's Fresnel term
and its own formula for anisotropy. The coat of our `plastic` by itself (diffuse = 0) is the reflected half of `roughdielectric`. The rotation
is a turn of both directions the other way.
"""

import csv
import pathlib

import mitsuba
import numpy

mitsuba.set_variant("scalar_rgb")

GOLD = {"eta": [0.143, 0.375, 1.442], "k": [3.983, 2.386, 1.603]}
ROUGHNESS = [(0.3, 0.3, 0), (0.05, 0.3, 0), (0.5, 0.1, 0), (0.02, 0.06, 30), (1.0, 0.2, -75)]
COUNT = 20


def directions(random, alpha):
    """Pairs towards light and eye: half of them anywhere, half by half vectors in the lobe; within 85 degrees of the normal."""
    pairs = []
    while len(pairs) < COUNT:
        w_o = normalised(random.normal(size=3) * [1, 1, 0.7])
        w_i = normalised(random.normal(size=3) * [1, 1, 0.7])
        if len(pairs) % 2 == 1:
            slope = random.normal(size=2) * alpha
            h = normalised(numpy.array([slope[0], slope[1], 1.0]))
            w_i = 2 * w_o.dot(h) * h - w_o
        if min(w_i[2], w_o[2]) > 0.087:
            pairs.append((w_i, w_o))
    return pairs


def normalised(vector):
    return vector / numpy.linalg.norm(vector)


def turned(vector, rotation_deg):
    angle = numpy.radians(rotation_deg)
    cos, sin = numpy.cos(angle), numpy.sin(angle)
    return numpy.array([cos * vector[0] - sin * vector[1], sin * vector[0] + cos * vector[1], vector[2]])


def value(bsdf, w_i, w_o):
    """f(w_i, w_o) in 1/sr."""
    surface = mitsuba.SurfaceInteraction3f()
    surface.n = [0, 0, 1]
    surface.sh_frame = mitsuba.Frame3f([0, 0, 1])
    # Mitsuba names them the other way round: wi is towards the eye.
    surface.wi = mitsuba.Vector3f(w_o)
    f = bsdf.eval(mitsuba.BSDFContext(), surface, mitsuba.Vector3f(w_i))
    return numpy.array(f).ravel() / w_i[2]


def main():
    random = numpy.random.default_rng(15)
    rows = []
    for distribution in ("ggx", "beckmann"):
        for alpha_x, alpha_y, rotation_deg in ROUGHNESS:
            facets = {"distribution": distribution, "alpha_u": alpha_x, "alpha_v": alpha_y}
            metal = {name: {"type": "rgb", "value": numbers} for name, numbers in GOLD.items()}
            models = {
                "conductor": mitsuba.load_dict({"type": "roughconductor", **facets, **metal}),
                "plastic": mitsuba.load_dict({"type": "roughdielectric", "int_ior": 1.5, "ext_ior": 1.0, **facets}),
            }
            for model, bsdf in models.items():
                for w_i, w_o in directions(random, [alpha_x, alpha_y]):
                    f = value(bsdf, w_i, w_o)
                    # The material is turned by rotation_deg, and both directions with it.
                    w = [*turned(w_i, rotation_deg), *turned(w_o, rotation_deg)]
                    numbers = [f"{number:.12g}" for number in w] + [f"{number:.7g}" for number in f]
                    rows.append([model, distribution, alpha_x, alpha_y, rotation_deg, *numbers])
    columns = "model distribution alpha_x alpha_y rotation_deg ix iy iz ox oy oz r g b".split()
    with open(pathlib.Path(__file__).with_suffix(".csv"), "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([columns, *rows])


if __name__ == "__main__":
    main()
