"""Grids of worlds against geometry, and map files against the rules of map_server."""

from math import cos, pi, sin

import numpy as np
import pytest
from PIL import Image

from kbot.kinematics import PlanarPose, Transform
from kbot.text import KbotError
from kbot.world import Body, Box, Cylinder, HeightField, Part, Plane, World, load_world
from kbot.world.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from kbot.world.occupancy_files import read_map, write_map
from kbot.world.occupancy_of_world import world_grid


def _world(shape, pose, **part):
    return World("test", (Body("thing", (Part(shape, **part),), pose),))


def _at(x, y, z=0.5, yaw=0.0, pitch=0.0):
    return Transform.from_xyz_rpy((x, y, z), (0.0, pitch, yaw))


def test_box_occupies_the_cells_it_overlaps():
    grid = world_grid(_world(Box((1.0, 0.5, 1.0)), _at(1.0, 0.25)), resolution=0.1)
    assert (grid.cells == OCCUPIED).sum() == 10 * 5
    assert grid.value(0.55, 0.05) == OCCUPIED
    assert grid.value(0.45, 0.05) == FREE
    assert grid.value(1.45, 0.45) == OCCUPIED
    assert grid.value(1.45, 0.55) == FREE


def test_rotated_box_occupies_its_area():
    grid = world_grid(_world(Box((1.0, 0.5, 1.0)), _at(0.3, 0.1, yaw=0.5)), resolution=0.01)
    area = (grid.cells == OCCUPIED).sum() * 0.01**2
    # cells that the outline only touches add about one cell along it
    assert 0.5 < area < 0.5 + 3.0 * 0.01 * 1.2
    for row, column in np.argwhere(grid.cells == OCCUPIED)[::7].tolist():
        x, y = grid.center(row, column)
        u = cos(0.5) * (x - 0.3) + sin(0.5) * (y - 0.1)
        v = cos(0.5) * (y - 0.1) - sin(0.5) * (x - 0.3)
        assert abs(u) <= 0.5 + 0.0071
        assert abs(v) <= 0.25 + 0.0071


def test_cylinder_occupies_a_circles_area():
    grid = world_grid(_world(Cylinder(0.5, 1.0), _at(0.0, 0.0)), resolution=0.01)
    area = (grid.cells == OCCUPIED).sum() * 0.01**2
    assert pi * 0.25 < area < pi * 0.515**2


def test_wall_thinner_than_a_cell_is_kept():
    grid = world_grid(_world(Box((2.0, 0.002, 1.0)), _at(0.0, 0.033, yaw=0.4)), resolution=0.1)
    # a line of 2 m at 0.4 rad crosses this many columns
    columns = (grid.cells == OCCUPIED).any(axis=0).sum()
    assert columns >= 2.0 * cos(0.4) / 0.1


def test_only_objects_at_the_robots_height_are_obstacles():
    beam = Box((1.0, 0.1, 0.1))
    assert not (world_grid(_world(beam, _at(0, 0, z=0.5))).cells == OCCUPIED).any()
    assert (world_grid(_world(beam, _at(0, 0, z=0.2))).cells == OCCUPIED).any()
    assert not (world_grid(_world(beam, _at(0, 0, z=0.2), ground=True)).cells == OCCUPIED).any()
    assert not (world_grid(_world(beam, _at(0, 0, z=0.2), solid=False)).cells == OCCUPIED).any()


def test_leaning_plate_is_cut_at_the_heights():
    # a plate 45 degrees up along x from the origin: between 0.1 and 0.3 m it covers x of 0.1 to 0.3
    plate = _world(Box((2.0, 1.0, 0.001)), _at(0.0, 0.0, z=0.0, pitch=-pi / 4))
    grid = world_grid(plate, resolution=0.01, heights=(0.1, 0.3))
    columns = np.flatnonzero((grid.cells == OCCUPIED).any(axis=0)) * 0.01 + grid.origin.x
    assert columns.min() == pytest.approx(0.1, abs=0.011)
    assert columns.max() + 0.01 == pytest.approx(0.3, abs=0.011)


def test_planes_are_ground_unless_they_are_too_steep():
    around = ((-1.0, -1.0), (1.0, 1.0))
    gentle = _world(Plane(), _at(0.0, 0.0, z=0.0, pitch=-0.4))
    assert not (world_grid(gentle, around=around).cells == OCCUPIED).any()
    # this plane rises by 45 degrees along x: at 0.01 m above the floor, x > 0.01 is inside it
    steep = world_grid(_world(Plane(), _at(0.0, 0.0, z=0.0, pitch=-pi / 4)), around=around)
    assert steep.value(0.05, 0.3) == OCCUPIED
    assert steep.value(-0.05, 0.3) == FREE
    wall = world_grid(_world(Plane(), _at(0.5, 0.0, z=0.0, pitch=-pi / 2)), around=around)
    assert (wall.value(0.45, 0.7), wall.value(0.55, 0.7)) == (FREE, OCCUPIED)


