"""Textures in pictures that are drawn without a browser."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from kbot.cli.main import run

from .pictures import decode_png

UPPER, LOWER = (255, 0, 0), (0, 0, 255)


@pytest.mark.parametrize("ending", ["glb", "obj"])
def test_a_texture_is_the_right_way_up(tmp_path: Path, ending: str) -> None:
    """A board across x with a texture that is red above and blue below, seen from the front."""
    picture = Image.new("RGB", (16, 16), UPPER)
    picture.paste(LOWER, (0, 8, 16, 16))
    corners = np.array([[0, -1, 0], [0, 1, 0], [0, 1, 2], [0, -1, 2]], float)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    material = PBRMaterial(baseColorTexture=picture) if ending == "glb" else SimpleMaterial(image=picture)
    board = trimesh.Trimesh(
        corners, [[0, 1, 2], [0, 2, 3]], process=False, visual=TextureVisuals(uv, material)
    )
    board.export(tmp_path / f"board.{ending}")
    file = tmp_path / "board.urdf"
    mesh = f'<visual><geometry><mesh filename="file://{tmp_path}/board.{ending}"/></geometry></visual>'
    file.write_text(f'<robot name="board"><link name="base">{mesh}</link></robot>')
    out = tmp_path / "out.png"
    assert (
        run(["export", str(file), "-o", str(out), "--from", "0,0", "--transparent", "--size", "300x300"]) == 0
    )
    seen = decode_png(out.read_bytes()).astype(int)[:, :, :3]
    red = np.argwhere((seen[..., 0] > 80) & (seen[..., 1:].max(axis=-1) < 60))
    blue = np.argwhere((seen[..., 2] > 80) & (seen[..., :2].max(axis=-1) < 60))
    assert len(red) == pytest.approx(len(blue), rel=0.05)
    assert red[:, 0].max() <= blue[:, 0].min()
