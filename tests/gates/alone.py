#!/usr/bin/env python3
"""Each file of the product compiles by itself, and has the definition of each template that it uses.

Usage: alone.py BUILD   prints the errors; the exit code is 1 if there are any

A user builds file by file. Our own builds join files (CMAKE_UNITY_BUILD), and there one of them has the includes of another.
BUILD is configured for clang without joining; its generated and precompiled headers are made. No code is generated from a file:
a template that is used and not defined is an error of the linker otherwise, and of the compiler here.
"""

import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

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
    build = pathlib.Path(sys.argv[1]).resolve()
    entries = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    entries = [entry for entry in entries if build not in pathlib.Path(entry["file"]).parents]
    if not entries:
        sys.exit(f"there is no file in {build}/compile_commands.json")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        errors = [text for text in pool.map(compile_alone, entries) if text]
    print("".join(errors), end="")
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
