#!/bin/sh
# Process 1 of a container of manager/Containerfile, in the place of systemd.
#   plchost-container [CONFIGURATION]
#
# A manager that ends without a word is started again and adopts its instances, which run on meanwhile. One that cannot start
# ends the container, unless PLCs run. SIGTERM stops all of them in order, SIGHUP takes over a changed configuration.
configuration=${1:-/etc/plchost/plchost.toml}
umask 0027
stopped=no
trap 'stopped=yes; kill -TERM "$manager" 2>/dev/null' TERM INT
trap 'kill -HUP "$manager" 2>/dev/null' HUP
plcs_run() { grep -qsx plc-instance /proc/[0-9]*/comm; }
while :; do
  # The API server and instances reach its files by this group, as those of the unit of systemd.
  setpriv --regid plchost --clear-groups plchostd --config "$configuration" &
  manager=$!
  # The signal came while there was no manager, and PLCs are left to be ended in order.
  [ "$stopped" = no ] || { sleep 1 && kill -TERM "$manager" 2>/dev/null; }
  # A signal ends wait, too. While it waits, it also takes leave of orphans, which are this process's.
  while :; do
    wait "$manager"
    code=$?
    kill -0 "$manager" 2>/dev/null || break
  done
  if ! plcs_run; then
    [ "$stopped" = no ] || exit 0
    [ "$code" -gt 128 ] || exit "$code"
  fi
  sleep 0.1
done
