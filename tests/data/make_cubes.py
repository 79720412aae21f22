#!/usr/bin/env python3
"""Makes small models for tests, beside this script:

letter_cube.{wrl,obj,mtl,ply}, letter_cube.png
    A cube of 20 mm with a letter F and the face's number, 1 to 6, on each face: 1 front, 2 right, 3 back, 4 left, 5 top, 6 bottom. The same
    cube in three formats, each by its own rules: VRML (meters, y up), OBJ (here millimeters, y up), PLY (millimeters, z up, texture
    coordinates per vertex and the image named by a TextureFile comment, as MeshLab writes them). In all of them texture coordinates start
    at the image's lower left corner.
face_colors.wrl      a cube of 20 mm, each face in a gray of its own (colorPerVertex FALSE with colorIndex)
vertex_colors.wrl    a plate whose corners are black and white (color per vertex, no colorIndex)
vertex_colors.ply    the same plate

Standard library only."""

import os
import sys

sys.dont_write_bytecode = True
import drawing

TILE = 96  # pixels of one face's square in the image; tiles are in two rows of three, face 1 at the upper left
SIDE_MM = 20

# Looking at the face from outside: its normal, and which way is right and up in the picture. File axes with y up.
FACES = [
    ("front", (0, 0, 1), (1, 0, 0), (0, 1, 0)),
    ("right", (1, 0, 0), (0, 0, -1), (0, 1, 0)),
    ("back", (0, 0, -1), (-1, 0, 0), (0, 1, 0)),
    ("left", (-1, 0, 0), (0, 0, 1), (0, 1, 0)),
    ("top", (0, 1, 0), (1, 0, 0), (0, 0, -1)),
    ("bottom", (0, -1, 0), (1, 0, 0), (0, 0, 1)),
]
# Corners of a face, counter-clockwise from the lower left: how far right and up from the middle, in half sides.
CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]


