#!/usr/bin/env bash
# The tour of the README: each of its commands is run, in order, and says what the README says that it says. Twice: the second
# time finds nothing of the first.
. "$(dirname "$0")/common.sh"
root=$(cd "$(dirname "$0")/../../.." && pwd)
clean_up_tour() {
  [ ! -f "$cell/managers" ] || xargs -r kill -TERM <"$cell/managers" 2>/dev/null || true
  # Without a manager its instances go on.
  local process
  for process in /proc/[0-9]*; do
    ! { tr '\0' '\n' <"$process/cmdline"; } 2>/dev/null | grep -qxF "$cell/cell1" || kill -KILL "${process#/proc/}" || true
  done
  clean_up
}
trap clean_up_tour EXIT
for round in 1 2; do
  echo "- round $round"
  "$(dirname "$0")/tour_of_the_readme.py" "$root" "$BIN" "$cell" "$last_core" "$pool" || fail "round $round"
  nothing_left
  [ ! -e "$cell/tour" ] || fail "the tour leaves $(ls "$cell/tour")"
done
