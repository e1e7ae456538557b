#!/usr/bin/env bash
# A manager that is killed while its plchost-dds hangs: the next one serves alone, and each change is recorded.
. "$(dirname "$0")/common.sh"

write_host cell1 "$first_core"
write_instance cell1 line1 "$first_core" bottling_line
start_manager cell1
until_true 20 state_is line1 running
servers() { pgrep -f "plchost-dds --host cell1 .*$pool-cell1 " || true; }
served() { plcctl list hosts --json | jq -e 'length == 1 and .[0].state == "alive"'; }
audit=$cell/cell1.state/audit.cell1

pid=$(instance line1 pid)
take_over() {
  hanging=$(servers)
  others+=("$hanging")
  kill -STOP "$hanging"
  kill -KILL "${managers[-1]}"
  wait "${managers[-1]}" 2>/dev/null || true  # it has the lock of the run directory until it has ended
  start_manager cell1
  gone() { ! kill -0 "$hanging" 2>/dev/null; }
  until_true 20 gone
  others=()
  until_true 20 served
  until_true 20 state_is line1 running
  is "$(instance line1 pid)" "$pid" || fail "line1 is another process"
}
costs_no_cycle line1/Fill take_over
for round in 1 2 3; do
  take_over
  is "$(servers | wc -l)" 1 || fail "servers of the host: $(servers)"
  plcctl stop instance line1
  plcctl start instance line1
  is "$(cat "$audit"/*.log | grep -c '"what":"stop"')" "$round" || fail "the audit log misses a change"
done
"$BIN/plcctl" verify audit "$audit" || fail "the chain is broken"
kill -TERM "${managers[-1]}"
wait "${managers[-1]}" || fail "the manager ended with $?"
nothing_left
