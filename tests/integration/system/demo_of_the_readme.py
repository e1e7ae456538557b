#!/usr/bin/env python3
"""Holds the README's block of the demo against the output of the demo. Usage: demo_of_the_readme.py README OUTPUT

Each line of the block must come, in this order (readme_output.py). The block leaves out columns and rows of the tables: of a row it shows, the texts and the numbers that no machine changes are compared. Lost cycles are not: a machine that stands still loses some at any time, and the demo itself holds that a kill loses none.
"""
import re
import sys

from readme_output import missing

SAME = ["HOST", "NAME", "STATE", "SCHEDULER", "INSTANCE", "TASK", "KIND", "PRIO", "INTERVAL(us)", "RESTARTS"]


def is_head(line):
    return re.match(r"HOST +\S", line) is not None


def cells(head, line):
    """{name of the column: text}; columns of numbers end where their head ends."""
    found = {}
    for name in re.finditer(r"\S+", head):
        for cell in re.finditer(r"\S+", line):
            if cell.start() == name.start() or cell.end() == name.end():
                found.setdefault(name[0], cell[0])
    return found


def same(head, line):
    return {name: text for name, text in cells(head, line).items() if name in SAME}


def rows_below(lines, head):
    rows = []
    for line in lines[lines.index(head) + 1:]:
        if line.startswith(("== ", "$ ")) or not line.strip():
            break
        rows.append(same(head, line))
    return rows


def main():
    readme, output = (open(path, encoding="utf-8").read() for path in sys.argv[1:3])
    block = re.search(r"\n```\n(== start.*?)\n```\n", readme, re.DOTALL)[1].split("\n")
    output = re.sub(r"\x1b\[\d*m", "", output)
    printed = output.split("\n")
    said, head, rows, compared = [], None, [], 0
    for line in block:
        if is_head(line):
            head = line
            wanted = [name for name in head.split() if name in SAME]
            there = next((one for one in printed if is_head(one) and set(head.split()) <= set(one.split())), None)
            if there is None:
                sys.exit(f"no table of the demo has these columns:\n{line}")
            rows = [{name: row.get(name) for name in wanted} for row in rows_below(printed, there)]
        elif head is not None and not line.startswith(("== ", "$ ")) and line.startswith("demo "):
            compared += 1
            if same(head, line) not in rows:
                sys.exit(f"no row of the demo is like this one:\n{line}\nbut:\n" + "\n".join(map(str, rows)))
        else:
            said.append(line)
    absent = missing(said, output)
    if absent is not None:
        sys.exit(f"the README has, and the demo does not say:\n{absent}")
    if compared < 5 or len(said) < 10:
        sys.exit(f"only {compared} rows and {len(said)} lines were compared: where is the block?")


main()
