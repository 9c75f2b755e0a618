"""Names of a package that are imported when they are first used: for start-up time."""

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazy_names(package: str, homes: "Mapping[str, str]") -> "Callable[[str], object]":
    """The `__getattr__` of a package. `homes` are its names, each with the module of the package that has it.

    Raises:
        AttributeError: when called with a name that the package does not have.
    """

    def get(name: str) -> object:
        import sys
        from importlib import import_module  # lazy: the start of `kbot expand` counts in milliseconds

        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value: object = getattr(import_module(f"{package}.{homes[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return get
