#!/usr/bin/env python3
"""The left-overs of a run of the tests: processes, files, shared memories, networks, mounts, and files among the sources.

Usage: left_behind.py begin FILE   notes what is there already
       left_behind.py end FILE     prints what has come since; exit code 1 if that is anything

The run's processes inherit PLCHOST_RUN, by which they are found, and TMPDIR, a folder of the run. Those of another run on the same machine are not counted: its processes have another PLCHOST_RUN. Its memories are mapped by them or have the number of one of them in their names.
"""

import json
import os
import pathlib
import re
import subprocess
import sys

SHARED_MEMORY = pathlib.Path("/dev/shm")
# Names of ours in folders of all.
FOLDERS = [pathlib.Path(folder) for folder in ("/run", "/var/lib", "/var/log", "/tmp", "/run/netns", "/etc")]


def names_in(folder):
    try:
        return {entry.name for entry in folder.iterdir()}
    except OSError:
        return set()


def read(path):
    try:
        return path.read_bytes()
    except OSError:
        return b""


def processes():
    return [entry for entry in pathlib.Path("/proc").iterdir() if entry.name.isdigit()]


def ancestors():
    """This process and those that wait for it."""
    found, pid = set(), os.getpid()
    while pid > 0:
        found.add(str(pid))
        pid = int(read(pathlib.Path(f"/proc/{pid}/stat")).rpartition(b")")[2].split()[1] or 0)
    return found


def our_processes(marker):
    known = ancestors()
    wanted = b"PLCHOST_RUN=" + marker.encode()
    for process in processes():
        if process.name not in known and wanted in read(process / "environ").split(b"\0"):
            command = read(process / "cmdline").replace(b"\0", b" ").decode(errors="replace").strip()
            yield f"process {process.name}: {command}"


def of_others(marker):
    """The shared memories that processes of another run use, and the numbers of these processes."""
    wanted = b"PLCHOST_RUN=" + marker.encode()
    held, numbers = set(), set()
    for process in processes():
        if wanted in read(process / "environ").split(b"\0"):
            continue
        numbers.add(process.name)
        for line in read(process / "maps").splitlines():
            if b" /dev/shm/" in line:
                held.add(line.split(b" /dev/shm/", 1)[1].decode(errors="replace"))
    return held, numbers


def untracked():
    """Files of the working folder's checkout that git neither has nor ignores; none if it is no checkout."""
    try:
        said = subprocess.run(["git", "ls-files", "-z", "--others", "--exclude-standard", "--", "."], check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError):
        return []
    return sorted(said.stdout.split("\0")[:-1])


def noted():
    there = {str(folder): sorted(name for name in names_in(folder) if "plc" in name) for folder in FOLDERS}
    there[str(SHARED_MEMORY)] = sorted(names_in(SHARED_MEMORY))
    there["links"] = sorted(names_in(pathlib.Path("/sys/class/net")))
    return there


def left(before, marker, folder):
    yield from our_processes(marker)
    yield from (f"file {entry}" for entry in sorted(pathlib.Path(folder).rglob("*")))
    for line in read(pathlib.Path("/proc/self/mounts")).decode(errors="replace").splitlines():
        if folder in line:
            yield f"mount {line}"
    yield from (f"in the sources: {name}" for name in untracked() if name not in before["sources"])
    held, numbers = of_others(marker)
    for place, now in noted().items():
        for name in now:
            inside = os.path.join(place, name)
            others = name in held or numbers & set(re.findall(r"\d{4,}", name))
            if name not in before[place] and not others and not folder.startswith(inside):
                yield f"in {place}: {name}"


def main():
    if len(sys.argv) != 3 or sys.argv[1] not in ("begin", "end"):
        raise SystemExit(__doc__)
    file = pathlib.Path(sys.argv[2])
    if sys.argv[1] == "begin":
        file.write_text(json.dumps({**noted(), "sources": untracked()}), encoding="utf-8")
        return 0
    found = list(left(json.loads(file.read_text(encoding="utf-8")), os.environ["PLCHOST_RUN"], os.environ["TMPDIR"]))
    for what in found:
        print(f"left behind: {what}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
