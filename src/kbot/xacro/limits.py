"""Limits on descriptions. Exceeding one is an error (X190 to X199). Python code can raise them."""

from __future__ import annotations


class Limits:
    """Limits of one expansion. To raise one, pass `Limits(steps=…)`. Do not change an instance.

    With the defaults, every verb answers a hostile description within 10 s of CPU time and 1 GB of memory.
    The largest of 168 real robots needs 1,000 nodes and 40,000 characters.

    file_bytes      Size of each file.
    nesting         Depth of elements, macro calls and includes together.
    includes        Depth of files that include one another.
    macro_calls     Depth of macros that call one another.
    nodes           Elements and texts of the result and of everything evaluated for it.
    text            Characters of all evaluated text, and of the result.
    steps           Work of expressions. A step takes at most about a microsecond and 64 bytes.
    length          Length of one string, list, tuple, set or dictionary.
    bits            Size of one integer.
    function_depth  Depth of lambda functions and iterators that call one another.
    errors          Errors after which expansion stops.
    """

    __slots__ = (
        "bits",
        "errors",
        "file_bytes",
        "function_depth",
        "includes",
        "length",
        "macro_calls",
        "nesting",
        "nodes",
        "steps",
        "text",
    )

    def __init__(
        self,
        *,
        file_bytes: int = 32 * 1024 * 1024,
        nesting: int = 1000,
        includes: int = 100,
        macro_calls: int = 500,
        nodes: int = 200_000,
        text: int = 16 * 1024 * 1024,
        steps: int = 5_000_000,
        length: int = 4_000_000,
        bits: int = 32_768,
        function_depth: int = 100,
        errors: int = 200,
    ) -> None:
        self.file_bytes = file_bytes
        self.nesting = nesting
        self.includes = includes
        self.macro_calls = macro_calls
        self.nodes = nodes
        self.text = text
        self.steps = steps
        self.length = length
        self.bits = bits
        self.function_depth = function_depth
        self.errors = errors

    def __repr__(self) -> str:
        return f"Limits({', '.join(f'{name}={getattr(self, name)}' for name in self.__slots__)})"


DEFAULT = Limits()
