#!/usr/bin/env python3
"""Builds the programs of STruC++'s own suite with both compilers for Structured Text, runs them, and compares the values.

Usage: proof.py PROGRAMS [--cycles N] [--only WORD] [--table FILE] [--without-runner]
PROGRAMS: the folder of plcctl and plc-instance. The compilers are named by PLCHOST_MATIEC and PLCHOST_STRUCPP, both folders of
a built source tree. Without them nothing is proven, and the exit code is 77.

Each source gets a CONFIGURATION of one task of 10 ms. For each one:
build   plcctl makes an application, which plc-instance checks
run     plc-instance runs it for a second: no exception, and it ends by SIGTERM
runner  the values after each cycle are those of STruC++'s own runner, of the variables of programs whose values that shows
both    the values after each cycle are those of the application of the other compiler, of all variables that both declare
The exit code is 1 if a program of STruC++ is not built, does not run, or has another value than its runner.
"""

import argparse
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile

TICK_NS = 10_000_000
HERE = pathlib.Path(__file__).resolve().parent
INTEGERS = ("SINT", "USINT", "INT", "UINT", "DINT", "UDINT", "LINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD")
NS_OF_A_DAY = 86_400_000_000_000
# As instances/plc_variables.h numbers and lays out the types.
BOOL, STRING, COUNTED_STRING, SIZED_STRING, DAYS_DATE = 1, 20, 25, 26, 27
PLAIN = {2: "b", 3: "h", 4: "i", 5: "q", 6: "B", 7: "H", 8: "I", 9: "Q", 10: "B", 11: "H", 12: "I", 13: "Q", 14: "f", 15: "d",
         16: "q", 17: "q", 18: "q", 19: "q"}


def sources_of(strucpp):
    found = [p for p in sorted((strucpp / "tests/st-validation").rglob("*.st")) if not p.name.startswith("test_")]
    return found + sorted((strucpp / "examples").glob("*.st"))


def without_comments(text):
    return re.sub(r"\(\*.*?\*\)|//[^\n]*|/\*.*?\*/", " ", text, flags=re.S)


def with_configuration(text):
    """Programs of the source; if there is none, one that calls its function blocks."""
    plain = without_comments(text)
    programs = re.findall(r"^\s*PROGRAM\s+(\w+)", plain, flags=re.I | re.M)
    if not programs:
        blocks = re.findall(r"^\s*FUNCTION_BLOCK\s+(?!ABSTRACT\b)(?:FINAL\s+)?(\w+)(.*?)END_FUNCTION_BLOCK", plain, flags=re.I | re.M | re.S)
        names = [name for name, body in blocks if not re.search(r"\bVAR_IN_OUT\b", body, flags=re.I)]
        variables = "".join(f"  block{i} : {name};\n" for i, name in enumerate(names))
        calls = "".join(f"  block{i}();\n" for i in range(len(names)))
        text += f"\nPROGRAM Caller\nVAR\n  cycles : DINT;\n{variables}END_VAR\n  cycles := cycles + 1;\n{calls}END_PROGRAM\n"
        programs = ["Caller"]
    instances = "".join(f"    PROGRAM run{i} WITH cyclic : {name};\n" for i, name in enumerate(programs))
    return (f"{text}\nCONFIGURATION proof\n  RESOURCE one ON PLC\n    TASK cyclic (INTERVAL := T#10ms, PRIORITY := 1);\n"
            f"{instances}  END_RESOURCE\nEND_CONFIGURATION\n")


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
    """Of STruC++'s runner, after each cycle: {name: its one element}."""
    made = call(["node", strucpp / "dist/node/cli.js", source.name, "-o", "runner.cpp", "--build", "--cxx-flags", "-O0"], folder)
    if made.returncode != 0 or not (folder / "runner").exists():
        return None
    said = call([folder / "runner"], folder, given="run 1\nvars\n" * cycles, limit=60).stdout
    result = []
    said = re.sub(r"\x1b\[[0-9;]*m", "", said).replace("Executed ", "\nExecuted ")  # no line ends before it
    for line in said.splitlines():
        if line.startswith("Executed "):
            result.append({})
        elif result and (found := re.match(r"(\w+\.\w+) : (\w+) = (.*)$", line)):
            result[-1][found[1].lower()] = [shown(found[3], found[2])]
    return result


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


def compare(mine, others):
    """(values that are the same, the first difference of each variable)."""
    count, different = 0, {}
    for cycle, (values, expected) in enumerate(zip(mine, others), 1):
        for name in values.keys() & expected.keys():
            if None in values[name] or None in expected[name]:
                continue
            if len(values[name]) == len(expected[name]) and all(map(same, values[name], expected[name])):
                count += len(values[name])
            else:
                different.setdefault(name, f"{name} is {listed(values[name])}, not {listed(expected[name])} (cycle {cycle})")
    return count, [different[name] for name in sorted(different)]


