#!/usr/bin/env bash
# A task does not come to the end of its cycle when the application is to stop: the operator's view of it.
. "$(dirname "$0")/common.sh"

cat >"$cell/line1.cfg" <<CFG
[CmpSchedule]
Watchdog.DefaultTimeMs=0
Stop.OthersLimitMs=300
CFG
write_host cell "$first_core"
write_instance cell line1 "$first_core" held 'settings = "line1.cfg"'
start_manager cell
until_true 20 state_is line1 running

exception() { plcctl show exception line1 --json | jq -r ".[0].$1"; }
has() { [ "$(exception "$1")" = "$2" ]; }
ran() { [ "$(task line1/HoldOther cycles)" -ge 1 ]; }
tasks_of() { plcctl list events --json | jq -r ".[] | select(.event == \"$1\") | .bound_tasks"; }

echo "- the stop is answered when its time is over, and names the task"
bound() { is "$(tasks_of hold_other)" 1; }
until_true 20 bound
plcctl post event line1/hold_other >/dev/null
until_true 20 ran
sleep 0.1  # five cycles: it holds by now
if said=$(plcctl stop instance line1 2>&1); then fail "the stop succeeded"; fi
grep -qF 'task Other (after 300 ms)' <<<"$said" || fail "$said"
state_is line1 exception || fail "$(plcctl list instances)"

echo "- it is an exception like any other: shown and listed"
until_true 20 has present true
has count 1 && has task Other && has kind "stop_timeout" && has stopped application || fail "$(plcctl show exception line1)"
exception text | grep -qF 'after 300 ms, the limit of the second phase of a stop' || fail "$(exception text)"
plcctl list exceptions | grep -q 'Other .*stop_timeout .*300 ms' || fail "$(plcctl list exceptions)"

echo "- a reset leads out of it; the exception stays known"
plcctl reset instance line1 && plcctl start instance line1 && state_is line1 running || fail "reset and start failed"
has present false && has count 1 || fail "$(plcctl show exception line1)"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
