"""Registers the environments of `kbot.learn` with Gymnasium when both are imported, in any order.

Gymnasium 1.0 removed its entry points, so the environments of a package exist after the package is imported.
Importing Gymnasium in `import kbot` would make it ten times as slow.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # as in typing, which is slow to import
if TYPE_CHECKING:
    from importlib.machinery import ModuleSpec
    from types import ModuleType

_NAME = "gymnasium"


def register_with_gymnasium() -> None:
    """Register the environments now if Gymnasium is imported, else as soon as it is."""
    if sys.modules.get(_NAME) is not None:
        _register()
    else:
        sys.meta_path.insert(0, _Finder())


class _Finder:
    """Finds Gymnasium where it is, and lets its loader register the environments at the end."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        if name != _NAME:
            return None
        others = (finder for finder in sys.meta_path if finder is not self)
        specs = (finder.find_spec(name, None, None) for finder in others)
        spec = next((each for each in specs if each is not None), None)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)
                # not before: a program may look for the module without importing it
                if self in sys.meta_path:
                    sys.meta_path.remove(self)
                _register()

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec


def _register() -> None:
    from kbot.learn.environments.registration import register

    register()
