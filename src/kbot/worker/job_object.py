"""Ends the children of this process when it ends. On Windows, a job object does this.

The system terminates the processes of a job when its last handle is closed, as at the end of this process:
JOB_OBJECT_LIMIT_KILL_ON_JOB_CLOSE in
https://learn.microsoft.com/en-us/windows/win32/api/winnt/ns-winnt-jobobject_basic_limit_information
What a process in a job starts is in the job too:
https://learn.microsoft.com/en-us/windows/win32/procthread/job-objects
"""

from __future__ import annotations

import ctypes
import sys
from functools import cache
from typing import Any

_KILL_ON_JOB_CLOSE = 0x2000
_EXTENDED_LIMITS = 9
"""JobObjectExtendedLimitInformation, for SetInformationJobObject."""
_SET_QUOTA_AND_TERMINATE = 0x0100 | 0x0001
"""The rights to a process that AssignProcessToJobObject needs."""


class _BasicLimits(ctypes.Structure):
    """JOBOBJECT_BASIC_LIMIT_INFORMATION."""

    _fields_ = (
        ("PerProcessUserTimeLimit", ctypes.c_int64),
        ("PerJobUserTimeLimit", ctypes.c_int64),
        ("LimitFlags", ctypes.c_uint32),
        ("MinimumWorkingSetSize", ctypes.c_size_t),
        ("MaximumWorkingSetSize", ctypes.c_size_t),
        ("ActiveProcessLimit", ctypes.c_uint32),
        ("Affinity", ctypes.c_size_t),
        ("PriorityClass", ctypes.c_uint32),
        ("SchedulingClass", ctypes.c_uint32),
    )


class ExtendedLimits(ctypes.Structure):
    """JOBOBJECT_EXTENDED_LIMIT_INFORMATION."""

    _fields_ = (
        ("BasicLimitInformation", _BasicLimits),
        ("IoInfo", ctypes.c_uint64 * 6),
        ("MemoryLimits", ctypes.c_size_t * 4),
    )


def add(pid: int) -> None:
    """Let a child end with this process. If the system refuses that, it still ends unless KBot is killed."""
    job, kernel = _job(), _kernel()
    process = kernel.OpenProcess(_SET_QUOTA_AND_TERMINATE, False, pid)
    if process:  # else it has ended
        kernel.AssignProcessToJobObject(ctypes.c_void_p(job), ctypes.c_void_p(process))
        kernel.CloseHandle(ctypes.c_void_p(process))


@cache
def _job() -> int | None:
    """The job of the children. Its handle is never closed, and no child inherits it."""
    kernel = _kernel()
    job: int | None = kernel.CreateJobObjectW(None, None)
    limits = ExtendedLimits()
    limits.BasicLimitInformation.LimitFlags = _KILL_ON_JOB_CLOSE
    kernel.SetInformationJobObject(
        ctypes.c_void_p(job), _EXTENDED_LIMITS, ctypes.byref(limits), ctypes.sizeof(limits)
    )
    return job


@cache
def _kernel() -> Any:  # noqa: ANN401 - ctypes has no types for the functions of a library
    if sys.platform != "win32":
        raise NotImplementedError("only Windows has job objects")
    kernel = ctypes.WinDLL("kernel32")
    for function in (kernel.CreateJobObjectW, kernel.OpenProcess):
        function.restype = ctypes.c_void_p  # a handle; ctypes would take it for an int of 32 bits
    return kernel
