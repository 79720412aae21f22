"""The picture on the egg cup: what its walls show, as one image in strips. Rendered from formulas; no photograph was used.

Strips, top to bottom of the image (the fractions are in STRIPS): the inner wall, the bowl (a lake between mountains under a line of text), the
stem (a Hilbert curve), the foot (eleven tones, and rays), and a white strip for the surface that stands on the fixture.
Everything repeats around the cup: the left edge of the image meets its right edge."""

import math
import random

from drawing import Canvas, text_width

WIDTH, HEIGHT = 1152, 864
# Name: (top row, bottom row); v = 1 - row / HEIGHT.
STRIPS = {"inner": (0, 232), "bowl": (240, 600), "stem": (608, 736), "foot": (744, 848), "blank": (852, 864)}


class Noise:
    """Smooth value noise on the torus [0, 1) x [0, 1), in octaves."""

    def __init__(self, rng, columns, rows, octaves):
        self.layers = []
        for octave in range(octaves):
            nx, ny = columns << octave, rows << octave
            self.layers.append((nx, ny, 0.5 ** octave, [[rng.random() * 2 - 1 for _ in range(nx)] for _ in range(ny)]))

    def __call__(self, x, y):
        total = 0.0
        for nx, ny, weight, lattice in self.layers:
            fx, fy = x * nx, y * ny
            ix, iy = math.floor(fx), math.floor(fy)
            tx, ty = fx - ix, fy - iy
            tx, ty = tx * tx * (3 - 2 * tx), ty * ty * (3 - 2 * ty)
            row0, row1 = lattice[iy % ny], lattice[(iy + 1) % ny]
            a, b = row0[ix % nx], row1[ix % nx]
            c, d = row0[(ix + 1) % nx], row1[(ix + 1) % nx]
            total += weight * (a + (c - a) * tx + (b - a) * ty + (a - b - c + d) * tx * ty)
        return total


def mix(a, b, t):
    t = max(0.0, min(1.0, t))
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def smooth(low, high, x):
    t = max(0.0, min(1.0, (x - low) / (high - low)))
    return t * t * (3 - 2 * t)


def ridge_line(rng, base, height, frequencies, sharpness):
    """A mountain range's outline: heights in 0..1 from the top, one a column, the same at both ends."""
    waves = [(k, rng.random() * 2 * math.pi, rng.uniform(0.6, 1.0) * k ** -1.05) for k in frequencies]
    norm = sum(w for _, _, w in waves)
    line = []
    for i in range(WIDTH):
        angle = 2 * math.pi * i / WIDTH
        value = sum(w * (1 - 2 * abs(math.sin(k * angle / 2 + phase)) ** sharpness) for k, phase, w in waves) / norm
        line.append(base - height * value)
    return line


# --- the bowl: a landscape -------------------------------------------------------------------------------------------

SHORE = 0.66       # where the lake begins, from the top of the landscape
TEXT_SHARE = 0.17  # of the strip's height
SUN = (0.24, 0.44)
MOON = (0.70, 0.17)


def sky(x, y, clouds):
    color = mix((0.16, 0.27, 0.46), (0.80, 0.82, 0.80), smooth(-0.05, 0.5, y))
    dx = min(abs(x - SUN[0]), 1 - abs(x - SUN[0])) * 2.9
    color = mix(color, (1.0, 0.90, 0.68), math.exp(-math.hypot(dx, y - SUN[1]) * 4.5))
    cover = smooth(0.10, 0.95, clouds(x, y * 0.9) + 0.35 - 0.4 * y)
    lit = 0.78 + 0.2 * (clouds(x + 0.004, y * 0.9 - 0.02) - clouds(x, y * 0.9)) * 4
    return mix(color, (min(1, lit * 1.04), min(1, lit), min(1, lit * 0.97)), cover * 0.9)


def mountains(rng):
    """Ranges from far to near: (outline, color in the light, color in the shade, haze)."""
    return [
        (ridge_line(rng, 0.44, 0.17, (3, 5, 8, 13, 21, 34, 55), 0.9), (0.72, 0.76, 0.80), (0.47, 0.54, 0.62), 0.45),
        (ridge_line(rng, 0.52, 0.13, (2, 5, 9, 15, 27, 44, 71), 0.8), (0.62, 0.62, 0.58), (0.28, 0.33, 0.38), 0.22),
        (ridge_line(rng, 0.61, 0.07, (3, 4, 7, 12, 19, 35), 1.2), (0.38, 0.43, 0.30), (0.12, 0.18, 0.16), 0.06),
    ]