def _field(rise):
    """Level up to x = 0, then rising by `rise` per metre for 1 m, then level again; 6 x 2 m."""
    x = np.linspace(-3.0, 3.0, 601)
    return HeightField(np.tile(np.clip(x, 0.0, 1.0) * rise, (5, 1)), (6.0, 2.0))


def test_gentle_slopes_of_a_height_field_are_free():
    grid = world_grid(_world(_field(0.5), _at(0.0, 0.0, z=0.0)))
    assert not (grid.cells == OCCUPIED).any()
    steep = world_grid(_world(_field(1.0), _at(0.0, 0.0, z=0.0)))
    columns = np.flatnonzero((steep.cells == OCCUPIED).any(axis=0)) * steep.resolution + steep.origin.x
    assert columns.min() == pytest.approx(0.0, abs=0.03)
    assert columns.max() == pytest.approx(1.0, abs=0.03)
    # a rotated and moved field is at its pose
    turned = world_grid(_world(_field(1.0), _at(2.0, 1.0, z=0.0, yaw=pi / 2)))
    assert turned.value(2.0, 1.5) == OCCUPIED
    assert turned.value(2.0, 0.5) == turned.value(2.0, 2.5) == FREE


def test_object_on_a_hill_is_on_the_map():
    hill = Body("hill", (Part(_field(0.5)),))
    stone = Body("stone", (Part(Box((0.2, 0.2, 0.2))),), _at(2.0, 0.0, z=0.6))
    grid = world_grid(World("hill", (hill, stone)))
    assert grid.value(2.0, 0.0) == OCCUPIED
    assert grid.value(2.2, 0.0) == FREE


def test_ramp_is_free_along_its_length_and_blocked_at_its_sides():
    grid = world_grid(load_world("ramp"))
    # the middle of the ramp, from the floor to the level top and down again
    row = grid.cell(0.0, 0.0)[0]
    ahead = slice(grid.cell(0.0, 0.0)[1], grid.cell(5.9, 0.0)[1])
    assert (grid.cells[row, ahead] == FREE).all()
    # beside the top, 0.75 m to the left, is an edge of 2 sin 10 deg = 0.35 m
    across = grid.cells[slice(grid.cell(3.0, 0.6)[0], grid.cell(3.0, 0.9)[0]), grid.cell(3.0, 0.0)[1]]
    assert (across == OCCUPIED).any()
    # steps of 1 cm are drivable, steps of 5 cm are not
    low = world_grid(load_world("stairs"))
    end = low.cell(3.4, 0.0)[1]
    assert (low.cells[low.cell(0.0, 0.0)[0], :end] == FREE).all()
    high = world_grid(load_world("stairs:height=0.05"))
    assert (high.cells[high.cell(0.0, 0.0)[0]] == OCCUPIED).sum() == 2 * 6


def test_maze_is_closed_and_connected():
    grid = world_grid(load_world("maze:size=5,seed=2"), resolution=0.02)
    seen = np.zeros(grid.cells.shape, dtype=bool)
    waiting = [grid.cell(0.0, 0.0)]
    while waiting:
        row, column = waiting.pop()
        if grid.contains(row, column) and not seen[row, column] and grid.cells[row, column] == FREE:
            seen[row, column] = True
            waiting += [(row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)]
    centers = [grid.cell(0.6 * x, 0.6 * y) for x in range(5) for y in range(5)]
    assert all(seen[cell] for cell in centers)
    assert not seen[0, 0]


@pytest.mark.parametrize("picture", ["png", "pgm"])
def test_written_map_is_read_back_unchanged(tmp_path, picture):
    random = np.random.default_rng(3)
    cells = random.choice(np.array([FREE, OCCUPIED, UNKNOWN], dtype=np.int8), (7, 11))
    grid = OccupancyGrid(cells, 0.05, PlanarPose(-1.25, 2.5, 0.3))
    image = write_map(grid, tmp_path / "map.yaml", picture)
    assert image.name == f"map.{picture}"
    back = read_map(tmp_path / "map.yaml")
    assert np.array_equal(back.cells, cells)
    assert (back.resolution, back.origin) == (0.05, PlanarPose(-1.25, 2.5, 0.3))
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([image.name, "map.yaml"])


def test_image_equals_that_of_map_saver(tmp_path):
    grid = OccupancyGrid(np.array([[FREE, UNKNOWN], [OCCUPIED, FREE]], dtype=np.int8), 0.1)
    write_map(grid, tmp_path / "map.yaml")
    with Image.open(tmp_path / "map.png") as image:
        # the first row of the grid is the lowest row of the image
        assert np.asarray(image).tolist() == [[0, 254], [254, 205]]


