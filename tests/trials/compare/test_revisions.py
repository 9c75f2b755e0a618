"""What A and B may be, and what a stranger's repository cannot do."""

import hashlib
import os
import shutil
import subprocess
import sys
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from kbot.model.load import SHIPPED_PACKAGE
from kbot.text import KbotError
from kbot.text.notes import notes_sent_to
from kbot.trials.compare import git as git_module
from kbot.trials.compare.revisions import Description, RecordingFile, opened

ROBOT = '<robot name="{0}"><link name="{0}"/></robot>\n'
MAIN = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(find parts)/part.xacro"/>
</robot>
"""


def git(folder: Path, *arguments: str, text: str | None = None) -> str:
    names = ("-c", "user.name=t", "-c", "user.email=t@example.org", "-c", "init.defaultBranch=main")
    environment = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")}
    done = subprocess.run(
        ["git", *names, *arguments],
        cwd=folder, env=environment, check=True, capture_output=True, text=True, input=text,
    )  # fmt: skip
    return done.stdout


def commit(folder: Path, message: str = "change") -> None:
    git(folder, "add", "-A")
    git(folder, "commit", "-q", "-m", message)


def package(folder: Path, name: str, **files: str) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    for file, text in files.items():
        path = folder / file.replace("__", "/").replace("_x", ".x").replace("_u", ".u")
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return folder


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_packages: None) -> Path:
    """Two packages in a repository with two commits, and a change in the working directory. The robot has one
    link, from a file of the other package."""
    top = tmp_path / "elsewhere" / "repository"
    package(top / "src" / "robot", "robot", urdf__robot_xacro=MAIN)
    package(top / "src" / "parts", "parts", part_xacro=ROBOT.format("first"))
    git(top, "init", "-q")
    commit(top)
    git(top, "tag", "v1")
    for name in ("second", "unsaved"):
        (top / "src" / "parts" / "part.xacro").write_text(ROBOT.format(name))
        if name == "second":
            commit(top)
    monkeypatch.chdir(top)
    return top


def links(word: str, **values: str) -> list[str]:
    with opened(word, values) as description:
        assert isinstance(description, Description)
        return [*description.load().require().links]


@pytest.mark.parametrize(
    ("folder", "word", "expected"),
    [
        (".", "HEAD~1:src/robot/urdf/robot.xacro", "first"),
        (".", "HEAD~1:src/robot", "first"),
        (".", "v1:src/robot/", "first"),
        (".", "main:src/robot/urdf/robot.xacro", "second"),
        (".", "src/robot", "unsaved"),
        (".", "src/robot/urdf/robot.xacro", "unsaved"),
        (".", "robot", "unsaved"),
        ("src/robot", "HEAD~1:", "first"),
        ("src/robot", "HEAD:", "second"),
        ("src/robot", "HEAD~1:./urdf/robot.xacro", "first"),
        # git's rule is the top, but nobody means a path that does not exist
        ("src/robot", "HEAD~1:urdf/robot.xacro", "first"),
        ("src/robot", ".", "unsaved"),
        ("src", "HEAD:../src/robot", "second"),
    ],
)
def test_a_revision_uses_its_own_files_and_packages(
    repository: Path, monkeypatch: pytest.MonkeyPatch, folder: str, word: str, expected: str
):
    monkeypatch.chdir(repository / folder)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(repository / "src"))
    assert links(word) == [expected]


def test_the_files_of_a_revision_are_removed_also_after_an_error(repository: Path):
    trees = []
    with opened("v1:src/robot") as description:
        assert isinstance(description, Description)
        assert Path(description.file).is_file()
        assert description.shown(description.file) == "src/robot/urdf/robot.xacro"
        trees.append(description.tree)
    with suppress(ZeroDivisionError), opened("v1:src/robot") as description:
        assert isinstance(description, Description)
        trees.append(description.tree)
        raise ZeroDivisionError
    assert not any(Path(tree).exists() for tree in trees)


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("mian:src/robot", "there is no git revision 'mian': did you mean 'main'?"),
        ("release/7:src/robot", "there is no git revision 'release/7': the branches and tags are main, v1"),
        ("--help:src", "'--help' is not a git revision"),
        ("v1:src/robt", "src/robt does not exist in the revision v1"),
        ("v1:robot.xacro", "does not exist in the revision v1: did you mean 'src/robot/urdf/robot.xacro'?"),
        ("v1:src/robot/urdf/robt.xacro", "revision v1: did you mean 'src/robot/urdf/robot.xacro'?"),
        ("v1:../outside", "../outside does not exist in the revision v1"),
        ("nowhere", "nowhere is not a file, a package, a recording or a git revision (REVISION:PATH)"),
    ],
)  # fmt: skip
def test_what_does_not_exist(repository: Path, word: str, message: str):
    with pytest.raises(KbotError) as raised, opened(word):
        pass
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_package_needs_exactly_one_robot(repository: Path):
    other = repository / "src" / "robot" / "urdf" / "other.urdf"
    other.write_text(ROBOT.format("other"))
    with pytest.raises(KbotError, match=r"src/robot contains 2 robots. Choose one: \S+r.urdf, \S+t.xacro"):
        links("src/robot")
    commit(repository)
    with pytest.raises(KbotError, match=r"Choose one: HEAD:src/robot/urdf/other.urdf, HEAD:src/robot"):
        links("HEAD:src/robot")
    (repository / "empty").mkdir()
    with pytest.raises(KbotError, match="the folder empty contains no robot"):
        links("empty")


def test_outside_a_repository(tmp_path: Path, no_packages: None):
    with pytest.raises(KbotError, match=r"elsewhere is not in a git repository, so that it has no revisions"):
        links("main:robot.xacro")


def test_without_git(repository: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(KbotError, match="git is not installed: install it, or compare two files"):
        links("main:src/robot")


def test_a_file_with_a_colon_and_a_drive_letter_are_not_revisions(tmp_path: Path, no_packages: None):
    Path("v1:robot.urdf").write_text(ROBOT.format("colon"))
    assert links("v1:robot.urdf") == ["colon"]
    for word in ("C:\\robots\\robot.urdf", "C:/robots/robot.urdf"):
        with opened(word) as description:
            assert isinstance(description, Description)
            assert (description.file, description.tree) == (word, "")


def test_recordings_are_recognised(tmp_path: Path, no_packages: None):
    Path("bag").mkdir()
    Path("bag/bag_0.db3").touch()
    for word in ("run.mcap", "run.bag", "bag"):
        with opened(word) as found:
            assert found == RecordingFile(word)


def test_the_shipped_robot_and_its_values(no_packages: None):
    assert "lidar_link" in links("kbot", lidar="true")
    assert links(str(SHIPPED_PACKAGE)) == links("kbot")
    with pytest.raises(KbotError, match="there is no argument or top-level property 'lider'"):
        links("kbot", lider="true")


def test_two_copies_of_a_package_use_their_own_files(
    tmp_path: Path, no_packages: None, monkeypatch: pytest.MonkeyPatch
):
    texts = {"a": "a", "b": "b"}
    for name in texts:
        main = MAIN.replace("$(find parts)", "$(find robot)/urdf")
        package(
            tmp_path / name / "robot", "robot", urdf__robot_xacro=main, urdf__part_xacro=ROBOT.format(name)
        )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "a"))
    notes: list[str] = []
    with notes_sent_to(notes.append):
        assert [links(str(tmp_path / name / "robot")) for name in texts] == [["a"], ["b"]]
    assert notes == []


# --- strangers' repositories ---------------------------------------------------------------------


def test_nothing_that_a_repository_configures_runs(repository: Path, tmp_path: Path):
    """Filters, hooks, a file system monitor, a pager and an alias are programs that a repository can name."""
    mark = tmp_path / "ran"
    program = tmp_path / "program"
    program.write_text(f"#!/bin/sh\ntouch {mark}\ncat\n")
    program.chmod(0o755)
    (repository / ".gitattributes").write_text(
        "*.xacro filter=evil diff=evil export-subst\n*.xml export-ignore\n"
    )
    (repository / "src" / "parts" / "part.xacro").write_text(
        ROBOT.format("second") + "<!-- $Format:%H$ -->\n"
    )
    commit(repository)
    for name in ("filter.evil.smudge", "filter.evil.clean", "filter.evil.process", "diff.evil.textconv"):
        git(repository, "config", name, str(program))
    for name in ("core.fsmonitor", "core.pager", "core.sshCommand", "alias.cat-file", "tar.tar.command"):
        git(repository, "config", name, str(program))
    git(repository, "config", "filter.evil.required", "true")
    hooks = repository / ".git" / "hooks"
    for name in ("post-checkout", "reference-transaction", "post-index-change"):
        shutil.copy(program, hooks / name)
    mark.unlink(missing_ok=True)
    with opened("HEAD:src/robot") as description:
        assert isinstance(description, Description)
        assert [*description.load().require().links] == ["second"]
        assert "$Format:%H$" in (Path(description.tree) / "src/parts/part.xacro").read_text()
        assert (Path(description.tree) / "src/parts/package.xml").is_file()
    assert not mark.exists()


def test_links_out_of_the_tree_and_names_out_of_it_are_left_out(repository: Path, tmp_path: Path):
    (tmp_path / "secret").write_text("secret")
    (repository / "absolute").symlink_to(tmp_path / "secret")
    (repository / "relative").symlink_to("../../secret")
    (repository / "src" / "folder").symlink_to("parts")
    (repository / "src" / "parts" / "same.xacro").symlink_to("../robot/urdf/robot.xacro")
    commit(repository)
    with opened("HEAD:src/robot") as description:
        assert isinstance(description, Description)
        tree = Path(description.tree)
        assert not (tree / "absolute").is_symlink()
        assert not (tree / "relative").is_symlink()
        assert (tree / "src" / "folder" / "part.xacro").is_file()
        assert (tree / "src" / "parts" / "same.xacro").read_text() == MAIN
    for name in ("../a", "a/../../b", "/a", "a//b", ".git/config", "a/.GIT/hooks/b", "."):
        assert not git_module._stays_inside(name)
    assert git_module._stays_inside("a/b..c/.gitignore")


def test_a_missing_object_is_reported(repository: Path):
    name = git(repository, "rev-parse", "HEAD:src/parts/part.xacro").strip()
    (repository / ".git" / "objects" / name[:2] / name[2:]).unlink()
    with pytest.raises(KbotError, match=r"git does not have the content of src/parts/part\.xacro"):
        links("HEAD:src/robot")


def test_a_mesh_of_git_lfs_is_read_where_lfs_keeps_it(repository: Path):
    digest = "4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393"
    pointer = f"version https://git-lfs.github.com/spec/v1\noid sha256:{digest}\nsize 5\n"
    for name, kept in (("kept.stl", True), ("gone.stl", False)):
        text = pointer if kept else pointer.replace("4d7a", "0000")
        (repository / name).write_text(text)
    commit(repository)
    place = repository / ".git" / "lfs" / "objects" / "4d" / "7a"
    place.mkdir(parents=True)
    (place / digest).write_text("mesh\n")
    with opened("HEAD:src/robot") as description:
        assert isinstance(description, Description)
        assert (Path(description.tree) / "kept.stl").read_text() == "mesh\n"
        assert (Path(description.tree) / "gone.stl").read_text().startswith("version https://git-lfs")


def bomb(repository: Path, leaf: str) -> None:
    """Commit a tree whose ten entries are the same tree, ten levels deep: 10^10 entries from ten objects.

    `leaf` has the entries of the innermost tree.
    """
    tree = mktree(repository, leaf)
    for _ in range(10):
        tree = mktree(repository, "".join(f"040000 tree {tree}\td{index}\n" for index in range(10)))
    made = git(repository, "commit-tree", "-m", "bomb", tree).strip()
    git(repository, "tag", "bomb", made)


def mktree(repository: Path, entries: str) -> str:
    return git(repository, "mktree", text=entries).strip()


@pytest.mark.parametrize("leaf", ["file", "empty"])
def test_a_tree_that_contains_itself_many_times_is_refused(
    repository: Path, leaf: str, tmp_path: Path, measured_kbot: Callable[..., Any]
) -> None:
    blob = git(repository, "rev-parse", "HEAD:src/parts/part.xacro").strip()
    bomb(repository, f"100644 blob {blob}\tpart.xacro\n" if leaf == "file" else "")
    result = measured_kbot("compare", "bomb:part.xacro", "v1:src/robot", cwd=repository)
    assert result.is_refusal(), result
    assert result.err == (
        "error: the revision is too large to compare: it has more than 200,000 files and folders. "
        "Compare two files instead\n"
    )


def stored(repository: Path, kind: str, part: bytes, times: int) -> str:
    """Store an object with the same bytes many times. Packed, it takes a thousandth of its size."""
    head = f"{kind} {len(part) * times}\0".encode()
    digest, packer = hashlib.sha1(head, usedforsecurity=False), zlib.compressobj(1)
    packed = [packer.compress(head)]
    for _ in range(times):
        digest.update(part)
        packed.append(packer.compress(part))
    name = digest.hexdigest()
    place = repository / ".git" / "objects" / name[:2] / name[2:]
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(b"".join([*packed, packer.flush()]))
    return name


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits the memory")
@pytest.mark.parametrize("what", ["tree", "commit"])
def test_an_object_that_needs_much_memory_is_refused(
    repository: Path, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """git reads a whole tree or commit before it prints anything."""
    monkeypatch.setattr(git_module, "_MEMORY", 100_000_000)  # the real limit takes ten times as long
    head = git(repository, "cat-file", "commit", "HEAD").encode()
    if what == "tree":
        tree = stored(repository, "tree", (b"100644 a\0" + b"\x11" * 20) * 10_000, 500)
        name = git(repository, "commit-tree", "-m", "large", tree, "-p", "HEAD").strip()
    else:
        name = stored(repository, "commit", head.ljust(1_000_000), 150)
    with pytest.raises(KbotError, match="the revision is too large to compare: it has an object for which g"):
        links(f"{name}:src/robot")


def test_a_path_that_is_too_long_for_a_file_is_refused(repository: Path) -> None:
    """Folders nested 10,000 levels deep, whose paths have 100 MB together."""
    tree = mktree(repository, "")
    for _ in range(10_000):  # git would start a process for each
        data = b"40000 f\0" + bytes.fromhex(tree)
        stored = b"tree %d\0%b" % (len(data), data)
        tree = hashlib.sha1(stored, usedforsecurity=False).hexdigest()
        place = repository / ".git" / "objects" / tree[:2] / tree[2:]
        place.parent.mkdir(exist_ok=True)
        place.write_bytes(zlib.compress(stored, 1))
    git(repository, "tag", "deep", git(repository, "commit-tree", "-m", "deep", tree).strip())
    with pytest.raises(KbotError, match=r"the revision has paths of more than 4,096 bytes, too long to comp"):
        links("deep:f")


def test_many_pointers_to_one_large_file_are_refused(
    repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    digest = 64 * "b"
    for index in range(5):
        text = f"version https://git-lfs.github.com/spec/v1\noid sha256:{digest}\nsize 1000 {index}\n"
        (repository / f"{index}.stl").write_text(text)
    commit(repository)
    place = repository / ".git" / "lfs" / "objects" / "bb" / "bb" / digest
    place.parent.mkdir(parents=True)
    place.write_bytes(bytes(1000))
    monkeypatch.setattr(git_module, "_MOST_ALL", 4000)
    with pytest.raises(
        KbotError, match="the revision is too large to compare: it has more than 4 GB of files"
    ):
        links("HEAD:src/robot")


def test_a_submodule_has_no_files(repository: Path):
    head = git(repository, "rev-parse", "HEAD").strip()
    git(repository, "update-index", "--add", "--cacheinfo", f"160000,{head},src/module")
    git(repository, "commit", "-q", "-m", "module")
    assert links("HEAD:src/robot") == ["second"]


@pytest.mark.skipif(os.name == "nt", reason="needs symbolic links")
def test_links_that_lead_outside_only_through_other_links_are_left_out(repository: Path) -> None:
    (repository / "links").mkdir()
    (repository / "links" / "a").symlink_to("z/z/z/../../../../secret")
    (repository / "links" / "z").symlink_to(".")
    (repository / "links" / "same").symlink_to("z/z/a.txt")
    (repository / "links" / "a.txt").write_text("text")
    (repository.parent / "secret").write_text("secret")
    commit(repository)
    with opened("HEAD:src/robot") as found:
        assert isinstance(found, Description)
        links = Path(found.tree, "links")
        assert not (links / "a").is_symlink()
        assert (links / "same").read_text() == "text"


def test_a_link_whose_goal_no_system_has_is_left_out(repository: Path) -> None:
    blob = git(repository, "hash-object", "-w", "--stdin", text="a\0b").strip()
    git(repository, "update-index", "--add", "--cacheinfo", f"120000,{blob},link")
    git(repository, "commit", "-q", "-m", "link")
    with opened("HEAD:src/robot") as found:
        assert isinstance(found, Description)
        assert not Path(found.tree, "link").is_symlink()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
@pytest.mark.parametrize("what", ["HEAD", "tree", "blob"])
def test_a_git_that_waits_for_a_pipe_is_ended(
    repository: Path, tmp_path: Path, what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = git(repository, "rev-parse", "HEAD:src/parts/part.xacro" if what == "blob" else "HEAD:src").strip()
    around, head = git_module.Repository.around(str(repository)), git(repository, "rev-parse", "HEAD").strip()
    place = (
        repository / ".git" / "HEAD"
        if what == "HEAD"
        else repository / ".git" / "objects" / name[:2] / name[2:]
    )
    place.unlink()
    os.mkfifo(place)
    monkeypatch.setattr(git_module, "_SECONDS", 0.5)
    out = str(tmp_path / "out")
    use: dict[str, Callable[[], object]] = {
        "HEAD": lambda: around.commit("HEAD"),
        "tree": lambda: git_module.extract(around, head, out),
        "blob": lambda: git_module._write(around, out, [("a", name)], []),  # it is one after it was listed
    }
    with pytest.raises(KbotError, match=r"git has printed nothing for 0\.5 s"):
        use[what]()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
def test_a_pipe_in_place_of_a_large_file_is_not_read(repository: Path) -> None:
    digest = 64 * "a"
    (repository / "mesh.stl").write_text(
        f"version https://git-lfs.github.com/spec/v1\noid sha256:{digest}\nsize 5\n"
    )
    commit(repository)
    place = repository / ".git" / "lfs" / "objects" / "aa" / "aa" / digest
    place.parent.mkdir(parents=True)
    os.mkfifo(place)
    with opened("HEAD:src/robot") as found:
        assert isinstance(found, Description)
        assert Path(found.tree, "mesh.stl").read_text().startswith("version https://git-lfs")
