"""Coverage-guided fuzzing of the reader of XML-RPC, which reads whatever a ROS 1 peer sends.

    pip install atheris
    python fuzz/fuzz_xmlrpc.py CORPUS_FOLDER [-runs=1000000]

Whatever the bytes, the reader returns values that are not nested too deeply, or raises ValueError or
the fault that the bytes describe; anything else is a finding. What was found is kept in
tests/bridges/test_ros1_access.py.
"""

import sys

import atheris

with atheris.instrument_imports(include=["xmlrpc.client", "kbot.ros.bridges.ros1.rpc"]):
    import xmlrpc.client

    from kbot.ros.bridges.ros1.rpc import DEEPEST, read_answer

TAGS = (
    *("params", "param", "fault", "methodName", "value", "array", "data", "struct", "member", "name"),
    *("nil", "boolean", "int", "i8", "double", "bigdecimal", "string", "base64", "dateTime.iso8601", "a:int"),
)


def depth(value: object) -> int:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return 1 + max(map(depth, inner), default=0)


def element(provider: atheris.FuzzedDataProvider, level: int) -> bytes:
    """An element with others in it, or a text."""
    if level > 200 or provider.ConsumeIntInRange(0, 3) == 0:
        return provider.ConsumeBytes(12)
    tag = provider.PickValueInList(list(TAGS)).encode()
    inside = b"".join(element(provider, level + 1) for _ in range(provider.ConsumeIntInRange(1, 3)))
    return b"<" + tag + b">" + inside + b"</" + tag + b">"


def document(data: bytes) -> bytes:
    """The bytes themselves, or an answer with some elements."""
    provider = atheris.FuzzedDataProvider(data)
    if provider.ConsumeBool():
        return provider.ConsumeBytes(4_000)
    return b"<methodResponse>" + element(provider, 0) + b"</methodResponse>"


def one_input(data: bytes) -> None:
    try:
        values = read_answer(document(data))
    except (ValueError, xmlrpc.client.Fault):
        return
    assert depth(values) <= DEEPEST


if __name__ == "__main__":
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
