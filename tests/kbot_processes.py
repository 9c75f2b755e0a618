"""Runs `kbot` in processes that are forked from this one, which imports KBot only once.

    kbot_processes.py SOCKET

Starting Python and importing KBot takes longer than most verbs. A request is a line of JSON with the three
standard streams attached; the answer is a line of JSON. The children are measured from here and not from the
test runner, because Linux starts a child's peak memory at that of its parent, and the runner's own is large.
"""

import gc
import json
import os
import resource
import socket
import sys
import time
from importlib import import_module

from kbot.cli import main, start

CPU_S = 10
"""CPU time in which a verb must have answered a hostile file."""

DATA_BYTES = 4 << 30
"""The system stops a child at this size, which fails its test anyway, before it fills the memory."""


def become_kbot(streams: list[int], words: list[str], cwd: str, env: dict[str, str]) -> None:
    """Give this process the streams, arguments, folder, environment and limits of a `kbot` process."""
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    # the streams of the parent remember whether its files can seek
    sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w", buffering=1)
    sys.argv = ["kbot", *words]
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    # the hard limit is a second later, for a child that ignores SIGXCPU
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 1))
    if sys.platform == "linux":
        resource.setrlimit(resource.RLIMIT_DATA, (DATA_BYTES, DATA_BYTES))


def serve(requests: socket.socket) -> None:
    import_s = time.process_time()
    request, streams = b"", list[int]()
    while True:
        part, attached, _, _ = socket.recv_fds(requests, 1 << 16, 3)
        if not part:
            break
        request += part
        streams += attached
        if not request.endswith(b"\n"):
            continue
        child = os.fork()
        if child == 0:
            requests.close()
            become_kbot(streams, **json.loads(request))
            start.main()
            sys.exit()
        for stream in streams:
            os.close(stream)
        _, status, usage = os.wait4(child, 0)
        answer = {
            "status": os.waitstatus_to_exitcode(status),
            "cpu_s": import_s + usage.ru_utime + usage.ru_stime,
            "peak_bytes": usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024),
        }
        requests.sendall(json.dumps(answer).encode() + b"\n")
        request, streams = b"", []


IMPORTED_LATER = ("checks.rules", "render.glb", "ros.graph", "sensors", "sim.simulation", "workbench.serve")
"""What verbs import only when they need it."""

if __name__ == "__main__":
    for place, _ in main.VERBS.values():
        import_module(place.split(":")[0])
    for name in IMPORTED_LATER:
        import_module(f"kbot.{name}")
    gc.freeze()  # else every child copies the memory of all modules when it collects garbage at its end
    serve(socket.socket(fileno=int(sys.argv[1])))
