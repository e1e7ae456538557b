#!/usr/bin/env python3
"""Builds the programs of STruC++'s own suite with both compilers for Structured Text, runs them, and compares the values.

Usage: proof.py PROGRAMS [--only PATTERN] [--cycles N] [--seconds N] [--write FILE]
PROGRAMS: the folder of plcctl, plchostd and plc-instance. PLCHOST_STRUCPP names the folder of the built compiler, in which the suite
lies. PLCHOST_MATIEC names that of the other one; without it, its columns are empty. Without the suite nothing is proven, and the
exit code is 77. --write: the table of all, between its two comments in FILE (instances/adapters/README.md).

Each source gets a configuration of one task of 10 ms. For each one, and each compiler:
build       plcctl makes an application, which plc-instance checks
runner      the values after each cycle are those of STruC++'s own runner, of the variables of programs whose values that shows
statements  those of the suite about the source (test_*.st) hold: another application makes them itself (stated.py)
instance    a host runs both applications: values of its cycles, and statements, are those of step_application
both        the values after each cycle are those of the application of the other compiler, of all variables that both declare
The exit code is 1 if something of that is otherwise, and known_differences.py does not name it, or if that names too much.
"""

import argparse
import itertools
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # beside the sources nothing is left
from instance_of_proof import InstanceOfProof
from known_differences import OTHER_VALUES, REFUSED_BY_MATIEC, STATED_OTHERWISE, STATEMENTS_REFUSED_BY_MATIEC, WITHOUT_RUNNER
from stated import TICK_MS, blocks_of, program_of, without_comments

TICK_NS = TICK_MS * 1_000_000
CYCLES_OF_INSTANCE = 2000  # of those that it may have run when it is looked at
HERE = pathlib.Path(__file__).resolve().parent
INTEGERS = ("SINT", "USINT", "INT", "UINT", "DINT", "UDINT", "LINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD")
NS_OF_A_DAY = 86_400_000_000_000
COUNTER = "counted.cycles"
TIMED = re.compile(r"\b(TON|TOF|TP)\b|\bTIME\s*\(", re.I)
COLUMNS = {"source": "source", "strucpp": "STruC++", "runner": "values as its runner", "strucpp stated": "its suite's statements hold",
           "strucpp instance": "in an instance", "matiec": "MATIEC", "matiec stated": "statements hold", "matiec instance": "in an instance",
           "both": "values as by STruC++"}
BEGIN, END = "<!-- made by tests/compilers/proof.py --write", "<!-- end of the table -->"
# As instances/plc_variables.h numbers and lays out the types.
BOOL, STRING, COUNTED_STRING, SIZED_STRING, DAYS_DATE, SIZED_WSTRING = 1, 20, 25, 26, 27, 31
PLAIN = {2: "b", 3: "h", 4: "i", 5: "q", 6: "B", 7: "H", 8: "I", 9: "Q", 10: "B", 11: "H", 12: "I", 13: "Q", 14: "f", 15: "d",
         16: "q", 17: "q", 18: "q", 19: "q"}


def sources_of(strucpp):
    found = [p for p in sorted((strucpp / "tests/st-validation").rglob("*.st")) if not p.name.startswith("test_")]
    return found + sorted((strucpp / "examples").glob("*.st"))


def configured(text, programs):
    """With a program that counts its cycles, the last one of the task."""
    text += "\nPROGRAM CountedCycles\nVAR\n  cycles : DINT;\nEND_VAR\ncycles := cycles + 1;\nEND_PROGRAM\n"
    instances = "".join(f"    PROGRAM {name} WITH cyclic : {program};\n" for name, program in programs + [("counted", "CountedCycles")])
    return (f"{text}\nCONFIGURATION proof\n  RESOURCE one ON PLC\n    TASK cyclic (INTERVAL := T#{TICK_MS}ms, PRIORITY := 1);\n"
            f"{instances}  END_RESOURCE\nEND_CONFIGURATION\n")


def with_configuration(text):
    """Programs of the source; if there is none, one that calls its function blocks."""
    plain = without_comments(text)
    programs = re.findall(r"^\s*PROGRAM\s+(\w+)", plain, flags=re.I | re.M)
    if not programs:
        blocks = re.findall(r"^\s*FUNCTION_BLOCK\s+(?!ABSTRACT\b)(?:FINAL\s+)?(\w+)(.*?)END_FUNCTION_BLOCK", plain, flags=re.I | re.M | re.S)
        names = [name for name, body in blocks if not re.search(r"\bVAR_IN_OUT\b", body, flags=re.I)]
        variables = "".join(f"  block{i} : {name};\n" for i, name in enumerate(names))
        calls = "".join(f"  block{i}();\n" for i in range(len(names)))
        text += f"\nPROGRAM Caller\nVAR\n  calls : DINT;\n{variables}END_VAR\ncalls := calls + 1;\n{calls}END_PROGRAM\n"
        programs = ["Caller"]
    return configured(text, [(f"run{i}", name) for i, name in enumerate(programs)])


