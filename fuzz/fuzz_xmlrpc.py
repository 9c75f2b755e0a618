"""Coverage-guided fuzzing of the XML-RPC reader, which reads messages from ROS 1 peers.

    pip install atheris
    python fuzz/fuzz_xmlrpc.py CORPUS_FOLDER [-runs=1000000]

For any bytes, the reader returns values that are not nested too deeply, or raises ValueError or the fault
that the bytes describe. Anything else is a finding. tests/bridges/test_ros1_access.py has the inputs that
failed.
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
    """A random element with children, or text."""
    if level > 200 or provider.ConsumeIntInRange(0, 3) == 0:
        return provider.ConsumeBytes(12)
    tag = provider.PickValueInList(list(TAGS)).encode()
    inside = b"".join(element(provider, level + 1) for _ in range(provider.ConsumeIntInRange(1, 3)))
    return b"<" + tag + b">" + inside + b"</" + tag + b">"


def document(data: bytes) -> bytes:
    """The input itself, or a response with random elements."""
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
