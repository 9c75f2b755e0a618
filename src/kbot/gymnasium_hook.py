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
        from importlib.util import find_spec  # imported lazily, for a fast start-up

        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is not None and spec.loader is not None:
            execute = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute(module)
                _register()

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec


def _register() -> None:
    from kbot.learn.environments.registration import register

    register()