def call(command, folder, given=None, limit=600):
    return subprocess.run([str(word) for word in command], cwd=folder, input=given, capture_output=True, text=True, errors="replace",
                          timeout=limit, check=False)


def build(options, source, compiler, folder):
    """None, and why not; else the application."""
    application = folder / f"{compiler}.so"
    done = call([options.programs / "plcctl", "build", "application", source.name, "-o", application, "--compiler", compiler], folder)
    errors = [line for line in (done.stdout + done.stderr).splitlines() if ": note: " not in line and not line.startswith("note")]
    return (application, "") if done.returncode == 0 else (None, errors[0] if errors else "no reason is told")


def decoded(kind, value):
    """An element as a number, a truth or a text, the same in all layouts of compilers; None: of another type."""
    if kind == BOOL:
        return value[0] != 0
    if kind in PLAIN:
        return struct.unpack("<" + PLAIN[kind], value)[0]
    if kind == DAYS_DATE:
        return struct.unpack("<q", value)[0] * NS_OF_A_DAY
    if kind == COUNTED_STRING:
        return value[1:1 + value[0]].decode("latin-1")
    if kind in (STRING, SIZED_STRING):
        return value.split(b"\0")[0].decode("latin-1")
    if kind == SIZED_WSTRING:
        return value.decode("utf-16-le", "replace").split("\0")[0]
    if len(value) == 16:
        seconds, nanoseconds = struct.unpack("<qq", value)
        return seconds * 1_000_000_000 + nanoseconds
    return None