def land_column(i, height, ranges, clouds, rock):
    """The colors of one column down to the shore."""
    x, column = i / WIDTH, []
    for j in range(round(height * SHORE)):
        y = j / height
        color = sky(x, y, clouds)
        for line, light, shade, haze in ranges:
            depth = y - line[i]
            if depth < -1.0 / height:
                continue
            slope = (line[(i + 3) % WIDTH] - line[i - 3]) * height / 6
            relief = rock(x, y * 0.8) * 0.9 + slope * 0.45 * math.exp(-depth * 9)
            face = mix(shade, light, 0.45 + relief)
            if light[2] > 0.55:  # snow on the high ranges
                face = mix(face, (0.97, 0.97, 0.98), smooth(0.02, -0.05, y - 0.38 - 0.12 * relief) * (0.7 + 0.3 * relief))
            face = mix(face, (0.80, 0.82, 0.80), haze + 0.35 * smooth(0.05, 0.25, depth))
            color = mix(color, face, (depth * height + 1) / 1.5)
        column.append(color)
    return column


def lake_row(y, columns, height, ripple):
    """The lake mirrors what is above the shore, darker, broken by ripples that grow towards the viewer."""
    shore = round(height * SHORE)
    below = y - SHORE
    row = []
    for i in range(WIDTH):
        wave = ripple(i / WIDTH, y * 3)
        mirror = shore - 2 - round(below * height * 1.35 + wave * 5 * (0.2 + below * 6))
        source = columns[(i + round(wave * 14 * below)) % WIDTH][max(0, min(shore - 1, mirror))]
        shine = 0.17 * smooth(0.45, 0.9, math.sin((below + 0.05) ** 0.5 * 330 + wave * 5) * (0.6 + wave))
        row.append(mix(mix(source, (0.07, 0.15, 0.20), 0.30 + 0.9 * below), (1, 1, 1), shine))
    return row


def draw_moon(canvas, top, height, rng):
    """A shaded ball: light from the left, craters as darker discs."""
    cx, cy, radius = MOON[0] * WIDTH, top + MOON[1] * height, 0.115 * height
    craters = []
    for _ in range(26):
        angle, distance = rng.random() * 2 * math.pi, math.sqrt(rng.random()) * 0.92
        craters.append((distance * math.cos(angle), distance * math.sin(angle), rng.uniform(0.04, 0.19)))
    for y in range(round(cy - radius) - 1, round(cy + radius) + 2):
        for x in range(round(cx - radius) - 1, round(cx + radius) + 2):
            dx, dy = (x + 0.5 - cx) / radius, (y + 0.5 - cy) / radius
            r2 = dx * dx + dy * dy
            z = math.sqrt(max(0.0, 1 - r2))
            tone = 0.12 + 0.86 * max(0.0, -0.62 * dx - 0.35 * dy + 0.70 * z)
            for px, py, size in craters:
                d = math.hypot(dx - px, dy - py) / size
                if d < 1:
                    tone *= 0.84 + 0.10 * d - 0.10 * (dx - px) / size
                elif d < 1.25:
                    tone *= 1.05
            canvas.blend(x, y, (tone, tone * 0.98, tone * 0.93), (1 - math.sqrt(r2)) * radius + 0.5)


def draw_firs(canvas, top, height, rng):
    shore = top + height * SHORE
    for _ in range(150):
        x = rng.random() * WIDTH
        if 0.34 < x / WIDTH < 0.50:
            continue  # the clearing where the boat sails
        tall = rng.uniform(0.05, 0.15) * height * (1.2 if x / WIDTH > 0.8 or x / WIDTH < 0.12 else 0.8)
        tone = rng.uniform(0.03, 0.17)
        color = (tone, tone * 1.25, tone * 1.05)
        base = shore + rng.uniform(-1, 3)
        canvas.line([(x, base), (x, base - tall)], 1.2, color)
        tiers = max(4, int(tall / 4))
        for tier in range(tiers):
            y = base - tall * (0.12 + 0.86 * tier / tiers)
            reach = tall * 0.24 * (1 - tier / tiers) + 0.8
            canvas.polygon([(x - reach, y + 1.5), (x, y - tall / tiers * 1.3), (x + reach, y + 1.5)], color, 0.9)


