#!/usr/bin/env bash
# clang-tidy over all translation units of a build, or over the files named. Most of the work is the headers of others:
# it is quickest in a unity build, whose units are joined further.
# Usage: tidy.sh [--share N] BUILD [FILE...]   --share: only each N-th source, and what was changed last (in_turn.py)
set -euo pipefail
share=1
if [ "$1" = --share ]; then
  share=$2
  shift 2
fi
build=$1
shift
cd "$(dirname "$0")/../.."
tidy() { # tidy COMPILE_COMMANDS FILE
  clang-tidy-19 -p "$1" "$2" --quiet --config-file=.clang-tidy --checks=-bugprone-suspicious-include \
    --header-filter='/(shm|schedulers|instances|manager|api|tests)/.*\.[ch]pp$' --extra-arg=-Wno-unknown-warning-option \
    --extra-arg=-Wno-deprecated-declarations --extra-arg=-Wno-ignored-optimization-argument 2>/dev/null
}
# check LINE: of join_units.py. Units that cannot be compiled together, as two of them use a name, are read one by one.
check() {
  local file commands units output unit code=0
  IFS=$'\t' read -r file commands units <<<"$1"
  output=$(tidy "$commands" "$file") && return
  if [ -z "$units" ] || ! grep -qF '[clang-diagnostic-error]' <<<"$output"; then
    printf '%s\n' "$output"
    return 1
  fi
  for unit in ${units//$'\t'/ }; do tidy "$build" "$unit" || code=1; done
  return "$code"
}
export build
export -f tidy check
# clang reads the compile commands of g++; flags that only g++ knows are not its business
sed -i 's/ -fno-gnu-unique//g' "$build/compile_commands.json"
if [ $# -eq 0 ]; then
  units=$(tests/gates/join_units.py --share "$share" "$build")
else
  units=$(printf "%s\t$build\n" "$@")
fi
[ -n "$units" ] || { echo "there is no unit in $build/compile_commands.json"; exit 1; }
xargs -d '\n' -n 1 -P "$(nproc)" bash -c 'check "$1"' _ <<<"$units"
