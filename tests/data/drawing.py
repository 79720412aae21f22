"""What the generators of this folder draw with: an image of floats, lines, polygons and letters with soft edges, and PNG files.

Standard library only. Colors are sRGB-encoded and run from 0 to 1; x goes right and y down, in pixels."""

import array
import math
import struct
import zlib


class Canvas:
    """An image with 1 (gray) or 3 (red, green, blue) channels."""

    def __init__(self, width, height, channels, background=1.0):
        self.width, self.height, self.channels = width, height, channels
        self.values = array.array("f", [background]) * (width * height * channels)

    def blend(self, x, y, color, coverage):
        """Lays `color` over one pixel; columns wrap around, rows outside the image are left out."""
        if coverage <= 0 or not 0 <= y < self.height:
            return
        start = (y * self.width + x % self.width) * self.channels
        for c in range(self.channels):
            self.values[start + c] += (color[c] - self.values[start + c]) * min(coverage, 1)

    def polygon(self, points, color, opacity=1.0):
        """Fills a simple polygon; 3 x 3 samples a pixel make its edge soft."""
        ys = [p[1] for p in points]
        for y in range(math.floor(min(ys)), math.ceil(max(ys)) + 1):
            counts = {}
            for sub_y in (1 / 6, 3 / 6, 5 / 6):
                crossings = sorted(_crossings(points, y + sub_y))
                for left, right in zip(crossings[::2], crossings[1::2]):
                    # Sample columns whose center, (k + .5) / 3, is inside.
                    for k in range(math.ceil(left * 3 - 0.5), math.ceil(right * 3 - 0.5)):
                        counts[k // 3] = counts.get(k // 3, 0) + 1
            for x, count in counts.items():
                self.blend(x, y, color, opacity * count / 9)

    def line(self, points, width, color, opacity=1.0):
        """Draws a polyline with round ends. Joints are not drawn twice: coverage comes from the nearest piece."""
        radius = width / 2
        nearest = {}
        for (x0, y0), (x1, y1) in zip(points, points[1:]):
            dx, dy = x1 - x0, y1 - y0
            length2 = dx * dx + dy * dy or 1e-12
            for y in range(math.floor(min(y0, y1) - radius - 1), math.ceil(max(y0, y1) + radius + 1) + 1):
                for x in range(math.floor(min(x0, x1) - radius - 1), math.ceil(max(x0, x1) + radius + 1) + 1):
                    t = max(0, min(1, ((x + 0.5 - x0) * dx + (y + 0.5 - y0) * dy) / length2))
                    distance = math.hypot(x + 0.5 - x0 - t * dx, y + 0.5 - y0 - t * dy)
                    if distance < nearest.get((x, y), radius + 0.5):
                        nearest[(x, y)] = distance
        for (x, y), distance in nearest.items():
            self.blend(x, y, color, opacity * min(1, radius + 0.5 - distance))

    def text(self, text, x, y, height, width, color, spacing=0.35):
        """Writes `text` with its baseline's left end at (x, y); returns where the next letter would start."""
        for letter in text:
            strokes, advance = LETTERS[letter]
            for stroke in strokes:
                self.line([(x + px * height, y - py * height) for px, py in stroke], width, color)
            x += (advance + spacing) * height
        return x

    def to_bytes(self):
        return bytes(max(0, min(255, round(v * 255))) for v in self.values)


def text_width(text, height, spacing=0.35):
    return sum(LETTERS[letter][1] + spacing for letter in text) * height - spacing * height


def _crossings(points, y):
    for (x0, y0), (x1, y1) in zip(points, points[1:] + points[:1]):
        if (y0 <= y) != (y1 <= y):
            yield x0 + (y - y0) / (y1 - y0) * (x1 - x0)


def _arc(cx, cy, rx, ry, start_deg, end_deg, steps=12):
    """Points of an ellipse's arc, angles counter-clockwise from the right."""
    angles = [math.radians(start_deg + (end_deg - start_deg) * i / steps) for i in range(steps + 1)]
    return [(cx + rx * math.cos(a), cy + ry * math.sin(a)) for a in angles]


# Strokes on a line 1 high, y up, and the width of the letter.
LETTERS = {
    "H": ([[(0, 0), (0, 1)], [(0.6, 0), (0.6, 1)], [(0, 0.5), (0.6, 0.5)]], 0.6),
    "I": ([[(0, 0), (0, 1)]], 0.0),
    "L": ([[(0, 1), (0, 0), (0.5, 0)]], 0.5),
    "B": ([[(0, 0), (0, 1), (0.3, 1)] + _arc(0.3, 0.76, 0.25, 0.24, 90, -90) + [(0, 0.52), (0.3, 0.52)]
           + _arc(0.3, 0.26, 0.3, 0.26, 90, -90) + [(0, 0)]], 0.6),
    "R": ([[(0, 0), (0, 1), (0.3, 1)] + _arc(0.3, 0.75, 0.27, 0.25, 90, -90) + [(0, 0.5)], [(0.25, 0.5), (0.6, 0)]], 0.6),
    "U": ([[(0, 1), (0, 0.3)] + _arc(0.3, 0.3, 0.3, 0.3, 180, 360) + [(0.6, 1)]], 0.6),
    "S": ([_arc(0.28, 0.75, 0.26, 0.25, 30, 270) + _arc(0.28, 0.25, 0.28, 0.25, 90, -150)], 0.56),
    "F": ([[(0, 0), (0, 1), (0.6, 1)], [(0, 0.52), (0.45, 0.52)]], 0.6),
    "1": ([[(0, 0.75), (0.2, 1), (0.2, 0)]], 0.2),
    "2": ([_arc(0.27, 0.73, 0.27, 0.27, 170, -30) + [(0, 0), (0.55, 0)]], 0.55),
    "3": ([_arc(0.25, 0.76, 0.25, 0.24, 150, -90) + _arc(0.25, 0.26, 0.28, 0.26, 90, -150)], 0.53),
    "4": ([[(0.42, 0), (0.42, 1), (0, 0.3), (0.6, 0.3)]], 0.6),
    "5": ([[(0.5, 1), (0.06, 1), (0.03, 0.55)] + _arc(0.24, 0.31, 0.29, 0.31, 125, -140)], 0.53),
    "6": ([[(0.45, 0.97)] + _arc(0.42, 0.42, 0.42, 0.5, 110, 180) + _arc(0.28, 0.29, 0.28, 0.29, 180, -180, 20)], 0.56),
    " ": ([], 0.3),
}


def _paeth(a, b, c):
    p = a + b - c
    pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c


def _filtered_row(row, above, step):
    """The row under the PNG filter that leaves the smallest differences."""
    left = bytes(step) + row[:-step]
    above_left = bytes(step) + above[:-step]
    candidates = [
        (0, row),
        (1, bytes((v - a) & 255 for v, a in zip(row, left))),
        (2, bytes((v - b) & 255 for v, b in zip(row, above))),
        (4, bytes((v - _paeth(a, b, c)) & 255 for v, a, b, c in zip(row, left, above, above_left))),
    ]
    kind, data = min(candidates, key=lambda c: sum(min(v, 256 - v) for v in c[1]))
    return bytes([kind]) + data


def write_png(canvas, file):
    """Writes an 8-bit gray or RGB PNG, tagged as sRGB."""
    step, stride, data = canvas.channels, canvas.width * canvas.channels, canvas.to_bytes()
    above, rows = bytes(stride), []
    for y in range(canvas.height):
        row = data[y * stride:(y + 1) * stride]
        rows.append(_filtered_row(row, above, step))
        above = row

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", canvas.width, canvas.height, 8, 2 if step == 3 else 0, 0, 0, 0)
    with open(file, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"sRGB", b"\0")
                  + chunk(b"IDAT", zlib.compress(b"".join(rows), 9)) + chunk(b"IEND", b""))


def read_png(file):
    """The pixels of a PNG that write_png() wrote: (width, height, channels, bytes)."""
    with open(file, "rb") as stream:
        data = stream.read()
    width, height, _, kind = struct.unpack(">IIBB", data[16:26])
    step = 3 if kind == 2 else 1
    body, at = b"", 8
    while at < len(data):
        length, name = struct.unpack(">I4s", data[at:at + 8])
        if name == b"IDAT":
            body += data[at + 8:at + 8 + length]
        at += 12 + length
    raw, stride, rows = zlib.decompress(body), width * step, []
    above = bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride if kind else 0):
            a = row[i - step] if i >= step else 0
            c = above[i - step] if i >= step else 0
            row[i] = (row[i] + (a if kind == 1 else above[i] if kind == 2 else _paeth(a, above[i], c))) & 255
        rows.append(bytes(row))
        above = row
    return width, height, step, b"".join(rows)
