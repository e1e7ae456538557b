#!/usr/bin/env python3
"""Runs the tests of a build by ctest, and says at the end what failed, what was skipped and what needed a second run.

Usage: suite.py [--jobs N] BUILD [CTEST_OPTION...]

A test that fails runs again only if tests/retries.txt names it. A test that is skipped although tests/skips.txt does not
name it fails the run. Shares of whole programs (cases.py) count with each of their cases.
"""

import argparse
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

from expected import Expected

OUTPUT_LINES = 40  # of a failed case, repeated at the end
HERE = pathlib.Path(__file__).resolve().parent


def kind_of(build):
    found = re.search(r"^SANITIZER:\w+=(.*)$", (build / "CMakeCache.txt").read_text(encoding="utf-8"), re.MULTILINE)
    return {"": "plain", "thread": "thread"}.get(found.group(1) if found else "", "address")


class Suite:
    def __init__(self, build, jobs, options):
        self.build, self.jobs, self.options = build, jobs, options
        self.shares = build / "Testing" / "shares"
        self.outputs = {}  # of what failed in its last run

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
        subprocess.run(["ctest", "--test-dir", self.build, "--output-on-failure", "-j", str(self.jobs), "--no-tests=error",
                        "--output-junit", file, *options], check=False)
        if not file.exists():
            return None
        results = {}
        for test in ElementTree.parse(file).getroot().iter("testcase"):
            name, status = test.get("name"), test.get("status")
            self.outputs.pop(name, None)
            if status == "fail":
                self.outputs[name] = test.findtext("system-out", "")
            cases = self.cases_of(name)
            results.update(cases)
            # A share stands for itself if it could not tell which of its cases failed.
            if not cases or (status == "fail" and "failed" not in cases.values()):
                results[name] = {"run": "passed", "disabled": "skipped", "notrun": "skipped"}.get(status, "failed")
        return results

    def cases_of(self, share):
        file = self.shares / f"{share}.txt"
        if not file.exists():
            return {}
        lines = (line.split("\t") for line in file.read_text(encoding="utf-8").splitlines())
        return {case: result for result, _, case in lines}


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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("build", type=pathlib.Path)
    options, for_ctest = parser.parse_known_args()
    kind = kind_of(options.build)
    retries, skips = Expected(HERE / "retries.txt", kind), Expected(HERE / "skips.txt", kind)

    suite = Suite(options.build, options.jobs, for_ctest)
    results = suite.run()
    if results is None:
        return 1
    again = [name for name, result in results.items() if result == "failed" and retries.reason(name)]
    for name, result in (suite.run_again(again) if again else {}).items():
        results[name] = "retried" if result == "passed" else "failed"

    named = {what: sorted(name for name, result in results.items() if result == what)
             for what in ("failed", "skipped", "retried")}
    unexpected = [name for name in named["skipped"] if skips.reason(name) is None]
    for name, output in suite.outputs.items():
        print(f"----- {name} failed with:", *end_of(output), sep="\n")
    for name in named["retried"]:
        print(f"second run: {name}: {retries.reason(name)}")
    for name in named["skipped"]:
        print(f"skipped: {name}: {skips.reason(name) or 'NOT EXPECTED (tests/skips.txt)'}")
    for name in named["failed"]:
        print(f"FAILED: {name}")
    failed = len(named["failed"]) + len(unexpected)
    print(f"{len(results) - failed} passed, {failed} failed; {len(named['skipped'])} skipped, "
          f"{len(named['retried'])} in a second run")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
