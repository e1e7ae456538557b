#!/usr/bin/env bash
# A program with the right to write the pool cuts its file short, under a running manager and instances.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" bottling_line 'share_core = true'
start_manager cell
until_true 20 state_is line1 running
cycles() { task line1/Fill cycles; }
more_than() { [ "$(cycles)" -gt "$1" ]; }
pid=$(instance line1 pid)
bound() { plcctl list events --json | jq -e 'any(.[]; .bound_tasks > 0)'; }
until_true 20 bound

before=$(cycles)
truncate -s 0 "/dev/shm/$pool-cell"
echo "- the tasks of the instance run on"
until_true 20 more_than "$before"
is "$(instance line1 pid)" "$pid" || fail "it was started anew"
grep -q "has cut its file in /dev/shm short" "$cell/cell.log" || until_true 5 grep -q "cut its file" "$cell/cell.log"

echo "- it can be stopped, its external-event tasks too, and the manager ends in order"
plcctl stop instance line1 || fail "the stop failed"
state_is line1 stopped || fail "$(plcctl list instances)"
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
if grep -v " API server: " "$cell/cell.log" | grep -iE "killed|failed"; then fail "an instance did not end in order"; fi
nothing_left
