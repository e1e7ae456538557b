#!/usr/bin/env python3
"""Runs the cases of one test program in as few processes as possible, and names each case that fails.

Usage: cases.py [--share I/N] [--limit SECONDS] [--results FILE] [--retries FILE] [--skips FILE] [--without PATTERNS] [--kind KIND]
                [--emulator EMULATOR] PROGRAM

One process runs one case after the other. If a case ends the process or exceeds the limit, the case is named, and the
next process continues with the case after it. If a process fails although none of its cases did (a leak), each of them
runs again in a process of its own. A process that a case leaves running is a failure, too.
--share    which cases: each N-th one, from the I-th one on (0 to N-1); GTEST_FILTER chooses among all, as usual
--results  one line per case, separated by tabs: result, seconds, seconds of the stall that excuses its first run, and name.
           Results are passed, failed, skipped and retried
--retries  the tests that may run a second time if they fail (tests/retries.txt). Stalls of the machine are read from $PLCHOST_STALLS
--skips    a list of tests (tests/skips.txt). A case is skipped without being run if its reason there begins with "not run:"
--without  cases that run elsewhere, names with * and ?, separated by colons
--kind     of the build, for these lists: plain, address, thread, threads or emulated
--emulator starts a program that is for another processor
"""

import argparse
import ctypes
import fnmatch
import functools
import os
import pathlib
import re
import selectors
import signal
import subprocess
import sys
import tempfile
import time
import typing

from expected import Expected
from stalls import ENVIRONMENT, SETTLED, STALLED, longest_stall, milliseconds

EVENT = re.compile(rb"\[( RUN      |       OK |  FAILED  |  SKIPPED )\] ([\w./]+)")
RESULTS = {b"       OK ": "passed", b"  FAILED  ": "failed", b"  SKIPPED ": "skipped"}
PR_SET_PDEATHSIG = 1
# tests/run.sh leaves this out of processes that run one case. One that runs many of them pays for it once.
OF_CASES = {**os.environ, "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":detect_stack_use_after_return=1"}


def started(program, emulator):
    return [emulator, program] if emulator else [program]


def list_cases(program, emulator=""):
    cases, suite = [], ""
    # A program that is slow to start is one that hangs.
    said = subprocess.run([*started(program, emulator), "--gtest_list_tests"], check=True, capture_output=True, text=True, timeout=120)
    for line in said.stdout.splitlines():
        name = line.split("#")[0].rstrip()
        if name.startswith("  "):
            cases.append(suite + name.strip())
        elif name.endswith("."):
            suite = name
    return [case for case in cases if "DISABLED_" not in case]


def follow(parent):
    """In the child: ends with the parent, also if that ended before the kernel knew of this."""
    os.setsid()
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)


def members(group):
    """Name and number of the processes of a group that run."""
    found = []
    for file in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            number, name, rest = re.fullmatch(r"(\d+) \((.*)\) (.*)\n", file.read_text(errors="replace"), re.DOTALL).groups()
        except OSError:
            continue  # it has ended
        state, _, its_group = rest.split()[:3]
        if int(its_group) == group and state not in "ZX":
            found.append(f"{name} ({number})")
    return found


class Result(typing.NamedTuple):
    word: str
    began: float
    ended: float
    output: str


class Run:
    """One process, and what it has said about its cases."""

    def __init__(self, command, cases, limit):
        self.cases, self.limit = cases, limit
        self.results = {}
        self.current, self.began = None, time.monotonic()
        self.output, self.line = [], b""
        self.trouble = ""
        with tempfile.NamedTemporaryFile("w", suffix=".flags") as flags:
            flags.write("--gtest_filter=" + ":".join(cases) + "\n")
            flags.flush()
            self.process = subprocess.Popen(
                [*command, "--gtest_flagfile=" + flags.name, "--gtest_brief=0"], env=OF_CASES,
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=functools.partial(follow, os.getpid()))
            try:
                self.watch()
            finally:
                self.end_group()

    def watch(self):
        pipe = self.process.stdout
        os.set_blocking(pipe.fileno(), False)
        with selectors.DefaultSelector() as selector:
            selector.register(pipe, selectors.EVENT_READ)
            while True:
                ended = self.process.poll() is not None
                at_end = False
                if selector.select(0 if ended else 0.2):
                    at_end = self.take(pipe)
                elif ended:
                    break
                if at_end:
                    selector.unregister(pipe)
                    self.process.wait()
                    break
                if time.monotonic() - self.began > self.limit:
                    self.trouble = f"takes longer than {self.limit} s"
                    break
        code = self.process.returncode
        if not self.trouble and (self.current or code != (1 if self.failed() else 0)):
            self.trouble = "ended its process " + (f"by signal {-code}" if code < 0 else f"with exit code {code}")
        if self.current:
            self.results[self.current] = Result("failed", self.began, time.monotonic(), self.text())

    def failed(self):
        return [case for case, result in self.results.items() if result.word == "failed"]

    def text(self):
        return b"".join([*self.output, self.line]).decode(errors="replace")

    def take(self, pipe):
        """The text written since; true at the end of all that will be."""
        block = pipe.read(1 << 16)
        if block == b"":
            return True
        *lines, self.line = (self.line + (block or b"")).split(b"\n")
        for line in lines:
            self.take_line(line + b"\n")
        return False

    def take_line(self, line):
        found = EVENT.search(line)
        name = found.group(2).decode() if found else ""
        if found and found.group(1) == b" RUN      " and name in self.cases:
            self.current, self.output = name, [line]  # it began when the one before it ended: this line may be read late
            return
        self.output.append(line)
        if found and name == self.current and found.group(1) in RESULTS:
            self.results[name] = Result(RESULTS[found.group(1)], self.began, time.monotonic(), self.text())
            self.current, self.began, self.output = None, time.monotonic(), []

    def end_group(self):
        """Ends the process and its children. Of one that has ended, none should be left."""
        children_of = self.process.pid
        ended_alone = self.process.poll() is not None
        left = members(children_of) if ended_alone else []
        patience = time.monotonic() + 5
        while left and time.monotonic() < patience:  # a sanitizer's symbolizer ends when its pipe does
            time.sleep(0.05)
            left = members(children_of)
        try:
            os.killpg(children_of, signal.SIGKILL)
            if left and not self.trouble:
                self.trouble = f"left processes running: {', '.join(left)}"
        except ProcessLookupError:
            pass
        self.process.wait()
        self.process.stdout.close()


