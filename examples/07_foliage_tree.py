#!/usr/bin/env python3
"""A tree of leaves as Wavefront OBJ: a trunk, and quads turned at random in a crown. The same numbers make the same leaves everywhere.

    07_foliage_tree.py FILE.obj [LEAVES]
"""

import math
import sys


def numbers(state=1):
    """0 to 1, one after the other: a linear congruential generator (Knuth's MMIX), of which the upper 32 bits count."""
    while True:
        state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
        yield (state >> 32) / 2**32


def direction(random):
    """Evenly over the sphere."""
    z, turn = 2 * next(random) - 1, 2 * math.pi * next(random)
    across = math.sqrt(1 - z * z)
    return across * math.cos(turn), z, across * math.sin(turn)


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def leaf(random):
    """Four corners: 0.12 long, 0.07 wide, in a crown of 1.1 by 0.9 around (0, 2.4, 0), denser towards its outside."""
    away = (0.2 + 0.8 * next(random)) ** (1 / 3)
    out = direction(random)
    middle = (1.1 * away * out[0], 2.4 + 0.9 * away * out[1], 1.1 * away * out[2])
    along, aside = direction(random), direction(random)
    across = cross(along, aside)
    scale = 0.035 / math.sqrt(sum(c * c for c in across))
    return [
        [m + 0.06 * i * a + scale * j * c for m, a, c in zip(middle, along, across)]
        for i, j in ((-1, 0), (0, -1), (1, 0), (0, 1))  # pointed: a kite with its corners on the axes
    ]


def main():
    path, leaves = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 4000
    random = numbers()
    trunk = [(0.08 * math.cos(math.pi * k / 3), y, 0.08 * math.sin(math.pi * k / 3)) for y in (0, 2.2) for k in range(6)]
    with open(path, "w", encoding="ascii") as file:
        for corner in trunk + [corner for _ in range(leaves) for corner in leaf(random)]:
            file.write("v %.5f %.5f %.5f\n" % tuple(corner))
        for k in range(6):
            file.write("f %d %d %d %d\n" % (k + 1, k + 7, (k + 1) % 6 + 7, (k + 1) % 6 + 1))
        for first in range(13, 13 + 4 * leaves, 4):
            file.write("f %d %d %d %d\n" % (first, first + 1, first + 2, first + 3))


if __name__ == "__main__":
    main()
