#!/usr/bin/env bash
# The static analyzers of gcc and of cppcheck over the C files, which no clang-tidy reads. cppcheck of Debian 12 misreads C++23.
# Usage: c_files.sh [TREE]
set -euo pipefail
cd "${1:-"$(dirname "$0")/../.."}"
mapfile -t files < <(git ls-files '*.c')
[ ${#files[@]} -gt 0 ] || { echo "no C file was found"; exit 1; }
include=(-I . -I shm -I instances -I instances/adapters/application)
code=0
for file in "${files[@]}"; do
  gcc -std=gnu11 -D_GNU_SOURCE= -O2 -Wall -Wextra -Werror -fanalyzer "${include[@]}" -c -o /dev/null "$file" || code=1
done
# The release of Cyclone is told by the build. That cppcheck 2.17 does not look at each branch of a large function is no fault.
cppcheck --std=c11 --enable=warning,performance,portability --inline-suppr --quiet --error-exitcode=1 '-DDDS_VERSION="0"' \
  --suppress=normalCheckLevelMaxBranches "${include[@]}" "${files[@]}" || code=1
exit "$code"
