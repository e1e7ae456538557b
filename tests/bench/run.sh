#!/usr/bin/env bash
# Measures plchost beside the floor of this machine, in the same run.
#   tests/bench/run.sh [--quick] [--stress] [--json FILE] [--markdown FILE] [--plots DIR]
#                      [--only PART,...] [--seconds N]
# 60 s of each thing: three quarters of an hour idle, and half an hour more with --stress, which measures again
# beside stress-ng. --quick: 5 s of each, five minutes. --seconds: so many of each. Progress is on standard error.
# A noisy machine shows in the floor as well: read the ratios.
set -euo pipefail
here=$PWD
cd "$(dirname "$0")/../.."
.ci/packages bench
build=.build/bench
args=()
while [ $# -gt 0 ]; do
  case "$1" in
    --json | --markdown | --plots) args+=("$1" "$(cd "$here" && realpath -m "$2")"); shift ;;
    *) args+=("$1") ;;
  esac
  shift
done
log=$(mktemp)
trap 'rm -f "$log"' EXIT
echo "building ..." >&2
if ! { cmake -S . -B "$build" -G Ninja -DPLCHOST_TESTS=OFF && cmake --build "$build"; } >"$log" 2>&1; then
  tail -n 60 "$log" >&2
  exit 1
fi
exec "$build/bin/plchost-bench" "${args[@]}"
