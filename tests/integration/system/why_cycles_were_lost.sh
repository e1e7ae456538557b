#!/usr/bin/env bash
# A task computes longer than its interval: plcctl tells why it has lost cycles, after a restart of the API server, too.
. "$(dirname "$0")/common.sh"

write_host cell "$first_core"
write_instance cell line1 "$first_core" losses 'share_core = true'
write_instance cell line2 "$first_core" losses 'share_core = true' 'autostart = false'
start_manager cell
until_true 20 state_is line1 running

# The machine may cost it cycles, too: of these only the long cycle is looked for.
long_cycles() { plcctl show losses "$1" --json | jq "map(select(.cause == \"long_cycle\" and .task == \"Loser\" and .lost >= 6)) | $2"; }
has_long_cycle() { [ "$(long_cycles "$1" length)" -ge 1 ]; }
ran() { [ "$(task line1/Loser cycles)" -ge 20 ]; }
until_true 20 ran

echo "- a task and an instance that lost none"
is "$(plcctl show losses line1/Burst)" "line1/Burst has lost no cycles" || fail "$(plcctl show losses line1/Burst)"
is "$(plcctl show losses line2)" "line2 has lost no cycles" || fail "$(plcctl show losses line2)"
is "$(plcctl show losses line2 --json)" "[]" || fail "$(plcctl show losses line2 --json)"
refused "line1, line2" plcctl show losses line3
refused "Burst" plcctl show losses line1/Nobody

echo "- the task that computed too long is told with the time that it had the core"
# Again and again: if other programs have the core just then for longer than the task, that is the cause.
told_after_a_post() { has_long_cycle line1 || { plcctl post event line1/overrun >/dev/null && sleep "0.$((RANDOM % 5 + 3))" && false; }; }
until_true 20 told_after_a_post
has_long_cycle line1/Loser || fail "$(plcctl show losses line1/Loser)"
is "$(long_cycles line1 '.[0] | .instance == "line1" and .interval_us == 5000 and .own_us >= 20000 and .holder == null and .span_us >= .own_us')" true ||
  fail "$(plcctl show losses line1 --json)"
plcctl show losses line1 | grep -qE 'line1 +Loser +[0-9]+ +long_cycle' || fail "$(plcctl show losses line1)"
is "$(plcctl show losses line1/Burst)" "line1/Burst has lost no cycles" || fail "$(plcctl show losses line1/Burst)"
is "$(plcctl list losses --json | jq -r 'map(.instance) | unique | join(" ")')" line1 || fail "$(plcctl list losses)"
PYTHONPATH=$BIN/../python python3 -c '
import os, plchost_client
with plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=20.0) as client:
    assert any(loss.cause == "long_cycle" and loss.task == "Loser" for loss in client.losses("cell")), client.losses()' || fail "the losses of Python"
plcctl show task line1/Loser | grep -qxF "why cycles were lost: plcctl show losses line1/Loser" || fail "$(plcctl show task line1/Loser)"

echo "- it is still known after a restart of the API server"
first=$(long_cycles line1 '.[0] | [.number, .time_unix_ns, .lost]')
server() { pgrep -f "plchost-dds --host cell .*$pool-cell "; }
old=$(server)
kill -KILL "$old"
is_new() { is "$(server | grep -cvx "$old")" 1; }
until_true 20 is_new
until_true 20 has_long_cycle line1/Loser
is "$(long_cycles line1 '.[0] | [.number, .time_unix_ns, .lost]')" "$first" || fail "it was $first: $(plcctl show losses line1 --json)"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
