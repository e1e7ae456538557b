#!/usr/bin/env python3
"""Runs the tests of a build by ctest, and says at the end what failed, what was skipped and what needed a second run.

Usage: suite.py [--jobs N] BUILD [CTEST_OPTION...]

A test that fails runs again if tests/retries.txt names it, or if the machine stood still while it ran (stalls.py). The latter is
printed with what it said at first. More than three of these fail the run. A test that is skipped or left out by the build
fails the run if tests/skips.txt does not name it. So does one that needed a further round without being listed. So does a case
of a test program that ctest does not have exactly once, and so does a line of these two lists that matches no test. Shares of
whole programs (cases.py) count with each of their cases. The last lines name the tests that took most processor time, and say how
long the machine stood still.
"""

import argparse
import fnmatch
import itertools
import json
import pathlib
import re
import subprocess
import sys
import threading
import time
import xml.etree.ElementTree as ElementTree

from cases import list_cases
from expected import LEFT_OUT, Expected
from processor_time import ProcessorTime
from stalls import SETTLED, STALLED, Stalls, longest_stall, milliseconds
from when_run import WhenRun

OUTPUT_LINES = 40  # of a failed case, repeated at the end
# A test that measures time may have rounds of its own. It says so in its output at each round after the first.
FURTHER_ROUND = re.compile(r"^further round: (\S+): (.*)$", re.MULTILINE)
ONE_CASE = "--gtest_filter="
PROGRAM = re.compile(r"TEST_EXECUTABLE \[==\[(.*?)\]==\]")  # in what gtest_discover_tests writes
COSTLY = 20  # tests named with their processor time
SLOW = 3  # second runs in a build whose programs are all slow
HERE = pathlib.Path(__file__).resolve().parent


def emulator_of(build):
    """The program that starts those of this build; empty: they are for this processor."""
    found = re.search(r"^CMAKE_CROSSCOMPILING_EMULATOR:\w+=(.*)$", (build / "CMakeCache.txt").read_text(encoding="utf-8"), re.MULTILINE)
    return found.group(1) if found else ""


def kind_of(build):
    if emulator_of(build):
        return "emulated"
    cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
    found = re.search(r"^SANITIZER:\w+=(.*)$", cache, re.MULTILINE)
    threads = "threads" if re.search(r"^PLCHOST_ALL_THREADS:\w+=ON$", cache, re.MULTILINE) else "thread"
    return {"": "plain", "thread": threads}.get(found.group(1) if found else "", "address")


