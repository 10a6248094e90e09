"""Writes made-up anisotropic files in the form of the RGL database: small, smooth, and different in every dimension.

    pip install mitsuba numpy
    python3 tests/rgl/make.py
    python3 tests/rgl_by_mitsuba.py tests/rgl > tests/rgl/by_mitsuba.csv

One for each part of a turn that the database measures of materials: `whole_turn_rgb.bsdf`, `half_turn_rgb.bsdf` (half a turn leaves them as
they are) and `quarter_turn_rgb.bsdf` (so do mirrors along and across the tangent).
"""

import pathlib
import struct

import numpy as np


def tensor_file(fields):
    kinds = {np.dtype(np.uint8): 1, np.dtype(np.float32): 10}
    offset = 18 + sum(13 + len(name) + 8 * array.ndim for name, array in fields)
    header, values = b"tensor_file\0\1\0" + struct.pack("<I", len(fields)), b""
    for name, array in fields:
        header += struct.pack("<H", len(name)) + name.encode()
        header += struct.pack("<HBQ", array.ndim, kinds[array.dtype], offset + len(values))
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        values += array.tobytes()
    return header + values


def smooth(random, *sizes):
    """Positive numbers: waves of some random directions and phases."""
    at = np.stack(np.meshgrid(*[np.linspace(0, 1, size) for size in sizes], indexing="ij"), -1)
    waves = [np.sin(at @ random.uniform(-4, 4, len(sizes)) + random.uniform(0, 6)) for _ in range(4)]
    return np.float32(np.exp(0.7 * sum(waves)))


def material(random, phi_i):
    phis, theta_i = len(phi_i), np.float32([0, 0.4, 0.9, 1.5])
    fields = [
        ("description", np.frombuffer(b"made up", np.uint8)),
        ("jacobian", np.ones(1, np.uint8)),
        ("phi_i", np.float32(phi_i)),
        ("theta_i", theta_i),
        ("ndf", smooth(random, 9, 7)),
        ("sigma", 0.2 + 0.2 * smooth(random, 8, 5)),
        ("vndf", smooth(random, phis, len(theta_i), 7, 6)),
        ("luminance", smooth(random, phis, len(theta_i), 5, 5)),
        ("rgb", 0.1 * smooth(random, phis, len(theta_i), 3, 5, 5)),
    ]
    # Along the normal all azimuths are one.
    for name, array in fields:
        if name == "sigma" or array.ndim > 3:
            array[:, 0] = array[0, 0]
    return fields


for part, last_deg, phis in [("whole", 180, 7), ("half", 0, 5), ("quarter", -90, 4)]:
    fields = material(np.random.default_rng(phis), np.radians(np.linspace(-180, last_deg, phis)))
    pathlib.Path(__file__).with_name(f"{part}_turn_rgb.bsdf").write_bytes(tensor_file(fields))
