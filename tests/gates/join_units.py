#!/usr/bin/env python3
"""Joins the units of a unity build, so that clang-tidy reads the headers of others once for many files.

Usage: join_units.py [--share N] BUILD

It writes BUILD/joined/ with the joined files and their compile_commands.json. It prints the path of each file that
clang-tidy has to read, the folder of its compile commands and the units that were joined in it, separated by tabs.

Units of libraries are joined, each with others of its top-level folder. All other units stay as they are: programs and
shared objects use names a second time that others of the folder have, and few units have another language version.

--share N  only each N-th source, and what was changed last (in_turn.py)
"""

import argparse
import json
import pathlib
import re

from in_turn import in_turn

SOURCES = 75  # in one file at most
FLAG = re.compile(r"-isystem \S+|-(?:D|I|std=)\S+")
ENDS = re.compile(r"_EXPORTS\b|^int main\(", re.MULTILINE)


class Unit:
    def __init__(self, entry, build):
        self.file = entry["file"]
        text = pathlib.Path(self.file).read_text(encoding="utf-8") if self.file.endswith(".cxx") else ""
        self.sources = re.findall(r'^#include "(.+\.cpp)"$', text, re.MULTILINE)
        self.flags = FLAG.findall(entry["command"])
        self.folder = self.file.removeprefix(f"{build}/").split("/", maxsplit=1)[0]
        texts = [entry["command"], *(pathlib.Path(source).read_text(encoding="utf-8") for source in self.sources)]
        self.alone = not self.sources or "-std=c++23" not in self.flags or any(ENDS.search(text) for text in texts)

    def read(self):
        return self.sources or [self.file]

    def keep(self, chosen):
        """Keeps only those sources, and says whether there are any. A unit that stays as it is is read with all of its sources."""
        kept = [source for source in self.read() if source in chosen]
        if not self.alone:
            self.sources = kept
        return bool(kept)

    def takes(self, others):
        return not self.alone and others and not others[-1].alone and others[-1].folder == self.folder and (
            sum(len(other.sources) for other in others) + len(self.sources) <= SOURCES)


def groups_of(units):
    groups = []
    for unit in sorted(units, key=lambda unit: (unit.folder, unit.alone)):
        if groups and unit.takes(groups[-1]):
            groups[-1].append(unit)
        else:
            groups.append([unit])
    return sorted(groups, key=lambda group: -sum(len(unit.sources) for unit in group))  # the longest begins first


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--share", type=int, default=1)
    parser.add_argument("build", type=pathlib.Path)
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    entries = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    # Those of the precompiled headers are empty.
    units = [Unit(entry, build) for entry in {entry["file"]: entry for entry in entries}.values()
             if entry["file"].endswith((".cpp", ".cxx")) and "plchost_headers.dir" not in entry["file"]]
    chosen = in_turn([source for unit in units for source in unit.read()], arguments.share)
    # Groups are those of all sources, which are known to have no name twice.
    groups = [[unit for unit in group if unit.keep(chosen)] for group in groups_of(units)]
    folder = build / "joined"
    folder.mkdir(exist_ok=True)
    commands = []
    for number, group in enumerate(group for group in groups if group):
        if group[0].alone:
            print(group[0].file, build, sep="\t")
            continue
        file = folder / f"joined_{number}.cpp"
        file.write_text("".join(f'#include "{source}"\n' for unit in group for source in unit.sources), encoding="utf-8")
        flags = list(dict.fromkeys(flag for unit in group for flag in unit.flags))
        commands.append({"directory": str(build), "command": f"c++ {' '.join(flags)} -c {file}", "file": str(file)})
        print(file, folder, *(unit.file for unit in group), sep="\t")
    (folder / "compile_commands.json").write_text(json.dumps(commands, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