class Suite:
    def __init__(self, build, jobs, options, stalls):
        self.build, self.jobs, self.options, self.stalls = build, jobs, options, stalls
        self.shares = build / "Testing" / "shares"
        self.outputs = {}  # of what failed in its last run
        self.first_outputs = {}  # of what failed in its first one
        self.rounds = []  # further ones: test and reason
        self.seconds = {}  # of processors, by test
        self.ran = {}  # when it began and ended in its first run, by test
        self.stalled_cases = {}  # of shares, that ran again because of a stall: its seconds

    def run(self):
        """The result of each test and case; None: ctest ran none."""
        self.shares.mkdir(parents=True, exist_ok=True)
        for old in self.shares.iterdir():
            old.unlink()
        return self.ctest("suite.xml", self.options)

    def run_again(self, names):
        either = "|".join(re.escape(name) for name in names)
        return self.ctest("again.xml", [*self.options, "-R", f"^({either})$"]) or {}

    def ctest(self, report, options):
        file = (self.build / "Testing" / report).resolve()
        file.unlink(missing_ok=True)
        # Alone: the first ctest after a build finds the cases of each program, and writes them into files.
        commands = dict(self.listed(options))
        with subprocess.Popen(["ctest", "--test-dir", self.build, "--output-on-failure", "-j", str(self.jobs), "--no-tests=error",
                               "--test-output-size-passed", "65536", "--output-junit", file, *options], stdout=subprocess.PIPE) as process:
            times, when = ProcessorTime(process.pid, commands), WhenRun(commands)
            said = threading.Thread(target=when.follow, args=(process.stdout, sys.stdout.buffer))
            said.start()
            while process.poll() is None:
                times.look()
                time.sleep(0.2)
            said.join()
        self.ran = {**when.ran, **self.ran}
        for name, seconds in times.seconds().items():
            self.seconds[name] = max(seconds, self.seconds.get(name, 0))
        if not file.exists():
            return None
        results = {}
        for test in ElementTree.parse(file).getroot().iter("testcase"):
            name, status = test.get("name"), test.get("status")
            self.outputs.pop(name, None)
            output = test.findtext("system-out", "")
            self.rounds += FURTHER_ROUND.findall(output)
            if status == "fail":
                self.outputs[name] = output
                self.first_outputs.setdefault(name, output)
            cases = self.cases_of(name)
            self.first_outputs.update({case: output for case, result in cases.items() if result == "retried"})
            results.update(cases)
            # A share stands for itself if it could not tell which of its cases failed.
            if not cases or (status == "fail" and "failed" not in cases.values()):
                results[name] = {"run": "passed", "disabled": "skipped", "notrun": "skipped"}.get(status, "failed")
        return results

    def listed(self, options):
        """Name and command of each test."""
        said = subprocess.run(["ctest", "--test-dir", self.build, "--show-only=json-v1", *options], check=False, capture_output=True, text=True)
        try:
            tests = json.loads(said.stdout)["tests"]
        except ValueError:
            return []
        return [(test["name"], test["command"]) for test in tests if "command" in test]

    def wrongly_listed(self):
        """Cases of the test programs for which ctest has no test, or two: it keeps what it once found in files."""
        programs = {}
        for file in self.build.rglob("*_include.cmake"):
            for program in PROGRAM.findall(file.read_text(encoding="utf-8")):
                programs[program] = []
        for _, command in self.listed([]):
            for before, word in itertools.pairwise(command):  # an emulator may stand before the program
                case = word.removeprefix(ONE_CASE)
                if word.startswith(ONE_CASE) and not set(case) & set("*?:"):
                    programs.setdefault(before, []).append(case)
        wrong = []
        for program, cases in programs.items():
            try:
                there = set(list_cases(program, emulator_of(self.build)))
            except (OSError, subprocess.SubprocessError) as error:
                wrong.append(f"{program} ({error})")
                continue
            # The disabled ones are programs of others.
            wrong += [case for case in {*cases, *there}
                      if "DISABLED_" not in case and not any(fnmatch.fnmatchcase(case, pattern) for pattern in self.left_out())
                      and (cases.count(case) != 1 or case not in there)]
        return sorted(wrong)

    def of_no_test(self, *lists):
        """Lines that name no test of this build, be it chosen for this run or not, and nothing that it leaves out."""
        names = [name for name, _ in self.listed([])]
        return [line for entries in lists for line in entries.of_no_test(names, self.left_out())]

    def left_out(self):
        """Tests, patterns of tests, and folders that the build does not have (plchost_left_out in CMakeLists.txt)."""
        file = self.build / "tests" / "left_out.txt"
        return file.read_text(encoding="utf-8").split() if file.exists() else []

    def print_costly(self):
        """Of all tests to a file, of the first to standard output."""
        lines = [f"{seconds:8.1f} s {name}\n" for name, seconds in
                 sorted([*self.seconds.items(), ("(all)", sum(self.seconds.values()))], key=lambda test: -test[1])]
        (self.build / "Testing" / "processor_time.txt").write_text("".join(lines), encoding="utf-8")
        print("processor time:\n" + "".join(lines[:COSTLY + 1]), end="")

    def cases_of(self, share):
        file = self.shares / f"{share}.txt"
        if not file.exists():
            return {}
        lines = [line.split("\t") for line in file.read_text(encoding="utf-8").splitlines()]
        self.stalled_cases.update({case: float(stall) for result, _, stall, case in lines if result == "retried" and float(stall)})
        return {case: result for result, _, _, case in lines}

    def stalls_of(self, names):
        """The longest stall of the machine during the first run of each of these; those without one are left out."""
        if names:
            time.sleep(SETTLED)
        longest = {name: longest_stall(self.stalls.file, *self.ran[name]) for name in names if name in self.ran}
        return {name: seconds for name, seconds in longest.items() if seconds}


def shortened(lines):
    left_out = len(lines) - OUTPUT_LINES
    if left_out <= 1:
        return lines
    half = OUTPUT_LINES // 2
    return [*lines[:half], f"... ({left_out} lines)", *lines[-half:]]


def end_of(output):
    """First and last lines of a failed test's output; of a GoogleTest program those of each case that failed."""
    lines, case, failed = output.splitlines(), [""], []
    for line in lines:
        case = [line] if line.startswith("[ RUN ") else [*case, line]
        if line.startswith("FAILED: "):  # said by cases.py
            failed.append(line)
        if line.startswith("[  FAILED  ]") and case[0].startswith("[ RUN ") and line.endswith(" ms)"):
            failed += shortened(case)
        if line.startswith(("[  FAILED  ]", "[       OK ]", "[  SKIPPED ]")):
            case = [""]
    return failed if any(line.startswith("[ RUN ") for line in lines) else shortened(lines)


