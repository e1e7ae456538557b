#!/usr/bin/env bash
# Measures plchost beside the floor of this machine, in the same run. Standard output is a JSON array with an object for
# each thing that was measured; standard error has the progress, and at the end the same as a table.
#   tests/bench/run.sh [--quick] [--stress] [--json FILE] [--markdown FILE] [--plots DIR]
#                      [--only PART,...] [--seconds N] [--rounds N]
# 60 s of each thing in three rounds: an hour and a half idle, and half as much again with --stress, which measures again
# beside stress-ng. --quick: 0.8 s of each in two rounds, in less than four minutes after the build. --help: this text, and once it is built, the
# parts that there are.
# A noisy machine shows in the floor and in the spread of the rounds: read the ratios.
set -euo pipefail
here=$PWD
cd "$(dirname "$0")/../.."
build=.build/bench
export PYTHONDONTWRITEBYTECODE=1  # the tree of the sources stays as it was
case " $* " in
  *" -h "* | *" --help "*)
    sed -n '2,/^[^#]/s/^# \{0,1\}//p' tests/bench/run.sh
    [ ! -x "$build/bin/plchost-bench" ] || "$build/bin/plchost-bench" --help
    exit
    ;;
esac
.ci/packages bench >&2
arguments=()
markdown=
while [ $# -gt 0 ]; do
  case "$1" in
    --markdown) markdown=$(cd "$here" && realpath -m "$2"); shift ;;
    --json | --plots) arguments+=("$1" "$(cd "$here" && realpath -m "$2")"); shift ;;
    *) arguments+=("$1") ;;
  esac
  shift
done

# All that the run makes is in this folder or in /dev/shm, by the benchmark's own number, and goes with it. So do its
# processes, which are one group.
work=$(mktemp -d "${TMPDIR:-/tmp}/plchost-bench.XXXXXX")
bench=
# Files of iceoryx's daemon, which the benchmark kills. It is started once on a machine: those of another one are left alone.
roudi() { ls -d /dev/shm/{iceoryx_mgmt,root} /tmp/roudi{,.lock} /tmp/iox-unique-roudi.lock 2>/dev/null || true; }
roudi_before=$(roudi)
roudi_left() { comm -13 <(sort <<<"$roudi_before") <(roudi | sort); }
shared() { find /dev/shm -maxdepth 1 -name "*plct-*-$bench-*" 2>/dev/null; }
clean_up() {
  if [ -n "$bench" ]; then
    kill -TERM -- "-$bench" 2>/dev/null || true
    for _ in $(seq 100); do
      kill -0 -- "-$bench" 2>/dev/null || break
      sleep 0.1
    done
    kill -KILL -- "-$bench" 2>/dev/null || true
    shared | xargs -r rm -rf
    rm -f /tmp/plct-*-"$bench"-*  # where iceoryx has its sockets
    roudi_left | xargs -r rm -f
  fi
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 130' INT TERM

# Of these sources, and of no repository around them.
PLCHOST_REVISION=$([ ! -e .git ] || git describe --always --dirty 2>/dev/null || true)
export PLCHOST_REVISION=${PLCHOST_REVISION:-unknown}
echo "building ..." >&2
if ! { cmake -S . -B "$build" -G Ninja -DPLCHOST_TESTS=OFF -DPLCHOST_PYTHON=OFF -DPLCHOST_ICEORYX=ON -DCMAKE_UNITY_BUILD=ON \
    -DCMAKE_UNITY_BUILD_BATCH_SIZE=10 &&
  cmake --build "$build" --target plchost-bench; } >"$work/log" 2>&1; then
  tail -n 60 "$work/log" >&2
  exit 1
fi
mkdir "$work/tmp"
set -m  # as a process group
TMPDIR=$work/tmp "$build/bin/plchost-bench" "${arguments[@]}" >"$work/figures.json" &
bench=$!
set +m
code=0
wait "$bench" || code=$?
cat "$work/figures.json"
[ -z "$markdown" ] || [ ! -s "$work/figures.json" ] || python3 tests/bench/figures.py "$work/figures.json" >"$markdown"
left=$(shared; roudi_left; find "$work/tmp" -mindepth 1)
[ -z "$left" ] || { echo "the benchmark has left behind: $left" >&2; code=1; }
exit "$code"
