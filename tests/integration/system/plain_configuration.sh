#!/usr/bin/env bash
# A plain "cmake -S . -B build" needs neither GoogleTest nor pybind11, and says what is left out without them; who wants them
# for sure is told that they are missing.
set -euo pipefail
root=$(cd "$(dirname "$0")/../../.." && pwd)
folder=$(mktemp -d "${TMPDIR:-/tmp}/plchost-system.XXXXXX")
trap 'rm -rf "$folder"' EXIT
without=(-DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON -DCMAKE_DISABLE_FIND_PACKAGE_pybind11=ON)
configure() { cmake -S "$root" -B "$folder/build" -G Ninja "${without[@]}" "$@" >"$folder/log" 2>&1; }
fail() { echo "FAILED: $*" >&2; tail -n 30 "$folder/log" >&2; exit 1; }

configure || fail "it does not configure"
for said in "GTest is not installed: without the tests" "pybind11 is not installed: without the module for Python"; do
  grep -qF "$said" "$folder/log" || fail "it does not say '$said'"
done
! configure -DPLCHOST_PYTHON=ON || fail "the module for Python is left out in spite of PLCHOST_PYTHON=ON"