def listed(elements):
    return ", ".join(map(str, elements))


def told(count, different):
    more = "" if len(different) <= 3 else f", and {len(different) - 3} more"
    return f"{count} values" + ("; " + ", ".join(different[:3]) + more if different else "")


def runs_in_instance(options, application, folder, name):
    """Why not; empty: it runs."""
    with subprocess.Popen([options.programs / "plc-instance", "--name", "proof", "--pool", name, "--run-directory", folder,
                           "--application", application], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as instance:
        try:
            said, _ = instance.communicate(timeout=options.seconds)
            return f"it has ended: {said.strip().splitlines()[-1:]}"
        except subprocess.TimeoutExpired:
            instance.send_signal(signal.SIGTERM)
        said, _ = instance.communicate(timeout=60)
    for left in pathlib.Path("/dev/shm").glob(f"*{name}*"):
        left.unlink(missing_ok=True)
    wrong = [line for line in said.splitlines() if "exception" in line.lower()]
    return wrong[0] if wrong else "" if instance.returncode == 0 else f"exit code {instance.returncode}"


class Proof:
    def __init__(self, options, strucpp, step):
        self.options, self.strucpp, self.step = options, strucpp, step
        self.failed = 0

    def of(self, path, folder):
        source = folder / "program.st"
        source.write_text(with_configuration(path.read_text(encoding="utf-8")), encoding="utf-8")
        row = {"source": str(path.relative_to(self.strucpp))}
        applications = {}
        for compiler in ("strucpp", "matiec"):
            applications[compiler], row[compiler] = build(self.options, source, compiler, folder)
        row["run"] = self.run(applications, folder)
        values = {}
        for compiler, application in applications.items():
            values[compiler] = None
            if application is not None:
                values[compiler], why = values_by_cycle(self.step, application, self.options.cycles)
                row[compiler] = row[compiler] or why
        row["runner"], row["both"] = "-", "-"
        runner = None
        if values["strucpp"] and not self.options.without_runner:
            runner = runner_values(self.strucpp, source, folder, self.options.cycles)
        if runner:
            count, different = compare(values["strucpp"], runner)
            row["runner"] = told(count, different)
            self.failed += len(different) > 0
        if values["strucpp"] and values["matiec"]:
            row["both"] = told(*compare(values["strucpp"], values["matiec"]))
        self.failed += row["strucpp"] != "" or row["run"] != ""
        return row

    def run(self, applications, folder):
        why = []
        for compiler, application in applications.items():
            if application is not None and (wrong := runs_in_instance(self.options, application, folder, f"proof{os.getpid()}")):
                why.append(f"{compiler}: {wrong}")
        return "; ".join(why)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=lambda text: pathlib.Path(text).resolve())
    parser.add_argument("--cycles", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--only", default="")
    parser.add_argument("--table", type=pathlib.Path)
    parser.add_argument("--without-runner", action="store_true", help="build and run only: it takes half of the time")
    options = parser.parse_args()
    folders = {name: os.environ.get(name, "") for name in ("PLCHOST_MATIEC", "PLCHOST_STRUCPP")}
    missing = [name for name, folder in folders.items() if not folder]
    if missing:
        print(f"nothing is proven: {' and '.join(missing)} must name the folder of a built compiler")
        return 77
    strucpp = pathlib.Path(folders["PLCHOST_STRUCPP"]).resolve()
    with tempfile.TemporaryDirectory(prefix="plchost-proof.") as base:
        step = pathlib.Path(base) / "step_application"
        subprocess.run(["cc", "-std=gnu2x", "-O1", "-rdynamic", f"-I{HERE.parent.parent / 'instances'}", HERE / "step_application.c", "-ldl", "-o", step], check=True)
        proof = Proof(options, strucpp, step)
        table = []
        for number, path in enumerate(sources_of(strucpp)):
            if options.only not in str(path):
                continue
            folder = pathlib.Path(base) / str(number)
            folder.mkdir()
            row = proof.of(path, folder)
            table.append(row)
            line = f"| {row['source']} | " + " | ".join((row[key] or "yes").replace("|", "/") for key in ("strucpp", "run", "runner", "matiec", "both")) + " |"
            print(line, flush=True)
            if options.table:
                with options.table.open("a", encoding="utf-8") as file:
                    file.write(line + "\n")
    built = {key: sum(row[key] == "" for row in table) for key in ("strucpp", "matiec")}
    print(f"{len(table)} sources; STruC++ builds {built['strucpp']}, MATIEC {built['matiec']}; {proof.failed} failures")
    return 1 if proof.failed else 0


if __name__ == "__main__":
    sys.exit(main())
