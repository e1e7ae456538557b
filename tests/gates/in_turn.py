"""The sources that a gate reads if it would take too long to read all of them.

Each commit has every N-th one, other ones than the commit before, and all that the last commits have changed: the file, or a header
that it names. Where git knows only this commit, every second one is read, and without git all are.
"""

import pathlib
import re
import subprocess
import zlib

LAST_COMMITS = 40
OUR_INCLUDE = re.compile(r'^#include "(.+)"', re.MULTILINE)
TOP = pathlib.Path(__file__).resolve().parents[2]


def git(*words):
    try:
        done = subprocess.run(["git", "-C", str(TOP), *words], capture_output=True, text=True, check=False)
    except OSError:
        return None  # it is not installed
    return done.stdout if done.returncode == 0 else None


def in_turn(files, share):
    """Those of these files, which are absolute paths. A share of 1 is all."""
    known = (git("rev-list", f"--max-count={LAST_COMMITS + 1}", "HEAD") or "").split()
    if share == 1 or not known:
        return set(files)
    commit, oldest = known[0], known[-1]
    share = 2 if commit == oldest else share
    changed = {str(TOP / name) for name in (git("diff", "--name-only", oldest) or "").splitlines()}

    def is_changed(file):
        included = OUR_INCLUDE.findall(pathlib.Path(file).read_text(encoding="utf-8"))
        return file in changed or any(str(TOP / name) in changed for name in included)

    def is_next(file):
        return zlib.crc32((commit + file.removeprefix(str(TOP))).encode()) % share == 0
    return {file for file in files if is_next(file) or is_changed(file)}
