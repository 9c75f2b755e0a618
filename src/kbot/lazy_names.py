"""The names of packages: imported at their first use, for start-up time, and listed by `dir`."""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazy_names(package: str, homes: "Mapping[str, str]") -> "Callable[[str], object]":
    """Create the `__getattr__` of a package. `homes` has the names, each with the module that defines it.

    The result raises AttributeError for a name that is not in `homes`.
    """

    def get(name: str) -> object:
        import sys
        from importlib import import_module  # imported lazily: each millisecond counts in `kbot expand`

        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value: object = getattr(import_module(f"{package}.{homes[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return get


def public_names(names: "list[str]") -> "Callable[[], list[str]]":
    """Create the `__dir__` of a package from its `__all__`: what a user may use, also before the first use.

    The modules inside the package and what it imports are left out.
    """
    return lambda: sorted(names)