def values_by_cycle(step, application, cycles):
    """After each cycle: {name in lower case: its elements}; or None, and why not."""
    done = call([step, application, cycles, TICK_NS], application.parent, limit=60)
    if done.returncode != 0:
        return None, (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    result = []
    for line in done.stdout.splitlines():
        name, kind, *elements = line.split()
        if not elements:  # "cycle 1"
            result.append({})
        else:
            result[-1][name.lower()] = [decoded(int(kind), bytes.fromhex(element)) for element in elements]
    return result, ""


def runner_values(strucpp, source, folder, cycles):
    """Of STruC++'s runner, after each cycle: {name: its one element}; or None, and why not."""
    libraries = folder / "libraries"  # but for those that have functions of the suite once more
    libraries.mkdir(exist_ok=True)
    for library in (strucpp / "libs").glob("iec-*"):
        shutil.copy(library, libraries)
    made = call(["node", strucpp / "dist/node/cli.js", source.name, "-o", "runner.cpp", "--build", "--cxx-flags", "-O0",
                 "--no-default-libs", "-L", libraries], folder)
    if made.returncode != 0 or not (folder / "runner").exists():
        return None, "; ".join(line for line in (made.stderr + made.stdout).splitlines() if "rror" in line)[:300]
    said = call([folder / "runner"], folder, given="run 1\nvars\n" * cycles, limit=60).stdout
    result = []
    said = re.sub(r"\x1b\[[0-9;]*m", "", said).replace("Executed ", "\nExecuted ")  # no line ends before it
    for line in said.splitlines():
        if line.startswith("Executed "):
            result.append({})
        elif result and (found := re.match(r"(\w+\.\w+) : (\w+) = (.*)$", line)):
            result[-1][found[1].lower()] = [shown(found[3], found[2])]
    return result, ""


def shown(text, kind):
    """A text of the runner as a value; None: of another type."""
    if kind == "BOOL":
        return text == "TRUE"
    if kind in INTEGERS:
        return int(text[3:], 16) if text.startswith("16#") else int(text)
    if kind in ("REAL", "LREAL"):
        return float(text)
    if kind == "TIME":
        units = {"d": NS_OF_A_DAY, "h": 3_600_000_000_000, "m": 60_000_000_000, "s": 1_000_000_000, "ms": 1_000_000, "us": 1_000, "ns": 1}
        sign = -1 if "-" in text else 1
        return sign * round(sum(float(number) * units[unit] for number, unit in re.findall(r"([\d.]+)(ms|us|ns|d|h|m|s)", text)))
    return None


def same(one, other):
    if isinstance(one, float):
        return one == other or (one != one and other != other) or abs(one - other) <= 1e-5 * max(abs(one), abs(other))
    return one == other


def compare(mine, others, cycles=None):
    """(values that are the same, {name: its first difference})."""
    count, different = 0, {}
    for cycle, values, expected in zip(cycles or itertools.count(1), mine, others):
        for name in values.keys() & expected.keys() - {COUNTER}:
            if None in values[name] or None in expected[name]:
                continue
            if len(values[name]) == len(expected[name]) and all(map(same, values[name], expected[name])):
                count += len(values[name])
            else:
                different.setdefault(name, f"{name} is {listed(values[name])}, not {listed(expected[name])} (cycle {cycle})")
    return count, different


def listed(elements):
    return ", ".join(map(str, elements))


class Source:
    """One of the suite, built and run. Its row says what was seen, its faults what is not as it must be."""

    def __init__(self, proof, path, folder):
        self.proof, self.path, self.folder = proof, path, folder
        self.text = path.read_text(encoding="utf-8")
        self.name = path.stem
        self.row, self.faults = {key: "" for key in COLUMNS}, []
        self.row["source"] = f"`{path.parent.name}/{path.stem}`"

    def fault(self, text):
        self.faults.append(f"{self.path.relative_to(self.proof.strucpp)}: {text}")

    def look(self):
        source = self.folder / "program.st"
        source.write_text(with_configuration(self.text), encoding="utf-8")
        values = {}
        for compiler in self.proof.compilers:
            application, why = self.proof.build(source, compiler)
            self.row[compiler] = "yes" if application else f"no: {self.reason(compiler, why)}"
            if application:
                values[compiler] = self.cycles(application, compiler)
        if values.get("strucpp") and not self.proof.options.without_runner:
            self.compare_with_runner(values["strucpp"], source)
        if values.get("strucpp") and values.get("matiec"):
            cycles = self.proof.options.cycles
            count, different = compare(values["strucpp"][:cycles], values["matiec"][:cycles])
            known = OTHER_VALUES.get(self.name, ())
            for name in different.keys() ^ set(known):
                self.fault(different.get(name, f"{name} is the same with both compilers by now"))
            self.row["both"] = f"{count}" + (f"; others: {', '.join(f'`{name}`' for name in known)}" if known else "")
        self.look_at_statements()
        return self

    def reason(self, compiler, why):
        known = REFUSED_BY_MATIEC.get(self.name) if compiler == "matiec" else None
        if known is None:
            self.fault(f"not built by {compiler}: {why}")
        return known or why

    def cycles(self, application, compiler):
        """Of the stepper, as the instance has them too."""
        values, why = values_by_cycle(self.proof.step, application, CYCLES_OF_INSTANCE)
        if values is None:
            self.fault(f"by {compiler}: {why}")
            return None
        if compiler == "matiec" and self.name in REFUSED_BY_MATIEC:
            self.fault("built by matiec by now")
        samples, why = self.proof.instance.samples(application, ["*"], self.proof.options.seconds)
        if samples is None:
            self.fault(f"in an instance, by {compiler}: {why}")
            return values
        seen = {int(sample[COUNTER][0]): sample for sample in samples if 0 < sample[COUNTER][0] <= CYCLES_OF_INSTANCE}
        if len(seen) < 2:
            self.fault(f"in an instance, by {compiler}: {len(seen)} cycles were seen")
        timed = TIMED.search(without_comments(self.text)) is not None
        count, different = (0, {}) if timed else compare(seen.values(), [values[cycle - 1] for cycle in seen], seen)
        for text in different.values():
            self.fault(f"in an instance, by {compiler}: {text}")
        self.row[f"{compiler} instance"] = "same values" if count else "runs"
        return values

    def compare_with_runner(self, values, source):
        runner, why = runner_values(self.proof.strucpp, source, self.folder, self.proof.options.cycles)
        known = WITHOUT_RUNNER.get(self.name)
        if (runner is None) != (known is not None):
            self.fault(f"its runner is not built: {why}" if runner is None else "its runner is built by now")
        if runner is None:
            self.row["runner"] = f"no: {known or why}"
            return
        count, different = compare(values, runner)
        self.row["runner"] = str(count)
        for text in different.values():
            self.fault(f"other than its runner: {text}")

    def look_at_statements(self):
        tests = self.path.with_name(f"test_{self.path.name}")
        if not tests.exists():
            return
        blocks = blocks_of(tests.read_text(encoding="utf-8"))
        source = self.folder / "stated.st"
        source.write_text(configured(program_of(self.text, blocks), [(f"{block.program}i", block.program) for block in blocks]), encoding="utf-8")
        for compiler in self.proof.compilers:
            application, why = self.proof.build(source, compiler)
            if application is None:
                known = None if compiler == "strucpp" else STATEMENTS_REFUSED_BY_MATIEC.get(self.name)
                if known is None and (compiler == "strucpp" or self.name not in REFUSED_BY_MATIEC):
                    self.fault(f"its statements are not built by {compiler}: {why}")
                self.row[f"{compiler} stated"] = f"no: {known}" if known else ""
                continue
            if compiler == "matiec" and self.name in STATEMENTS_REFUSED_BY_MATIEC:
                self.fault("its statements are built by matiec by now")
            held = self.statements(blocks, application, compiler)
            known = STATED_OTHERWISE.get(self.name, {}).values() if compiler == "matiec" else ()
            self.row[f"{compiler} stated"] = "; ".join([f"{held} of {sum(len(block.counters) for block in blocks)}", *known])

    def statements(self, blocks, application, compiler):
        cycles = max(block.cycles for block in blocks)
        values, why = values_by_cycle(self.proof.step, application, cycles)
        if values is None:
            self.fault(f"its statements, by {compiler}: {why}")
            return 0
        samples, why = self.proof.instance.samples(application, ["*.held*"], 0.1)
        if samples is None:
            self.fault(f"its statements in an instance, by {compiler}: {why}")
        held, otherwise = 0, set()
        for block in blocks:
            for counter, statement in block.counters:
                holds = values[-1][counter][0] > 0
                held += holds
                if not holds:
                    otherwise.add(block.name)
                    if compiler == "strucpp" or block.name not in STATED_OTHERWISE.get(self.name, ()):
                        self.fault(f"by {compiler}, {values[-1][counter][0]}: {statement}")
                if block.cycles == 1 and samples and (samples[-1][counter][0] > 0) != holds:
                    self.fault(f"in an instance, by {compiler}, {samples[-1][counter][0]}: {statement}")
        if compiler == "matiec":
            for name in set(STATED_OTHERWISE.get(self.name, ())) - otherwise:
                self.fault(f"holds with matiec by now: {name}")
        return held


class Proof:
    def __init__(self, options, compilers, strucpp, step, instance):
        self.options, self.compilers, self.strucpp, self.step, self.instance = options, compilers, strucpp, step, instance

    def build(self, source, compiler):
        return build(self.options, source, compiler, source.parent)


def line_of(row):
    return "| " + " | ".join((row[key] or "-").replace("|", "/") for key in COLUMNS) + " |"


def write_table(file, rows):
    """Rows of sources that were left out this time stay."""
    text = file.read_text(encoding="utf-8")
    begin, end = text.index("\n", text.index(BEGIN)) + 1, text.index(END)
    lines = {line.split(" | ")[0]: line for line in text[begin:end].splitlines() if line.startswith("| `")}
    lines.update({line.split(" | ")[0]: line for line in map(line_of, rows)})
    head = "| " + " | ".join(COLUMNS.values()) + " |\n" + "| --- " * len(COLUMNS) + "|\n"
    file.write_text(text[:begin] + head + "".join(f"{lines[key]}\n" for key in sorted(lines)) + text[end:], encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=lambda text: pathlib.Path(text).resolve())
    parser.add_argument("--cycles", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=0.5)
    parser.add_argument("--only", default="")
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--without-runner", action="store_true")
    options = parser.parse_args()
    strucpp = os.environ.get("PLCHOST_STRUCPP")
    if not strucpp:
        print("nothing is proven: PLCHOST_STRUCPP must name the folder of the built compiler, in which its suite lies")
        return 77
    strucpp = pathlib.Path(strucpp).resolve()
    compilers = ["strucpp"] + (["matiec"] if os.environ.get("PLCHOST_MATIEC") else [])
    sources = [path for path in sources_of(strucpp) if re.search(options.only, str(path))]
    rows, faults = [], []
    with tempfile.TemporaryDirectory(prefix="plchost-proof.") as base:
        base = pathlib.Path(base)
        step = base / "step_application"
        subprocess.run(["cc", "-std=gnu2x", "-O1", "-rdynamic", f"-I{HERE.parent.parent / 'instances'}", HERE / "step_application.c", "-ldl", "-o", step], check=True)
        with InstanceOfProof(options.programs, base) as instance:
            proof = Proof(options, compilers, strucpp, step, instance)
            for number, path in enumerate(sources):
                (folder := base / str(number)).mkdir()
                source = Source(proof, path, folder).look()
                shutil.rmtree(folder)
                rows.append(source.row)
                faults += source.faults
                print(line_of(source.row), *source.faults, sep="\n", flush=True)
    if options.write:
        write_table(options.write, rows)
    built = {compiler: sum(row[compiler] == "yes" for row in rows) for compiler in ("strucpp", "matiec")}
    print(f"{len(rows)} sources; STruC++ builds {built['strucpp']}, MATIEC {built['matiec']}; {len(faults)} faults")
    return 1 if faults or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
