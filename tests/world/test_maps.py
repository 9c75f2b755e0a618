"""Maps of ROS's map_server: occupied cells become walls."""

import struct
import zlib

import numpy as np
import pytest

from kbot.text import KbotError
from kbot.world import load_world
from kbot.world.images import read_picture
from kbot.world.load import rectangles

YAML = "image: {image}\nresolution: 0.5\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\n"


def chunk(name: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))


def png(pixels: np.ndarray, kind: int = 0, depth: int = 8, filters: int = 0) -> bytes:
    height, width = pixels.shape[:2]
    rows = b"".join(bytes([filters]) + row.tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0)
    data = chunk(b"IDAT", zlib.compress(rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + data + chunk(b"IEND", b"")


def test_occupied_cells_become_walls_at_their_positions(tmp_path):
    """The map has four columns and three rows, with the lower left cell at the origin.

    The black cell is the second of the upper row. Its centre is at -1 + 1.5 x 0.5 and -2 + 2.5 x 0.5.
    """
    cells = np.full((3, 4), 254, dtype=np.uint8)
    cells[0, 1] = 0
    (tmp_path / "room.pgm").write_bytes(b"P5\n# made by hand\n4 3\n255\n" + cells.tobytes())
    (tmp_path / "room.yaml").write_text(YAML.format(image="room.pgm"))
    world = load_world(tmp_path / "room.yaml")
    (wall,) = world.bodies[1].parts
    assert wall.shape.size == (0.5, 0.5, 0.3)
    place = (world.bodies[1].pose @ wall.pose).translation
    assert place == pytest.approx((-0.25, -0.75, 0.15))


def test_rectangles_cover_each_cell_once():
    random = np.random.default_rng(3)
    cells = random.random((30, 40)) < 0.4
    covered = np.zeros(cells.shape, dtype=int)
    for r0, c0, r1, c1 in rectangles(cells):
        covered[r0:r1, c0:c1] += 1
    assert (covered == cells).all()


def test_long_wall_is_one_rectangle():
    cells = np.zeros((10, 10), dtype=bool)
    cells[2:8, 3:5] = True
    assert rectangles(cells) == [(2, 3, 8, 5)]


GREY = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20


@pytest.mark.parametrize(
    "data",
    [
        png(GREY),
        png(np.stack([GREY] * 3, axis=-1), kind=2),
        png(GREY.astype(">u2") * 257, depth=16),
        b"P2\n4 3\n255\n" + " ".join(str(v) for v in GREY.ravel()).encode(),
    ],
    ids=["grey", "colour", "sixteen bits", "plain text"],
)
def test_images_are_read(tmp_path, data):
    (tmp_path / "picture").write_bytes(data)
    grey, opaque = read_picture(tmp_path / "picture")
    assert grey == pytest.approx(GREY / 255.0)
    assert opaque.all()


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_png_filters_are_decoded(tmp_path, kind):
    """Encode with each filter of the PNG standard, implemented here from its definition."""
    pixels = np.random.default_rng(kind).integers(0, 256, (5, 7)).astype(int)
    coded = np.zeros_like(pixels)
    for r in range(5):
        for c in range(7):
            a = pixels[r, c - 1] if c else 0
            b = pixels[r - 1, c] if r else 0
            corner = pixels[r - 1, c - 1] if r and c else 0
            p = a + b - corner
            paeth = min((a, b, corner), key=lambda v, p=p: abs(p - v))
            coded[r, c] = (pixels[r, c] - {1: a, 2: b, 3: (a + b) // 2, 4: paeth}[kind]) % 256
    (tmp_path / "p.png").write_bytes(png(coded.astype(np.uint8), filters=kind))
    assert read_picture(tmp_path / "p.png")[0] == pytest.approx(pixels / 255.0)


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"m.yaml": "image: no.pgm\nresolution: 1\norigin: [0, 0, 0]\n"}, "no.pgm does not exist"),
        ({"m.yaml": "a: 1\n"}, "'image' is missing"),
        ({"m.yaml": "a: [\n"}, "not YAML"),
        ({"m.yaml": "a: !!int ''\n"}, r'm\.yaml:1:4: not YAML: "" is not a valid int'),
        ({"m.yaml": "a: " + "[" * 5000}, "not YAML: it is nested more than 100 levels deep"),
        (
            {"m.yaml": YAML.format(image="p").replace("0.5", "-1"), "p": "P5\n1 1\n255\nx"},
            "resolution must be from 0.0001 to 1000 m, not -1",
        ),
        ({"m.yaml": YAML.format(image="p"), "p": "P5\n4 4\n255\nshort"}, "cannot be read: .*truncated"),
        ({"m.yaml": YAML.format(image="p"), "p": "GIF89a"}, "has an unknown format"),
        (
            {"m.yaml": YAML.format(image="p"), "p": "version https://git-lfs.github.com/spec/v1\n"},
            "it is only a pointer of Git LFS",
        ),
        ({"m.yaml": YAML.format(image="p").replace("0.5", ".nan"), "p": "x"}, "finite"),
    ],
)
def test_invalid_map_is_one_error(tmp_path, files, message):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(KbotError, match=message):
        load_world(tmp_path / "m.yaml")