def draw_boat(canvas, top, height):
    x, y, size = 0.425 * WIDTH, top + (SHORE + 0.10) * height, 0.17 * height
    canvas.polygon([(x - 0.03 * size, y - size), (x - 0.03 * size, y - 0.1 * size), (x - 0.5 * size, y - 0.1 * size)], (0.97, 0.96, 0.93))
    canvas.polygon([(x + 0.03 * size, y - 0.9 * size), (x + 0.36 * size, y - 0.1 * size), (x + 0.03 * size, y - 0.1 * size)], (0.82, 0.80, 0.76))
    canvas.line([(x, y), (x, y - 1.06 * size)], 1.6, (0.15, 0.10, 0.06))
    canvas.polygon([(x - 0.6 * size, y - 0.04 * size), (x + 0.5 * size, y - 0.04 * size), (x + 0.36 * size, y + 0.12 * size),
                    (x - 0.45 * size, y + 0.12 * size)], (0.24, 0.12, 0.08))
    for k in range(7):  # its reflection, in strokes
        reach = size * (0.5 - 0.05 * k)
        canvas.line([(x - reach, y + size * (0.17 + 0.05 * k)), (x + 0.8 * reach, y + size * (0.17 + 0.05 * k))], 1.0, (0.05, 0.06, 0.07), 0.55)


def draw_reeds(canvas, bottom, height, rng):
    """Fine strokes in the foreground."""
    for _ in range(620):
        x, tall, lean = rng.random() * WIDTH, rng.uniform(0.03, 0.17) * height, rng.uniform(-0.35, 0.35)
        if math.sin(2 * math.pi * x / WIDTH * 3 + 1) + 0.5 * math.sin(2 * math.pi * x / WIDTH * 7) < rng.uniform(-1.2, 1.2):
            tall *= 0.35
        tone = rng.choice((0.05, 0.10, 0.16, 0.55))
        canvas.line([(x, bottom), (x + 0.4 * lean * tall, bottom - 0.6 * tall), (x + lean * tall, bottom - tall)],
                    rng.uniform(0.8, 1.5), (tone, tone * 1.05, tone * 0.8), 0.9)


def draw_title(canvas, top, height):
    """The text line between two pairs of rules."""
    for y in range(top, top + height):
        for x in range(WIDTH):
            canvas.blend(x, y, (0.96, 0.95, 0.92), 1)
    for offset, width in ((3.0, 2.4), (7.0, 0.9)):
        for y in (top + offset, top + height - offset):
            canvas.line([(0, y), (WIDTH, y)], width, (0.08, 0.08, 0.10))
    size = height * 0.50
    for repeat in range(3):
        x = (repeat + 0.5) * WIDTH / 3
        half = text_width("HILBRUSH", size) / 2
        canvas.text("HILBRUSH", x - half, top + height / 2 + size / 2, size, 4.0, (0.05, 0.05, 0.08))
        y = top + height / 2
        for side in (-1, 1):  # a lozenge between the words
            cx = x + side * WIDTH / 6
            canvas.polygon([(cx - 9, y), (cx, y - 7), (cx + 9, y), (cx, y + 7)], (0.35, 0.12, 0.10))


def draw_bowl(canvas, rng):
    top, bottom = STRIPS["bowl"]
    title = round((bottom - top) * TEXT_SHARE)
    height = bottom - top - title
    clouds, rock, ripple = Noise(rng, 6, 9, 5), Noise(rng, 40, 30, 4), Noise(rng, 24, 90, 3)
    ranges = mountains(rng)
    columns = [land_column(i, height, ranges, clouds, rock) for i in range(WIDTH)]
    first = top + title
    for j in range(height):
        row = [column[j] for column in columns] if j < round(height * SHORE) else lake_row(j / height, columns, height, ripple)
        for i, color in enumerate(row):
            canvas.blend(i, first + j, color, 1)
    draw_moon(canvas, first, height, rng)
    draw_firs(canvas, first, height, rng)
    draw_boat(canvas, first, height)
    draw_reeds(canvas, bottom, height, rng)
    draw_title(canvas, top, title)


# --- inner wall, stem, foot ------------------------------------------------------------------------------------------

