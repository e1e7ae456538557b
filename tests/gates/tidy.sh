#!/usr/bin/env bash
# clang-tidy over all translation units of a build (a unity build is quickest), or over the files named.
# Usage: tidy.sh BUILD [FILE...]
set -euo pipefail
build=$1
shift
cd "$(dirname "$0")/../.."
if [ $# -eq 0 ]; then
  mapfile -t files < <(grep -oE '"file": "[^"]+\.(cpp|cxx)"' "$build/compile_commands.json" | cut -d'"' -f4 | grep -v "^$build/headers.cpp" | sort -u)
else
  files=("$@")
fi
# clang reads the compile commands of g++; flags that only g++ knows are not its business
sed -i 's/ -fno-gnu-unique//g' "$build/compile_commands.json"
printf '%s\0' "${files[@]}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy-19 -p "$build" --quiet \
  --checks=-bugprone-suspicious-include --header-filter='/(shm|schedulers|instances|manager|api|tests)/.*\.[ch]pp$' \
  --extra-arg=-Wno-unknown-warning-option --extra-arg=-Wno-deprecated-declarations --extra-arg=-Wno-ignored-optimization-argument 2>/dev/null
