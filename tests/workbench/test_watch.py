"""Detection of changed files."""

import asyncio
import os
import time
from pathlib import Path

from kbot.workbench.serving.file_watcher import Watcher


def wait_for_change(watcher: Watcher, change: object) -> None:
    async def run() -> None:
        waiting = asyncio.create_task(watcher.changed())
        await asyncio.sleep(0)
        assert callable(change)
        change()
        await asyncio.wait_for(waiting, 60)

    asyncio.run(run())


def test_writes_new_and_deleted_files_are_detected(tmp_path: Path) -> None:
    file, included = tmp_path / "a", tmp_path / "b"
    file.write_text("1")
    watcher = Watcher([str(file), str(included)], time.time_ns())
    wait_for_change(watcher, lambda: file.write_text("22"))
    wait_for_change(watcher, lambda: included.write_text("1"))
    wait_for_change(watcher, lambda: included.unlink())
    moved = tmp_path / "c"
    moved.write_text("33")
    wait_for_change(watcher, lambda: moved.replace(file))


def test_a_change_between_reading_and_watching_is_detected(tmp_path: Path) -> None:
    file, other = tmp_path / "a", tmp_path / "b"
    file.write_text("1")
    watcher = Watcher([str(file)], time.time_ns())
    file.write_text("22")
    watcher.watch([str(file), str(other)], time.time_ns())
    wait_for_change(watcher, lambda: None)


def test_a_change_after_reading_is_detected_for_files_watched_later(tmp_path: Path) -> None:
    file, included = tmp_path / "a", tmp_path / "b"
    read = time.time_ns()
    for entry in (file, included):
        entry.write_text("1")
        os.utime(entry, ns=(read, read - 1_000_000))
    watcher = Watcher([str(file)], read)
    included.write_text("2")
    os.utime(included, ns=(read, read + 1_000_000))
    watcher.watch([str(file), str(included)], read)
    wait_for_change(watcher, lambda: None)


def test_an_impossible_file_name_counts_as_missing(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_text("1")
    watcher = Watcher([str(file), f"{tmp_path}/\0", f"{tmp_path}/\ud800"], time.time_ns())
    wait_for_change(watcher, lambda: file.write_text("22"))
