#!/usr/bin/env bash
# clang-format, checked and not changed. Usage: format.sh [ROOT]
set -euo pipefail
cd "${1:-$(dirname "$0")/../..}"
find shm schedulers instances manager api tests \( -name '*.cpp' -o -name '*.hpp' -o -name '*.c' -o -name '*.h' \) -print0 2>/dev/null |
  xargs -0 --no-run-if-empty clang-format-19 --dry-run --Werror