def draw_inner(canvas):
    """A slow tone from light at the rim to dark at the bottom, meridians and parallels in fine lines, and a word to read from inside."""
    top, bottom = STRIPS["inner"]
    for y in range(top, bottom):
        depth = (y - top) / (bottom - top)
        for x in range(WIDTH):
            tone = 0.94 - 0.60 * depth ** 1.3 + 0.06 * math.cos(2 * math.pi * x / WIDTH * 4) * (1 - depth)
            canvas.blend(x, y, (tone, tone * 0.96, tone * 0.88), 1)
    ink = (0.10, 0.14, 0.26)
    for k in range(24):
        x = WIDTH * k / 24
        canvas.line([(x, top + 24), (x, bottom - (70 if k % 2 else 6))], 1.0 if k % 2 else 1.8, ink)
    for k in range(1, 8):
        canvas.line([(0, top + 24 + 26 * k), (WIDTH, top + 24 + 26 * k)], 0.8 + 0.25 * k, ink)
    for y in (top + 16, top + 23):
        canvas.line([(0, y), (WIDTH, y)], 1.5, ink)
    for k in range(4):
        size = 32
        x = WIDTH * (k + 0.5) / 4 - text_width("HILBRUSH", size) / 2
        canvas.polygon([(x - 12, top + 55), (x + text_width("HILBRUSH", size) + 12, top + 55),
                        (x + text_width("HILBRUSH", size) + 12, top + 110), (x - 12, top + 110)], (0.95, 0.92, 0.86))
        canvas.text("HILBRUSH", x, top + 98, size, 3.0, ink)


def hilbert_points(order):
    """Centers of the 4^order squares of the unit square, along the Hilbert curve."""
    points = [(0, 0)]
    for level in range(order):
        n = 1 << level
        points = ([(y, x) for x, y in points] + [(x, y + n) for x, y in points] + [(x + n, y + n) for x, y in points]
                  + [(2 * n - 1 - y, n - 1 - x) for x, y in points])
    n = 1 << order
    return [((x + 0.5) / n, (y + 0.5) / n) for x, y in points]


def draw_stem(canvas):
    top, bottom = STRIPS["stem"]
    height = bottom - top
    for y in range(top, bottom):
        for x in range(WIDTH):
            tone = 0.80 + 0.16 * math.sin(math.pi * (y - top) / height)
            canvas.blend(x, y, (tone, tone * 0.97, tone * 0.90), 1)
    # Two squares around. The stem is thin, so a pixel is four times as high as wide on the cup: upright strokes are drawn wider.
    for k in range(2):
        curve = [(WIDTH / 2 * (k + px), top + 8 + (height - 16) * (1 - py)) for px, py in hilbert_points(3)]
        for (x0, y0), (x1, y1) in zip(curve, curve[1:]):
            left, right, up, down = min(x0, x1) - 8, max(x0, x1) + 8, min(y0, y1) - 2, max(y0, y1) + 2
            canvas.polygon([(left, up), (right, up), (right, down), (left, down)], (0.10, 0.20, 0.22))


def draw_foot(canvas):
    """Eleven tones from black to white around the foot, their edges marked, and rays towards the stem."""
    top, bottom = STRIPS["foot"]
    middle = top + 46
    for y in range(top, bottom):
        for x in range(WIDTH):
            tone = math.floor(x / WIDTH * 11) / 10 if y >= middle else 0.90
            canvas.blend(x, y, (tone, tone, tone), 1)
    for k in range(66):
        x = WIDTH * k / 66
        canvas.polygon([(x - 3.5, middle), (x + 3.5, middle), (x + 0.6, top + (2 if k % 6 == 0 else 18)), (x - 0.6, top + (2 if k % 6 == 0 else 18))],
                       (0.12, 0.10, 0.12))
    canvas.line([(0, middle), (WIDTH, middle)], 2.0, (0.05, 0.05, 0.05))
    canvas.line([(0, bottom - 3), (WIDTH, bottom - 3)], 2.0, (0.05, 0.05, 0.05))


def render(seed=11):
    """The whole image, a Canvas."""
    canvas, rng = Canvas(WIDTH, HEIGHT, 3), random.Random(seed)
    draw_inner(canvas)
    draw_bowl(canvas, rng)
    draw_stem(canvas)
    draw_foot(canvas)
    return canvas