class Share:
    def __init__(self, command, limit):
        self.command, self.limit = command, limit
        self.results = {}

    def run(self, cases):
        left = list(cases)
        while left:
            run = Run(self.command, left, self.limit)
            self.results.update(run.results)
            if run.trouble and run.current:
                print(f"FAILED: {run.current} {run.trouble}")
            elif run.trouble:
                sound = [case for case in run.cases if case not in run.failed()]
                print(f"the process {run.trouble}, without a word of which case: each of {len(sound)} runs alone")
                self.find_the_guilty(sound, run)
            for case in left if not run.trouble else []:
                self.results.setdefault(case, Result("failed", 0, 0, "it did not run"))
            left = [case for case in left if case not in self.results]

    def find_the_guilty(self, cases, run):
        guilty = False
        for case in cases:
            alone = Run(self.command, [case], self.limit)
            self.results[case] = alone.results.get(case, Result("failed", 0, 0, ""))
            if alone.trouble:
                guilty = True
                self.results[case] = self.results[case]._replace(word="failed", output=alone.text())
                print(f"FAILED: {case} {alone.trouble}")
        if cases and not guilty:
            print(f"each of them succeeds alone: the last one, {cases[-1]}, stands for them")
            self.results[cases[-1]] = self.results[cases[-1]]._replace(word="failed", output=run.text())


def stalls_of(results):
    """The longest stall of the machine during each of these cases; those without one are left out."""
    file = pathlib.Path(os.environ.get(ENVIRONMENT, os.devnull))
    if results:
        time.sleep(SETTLED)
    longest = {case: longest_stall(file, result.began, result.ended) for case, result in results.items()}
    return {case: seconds for case, seconds in longest.items() if seconds}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--share", default="0/1")
    parser.add_argument("--limit", type=float, default=180)
    parser.add_argument("--results")
    parser.add_argument("--retries")
    parser.add_argument("--skips")
    parser.add_argument("--without", default="")
    parser.add_argument("--kind", default="plain")
    parser.add_argument("--emulator", default="")
    parser.add_argument("program")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))

    share, of = map(int, options.share.split("/"))
    elsewhere = options.without.split(":")
    cases = [case for case in list_cases(options.program, options.emulator) if not any(fnmatch.fnmatchcase(case, pattern) for pattern in elsewhere)][share::of]
    skips = Expected(options.skips, options.kind)
    left_out = {case: skips.reason(case, "not run:") for case in cases if skips.reason(case, "not run:")}
    command = started(options.program, options.emulator)
    work = Share(command, options.limit)
    work.run([case for case in cases if case not in left_out])
    work.results.update({case: Result("skipped", 0, 0, reason) for case, reason in left_out.items()})

    retries = Expected(options.retries, options.kind)
    failed = [case for case, result in work.results.items() if result.word == "failed"]
    stalled = stalls_of({case: work.results[case] for case in failed if not retries.second_run(case) and retries.may_stall(case)})
    for case in failed:
        if not (retries.second_run(case) or (case in stalled and len(stalled) <= STALLED)):
            continue
        print(f"again: {case}{f', as the machine stood still for {milliseconds(stalled[case])}' if case in stalled else ''}\n{work.results[case].output}")
        second = Share(command, options.limit)
        second.run([case])
        if second.results[case].word == "passed":
            work.results[case] = second.results[case]._replace(word="retried")

    if options.results:
        with open(options.results, "w", encoding="utf-8") as file:
            for case, result in work.results.items():
                file.write(f"{result.word}\t{result.ended - result.began:.3f}\t{stalled.get(case, 0):.3f}\t{case}\n")
    for result in work.results.values():
        print(*(line + "\n" for line in result.output.splitlines() if line.startswith("further round: ")), sep="", end="")
    failed = [case for case, result in work.results.items() if result.word == "failed"]
    for case in failed:
        print(f"---- {case}\n{work.results[case].output}")
    for case in failed:
        print(f"FAILED: {case}")
    print(f"{len(work.results) - len(failed)} of {len(cases)} cases passed")
    return 1 if failed or not cases else 0


if __name__ == "__main__":
    sys.exit(main())