LAUGHS = "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12))
MERGES = "m0: &m0 {x: 1}\n" + "".join(
    f"m{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 10)}]}}\n" for i in range(1, 12)
)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"resolution": "1" + "0" * 400}, r"m\.yaml:2:13: not YAML: a number is too large"),
        ({"resolution": "1" + "0" * 5000}, "not YAML: a number is too large"),
        ({"resolution": "0x" + "f" * 20_000}, "not YAML: a number is too large"),
        ({"resolution": "1" + ":1" * 200_000}, "not YAML: a number is too large"),  # base 60
        ({"resolution": "1.0e-300"}, r"m\.yaml:2:13: resolution must be from 0.0001 to 1000 m"),
        ({"origin": "[1.0e+308, 0, 0]"}, r"m\.yaml:3:9: origin must be .* up to 1e\+06"),
        ({"origin": "[1" + "0" * 400 + ", 0, 0]"}, "not YAML: a number is too large"),
        ({"origin": "&a [*a, *a, *a]"}, "not YAML: its aliases expand to too many values"),
        ({"occupied_thresh": "1.0e+308"}, "occupied_thresh must be from 0 to 1"),
        ({"negate": "1" + "0" * 400}, "not YAML: a number is too large"),
        ({"image": "[a, b]"}, r"m\.yaml:1:8: image must be a file name, not \['a', 'b'\]"),
        ({"": LAUGHS, "mode": "*a11"}, "not YAML: its aliases expand to too many values"),
        ({"": MERGES}, "not YAML: its aliases expand to too many values"),
        (
            {"": "<<: {resolution: x}\n", "resolution": None},
            r"m\.yaml:1:18: resolution must be a finite number, not 'x'",
        ),
    ],
)
def test_hostile_numbers_and_aliases_are_one_error(tmp_path, changed, message):
    lines = {"image": "p.pgm", "resolution": "0.5", "origin": "[0, 0, 0]"} | changed
    text = lines.pop("", "")
    (tmp_path / "p.pgm").write_bytes(b"P5\n1 1\n255\nx")
    (tmp_path / "m.yaml").write_text(text + "".join(f"{k}: {v}\n" for k, v in lines.items() if v))
    with pytest.raises(KbotError, match=message):
        load_world(tmp_path / "m.yaml")


def claim(width: int, height: int) -> bytes:
    """The header of a PNG without image data."""
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", b"")


@pytest.mark.filterwarnings("ignore::PIL.Image.DecompressionBombWarning")
@pytest.mark.parametrize(
    ("data", "message"),
    [
        (claim(50_000, 50_000), "exceeds limit of"),
        (claim(9_000, 9_000), "9000 x 9000 pixels, more than 50000000"),
        (b"P5\n9000 9000\n255\n", "9000 x 9000 pixels, more than 50000000"),
        (b"P5\n7000 7000\n255\n", "truncated"),
        (b"P5\n-4 -4\n255\n", "has an unknown format"),
        (b"P5\n99999999999999999999 1\n255\n", "Token too long"),
        (b"P2\n4 4\n255\n" + b"9" * 100_000, "Token too long"),
        (b"P5\n4 4\n0\n" + bytes(16), "maxval"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\n", "has an unknown format"),
    ],
)
def test_image_with_a_false_or_excessive_size_is_one_error(tmp_path, data, message):
    (tmp_path / "p").write_bytes(data)
    with pytest.raises(KbotError, match=message):
        read_picture(tmp_path / "p")


def test_map_with_too_many_wall_runs_is_one_error(tmp_path):
    """The map has four million runs of wall cells."""
    cells = np.tile(np.array([0, 255], dtype=np.uint8), (2000, 2050))
    (tmp_path / "room.pgm").write_bytes(b"P5\n4100 2000\n255\n" + cells.tobytes())
    (tmp_path / "room.yaml").write_text(YAML.format(image="room.pgm"))
    with pytest.raises(KbotError, match="runs of occupied cells in its rows, more than 2000000"):
        load_world(tmp_path / "room.yaml")


def test_truncated_png_is_one_error(tmp_path):
    (tmp_path / "p.png").write_bytes(png(GREY)[:40])
    with pytest.raises(KbotError, match="has an unknown format"):
        read_picture(tmp_path / "p.png")
