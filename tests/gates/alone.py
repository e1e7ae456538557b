#!/usr/bin/env python3
"""Each file of the product compiles by itself, and has the definition of each template that it uses.

Usage: alone.py [--share N] BUILD   prints the errors; the exit code is 1 if there are any

A user builds file by file. Our own builds join files (CMAKE_UNITY_BUILD), and there one of them has the includes of another.
BUILD is configured for clang without joining; its generated and precompiled headers are made. No code is generated from a file:
a template that is used and not defined is an error of the linker otherwise, and of the compiler here.

--share N  only each N-th file, and what was changed last (in_turn.py)
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

from in_turn import in_turn

DEFINED = "-Werror=undefined-func-template"
# Tables of templates that the file of each policy, and of each kind of task, instantiates.
TABLES = ("schedulers/policies/registry.cpp", "schedulers/tasks/task_kind.cpp")
ONLY_OF_GCC = "-fno-gnu-unique"


def compile_alone(entry):
    words = shlex.split(entry["command"])
    output = words.index("-o")
    words = [word for word in words[:output] + words[output + 2:] if word != ONLY_OF_GCC]
    words += ["-fsyntax-only"] if entry["file"].endswith(TABLES) else ["-fsyntax-only", DEFINED]
    done = subprocess.run(words, cwd=entry["directory"], capture_output=True, text=True, errors="replace", check=False)
    return done.stderr if done.returncode else ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--share", type=int, default=1)
    parser.add_argument("build", type=pathlib.Path)
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    entries = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    entries = [entry for entry in entries if build not in pathlib.Path(entry["file"]).parents]
    chosen = in_turn([entry["file"] for entry in entries], arguments.share)
    entries = [entry for entry in entries if entry["file"] in chosen]
    if not entries:
        sys.exit(f"there is no file in {build}/compile_commands.json")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        errors = [text for text in pool.map(compile_alone, entries) if text]
    print("".join(errors), end="")
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
