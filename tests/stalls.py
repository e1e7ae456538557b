#!/usr/bin/env python3
"""How long the machine stood still while tests ran.

Usage: stalls.py [--accounts FILE] CORE FILE

Sleeps on that core, 50 ms at a time, and ends with the process that has started it. Each sleep that takes longer than 100 ms
becomes a line of FILE. Its three numbers are in seconds: when it began (CLOCK_MONOTONIC), how long it took, and how long the core
did nothing meanwhile, but for the 50 ms.
A core that computes keeps this process waiting, too, but then the kernel's accounts have that time. A core that does nothing
although a process wants to run stands still: its virtual machine has no time, or is stopped.
--accounts  what the kernel has counted for each core (default: /proc/stat)
"""

import argparse
import ctypes
import os
import pathlib
import signal
import subprocess
import sys
import time

BEAT = 0.05  # s: with one reading of the accounts it costs 4 to 10 ms of a core in each second
NOTED = 0.1  # s: sleeps that take longer are lines of the file
# The shortest stall that counts. Measured for 86 minutes on a virtual machine of two cores with a load of 3 to 25: tests, builds and
# the benchmark, whose threads have real-time priorities. 648 sleeps took longer than 50 ms, 146 longer than 250 ms, and one
# 2,663 ms. For all but 77 ms at most, the core had worked: load alone reaches a third of this bound.
BOUND = 0.25  # s
STALLED = 3  # tests of a build that may run again because of a stall
PR_SET_PDEATHSIG = 1
ENVIRONMENT = "PLCHOST_STALLS"  # the file, for cases.py
SETTLED = 0.5  # s: by then a core that goes on has written its line


def worked(accounts, core):
    """For so many seconds that core has done anything since it began."""
    user, nice, system, _, _, interrupts, soft_interrupts = map(int, next(
        line for line in os.pread(accounts, 1 << 16, 0).decode().splitlines() if line.startswith(f"cpu{core} ")).split()[1:8])
    return (user + nice + system + interrupts + soft_interrupts) / os.sysconf("SC_CLK_TCK")


def watch(core, file, accounts):
    parent = os.getppid()
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    os.sched_setaffinity(0, {core})
    told = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    at, work = time.monotonic(), worked(accounts, core)
    while os.getppid() == parent:
        time.sleep(BEAT)
        began, at, before, work = at, time.monotonic(), work, worked(accounts, core)
        if at - began > NOTED:
            os.write(told, f"{began:.3f} {at - began:.3f} {max(0, at - began - BEAT - (work - before)):.3f}\n".encode())


class Stalls:
    """The lines of all cores, from the beginning of a `with` to its end."""

    def __init__(self, file):
        self.file, self.processes = pathlib.Path(file), []

    def __enter__(self):
        self.file.write_text("", encoding="ascii")
        self.began = time.monotonic()
        os.environ[ENVIRONMENT] = str(self.file.resolve())
        self.processes = [subprocess.Popen([sys.executable, __file__, str(core), self.file], stdin=subprocess.DEVNULL)
                          for core in sorted(os.sched_getaffinity(0))]
        return self

    def __exit__(self, *_):
        for process in self.processes:
            process.terminate()
            process.wait()

    def summary(self):
        """One line: how calm the machine was."""
        ended = [process for process in self.processes if process.poll() is not None]
        if ended:
            return f"not measured on {len(ended)} of {len(self.processes)} cores"
        lengths = [still for _, _, still in stalls_in(self.file)]
        return (f"{len(lengths)} of at least {milliseconds(BOUND)} in {time.monotonic() - self.began:,.0f} s, "
                f"{milliseconds(sum(lengths))} together, the longest {milliseconds(max(lengths, default=0))}")


def stalls_in(file):
    """Each one: between which times it was, and its length. Those of several cores at one time are one, as long as the longest."""
    lines = (map(float, line.split()) for line in file.read_text(encoding="ascii").splitlines())
    stalls = []
    for begin, end, still in sorted((began, began + slept, still) for began, slept, still in lines if still >= BOUND):
        if stalls and begin <= stalls[-1][1]:
            begin, other_end, other_still = stalls.pop()
            end, still = max(end, other_end), max(still, other_still)
        stalls.append((begin, end, still))
    return stalls


def longest_stall(file, began, ended):
    """Of those between two times, in seconds; 0: there was none."""
    return max((still for begin, end, still in stalls_in(file) if begin < ended and end > began), default=0)


def milliseconds(seconds):
    return f"{seconds * 1000:,.0f} ms"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--accounts", default="/proc/stat")
    parser.add_argument("core", type=int)
    parser.add_argument("file")
    options = parser.parse_args()
    watch(options.core, options.file, os.open(options.accounts, os.O_RDONLY))


if __name__ == "__main__":
    main()
