#!/usr/bin/env bash
# A task divides by zero: the operator's view and actions, while the instance beside it runs on.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" task_faults 'share_core = true'
write_instance cell line2 "$last_core" task_faults 'share_core = true'
start_manager cell
until_true 20 state_is line1 running
until_true 20 state_is line2 running

exception() { plcctl show exception "$1" --json | jq -r ".[0].$2"; }
has() { [ "$(exception "$1" "$2")" = "$3" ]; }
task_is() { [ "$(task "$1" state)" = "$2" ]; }
ran() { [ "$(task "$1" cycles)" -ge "$2" ]; }

echo "- no exception is no error"
is "$(plcctl show exception line1)" "instance 'line1' has had no exception" || fail "something else is said"
refused "line1, line2" plcctl show exception line3

# One fault and the way back.
fault_and_way_back() {
  faults=$1
  echo "- fault $faults: the exception names task, signal and function; the instance is reachable"
  plcctl post event line1/divide >/dev/null
  until_true 20 has line1 count "$faults"
  until_true 20 has line1 present true
  has line1 memory_address 0 && has line1 task Divide && has line1 signal SIGFPE && has line1 kind signal || fail "$(plcctl show exception line1)"
  symbol_is_known() { exception line1 symbol | grep -qF 'divide()+0x'; }
  until_true 20 symbol_is_known || fail "$(plcctl show exception line1)"
  is "$(exception line1 back_trace | head -n 1)" "$(exception line1 symbol)" && has line1 back_trace_end "" || fail "$(plcctl show exception line1)"
  until_true 20 task_is line1/Divide exception
  until_true 20 task_is line1/Fast stopped

  echo "- start is refused until a reset; then it runs"
  refused reset plcctl start instance line1
  plcctl reset instance line1 && state_is line1 stopped || fail "reset failed"
  has line1 present false && has line1 count "$faults" || fail "after the reset: $(plcctl show exception line1)"
  plcctl start instance line1 && state_is line1 running || fail "start failed"
  until_true 20 ran line1/Fast 10
}
costs_no_cycle line2/Low fault_and_way_back
has line2 count 0 || fail "line2 has an exception: $(plcctl show exception line2)"

echo "- the exception is still known after a restart of the manager"
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
start_manager cell
until_true 20 state_is line1 running
has line1 count "$faults" && has line1 task Divide && has line1 present false || fail "$(plcctl show exception line1)"
is "$(plcctl list exceptions --json | jq -r 'map(.instance) | join(",")')" line1 || fail "$(plcctl list exceptions)"

kill -TERM "${managers[1]}"
wait "${managers[1]}" || fail "the manager ended with $?"
nothing_left

echo "- and after a power cut, which empties the run directory"
rm -rf "$cell/cell"
start_manager cell
until_true 20 state_is line1 running
has line1 count "$faults" && has line1 task Divide && has line1 present false || fail "$(plcctl show exception line1)"
exception line1 symbol | grep -qF 'divide()+0x' || fail "$(plcctl show exception line1)"
plcctl post event line1/divide >/dev/null
faults=$((faults + 1))
until_true 20 has line1 count "$faults"
kill -TERM "${managers[2]}"
wait "${managers[2]}" || fail "the manager ended with $?"
is "$(jq -r '.count' "$cell/cell.state/exceptions.cell/line1.exceptions")" "$faults" || fail "the disk has not the newest one"
nothing_left
