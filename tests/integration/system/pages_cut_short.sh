#!/usr/bin/env bash
# A program with the right to write the pool cuts the files short in which an instance and the manager tell of themselves.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" bottling_line 'share_core = true'
start_manager cell
until_true 20 state_is line1 running
pid=$(instance line1 pid)

# The page that tells of its cycles is what is cut: its application says every second how it is.
reports() { grep -c "application: bottles" "$cell/cell.log"; }
more_reports() { [ "$(reports)" -ge "$1" ]; }
for file in instance.line1 transitions.line1; do
  echo "- $file: the cycles of the instance go on"
  truncate -s 0 "/dev/shm/$pool-cell.$file"
  until_true 20 more_reports $(($(reports) + 3))
  kill -0 "$pid" || fail "it has ended"
done
echo "- host and posts: manager and API server go on"
post() { plcctl post event line1/stop >/dev/null; }
post || fail "no post before"
for file in host posts; do
  truncate -s 0 "/dev/shm/$pool-cell.$file"
  until_true 10 post
done
until_true 10 state_is line1 running
grep -q "page of this instance was cut short" "$cell/cell.log" || fail "nobody says so"
[ "$(plcctl list instances --json | jq length)" = 1 ] || fail "the manager does not show it any more"

echo "- the manager ends in order, and the instance with it"
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
if grep -v " API server: " "$cell/cell.log" | grep -iE "killed|SIGBUS"; then fail "an instance did not end in order"; fi
nothing_left
