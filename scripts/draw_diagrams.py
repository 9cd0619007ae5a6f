#!/usr/bin/env python3
"""Draws the diagrams of docs/: docs/pictures/architecture.svg and docs/pictures/axes.svg. Standard library only.

    scripts/draw_diagrams.py
"""

import math
import pathlib

PICTURES = pathlib.Path(__file__).resolve().parent.parent / "docs" / "pictures"

INK, FAINT, PAPER = "#1b1f24", "#6a737d", "#ffffff"
RED, GREEN, BLUE = "#c62828", "#2e7d32", "#1565c0"


class Drawing:
    """A list of SVG elements, and the few shapes that the diagrams need."""

    def __init__(self, width, height):
        self.size = (width, height)
        self.parts = []
        self.heads = set()

    def text(self, x, y, words, size=14, colour=INK, anchor="middle", weight="normal", slant="normal"):
        self.parts.append(f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{colour}" text-anchor="{anchor}" '
                          f'font-weight="{weight}" font-style="{slant}">{words}</text>')

    def box(self, x, y, width, height, title, lines=(), fill="#f6f8fa"):
        self.parts.append(f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="6" fill="{fill}" stroke="{INK}"/>')
        self.text(x + width / 2, y + 21, title, 15, weight="bold")
        for k, line in enumerate(lines):
            self.text(x + width / 2, y + 39 + 16 * k, line, 12, FAINT)

    def line(self, a, b, colour=INK, width=1.5, dashed=False, arrow=False):
        dash = ' stroke-dasharray="5 4"' if dashed else ""
        head = ""
        if arrow:
            self.heads.add(colour)
            head = f' marker-end="url(#head{colour[1:]})"'
        self.parts.append(f'<line x1="{a[0]:g}" y1="{a[1]:g}" x2="{b[0]:g}" y2="{b[1]:g}" stroke="{colour}" stroke-width="{width}"{dash}{head}/>')

    def arrow(self, a, b, colour=INK, width=1.5):
        self.line(a, b, colour, width, arrow=True)

    def polygon(self, corners, fill, stroke=INK, opacity=1.0):
        points = " ".join(f"{x:g},{y:g}" for x, y in corners)
        self.parts.append(f'<polygon points="{points}" fill="{fill}" fill-opacity="{opacity}" stroke="{stroke}"/>')

    def dot(self, at, colour=INK, radius=3.5):
        self.parts.append(f'<circle cx="{at[0]:g}" cy="{at[1]:g}" r="{radius}" fill="{colour}"/>')

    def save(self, name):
        width, height = self.size
        heads = "".join(f'<marker id="head{c[1:]}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" markerHeight="7" orient="auto-start-reverse">'
                        f'<path d="M0 0 L10 5 L0 10 z" fill="{c}"/></marker>' for c in sorted(self.heads))
        body = "\n".join(self.parts)
        (PICTURES / name).write_text(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
            f'font-family="DejaVu Sans, Helvetica, Arial, sans-serif">\n<defs>{heads}</defs>\n'
            f'<rect width="{width}" height="{height}" fill="{PAPER}"/>\n{body}\n</svg>\n')


def architecture():
    """Rooms and who includes whom: every arrow points down."""
    d = Drawing(900, 780)

    # Doors.
    d.box(60, 20, 220, 62, "clients/cli", ["the command penumbra"], "#e8f0fe")
    d.box(340, 20, 220, 62, "server", ["HTTP, queue, workers"], "#e8f0fe")
    d.box(620, 20, 220, 62, "your program", ["links the library"], "#e8f0fe")

    # The library's public headers, then the rooms below.
    d.box(60, 130, 780, 46, "host/include/penumbra", [], "#fff8e1")
    for x in (170, 450, 730):
        d.arrow((x, 82), (x, 129))
    d.text(450, 170, "the public headers", 12, FAINT)

    d.box(60, 224, 520, 62, "host/engine", ["picks the technique, renders missing depth, times stages, one run of a mask"])
    d.arrow((320, 176), (320, 223))

    d.box(60, 334, 340, 62, "host/technique", ["one pair of files a technique"])
    d.arrow((230, 286), (230, 333))

    d.box(60, 440, 150, 62, "host/silhouette", ["edges, loops"])
    d.box(430, 334, 126, 62, "host/refine", ["which receivers"])
    d.box(430, 440, 150, 62, "host/trace", ["Embree: rays"])
    d.box(260, 540, 320, 62, "host/depth_image", ["depth images as casters and receivers"])
    d.box(190, 640, 390, 62, "host/opencl", ["devices, programs"])
    d.arrow((135, 396), (135, 439))
    d.arrow((225, 396), (225, 639))
    d.arrow((320, 396), (320, 539))
    d.arrow((390, 396), (460, 439))
    d.arrow((415, 286), (415, 539))
    d.arrow((493, 286), (493, 333))
    d.arrow((569, 286), (569, 439))
    d.arrow((505, 502), (505, 539))
    d.arrow((420, 602), (420, 639))

    d.box(650, 334, 190, 62, "host/io", ["images, meshes,", "the scene file"])
    d.arrow((745, 176), (745, 333))

    d.box(60, 730, 780, 30, "host/scene: lights, cameras, depth, meshes; plain data", [], "#e6f4ea")
    d.arrow((120, 502), (120, 729))
    d.arrow((385, 702), (385, 729))
    d.arrow((745, 396), (745, 729))
    d.save("architecture.svg")


def axes():
    """Left: a rectangle light and its axes. Right: a camera, its image, planar depth."""
    d = Drawing(980, 430)

    # Left. World axes by an oblique view: X right, Y up, Z towards the reader (down left).
    origin = (240, 322)

    def at(x, y, z):
        return (origin[0] + 46 * x - 23 * z, origin[1] - 46 * y + 17 * z)

    d.text(230, 26, "A rectangle light", 16, weight="bold")
    centre, u, v = (0, 4.6, 0), (2.2, 0, 0), (0, 0, -2.2)
    plus = lambda *vs: tuple(sum(c) for c in zip(*vs))
    minus = lambda a: tuple(-c for c in a)
    corners = [plus(centre, u, v), plus(centre, u, minus(v)), plus(centre, minus(u), minus(v)), plus(centre, minus(u), v)]
    d.polygon([at(*c) for c in corners], "#fff3b0")
    c = at(*centre)
    floor = [(3.0, 0, 1.6), (3.0, 0, -1.6), (-3.0, 0, -1.6), (-3.0, 0, 1.6)]
    d.polygon([at(*f) for f in floor], "#eceff1", FAINT)
    d.arrow(c, at(*plus(centre, u)), RED, 2.5)
    d.arrow(c, at(*plus(centre, v)), GREEN, 2.5)
    d.arrow(c, at(0, 2.1, 0), BLUE, 2.5)
    d.dot(c)
    d.text(c[0] - 8, c[1] + 16, "center", 13, anchor="end")
    x, y = at(*plus(centre, u))
    d.text(x + 8, y + 5, "half_u", 14, RED, "start", "bold")
    x, y = at(*plus(centre, v))
    d.text(x + 4, y - 9, "half_v", 14, GREEN, "start", "bold")
    x, y = at(0, 2.1, 0)
    d.text(x + 12, y - 22, "shines along", 14, BLUE, "start", "bold")
    d.text(x + 12, y - 4, "cross(half_v, half_u)", 14, BLUE, "start", "bold")
    d.text(230, 402, "half_u = [0.5, 0, 0], half_v = [0, 0, -0.5]: it shines down, along -Y", 13)
    d.text(230, 422, "half_u and half_v go from the centre to the middle of an edge", 13, FAINT)

    # World axes, on the floor's corner.
    o = (44, 110)
    d.arrow(o, (o[0] + 40, o[1]), INK)
    d.arrow(o, (o[0], o[1] - 40), INK)
    d.arrow(o, (o[0] - 23, o[1] + 17), INK)
    d.text(o[0] + 48, o[1] + 5, "X", 13)
    d.text(o[0], o[1] - 46, "Y", 13)
    d.text(o[0] - 30, o[1] + 27, "Z", 13)
    d.text(o[0] + 6, o[1] + 46, "world,", 12, FAINT)
    d.text(o[0] + 6, o[1] + 61, "right-handed", 12, FAINT)

    d.line((480, 20), (480, 410), "#d0d7de", 1)

    # Right. The camera from its side: it looks to the right, along its -Z.
    d.text(730, 26, "A camera", 16, weight="bold")
    eye = (548, 200)
    half = 0.42
    far = 300
    d.polygon([eye, (eye[0] + far, eye[1] - half * far), (eye[0] + far, eye[1] + half * far)], "#e3f2fd", "#90a4ae", 0.7)
    d.dot(eye)
    d.text(eye[0] - 20, eye[1] + 20, "eye", 13)
    d.arrow(eye, (eye[0] + 70, eye[1]), BLUE, 2.5)
    d.text(eye[0] + 40, eye[1] + 19, "-Z", 14, BLUE, weight="bold")
    d.arrow(eye, (eye[0], eye[1] - 60), GREEN, 2.5)
    d.text(eye[0] - 14, eye[1] - 52, "+Y", 14, GREEN, "end", "bold")
    d.text(eye[0] - 14, eye[1] - 36, "up", 12, GREEN, "end")

    # A point and its two distances.
    point = (eye[0] + 215, eye[1] - 72)
    foot = (point[0], eye[1])
    d.line(eye, point, FAINT, 1.2, dashed=True)
    d.text(eye[0] + 118, eye[1] - 48, "radial", 12, FAINT, slant="italic")
    d.line(foot, point, FAINT, 1.2, dashed=True)
    d.dot(point, RED, 4.5)
    d.text(point[0] + 9, point[1] + 4, "a point", 13, RED, "start")
    base = eye[1] + 52
    d.line(eye, (eye[0], base + 6), FAINT, 1, dashed=True)
    d.line(foot, (foot[0], base + 6), FAINT, 1, dashed=True)
    d.line(eye, foot, FAINT, 1)
    d.arrow((eye[0] + 40, base), (eye[0] + 1, base), RED)
    d.arrow((eye[0] + 40, base), (foot[0] - 1, base), RED)
    d.text(eye[0] + 118, base + 19, "planar depth: along the viewing axis", 13, RED)

    # The image.
    right = eye[0] + far
    d.line((right, eye[1] - half * far), (right, eye[1] + half * far), INK, 3)
    d.text(right + 10, eye[1] - half * far + 6, "row 0: top", 13, anchor="start")
    d.text(right + 10, eye[1] + half * far, "last row", 13, anchor="start")
    d.text(730, 382, "image x grows to the right (+X), rows grow downwards (-Y)", 13)
    d.text(730, 402, "depth is positive; +infinity where nothing is", 13)
    d.text(730, 422, "the light's own camera: image x along half_u, image up along half_v", 13, FAINT)
    d.save("axes.svg")


architecture()
axes()
