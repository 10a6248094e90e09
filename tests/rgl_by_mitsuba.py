"""Writes rgl_by_mitsuba.csv: values of RGL's measured materials as Mitsuba 3's plugin `measured` finds them.

    pip install mitsuba numpy
    python3 tests/rgl_by_mitsuba.py ../shared/data/bsdf/rgl > tests/rgl_by_mitsuba.csv

Mitsuba's `si.wi` is the direction that is known, the view; its `wo` is the light, by whose cosine `eval` has multiplied f.
Directions are in single precision, as Mitsuba computes. Columns: file, w_i, w_o, f for red, green and blue.
"""

import pathlib
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")


def direction(theta_deg, phi_deg):
    theta, phi = np.radians([theta_deg, phi_deg])
    w = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    # Adding 0 makes -0 positive, since Mitsuba's azimuth of (-0, -0, 1) is not 0.
    return np.float32(w / np.linalg.norm(w) + 0.0)


def pairs(random):
    """w_i and w_o: half of them about mirror directions at all distances, half anywhere, grazing ones among both."""
    for theta_o in [0, 2, 10, 25, 40, 55, 65, 75, 80, 84, 87, 89]:
        w_o = direction(theta_o, random.uniform(0, 360) if theta_o > 0 else 0)
        wanted = 10
        while wanted > 0:
            if wanted > 5:
                h = direction(60 * random.random() ** 3, random.uniform(0, 360)).astype(float)
                w_i = 2 * np.dot(h, w_o) * h - w_o
                w_i = np.float32(w_i / np.linalg.norm(w_i))
            else:
                w_i = direction(89.5 * np.sqrt(random.random()), random.uniform(0, 360))
            if w_i[2] > 0.005:
                wanted -= 1
                yield w_i, w_o


print("file,w_i.x,w_i.y,w_i.z,w_o.x,w_o.y,w_o.z,red,green,blue")
for path in sorted(pathlib.Path(sys.argv[1]).glob("*_rgb.bsdf")):
    bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
    random = np.random.default_rng(1)
    for w_i, w_o in pairs(random):
        si = mi.SurfaceInteraction3f()
        si.wi = mi.Vector3f(*map(float, w_o))
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*map(float, w_i)))) / float(w_i[2])
        numbers = [f"{number:.9g}" for number in [*w_i, *w_o]] + [f"{number:.7g}" for number in value]
        print(",".join([path.name, *numbers]))
