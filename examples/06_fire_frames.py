#!/usr/bin/env python3
"""Frames of a fire, made of noise: fire.0001.pfm ... in a folder. The same numbers make the same bytes everywhere.

    06_fire_frames.py FOLDER [FRAMES]

A frame is RGB, linear, 48 x 40 texels. The noise moves up by one period in all the frames, so that the last one leads to the first.
"""

import array
import math
import os
import sys

WIDTH, HEIGHT, OCTAVES = 48, 40, 4
PERIOD = 4  # of the noise's coarsest octave, upwards, in cells


def lattice(x, y, octave):
    """0 to 1 at a corner of the noise's cells: an integer hash (xorshift, multiply)."""
    n = (x * 374761393 + (y % (PERIOD << octave)) * 668265263 + octave * 974634777 + 0x5bd1e995) & 0xffffffff
    n = ((n ^ (n >> 13)) * 1274126177) & 0xffffffff
    return ((n ^ (n >> 16)) & 0xffff) / 65535.0


def noise(x, y, octave):
    """Value noise: the corners of the cell around (x, y), smoothly."""
    i, j = math.floor(x), math.floor(y)
    u, v = x - i, y - j
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
    below = lattice(i, j, octave) * (1 - u) + lattice(i + 1, j, octave) * u
    above = lattice(i, j + 1, octave) * (1 - u) + lattice(i + 1, j + 1, octave) * u
    return below * (1 - v) + above * v


def texel(x, y, time):
    """Red, green and blue at x from -1 to 1 and y from 0 (the ground) to 1; time from 0 to 1."""
    turbulence = sum(noise(2.5 * x * 2**o, (3 * y - PERIOD * time) * 2**o, o) / 2**o for o in range(OCTAVES)) / 1.875
    sway = 0.35 * y * (noise(0.5, 2 * y - PERIOD * time, 0) - 0.5)
    body = 1 - ((x + sway) / (0.85 - 0.55 * y)) ** 2
    heat = min(max(1.6 * body * (1 - y) + 1.5 * (turbulence - 0.55), 0), 1) if body > 0 else 0.0
    return [min(max(3 * heat - step, 0), 1) ** 2 for step in (0, 1, 2)]  # from black over red and yellow to white


def main():
    folder, frames = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 8
    for frame in range(frames):
        values = array.array("f")
        for row in range(HEIGHT):  # a PFM's rows go from the bottom to the top
            for column in range(WIDTH):
                values.extend(texel((2 * column + 1) / WIDTH - 1, (row + 0.5) / HEIGHT, frame / frames))
        if sys.byteorder == "big":
            values.byteswap()
        with open(os.path.join(folder, f"fire.{frame + 1:04}.pfm"), "wb") as file:
            file.write(b"PF\n%d %d\n-1.0\n" % (WIDTH, HEIGHT) + values.tobytes())


if __name__ == "__main__":
    main()
