#!/usr/bin/env bash
# The includes that each folder may have (the house has one direction). Usage: layers.sh [ROOT]; prints each wrong include.
set -euo pipefail
cd "${1:-$(dirname "$0")/../..}"

# folder: the folders it may include from (besides itself)
allowed() {
  local rooms="shm/files shm/log shm/base"
  local shared="shm/block_driver shm/pool shm/pages shm/sockets $rooms"
  case "$1" in
    shm/base) echo "" ;;
    shm/log | shm/toml | shm/sockets | shm/files) echo "shm/base" ;;
    shm/pages | shm/pool | shm/block_driver) echo "$rooms" ;;
    shm/library) echo "shm/pool shm/base" ;;
    schedulers) echo "shm/base" ;;
    instances/launch) echo "shm/log shm/base" ;;
    instances) echo "instances/launch schedulers $shared" ;;
    api/control) echo "shm/sockets shm/base" ;;
    api/security) echo "shm/files shm/base" ;;
    api) echo "api/control api/security shm/toml $shared" ;;
    manager) echo "api/control api/security instances/launch shm/toml $shared" ;;
  esac
}

# the longest layer that a path lies in
layer_of() {
  local layer
  for layer in shm/base shm/log shm/toml shm/sockets shm/files shm/pages shm/pool shm/block_driver shm/library schedulers instances/launch instances api/control api/security api manager; do
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
