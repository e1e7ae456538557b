#!/usr/bin/env python3
"""The documents (each .md that git knows) agree with each other and with the code.

Usage: documents.py [--write] [ROOT] (a git checkout); prints each fault. --write makes the generated tables anew.

* Each link leads to a file or folder, and its anchor to a heading there.
* Each document is reached from README.md by links; README.md has at most 250 lines.
* A table between "<!-- generated: NAME -->" and "<!-- end of generated -->" is that of today (TABLES below).
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

README_LINES = 250
BEGIN = re.compile(r"<!-- generated: ([\w-]+).*-->")
END = "<!-- end of generated -->"


class Fault(Exception):
    """A generated table cannot be made: its source is not as expected."""


def prose_lines(text):
    """(line number, line) outside of fenced blocks, without inline code and comments."""
    fenced = False
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, re.sub(r"<!--.*?-->|`[^`]*`", lambda code: "`" if code.group()[0] == "`" else "", line)


def anchors_of(text):
    """The anchors of the headings, as GitHub makes them."""
    anchors = set()
    fenced = False
    for line in text.split("\n"):
        if line.startswith("```"):
            fenced = not fenced
        heading = None if fenced else re.match(r"#+ (.*)", line)
        if heading:
            words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading.group(1)).strip().lower()
            anchors.add(re.sub(r"[^\w\- ]", "", words).replace(" ", "-"))
    return anchors


class Documents:
    def __init__(self, root):
        self.root = root
        self.names = subprocess.run(["git", "ls-files", "*.md"], cwd=root, check=True, capture_output=True,
                                    text=True).stdout.split()
        self.texts = {name: (root / name).read_text(encoding="utf-8") for name in self.names}
        self.anchors = {name: anchors_of(text) for name, text in self.texts.items()}

    def links(self, name):
        """(line number, target as written, path from the root or None for the outside, anchor)"""
        for number, line in prose_lines(self.texts[name]):
            for target in re.findall(r"\]\(([^)\s]+)\)", line):
                if re.match(r"[a-z]+:", target):
                    continue
                path, _, anchor = target.partition("#")
                there = (self.root / name).parent / path if path else self.root / name
                yield number, target, there.resolve(), anchor

    def link_faults(self):
        reached = {"README.md"}
        waiting = ["README.md"]
        faults = []
        for name in self.names:
            for number, target, there, anchor in self.links(name):
                where = f"{name}:{number}"
                if not there.is_relative_to(self.root) or not there.exists():
                    faults.append(f"{where}: the link '{target}' leads to no file")
                elif anchor and anchor not in self.anchors.get(str(there.relative_to(self.root)), ()):
                    faults.append(f"{where}: the link '{target}' leads to no heading")
        while waiting:
            for _, _, there, _ in self.links(waiting.pop()):
                found = str(there.relative_to(self.root)) if there.is_relative_to(self.root) else ""
                if found in self.texts and found not in reached:
                    reached.add(found)
                    waiting.append(found)
        faults += [f"{name}: no link leads here from README.md" for name in self.names if name not in reached]
        return faults

    def size_faults(self):
        lines = self.texts["README.md"].count("\n")
        return [f"README.md: {lines} lines; at most {README_LINES}"] if lines > README_LINES else []

    def table_faults(self, write):
        faults = []
        for name, text in self.texts.items():
            made = self.with_tables(name, text, faults)
            if made != text and write:
                (self.root / name).write_text(made, encoding="utf-8")
                self.texts[name] = made
            elif made != text:
                faults.append(f"{name}: a generated table is not up to date: run tests/gates/documents.py --write")
        return faults

    def with_tables(self, name, text, faults):
        out = []
        table = None
        for line in text.split("\n"):
            begin = BEGIN.fullmatch(line)
            if table is None:
                out.append(line)
            elif line == END:
                out += [*table, END]
                table = None
            if begin and begin.group(1) in TABLES:
                try:
                    table = TABLES[begin.group(1)](self.root)
                except Fault as fault:
                    faults.append(f"{name}: the table '{begin.group(1)}': {fault}")
                    return text
            elif begin:
                faults.append(f"{name}: no table is called '{begin.group(1)}'; there are {', '.join(TABLES)}")
                return text
        if table is not None:
            faults.append(f"{name}: a generated table without '{END}'")
            return text
        return "\n".join(out)


# Name in tests/bench/figures.md, condition, what the README says that it is.
FIGURES = (
    ("cyclic/CmpScheduleOneShot/1ms", "idle", "`CmpScheduleOneShot`, planned release to start, idle"),
    ("cyclic/CmpScheduleOneShot/1ms", "stress", "the same beside `stress-ng`"),
    ("cyclic/CmpScheduleTimer/1ms", "idle", "`CmpScheduleTimer`, planned release to start, idle"),
    ("cyclic/CmpSchedule/1ms", "idle", "`CmpSchedule`, planned release to start, idle"),
    ("post/process/other-core", "idle", "event from a process on another core to the start of its task"),
    ("post/dds", "idle", "event posted over DDS on the same machine to the start of its task"),
    ("distributed_clock/start", "idle", "start of a cycle off the grid of a drifting reference clock"),
    ("start/plc-instance", "idle", "spawning `plc-instance` to its first cycle"),
)


def figures(root):
    found = {}
    header = []
    for line in (root / "tests/bench/figures.md").read_text(encoding="utf-8").split("\n"):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if any("p50" in cell for cell in cells):
            header = cells
        elif len(cells) > 2 and len(cells) == len(header):
            found.setdefault((cells[0].strip("`"), cells[1]), cells)
    rows = ["| | median | 99th percentile | floor's median | floor's 99th percentile |", "| --- | --- | --- | --- | --- |"]
    for name, condition, meaning in FIGURES:
        if (name, condition) not in found:
            raise Fault(f"tests/bench/figures.md has no row '{name}', {condition}")
        p50, p99, _, floor50, floor99 = found[name, condition][2:7]
        if float(floor50) == 0:  # a grid has no floor
            floor50 = floor99 = "none"
        rows.append(f"| {meaning} | {p50} | {p99} | {floor50} | {floor99} |")
    return rows


TABLES = {"figures": figures}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).parent.parent.parent)
    options = parser.parse_args()
    documents = Documents(options.root.resolve())
    faults = documents.table_faults(options.write) + documents.size_faults() + documents.link_faults()
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
