#!/usr/bin/env python3
"""Makes the egg cup: eggcup.wrl, eggcup_needles.wrl (the same cup in long thin triangles) and their picture, eggcup.png.

    make_eggcup.py           writes the three files beside this script
    make_eggcup.py --check   exits with 1 if they are not what this script makes

The cup is a closed surface of revolution with wall thickness, 60 mm high, in meters with y up as VRML has it. Standard library only."""

import math
import os
import sys

sys.dont_write_bytecode = True
import drawing
import eggcup_picture

# The outline from the middle of the underside, out, up the outside, over the rim and down to the middle of the inside: radius and height in
# mm, in the picture's strips. A smooth curve goes through all of it.
OUTLINE = [
    ("blank", [(0.0, 1.2), (9.0, 1.1), (14.5, 0.7), (17.2, 0.0), (19.2, 0.0)]),
    ("foot", [(19.2, 0.0), (20.3, 0.9), (20.2, 2.2), (18.6, 3.1), (13.0, 4.7), (8.6, 6.8), (6.4, 9.6)]),
    ("stem", [(6.4, 9.6), (5.2, 13.0), (4.8, 16.5), (5.2, 20.0), (6.8, 22.6)]),
    ("bowl", [(6.8, 22.6), (11.5, 25.4), (17.0, 29.6), (21.3, 36.0), (23.9, 44.0), (25.0, 52.0), (24.7, 58.2), (23.6, 60.0)]),
    ("inner", [(23.6, 60.0), (22.5, 58.4), (22.5, 52.0), (21.4, 44.4), (18.8, 37.4), (14.6, 31.6), (9.0, 28.0), (4.0, 26.8), (0.0, 26.5)]),
]
EDGE_MM = 2.6


def catmull_rom(p0, p1, p2, p3, t):
    """Centripetal Catmull-Rom between p1 and p2 (Yuksel et al. 2011)."""
    knots = [0.0]
    for a, b in ((p0, p1), (p1, p2), (p2, p3)):
        knots.append(knots[-1] + max(math.sqrt(math.dist(a, b)), 1e-9))
    t = knots[1] + t * (knots[2] - knots[1])

    def blend(a, b, ta, tb):
        return tuple((x * (tb - t) + y * (t - ta)) / (tb - ta) for x, y in zip(a, b))

    a1, a2, a3 = (blend(p, q, knots[i], knots[i + 1]) for i, (p, q) in enumerate(((p0, p1), (p1, p2), (p2, p3))))
    b1, b2 = blend(a1, a2, knots[0], knots[2]), blend(a2, a3, knots[1], knots[3])
    return blend(b1, b2, knots[1], knots[2])


def fine_outline():
    """The outline as close points of (strip, share of the strip's length, radius, height); strip ends appear once for each strip."""
    knots = [p for _, points in OUTLINE for p in points[:-1]] + [OUTLINE[-1][1][-1]]
    # Beyond the axis the curve is mirrored, so that it meets the axis at a right angle.
    padded = [(-knots[1][0], knots[1][1])] + knots + [(-knots[-2][0], knots[-2][1])]
    outline, at = [], 0
    for strip, points in OUTLINE:
        curve = []
        for i in range(at, at + len(points) - 1):
            curve += [catmull_rom(*padded[i:i + 4], k / 100) for k in range(100)]
        at += len(points) - 1
        curve.append(points[-1])
        lengths = [0.0]
        for a, b in zip(curve, curve[1:]):
            lengths.append(lengths[-1] + math.dist(a, b))
        outline.append((strip, [(s / lengths[-1], r, h) for s, (r, h) in zip(lengths, curve)], lengths[-1]))
    return outline


def rings(tolerance_mm=None):
    """Places along the outline where vertices go, as (strip, share, radius, height): evenly, or only where it bends more than the tolerance."""
    result = []
    for strip, curve, length in fine_outline():
        if tolerance_mm is None:
            count = max(2, round(length / EDGE_MM))
            picked = [min(range(len(curve)), key=lambda i: abs(curve[i][0] - k / count)) for k in range(count + 1)]
        else:
            picked = simplify(curve, 0, len(curve) - 1, tolerance_mm)
        result += [(strip, *curve[i]) for i in picked]
    return result


def simplify(curve, first, last, tolerance):
    """Indices that keep the curve within the tolerance (Douglas & Peucker 1973)."""
    (_, r0, h0), (_, r1, h1) = curve[first], curve[last]
    length = math.hypot(r1 - r0, h1 - h0)
    far, distance = first, 0.0
    for i in range(first + 1, last):
        d = abs((r1 - r0) * (curve[i][2] - h0) - (h1 - h0) * (curve[i][1] - r0)) / length
        if d > distance:
            far, distance = i, d
    if distance <= tolerance:
        return [first, last]
    return simplify(curve, first, far, tolerance)[:-1] + simplify(curve, far, last, tolerance)


def texture_v(strip, share):
    """Up on the cup is up in the picture: strips end at their top row, except the inner wall, which is walked downwards."""
    top, bottom = (row + inset for row, inset in zip(eggcup_picture.STRIPS[strip], (1, -1)))
    row = top + (bottom - top) * share if strip == "inner" else bottom - (bottom - top) * share
    return 1 - row / eggcup_picture.HEIGHT


def texture_u(strip, turn):
    """To the right as the wall is looked at: from outside, or from inside."""
    return 1 - turn if strip == "inner" else turn


