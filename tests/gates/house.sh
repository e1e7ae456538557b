#!/usr/bin/env bash
# What the house looks like from outside: its eight entries, small files, nothing unfinished, no path of a
# developer's machine. Usage: house.sh [ROOT] (a git checkout); prints each fault.
set -euo pipefail
cd "${1:-$(dirname "$0")/../..}"
wrong=0
fault() { echo "$1"; wrong=1; }

while read -r entry; do
  case "$entry" in
    .* | CMakeLists.txt | manager | schedulers | instances | shm | api | tests | README.md) ;;
    *) fault "$entry: not one of the eight entries of the top level" ;;
  esac
done < <(git ls-files | cut -d/ -f1 | sort -u)

while read -r file; do
  lines=$(wc -l <"$file")
  [ "$lines" -le 500 ] || fault "$file: $lines lines; what is the second thing in it?"
done < <(git ls-files '*.cpp' '*.hpp' '*.h' '*.c')

marker='TO''DO|FIX''ME|X''XX'
git grep -nE "\b($marker)\b" -- ':!*.md' && fault "the lines above are unfinished" || true
home_path='/(work|home|root)/[a-z]'
git grep -nE "$home_path" -- ':!tests/gates' && fault "the lines above name a path of one machine" || true
exit $wrong
