#!/usr/bin/env python3
"""How many lines of each parser the corpora of the fuzzers reach.

Usage: coverage.py [--build FOLDER] [--grow SECONDS] [FUZZER...]   (default: all that parsers.txt names)
  --grow SECONDS   first lets each fuzzer look for new inputs for so long, and keeps those that reach new lines

Builds the fuzzers with counters of lines (PLCHOST_FUZZ_COVERAGE) in FOLDER, by default .build/coverage. Prints each
line that no input reaches. The exit code is 1 if a parser has less than its share.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
CORPUS = HERE / "corpus"
LEAST = 90  # percent of the lines
LIMITS = ["-rss_limit_mb=2048", "-max_len=8192"]


def parsers():
    """Of each fuzzer, the files that read what comes from outside, and what of them does something else."""
    table = {}
    for line in (HERE / "parsers.txt").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            fuzzer, *files = line.split()
            table[fuzzer] = {file: [word for word in others.split(",") if word] for file, _, others in (file.partition("!") for file in files)}
    return table


def run(command, **options):
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, errors="replace", check=False, **options)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command[:3]))} ... failed:\n{done.stdout[-2000:]}{done.stderr[-4000:]}")
    return done.stdout


def build(folder):
    flags = ["-O0 -g1 -DNDEBUG", "-fuse-ld=lld"]
    gated = ROOT / ".build/tests/bin/gated_cyclone"
    run(["cmake", "-S", ".", "-B", folder, "-G", "Ninja", "-DCMAKE_C_COMPILER=clang-19", "-DCMAKE_CXX_COMPILER=clang++-19",
         "-DPLCHOST_FUZZ=ON", "-DPLCHOST_FUZZ_COVERAGE=ON", "-DPLCHOST_MODBUS=ON", "-DPLCHOST_TESTS=OFF", "-DPLCHOST_BENCH=OFF",
         f"-DPLCHOST_GATED_CYCLONE={gated if gated.exists() else ''}", "-DCMAKE_UNITY_BUILD=ON", "-DCMAKE_UNITY_BUILD_BATCH_SIZE=0",
         "-DCMAKE_BUILD_TYPE=Debug", f"-DCMAKE_CXX_FLAGS_DEBUG={flags[0]}", f"-DCMAKE_C_FLAGS_DEBUG={flags[0]}",
         f"-DCMAKE_EXE_LINKER_FLAGS={flags[1]}"])
    run(["cmake", "--build", folder, "--target", "fuzzers"])


def grow(program, corpus, seconds):
    """Adds what was found, and keeps the fewest inputs that reach the same."""
    with tempfile.TemporaryDirectory() as scratch:
        found, fewest = pathlib.Path(scratch, "found"), pathlib.Path(scratch, "fewest")
        found.mkdir()
        fewest.mkdir()
        environment = dict(os.environ, LLVM_PROFILE_FILE="/dev/null")
        run([program, f"-max_total_time={seconds}", *LIMITS, found, corpus], env=environment)
        run([program, "-set_cover_merge=1", "-use_counters=0", *LIMITS, fewest, corpus, found], env=environment)
        shutil.rmtree(corpus)
        shutil.copytree(fewest, corpus)


def functions_of(covered, files):
    """FILE -> line -> name of its function"""
    functions = json.loads(run([*covered, "-format=text"]))["data"][0]["functions"]
    names = run(["c++filt"], input="\n".join(function["name"].split(":")[-1] for function in functions)).splitlines()
    table = {file: {} for file in files}
    for function, name in zip(functions, names):
        lines = table.get(os.path.relpath(function["filenames"][0], ROOT))
        if lines is not None:
            for first, _, last, *_ in function["regions"]:
                lines.update((line, name) for line in range(first, last + 1))
    return table


def lines_of(program, corpus, files, scratch):
    """FILE -> (lines, reached, FUNCTION -> the lines that are not)"""
    raw, merged = scratch / "raw", scratch / "merged"
    run([program, "-runs=0", *LIMITS, corpus], env=dict(os.environ, LLVM_PROFILE_FILE=str(raw)))
    run(["llvm-profdata-19", "merge", "-sparse", raw, "-o", merged])
    covered = ["llvm-cov-19", "export", f"-instr-profile={merged}", program, *(ROOT / file for file in files)]
    functions = functions_of(covered, files)
    table, file = {}, None
    for line in run([*covered, "-format=lcov"]).splitlines():
        if line.startswith("SF:"):
            file = os.path.relpath(line[3:], ROOT)
            table[file] = [0, 0, {}]
        elif line.startswith("DA:"):
            number, count = map(int, line[3:].split(","))
            function = functions[file].get(number, "")
            if any(word in function for word in files[file]):
                continue
            table[file][0] += 1
            if count:
                table[file][1] += 1
            else:
                table[file][2].setdefault(function.replace("(anonymous namespace)::", "").partition("(")[0], []).append(number)
    if gone := set(files) - set(table):
        sys.exit(f"{program.name} has no {' '.join(sorted(gone))}")
    return table


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--build", default=ROOT / ".build/coverage", type=pathlib.Path)
    arguments.add_argument("--grow", type=int, default=0)
    arguments.add_argument("fuzzers", nargs="*")
    chosen = arguments.parse_args()
    table = parsers()
    unknown = [name for name in chosen.fuzzers if name not in table]
    if unknown:
        sys.exit(f"parsers.txt has no {unknown[0]}; it has {' '.join(table)}")
    build(chosen.build)
    short = False
    for fuzzer in chosen.fuzzers or table:
        program, corpus = chosen.build / f"bin/fuzz_{fuzzer}", CORPUS / fuzzer
        corpus.mkdir(parents=True, exist_ok=True)
        if chosen.grow:
            grow(program, corpus, chosen.grow)
        if not table[fuzzer]:
            continue
        with tempfile.TemporaryDirectory() as scratch:
            for file, (lines, reached, missing) in lines_of(program, corpus, table[fuzzer], pathlib.Path(scratch)).items():
                share = 100 * reached / lines
                print(f"{fuzzer:20} {file:60} {reached:5} of {lines:5} lines  {share:5.1f} %", flush=True)
                if share < LEAST:
                    short = True
                    print(f"{'':20} less than {LEAST} %; no input reaches")
                    for function, numbers in missing.items():
                        print(f"{'':22}{function}: {' '.join(map(str, numbers))}")
    sys.exit(1 if short else 0)


if __name__ == "__main__":
    main()