class Mesh:
    """Vertices and texture coordinates with an index each, and faces of (vertex, texture coordinate) corners."""

    def __init__(self):
        self.points, self.coordinates, self.faces = [], [], []
        self.point_index, self.coordinate_index = {}, {}

    def corner(self, strip, share, radius, height, turn):
        angle = 2 * math.pi * (turn % 1)
        point = tuple(number(v / 1000) for v in (radius * math.sin(angle), height, radius * math.cos(angle)))
        coordinate = (number(texture_u(strip, turn)), number(texture_v(strip, share)))
        return _intern(self.points, self.point_index, point), _intern(self.coordinates, self.coordinate_index, coordinate)

    def quads(self, lower, upper, count):
        """Upright quadrangles between two rings: flat, because opposite sides are parallel."""
        for k in range(count):
            sides = ((lower, k), (lower, k + 1), (upper, k + 1), (upper, k))
            self.faces.append([self.corner(*ring, turn / count) for ring, turn in sides])

    def band(self, lower, upper, lower_count, upper_count):
        """Triangles between two rings, always continuing with the shorter diagonal; a ring on the axis is one point (count 0)."""
        strip = lower[0]

        def at(ring, count, k, turn):
            return self.corner(strip, *ring[1:], turn if count == 0 else k / count)

        i = j = 0
        while i < lower_count or j < upper_count:
            next_lower = (i + 1) / lower_count if i < lower_count else math.inf
            next_upper = (j + 1) / upper_count if j < upper_count else math.inf
            a, b = at(lower, lower_count, i, (j + 0.5) / max(upper_count, 1)), at(upper, upper_count, j, (i + 0.5) / max(lower_count, 1))
            if next_lower <= next_upper:
                self.faces.append((a, at(lower, lower_count, i + 1, 0), b))
                i += 1
            else:
                self.faces.append((a, at(upper, upper_count, j + 1, 0), b))
                j += 1


def _intern(values, index, value):
    if value not in index:
        index[value] = len(values)
        values.append(value)
    return index[value]


def number(value):
    """Six decimals at most: micrometers."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def make_mesh(outline, count_of_radius, as_quads=False):
    mesh = Mesh()
    for lower, upper in zip(outline, outline[1:]):
        if lower[0] != upper[0]:
            continue  # one ring in two strips
        lower_count, upper_count = count_of_radius(lower[2]), count_of_radius(upper[2])
        if as_quads and lower_count == upper_count:
            mesh.quads(lower, upper, lower_count)
        else:
            mesh.band(lower, upper, lower_count, upper_count)
    return mesh


def wrapped(items, width=150):
    lines, line = [], ""
    for item in items:
        if len(line) + len(item) + 1 > width:
            lines.append(line)
            line = ""
        line += (" " if line else "") + item
    return "\n".join(lines + [line])


def face(corners, which):
    return " ".join(str(corner[which]) for corner in corners) + " -1"


def vrml(mesh, title):
    return f"""#VRML V2.0 utf8
# {title}. Made by tests/data/make_eggcup.py. Meters, y up.
WorldInfo {{ title "{title}" }}
Viewpoint {{ position 0 .05 .2 description "front" }}
Shape {{
  appearance Appearance {{
    material Material {{ diffuseColor .8 .8 .8 }}
    texture ImageTexture {{ url "eggcup.png" repeatT FALSE }}
  }}
  geometry IndexedFaceSet {{
    creaseAngle 1
    coord Coordinate {{ point [
{wrapped(" ".join(p) + "," for p in mesh.points)}
    ] }}
    texCoord TextureCoordinate {{ point [
{wrapped(" ".join(c) + "," for c in mesh.coordinates)}
    ] }}
    coordIndex [
{wrapped(face(corners, 0) for corners in mesh.faces)}
    ]
    texCoordIndex [
{wrapped(face(corners, 1) for corners in mesh.faces)}
    ]
  }}
}}
"""


def even_count(radius):
    return 0 if radius < 1e-9 else max(8, round(2 * math.pi * radius / EDGE_MM))


def needle_count(radius):
    return 0 if radius < 1e-9 else 172


def models():
    return {
        "eggcup.wrl": vrml(make_mesh(rings(), even_count), "An egg cup with a picture, 60 mm high"),
        "eggcup_needles.wrl": vrml(make_mesh(rings(0.4), needle_count, as_quads=True), "The same egg cup in needle triangles"),
    }


def is_as_committed(folder):
    """Text must be equal; pixels may differ by one, because platforms round the last digit of a sine differently."""
    differing = []
    for name, text in models().items():
        with open(os.path.join(folder, name), encoding="utf-8") as file:
            if file.read() != text:
                differing.append(name)
    picture = eggcup_picture.render()
    width, height, channels, pixels = drawing.read_png(os.path.join(folder, "eggcup.png"))
    made = picture.to_bytes()
    if (width, height, channels) != (picture.width, picture.height, picture.channels) or any(abs(a - b) > 1 for a, b in zip(made, pixels)):
        differing.append("eggcup.png")
    for name in differing:
        print(f"{name} is not what make_eggcup.py makes", file=sys.stderr)
    return not differing


def main():
    folder = os.path.dirname(os.path.abspath(__file__))
    if sys.argv[1:] == ["--check"]:
        return 0 if is_as_committed(folder) else 1
    if sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        return 2
    for name, text in models().items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)
    drawing.write_png(eggcup_picture.render(), os.path.join(folder, "eggcup.png"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
