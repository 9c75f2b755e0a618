"""Lets a user's program import the modules beside it, each time as they are now."""

from __future__ import annotations

import importlib
import linecache
import sys
from types import ModuleType

from kbot.sim.user_code import UserCode


class OwnImports:
    """A `with` block in which a program imports modules from its own folder. Its end forgets them."""

    def __init__(self, code: UserCode) -> None:
        self._code = code
        self._known = frozenset(sys.modules)
        self._imported: tuple[str, ...] = ()
        self._bytecode_was_off = False

    @property
    def files(self) -> tuple[str, ...]:
        """The modules of the last block, and those that were imported so far in the current one."""
        return (*self._imported, *(file for _, file in self._modules()))

    def __enter__(self) -> None:
        self._known = frozenset(sys.modules)
        importlib.invalidate_caches()
        linecache.checkcache()
        sys.path.insert(0, str(self._code.folder))
        # the cache compares times in whole seconds, so a second save in the same second would be missed
        self._bytecode_was_off, sys.dont_write_bytecode = sys.dont_write_bytecode, True

    def __exit__(self, *error: object) -> None:
        sys.dont_write_bytecode = self._bytecode_was_off
        folder = str(self._code.folder)
        if folder in sys.path:  # the program may have changed it
            sys.path.remove(folder)
        modules = self._modules()
        self._imported = tuple(file for _, file in modules)
        for name, _ in modules:
            del sys.modules[name]

    def _modules(self) -> list[tuple[str, str]]:
        """Name and file of each module of the program's folder that the block has imported."""
        found = []
        for name, module in tuple(sys.modules.items()):
            # not getattr, which would load the contents of a lazy module
            file = vars(module).get("__file__") if isinstance(module, ModuleType) else None
            if name not in self._known and isinstance(file, str) and self._code.has(file):
                found.append((name, file))
        return found
