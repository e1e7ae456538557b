#!/usr/bin/env python3
"""Builds a program with WSTRING by STruC++, and lists, writes, forces and records its variables on a host of its own.

Usage: wide_texts.py PROGRAMS
PROGRAMS: the folder of plcctl, plchostd, plc-instance and step_application. PLCHOST_STRUCPP names the folder of the built compiler;
without it nothing is proven, and the exit code is 77. The exit code is 1 if something is not as it must be.
"""

import json
import os
import pathlib
import sys
import tempfile

sys.dont_write_bytecode = True  # beside the sources nothing is left
from instance_of_proof import NAME, InstanceOfProof
from proof import build, configured, values_by_cycle

TEXT = "PROGRAM Main\nVAR\n  title : WSTRING := \"press\";\n  copied : WSTRING(12);\nEND_VAR\ncopied := title;\nEND_PROGRAM\n"
GIVEN = "gr\u00fc\u00df \u20ac \U0001f600"


class Programs:
    def __init__(self, folder):
        self.programs = folder


def main():
    if not os.environ.get("PLCHOST_STRUCPP"):
        print("nothing is proven: PLCHOST_STRUCPP must name the folder of the built compiler")
        return 77
    options = Programs(pathlib.Path(sys.argv[1]).resolve())
    faults = []

    def expect(what, found, wanted):
        print(f"{what}: {found}")
        if found != wanted:
            faults.append(f"{what} is {found}, not {wanted}")

    with tempfile.TemporaryDirectory(prefix="plchost-wide.") as base:
        base = pathlib.Path(base)
        source = base / "wide.st"
        source.write_text(configured(TEXT, [("one", "Main")]), encoding="utf-8")
        application, why = build(options, source, "strucpp", base)
        if application is None:
            print(why)
            return 1
        cycles, why = values_by_cycle(options.programs / "step_application", application, 1)
        expect("after a cycle", (cycles or [why])[0].get("one.copied"), ["press"])
        with InstanceOfProof(options.programs, base) as instance:
            for words in (("load", "application", NAME, application), ("start", "instance", NAME), ("wait", "instance", NAME),
                          ("write", "variable", NAME, f'one.title="{GIVEN}"'), ("force", "variable", NAME, 'one.copied="$D83D$"$20AC"')):
                done = instance.plcctl(*words)
                expect(" ".join(map(str, words[:2])), done.returncode, 0)
            listed = {row["name"]: row for row in json.loads(instance.plcctl("list", "variables", NAME, "one.*", "-o", "json").stdout)}
            expect("the types", [listed[name]["type"] for name in ("one.copied", "one.title")], ["WSTRING[12]", "WSTRING[254]"])
            expect("title", listed["one.title"]["value"], f'"{GIVEN}"')
            expect("copied", listed["one.copied"]["forced_value"], '"$D83D$"\u20ac"')
            done = instance.plcctl("unforce", "variable", NAME, "one.copied")
            expect("unforce", done.returncode, 0)
            done = instance.plcctl("record", "variables", NAME, "one.title", "one.copied", "--interval", "0.05", "--duration", "0.5")
            last = done.stdout.splitlines()[-1]
            expect("recorded", f'"""{GIVEN}"""' in last and last.count(GIVEN) == 2, True)
    print(*faults, sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
