#!/usr/bin/env bash
# Runs a command where "/" is a mount and terminals can be opened. Network namespaces and the shells' pseudo terminals need
# both; a folder into which somebody has changed his root by a plain chroot has neither.   tests/own_root.sh COMMAND...
set -euo pipefail

has_both() { unshare --mount --propagation private test -c /dev/pts/ptmx 2>/dev/null; }
can_have() { command -v mount >/dev/null && unshare --mount --propagation unchanged true 2>/dev/null; }

if [ "$(id -u)" -ne 0 ] || has_both || ! can_have; then exec "$@"; fi
# The mounts are gone with their namespace.
exec unshare --mount --propagation unchanged bash -euc '
  folder=$1
  shift
  mount --rbind / /mnt
  [ -c /mnt/dev/pts/ptmx ] || mount -t devpts -o newinstance,ptmxmode=0666,mode=0620,gid=5 devpts /mnt/dev/pts
  exec chroot /mnt bash -c "cd \"\$1\" && shift && exec \"\$@\"" _ "$folder" "$@"' _ "$PWD" "$@"
