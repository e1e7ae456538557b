#!/usr/bin/env python3
"""Takes the cores from time to time while a command runs, so that races in tests show.

Usage: disturb.py [--priority N] [--busy MS] [--idle MS] COMMAND...

On each core that it may use, a process of SCHED_FIFO computes for so long and then sleeps for so long. Threads below its priority
stand still meanwhile, those of instances, too. A test that fails only now has compared something that it has not waited for. Tests
of lost cycles fail by right: nobody excuses these processes.

Ends with the result of the command. Needs the right to SCHED_FIFO. Example:
  tests/disturb.py tests/suite.py --jobs 8 .build/tests -C whole -LE case -R Debugging
"""

import argparse
import os
import signal
import subprocess
import sys
import time


def take(core, priority, busy, idle):
    """Until the process that has started it is gone."""
    parent = os.getppid()
    os.sched_setaffinity(0, {core})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    while os.getppid() == parent:
        until = time.perf_counter() + busy
        while time.perf_counter() < until:
            pass
        time.sleep(idle)


def start(*arguments):
    child = os.fork()
    if child != 0:
        return child
    try:
        take(*arguments)
    except PermissionError:
        print("disturb.py: no right to SCHED_FIFO", file=sys.stderr)
    os._exit(0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--priority", type=int, default=80, metavar="N", help="of SCHED_FIFO, 1 to 99 (default: 80)")
    parser.add_argument("--busy", type=float, default=3, metavar="MS", help="default: 3")
    parser.add_argument("--idle", type=float, default=9, metavar="MS", help="default: 9")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    asked = parser.parse_args()
    if not asked.command:
        parser.error("no command")
    cores = sorted(os.sched_getaffinity(0))
    children = [start(core, asked.priority, asked.busy / 1000, asked.idle / 1000) for core in cores]
    try:
        return subprocess.run(asked.command, check=False).returncode
    finally:
        for child in children:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


if __name__ == "__main__":
    sys.exit(main())
