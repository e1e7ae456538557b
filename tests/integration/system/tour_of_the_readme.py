#!/usr/bin/env python3
"""Runs the tour of README.md. Usage: tour_of_the_readme.py ROOT BIN CELL CORE POOL; PLCHOST_DOMAIN is its DDS domain.

Where the tour has "<!-- run here: PAGE ... -->", the console blocks of these pages behind "<!-- run in the tour -->" are run.

The commands are those of the indented lines and those behind "$ " in the console blocks. Blocks of code are files, by the name in their first line or in the line above. The output that a console block shows behind a command must come in this order (readme_output.py).
"""
import os
import re
import subprocess
import sys
import time

from readme_output import missing

ROOT, BIN, CELL, CORE, POOL = sys.argv[1:6]
PATIENCE_S = 75  # more than the longest command waits by itself
PLACES = {
    "$PWD/.build/demo/bin": BIN,
    "$PWD/instances": ROOT + "/instances",
    "/tmp/tour": CELL + "/tour",
    "/tmp/cell1": CELL + "/cell1",
    "pool 'plchost'": f"pool '{POOL}'",
}


def placed(text):
    for there, here in PLACES.items():
        text = text.replace(there, here)
    return text


def tour_lines():
    text = open(ROOT + "/README.md", encoding="utf-8").read()
    begin = text.index("## Ten minutes, by hand")
    lines = []
    for line in text[begin:text.index("\n## ", begin)].split("\n"):
        lines.append(line)
        also = re.fullmatch(r"<!-- run here: (.*) -->", line)
        for page in also.group(1).split() if also else []:
            lines += marked_blocks(page)
    return lines


def marked_blocks(page):
    lines = open(f"{ROOT}/{page}", encoding="utf-8").read().split("\n")
    marks = [at for at, line in enumerate(lines) if line == "<!-- run in the tour -->"]
    assert marks, f"{page} has no block that is to be run in the tour"
    return [line for at in marks for line in lines[at + 1:lines.index("```", at + 2) + 1]]


def steps(lines):
    """("file", name, text) and ("run", command, [expected line])"""
    above = ""
    at = 0
    while at < len(lines):
        line = lines[at]
        if line.startswith("```"):
            end = lines.index("```", at + 1)
            body = lines[at + 1:end]
            if line == "```":
                yield from console(body)
            else:
                named = re.match(r"// (\S+)$", body[0]) or re.search(r"`(\S+)`:$", above)
                yield "file", named.group(1), "\n".join(body) + "\n"
            at = end
        elif line.startswith("    "):
            yield "run", line.strip(), []
        if line.strip():
            above = line
        at += 1


def console(body):
    command, expected = None, []
    for line in body:
        if line.startswith("$ "):
            if command is not None:
                yield "run", command, expected
            command, expected = line[2:], []
        else:
            expected.append(line)
    yield "run", command, expected


class Shell:
    """A shell whose commands come from here; their output, also that of their children, goes to one file."""

    def __init__(self):
        self.path = CELL + "/tour.log"
        self.file = open(self.path, "w", encoding="utf-8")
        self.process = subprocess.Popen(["bash", "--norc"], stdin=subprocess.PIPE, stdout=self.file, stderr=self.file,
                                        text=True, cwd=CELL)
        self.commands = 0

    def said(self):
        return open(self.path, encoding="utf-8", errors="replace").read()

    def run(self, command, expected):
        begin = len(self.said())
        self.commands += 1
        mark = f"== {self.commands} =="
        self.process.stdin.write(f"{placed(command)}\necho '{mark}'\n")
        if command.endswith("&"):
            self.process.stdin.write(f"echo $! >>{CELL}/managers\n")
        self.process.stdin.flush()
        end = time.monotonic() + PATIENCE_S
        while True:
            output = self.said()[begin:]
            absent = missing(expected, output, placed) if mark in output else "(it does not end)"
            if absent is None:
                return
            if time.monotonic() > end or self.process.poll() is not None:
                sys.exit(f"$ {command}\nsays:\n{output}\nthe document has:\n{absent}")
            time.sleep(0.05)

    def end(self):
        self.process.stdin.close()
        self.process.wait(PATIENCE_S)


def main():
    shell = Shell()
    ran = 0
    for kind, what, detail in steps(tour_lines()):
        if kind == "file":
            text = placed(detail)
            if what.endswith(".toml"):
                text = re.sub(r"core = \d+", f"core = {CORE}", text)
                text = text.replace("[host]\n", f'[host]\ndds_domain = {os.environ["PLCHOST_DOMAIN"]}\npool = "{POOL}"\n')
            with open(f"{CELL}/tour/{what}", "w", encoding="utf-8") as file:
                file.write(text)
        else:
            shell.run(what, detail)
            ran += 1
    shell.end()
    assert ran > 20, f"only {ran} commands found"


main()