def _write_yaml(folder, text="", **keys):
    settings = {"image": "m.png", "resolution": 0.1, "origin": [0, 0, 0], "occupied_thresh": 0.65,
                "free_thresh": 0.25, **keys}  # fmt: skip
    lines = [f"{key}: {value}" for key, value in settings.items() if value is not None]
    (folder / "map.yaml").write_text(text or "\n".join(lines))
    return folder / "map.yaml"


def test_modes_negation_and_colours_are_read_as_in_map_server(tmp_path):
    Image.fromarray(np.array([[0, 255, 128, 100]], dtype=np.uint8)).save(tmp_path / "m.png")
    assert read_map(_write_yaml(tmp_path)).cells.tolist() == [[100, 0, -1, -1]]
    assert read_map(_write_yaml(tmp_path, negate=1)).cells.tolist() == [[0, 100, -1, -1]]
    assert read_map(_write_yaml(tmp_path, mode="raw")).cells.tolist() == [[0, -1, -1, 100]]
    # 1 + floor(98 (p - 0.25) / 0.4) with p = 127/255 and 155/255
    assert read_map(_write_yaml(tmp_path, mode="scale")).cells.tolist() == [[100, 0, 61, 88]]
    Image.fromarray(np.array([[[255, 0, 0], [255, 255, 240]]], dtype=np.uint8)).save(tmp_path / "m.png")
    assert read_map(_write_yaml(tmp_path)).cells.tolist() == [[100, 0]]


@pytest.mark.parametrize(
    ("keys", "word"),
    [
        ({"resolution": 0}, "resolution"),
        ({"resolution": "wide"}, "resolution"),
        ({"origin": [0, 0]}, "origin"),
        ({"mode": "trinaary"}, "did you mean 'trinary'"),
        ({"image": None}, "'image' is missing"),
        ({"occupied_thresh": None, "ocupied_thresh": 0.5}, "did you mean 'ocupied_thresh'"),
        ({"image": "n.png"}, "does not exist"),
        ({"image": "map.yaml"}, "has an unknown format"),
    ],
)
def test_invalid_map_setting_is_one_error(tmp_path, keys, word):
    Image.fromarray(np.zeros((1, 1), dtype=np.uint8)).save(tmp_path / "m.png")
    with pytest.raises(KbotError, match=word):
        read_map(_write_yaml(tmp_path, **keys))


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("resolution: wide", "2:13"),
        ("resolution: -1", "2:13"),
        ("resolution: 1\norigin: [0, x, 0]", "3:9"),
        ("resolution: 1\norigin: [0, 0, 0]\nmode: tri", "4:7"),
        ("resolution: 1\norigin: [0, 0, 0]\nfree_thresh: no", "4:14"),
    ],
)
def test_invalid_value_is_reported_at_its_place(tmp_path, line, place):
    Image.fromarray(np.zeros((1, 1), dtype=np.uint8)).save(tmp_path / "m.png")
    file = tmp_path / "map.yaml"
    file.write_text(f"image: m.png\n{line}\n" + ("" if "origin" in line else "origin: [0, 0, 0]\n"))
    with pytest.raises(KbotError, match=f"map.yaml:{place}: "):
        read_map(file)


def test_thresholds_default_to_those_of_map_saver(tmp_path):
    # occupied above 0.65, which is up to a grey of 89; free below 0.196, which is from 206; 205 is unknown
    Image.fromarray(np.array([[0, 89, 90, 205, 206, 255]], dtype=np.uint8)).save(tmp_path / "m.png")
    path = _write_yaml(tmp_path, occupied_thresh=None, free_thresh=None)
    assert read_map(path).cells.tolist() == [[100, 100, -1, -1, 0, 0]]
    # the world of the map has its walls in the same cells
    (wall,) = load_world(path).bodies[1].parts
    assert wall.shape.size == pytest.approx((0.2, 0.1, 0.3))


def test_invalid_yaml_is_reported_at_its_place(tmp_path):
    with pytest.raises(KbotError, match=r"map\.yaml:2:\d+: not YAML"):
        read_map(_write_yaml(tmp_path, "image: m.png\n]bad"))
    with pytest.raises(KbotError, match="is not a map"):
        read_map(_write_yaml(tmp_path, "just words"))
    with pytest.raises(KbotError, match="does not exist"):
        read_map(tmp_path / "gone.yaml")


def test_unwritable_map_is_one_error(tmp_path):
    grid = OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.1)
    with pytest.raises(KbotError, match=r"\.yaml"):
        write_map(grid, tmp_path / "map.txt")
    with pytest.raises(KbotError, match="png or pgm"):
        write_map(grid, tmp_path / "map.yaml", "gif")
    with pytest.raises(KbotError, match="cannot be written"):
        write_map(grid, tmp_path / "none" / "map.yaml")
