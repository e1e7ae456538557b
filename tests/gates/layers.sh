#!/usr/bin/env bash
# Who may include whom (the house has one direction). Usage: layers.sh [ROOT]; prints each wrong include.
set -euo pipefail
cd "${1:-$(dirname "$0")/../..}"

# folder: the folders it may include from (besides itself)
allowed() {
  case "$1" in
    shm/base) echo "" ;;
    shm/pool) echo "shm/base" ;;
    shm/block_driver) echo "shm/pool shm/base" ;;
    shm/library) echo "shm/pool shm/base" ;;
    schedulers) echo "shm/base" ;;
    instances/launch) echo "shm/base" ;;
    instances) echo "instances/launch schedulers shm/block_driver shm/pool shm/base" ;;
    api/control) echo "shm/base" ;;
    api/security) echo "shm/base" ;;
    api) echo "api/control api/security shm/block_driver shm/pool shm/base" ;;
    manager) echo "api/control api/security instances/launch shm/block_driver shm/pool shm/base" ;;
  esac
}

# the longest layer that a path lies in
layer_of() {
  local layer
  for layer in shm/base shm/pool shm/block_driver shm/library schedulers instances/launch instances api/control api/security api manager; do
    case "$1" in "$layer"/*) echo "$layer"; return ;; esac
  done
  echo none
}

wrong=0
while IFS=: read -r file line include; do
  target=$(sed -E 's/.*#include "([^"]+)".*/\1/' <<<"$include")
  from=$(layer_of "$file")
  to=$(layer_of "$target")
  [ "$to" = none ] && continue
  [ "$from" = "$to" ] && continue
  case " $(allowed "$from") " in
    *" $to "*) ;;
    *) echo "$file:$line: $from may not include $to ($target)"; wrong=1 ;;
  esac
done < <(grep -rnE '^[[:space:]]*#include "' --include='*.hpp' --include='*.cpp' --include='*.h' --include='*.c' \
  shm schedulers instances api manager 2>/dev/null || true)
exit $wrong
