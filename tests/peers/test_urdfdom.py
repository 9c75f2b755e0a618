"""KBot loads all URDF that urdfdom, ROS's parser, reads, also if it is not well-formed XML."""

import shutil
import subprocess

import pytest

from kbot.model.load import load_robot

LINK = "<link name='a'/>"
ROBOT = f"<robot name='r'>{LINK}</robot>"
FILES = {
    "well_formed": f"<?xml version='1.0'?>{ROBOT}",
    "dashes": f"<robot name='r'><!-- a -- b -->{LINK}</robot>",
    "dash_at_the_end": f"<robot name='r'><!-- a --->{LINK}</robot>",
    "blank_before_declaration": f"\n  <?xml version='1.0'?>{ROBOT}",
    "comment_before_declaration": f"<!-- c -->\n<?xml version='1.0'?>{ROBOT}",
    "two_declarations": f"<?xml version='1.0'?><?xml version='1.0'?>{ROBOT}",
    "two_roots": ROBOT + ROBOT,
    "end_tag_after_root": f"{ROBOT}</robot>",
    "undeclared_prefix": f"<robot name='r'>{LINK}<x:y/></robot>",
    "unknown_xacro_tag": f"<robot name='r' xmlns:xacro='x'>{LINK}<xacro:grey/></robot>",
    "cdata": f"<robot name='r'>{LINK}<gazebo><![CDATA[ <!-- -- ]]></gazebo></robot>",
    "text_before_declaration": f"text <?xml version='1.0'?>{ROBOT}",
    "text_before_root": f"text {ROBOT}",
    "attribute_twice": f"<robot name='r' name='s'>{LINK}</robot>",
    "not_closed": f"<robot name='r'>{LINK}",
    "space_in_tag": "<robot name='r'>< link name='a'/></robot>",
}
READ_BY_URDFDOM = set(FILES) - {
    "text_before_declaration", "text_before_root", "attribute_twice", "not_closed", "space_in_tag"
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_kbot_loads_what_urdfdom_reads(tmp_path, name):
    if shutil.which("check_urdf") is None:
        pytest.skip("urdfdom is not installed: run scripts/need_sdformat.sh")
    file = tmp_path / "robot.urdf"
    file.write_text(FILES[name])
    done = subprocess.run(["check_urdf", str(file)], capture_output=True, check=False)
    assert (done.returncode == 0) == (name in READ_BY_URDFDOM)
    loaded = load_robot(file)
    assert loaded.has_errors == (name not in READ_BY_URDFDOM)
    assert bool(loaded.diagnostics) == (name not in ("well_formed", "cdata"))