def skipped(names, skips):
    """Each test and its reason; those of one suite that are not run are one line."""
    lines = {}
    for name in names:
        reason = skips.skipped(name) or "NOT EXPECTED (tests/skips.txt)"
        suite = name.split(".")[0] if reason.startswith("not run:") else name
        lines.setdefault((suite, reason), []).append(name)
    return [(cases[0] if len(cases) == 1 else f"{suite}, {len(cases)} cases", reason) for (suite, reason), cases in lines.items()]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("build", type=pathlib.Path)
    options, for_ctest = parser.parse_known_args()
    (options.build / "Testing").mkdir(exist_ok=True)
    with Stalls(options.build / "Testing" / "stalls.txt") as stalls:
        return run(Suite(options.build, options.jobs, for_ctest, stalls))


def run(suite):
    kind = kind_of(suite.build)
    retries, skips = Expected(HERE / "retries.txt", kind), Expected(HERE / "skips.txt", kind)
    results = suite.run()
    if results is None:
        return 1
    failed_once = [name for name, result in results.items() if result == "failed"]
    stalled = suite.stalls_of([name for name in failed_once if not retries.second_run(name) and retries.may_stall(name)])
    again = [name for name in failed_once if retries.second_run(name) or (name in stalled and len(stalled) <= STALLED)]
    for name, result in (suite.run_again(again) if again else {}).items():
        if name in again:  # not a case of a share: cases.py runs these again
            results[name] = "retried" if result == "passed" else "failed"
    stalled.update(suite.stalled_cases)

    named = {what: sorted(name for name, result in results.items() if result == what)
             for what in ("failed", "skipped", "retried")}
    unexpected = [name for name in named["skipped"] if not skips.skipped(name)]
    for name, output in suite.outputs.items():
        print(f"----- {name} failed with:", *end_of(output), sep="\n")
    excused = [name for name in named["retried"] if name in stalled]
    for name in excused:
        print(f"----- {name} failed at first with:", *end_of(suite.first_outputs.get(name, "")), sep="\n")
    for name in named["retried"]:
        still = f"the machine stood still for {milliseconds(stalled[name])} while it ran" if name in stalled else ""
        print(f"second run: {name}: {still or retries.second_run(name)}")
    too_many = sorted(stalled) if len(stalled) > STALLED else []
    for name in too_many:
        print(f"FAILED: {name}: the machine stood still for {milliseconds(stalled[name])} while it ran, and while {len(stalled) - 1} others "
              f"that failed ran: at most {STALLED} may run again")
    slow = [name for name in named["retried"] if name not in stalled and retries.is_slow(name)]
    too_slow = slow if len(slow) > SLOW else []
    for name in too_slow:
        print(f"FAILED: {name}: a second run, as were {len(slow) - 1} others: of those that only a slow build excuses, at most {SLOW}")
    unlisted = [name for name, _ in suite.rounds if retries.reason(name, "rounds") is None]
    for name, what in suite.rounds:
        print(f"further round: {name}: {what}: {retries.reason(name, 'rounds') or 'NOT EXPECTED (tests/retries.txt)'}")
    for name, reason in skipped(named["skipped"], skips):
        print(f"skipped: {name}: {reason}")
    left_out = {name: skips.left_out(name) or "NOT EXPECTED (tests/skips.txt)" for name in suite.left_out()}
    print(f"left out by the build: {len(left_out)}")
    for reason in dict.fromkeys(left_out.values()):
        print(f"left out: {', '.join(name for name, why in left_out.items() if why == reason)}: {reason.removeprefix(LEFT_OUT).strip()}")
    not_left_out = [name for name in left_out if not skips.left_out(name)]
    for name in named["failed"]:
        print(f"FAILED: {name}")
    wrongly_listed = suite.wrongly_listed()
    for name in wrongly_listed:
        print(f"FAILED: {name}: ctest has not exactly one test for it; remove *_tests.cmake in {suite.build}")
    of_no_test = suite.of_no_test(retries, skips)
    for place, pattern in of_no_test:
        print(f"FAILED: {place}: no test matches {pattern}: remove the line, or name the test as it is called")
    suite.print_costly()
    print(f"stalls: {kind}: {suite.stalls.summary()}")
    failed = {*named["failed"], *unexpected, *unlisted, *too_many, *too_slow, *not_left_out, *wrongly_listed, *of_no_test}
    passed = {name for name, result in results.items() if result in ("passed", "retried")} - failed
    print(f"{len(passed)} passed, {len(failed)} failed; {len(named['skipped'])} skipped, "
          f"{len(named['retried'])} in a second run")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
