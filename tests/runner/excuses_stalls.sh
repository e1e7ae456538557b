#!/usr/bin/env bash
# A test that fails runs again if the machine stood still while it ran, and only then: the suite is shown tests that fail at first.
# Here the tests write the stalls into the file, as the processes of stalls.py do, which are shown a stop of their own.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
watcher=
trap '[ -z "$watcher" ] || kill -KILL "$watcher" 2>/dev/null || true; rm -rf "$folder"' EXIT
fail() { echo "FAILED: $*"; cat "$folder/said"; exit 1; }
export PYTHONDONTWRITEBYTECODE=1

mkdir "$folder/suite" "$folder/build"
cp ./*.py "$folder/suite/"
: >"$folder/suite/skips.txt"
echo 'SANITIZER:STRING=' >"$folder/build/CMakeCache.txt"
cat >"$folder/planted.py" <<'EOF'
"""planted.py MARK TIMES SECONDS STILL AGO: fails so many times, beside a stall of that length that ended so long ago."""
import os, pathlib, sys, time
mark, times = pathlib.Path(sys.argv[1]), int(sys.argv[2])
seconds, still, ago = map(float, sys.argv[3:])
runs = len(mark.read_text()) if mark.exists() else 0
if runs >= times:
    sys.exit(0)
mark.write_text("x" * (runs + 1))
print("said by the run that fails")
if seconds:
    with open(os.environ["PLCHOST_STALLS"], "a") as file:
        file.write(f"{time.monotonic() - ago - seconds:.3f} {seconds} {still}\n")
sys.exit(1)
EOF
# plant NAME TIMES SECONDS STILL AGO
plant() { echo "add_test(Planted.$1 python3 $folder/planted.py $folder/mark.$1 $2 $3 $4 $5)" >>"$folder/build/CTestTestfile.cmake"; }
# suite EXIT_CODE WHAT: with the tests planted since the last one
suite() {
  local code=0
  timeout 120 "$folder/suite/suite.py" --jobs 4 "$folder/build" >"$folder/said" 2>&1 || code=$?
  [ "$code" -eq "$1" ] || fail "$2: exit code $code instead of $1"
  rm -f "$folder"/mark.* "$folder/build/CTestTestfile.cmake"
}
says() { grep -qF -- "$1" "$folder/said" || fail "it does not say: $1"; }
does_not_say() { ! grep -qF -- "$1" "$folder/said" || fail "it says: $1"; }

echo 'any * stall planted' >"$folder/suite/retries.txt"
plant Calm 1 0 0 0
suite 1 "a failure without a stall"
says "FAILED: Planted.Calm"
does_not_say "second run:"

plant Stalled 1 1.24 1.24 0
suite 0 "a failure beside a stall"
says "second run: Planted.Stalled: the machine stood still for 1,240 ms while it ran"
says "----- Planted.Stalled failed at first with:"
says "said by the run that fails"
says "stalls: plain: 1 of at least"

plant Loaded 1 1.24 0.2 0
plant Earlier 1 1.24 1.24 60
suite 1 "a failure beside load, and one long after a stall"
for name in Loaded Earlier; do says "FAILED: Planted.$name"; done
does_not_say "second run:"

plant Twice 2 1.24 1.24 0
suite 1 "a failure in both runs"
says "FAILED: Planted.Twice"
does_not_say "second run:"

for name in One Two Three; do plant "$name" 1 0.5 0.5 0; done
suite 0 "three failures beside a stall"
for name in One Two Three Four; do plant "$name" 1 0.5 0.5 0; done
suite 1 "four failures beside a stall"
for name in One Two Three Four; do says "FAILED: Planted.$name: the machine stood still for 500 ms while it ran, and while 3 others that failed ran"; done

echo 'any Planted.Listed time planted' >"$folder/suite/retries.txt"
plant Listed 1 0 0 0
suite 0 "a failure of a test that the list names"
says "second run: Planted.Listed: time planted"
plant Listed 0 0 0 0
plant Stalled 1 1.24 1.24 0
suite 1 "a list that excuses no stall"
says "FAILED: Planted.Stalled"

# It starts one process per core.
echo 'any * stall planted' >"$folder/suite/retries.txt"
cat >"$folder/build/CTestTestfile.cmake" <<'EOF'
add_test(Planted.Watched sh -c "test $(cat /proc/[0-9]*/cmdline | tr '\\0' ' ' | grep -o \"stalls.py [0-9]* $PLCHOST_STALLS \" | wc -l) = $(nproc)")
EOF
suite 0 "each core is watched"

# They end with it, and tell a stop in which the core has done nothing from one in which it has worked.
core=$(python3 -c 'import os; print(min(os.sched_getaffinity(0)))')
# stop WORKED_TICKS: its line, after a stop of 0.6 s beside which the core is said to have worked so long
stop() {
  : >"$folder/lines"
  echo "cpu$core 0 0 0 0 0 0 0 0 0 0" >"$folder/accounts"
  ./stalls.py --accounts "$folder/accounts" "$core" "$folder/lines" &
  watcher=$!
  until readlink "/proc/$watcher/fd"/* 2>/dev/null | grep -qxF "$folder/lines" || ! kill -0 "$watcher"; do sleep 0.05; done
  sleep 0.5
  kill -STOP "$watcher"
  sleep 0.6
  echo "cpu$core $1 0 0 0 0 0 0 0 0 0" >"$folder/accounts"
  kill -CONT "$watcher"
  sleep 0.5
  kill "$watcher"
  wait "$watcher" 2>/dev/null || true
  watcher=
  cp "$folder/lines" "$folder/said"
}
stop 0
awk '$2 >= 0.45 && $3 >= 0.45 { found = 1 } END { exit !found }' "$folder/lines" || fail "a stop of a core that does nothing is not told"
stop 100000
awk '$2 >= 0.45 && $3 == 0 { found = 1 } $3 >= 0.45 { exit 1 } END { exit !found }' "$folder/lines" || fail "a stop of a core that works is called a stall"