def letter_picture():
    picture = drawing.Canvas(3 * TILE, 2 * TILE, 1)
    for k in range(6):
        left, bottom = k % 3 * TILE, (k // 3 + 1) * TILE
        picture.text("F", left + 18, bottom - 16, 64, 11, (0.0,))
        picture.text(str(k + 1), left + 66, bottom - 16, 26, 5, (0.0,))
    return picture


def texture_coordinate(face, corner):
    """Of the corner of a face, in the image."""
    return (face % 3 + (corner[0] + 1) / 2) / 3, (1 - face // 3 + (corner[1] + 1) / 2) / 2


def corner_position(face, corner, half):
    _, normal, right, up = FACES[face]
    return tuple(half * (n + corner[0] * r + corner[1] * u) for n, r, u in zip(normal, right, up))


def text_of(values):
    return " ".join(f"{v + 0.0:.6f}".rstrip("0").rstrip(".") for v in values)  # + 0.0: no minus zero


def cube_vertices(half):
    vertices = []
    for face in range(6):
        for corner in CORNERS:
            p = corner_position(face, corner, half)
            if p not in vertices:
                vertices.append(p)
    return vertices


def cube_vrml():
    vertices = cube_vertices(SIDE_MM / 2000)
    points = ",\n      ".join(text_of(p) for p in vertices)
    uvs = [texture_coordinate(f, c) for f in range(6) for c in CORNERS]
    index = "\n      ".join(" ".join(str(vertices.index(corner_position(f, c, SIDE_MM / 2000))) for c in CORNERS) + " -1" for f in range(6))
    uv_index = "\n      ".join(" ".join(str(4 * f + k) for k in range(4)) + " -1" for f in range(6))
    return f"""#VRML V2.0 utf8
# A cube with a letter on each face. Made by tests/data/make_cubes.py. Meters, y up.
Shape {{
  appearance Appearance {{ texture ImageTexture {{ url "letter_cube.png" }} }}
  geometry IndexedFaceSet {{
    coord Coordinate {{ point [
      {points}
    ] }}
    texCoord TextureCoordinate {{ point [
      {", ".join(text_of(uv) for uv in uvs)}
    ] }}
    coordIndex [
      {index}
    ]
    texCoordIndex [
      {uv_index}
    ]
  }}
}}
"""


def cube_obj():
    vertices = cube_vertices(SIDE_MM / 2)
    lines = ["# A cube with a letter on each face. Made by tests/data/make_cubes.py. Millimeters, y up.", "mtllib letter_cube.mtl", "usemtl letters"]
    lines += ["v " + text_of(p) for p in vertices]
    lines += ["vt " + text_of(texture_coordinate(f, c)) for f in range(6) for c in CORNERS]
    for f in range(6):
        lines.append("f " + " ".join(f"{vertices.index(corner_position(f, c, SIDE_MM / 2)) + 1}/{4 * f + k + 1}" for k, c in enumerate(CORNERS)))
    return "\n".join(lines) + "\n"


def cube_mtl():
    return "newmtl letters\nKd 1 1 1\nmap_Kd letter_cube.png\n"


def cube_ply():
    rows, faces = [], []
    for f in range(6):
        for c in CORNERS:
            x, y, z = corner_position(f, c, SIDE_MM / 2)
            rows.append(text_of((x, -z, y) + texture_coordinate(f, c)))  # y up to z up
        faces.append("4 " + " ".join(str(4 * f + k) for k in range(4)))
    header = ["ply", "format ascii 1.0", "comment A cube with a letter on each face. Made by tests/data/make_cubes.py. Millimeters, z up.",
              "comment TextureFile letter_cube.png", f"element vertex {len(rows)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "s", "t")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(header + rows + faces) + "\n"


def face_colors_vrml():
    vertices = cube_vertices(SIDE_MM / 2000)
    points = ",\n      ".join(text_of(p) for p in vertices)
    index = "\n      ".join(" ".join(str(vertices.index(corner_position(f, c, SIDE_MM / 2000))) for c in CORNERS) + " -1" for f in range(6))
    return f"""#VRML V2.0 utf8
# A cube, each face in a gray of its own. Made by tests/data/make_cubes.py. Meters, y up.
Shape {{
  geometry IndexedFaceSet {{
    colorPerVertex FALSE
    color Color {{ color [ 0 0 0, .2 .2 .2, .4 .4 .4, .6 .6 .6, .8 .8 .8, 1 1 1 ] }}
    colorIndex [ 3 1 4 0 2 5 ]
    coord Coordinate {{ point [
      {points}
    ] }}
    coordIndex [
      {index}
    ]
  }}
}}
"""


PLATE = [(-15, 0), (15, 0), (15, 20), (-15, 20)]  # mm; black at the left, white at the right
PLATE_Gray = [0, 1, 1, 0]


def vertex_colors_vrml():
    return f"""#VRML V2.0 utf8
# A plate from black to white, colors per vertex. Made by tests/data/make_cubes.py. Meters, y up.
Shape {{
  geometry IndexedFaceSet {{
    solid FALSE
    color Color {{ color [ {", ".join(text_of([g] * 3) for g in PLATE_Gray)} ] }}
    coord Coordinate {{ point [ {", ".join(text_of((x / 1000, y / 1000, 0)) for x, y in PLATE)} ] }}
    coordIndex [ 0 1 2 3 -1 ]
  }}
}}
"""


def vertex_colors_ply():
    header = ["ply", "format ascii 1.0", "comment A plate from black to white. Made by tests/data/make_cubes.py. Millimeters, z up.",
              "element vertex 4", "property float x", "property float y", "property float z"]
    header += [f"property uchar {name}" for name in ("red", "green", "blue")]
    header += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    rows = [f"{x} 0 {y} " + " ".join([str(255 * g)] * 3) for (x, y), g in zip(PLATE, PLATE_Gray)]
    return "\n".join(header + rows + ["4 0 1 2 3"]) + "\n"


def main():
    folder = os.path.dirname(os.path.abspath(__file__))
    files = {"letter_cube.wrl": cube_vrml(), "letter_cube.obj": cube_obj(), "letter_cube.mtl": cube_mtl(), "letter_cube.ply": cube_ply(),
             "face_colors.wrl": face_colors_vrml(), "vertex_colors.wrl": vertex_colors_vrml(), "vertex_colors.ply": vertex_colors_ply()}
    if sys.argv[1:] == ["--check"]:
        differing = [name for name, text in files.items() if open(os.path.join(folder, name), encoding="utf-8").read() != text]
        if drawing.read_png(os.path.join(folder, "letter_cube.png"))[3] != letter_picture().to_bytes():
            differing.append("letter_cube.png")
        for name in differing:
            print(f"{name} is not what make_cubes.py makes", file=sys.stderr)
        return 1 if differing else 0
    if sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        return 2
    for name, text in files.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)
    drawing.write_png(letter_picture(), os.path.join(folder, "letter_cube.png"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
