#!/usr/bin/env bash
# Eight controllers on one switch, and a desk: all are seen and addressed by name without any address being named. One
# vanishes and comes back, the network is divided and mended, names are given twice, a link is slow and loses packets.
. "$(dirname "$0")/fleet.sh"

names=(cell1 cell2 cell3 cell4 cell5 cell6 cell7 cell8)
make_spaces "${names[@]}" twin desk
switch "${names[@]}" twin desk
for name in "${names[@]}"; do
  write_member "$name"
  start_manager_within "$name"
done
all=${names[*]}

echo "- the desk sees all eight, with load and clock"
until_true 60 sees "$all"
all_run() { is "$(desk list instances --json | jq '[.[] | select(.state == "running")] | length')" 8; }
until_true 60 all_run
table=$(desk list hosts)
echo "$table"
# All have the same clock here: each measured offset must be zero, within the error that it claims. A host that does not
# answer within a second is shown without it.
seen_whole() {
  hosts=$(desk list hosts --json)
  jq -e 'all(.[]; .clock_offset_us == null or (.clock_offset_us | fabs) <= .clock_uncertainty_us)' <<<"$hosts" >/dev/null ||
    wrong_clock=$hosts
  jq -e 'all(.[];
    .state == "alive" and .running == 1 and .instances == 1 and .cores >= 1 and .load >= 0 and
    .available_mib > 0 and .memory_mib >= .available_mib and .uptime_s >= 0 and (.secured | not) and
    .clock_offset_us != null and .clock_uncertainty_us > 0)' <<<"$hosts"
}
wrong_clock=
until_true 30 seen_whole
[ -z "$wrong_clock" ] || fail "list hosts: $wrong_clock"
as_csv() { is "$(of cell7 list hosts -o csv | tail -n 1 | cut -d, -f1,2)" cell7,alive; }
until_true 30 as_csv

echo "- one vanishes: a watch says so, a fresh look does not show it; it comes back as it was"
ip netns exec "$(space desk)" "$BIN/plcctl" --timeout 10 --interface cable --watch --every 0.5 list hosts --json >"$cell/watch.log" 2>&1 &
others+=($!)
watch_says() { jq -s -e ".[-1] | any(.[]; .host == \"$1\" and .state == \"$2\")" "$cell/watch.log"; }
until_true 30 watch_says cell3 alive
before=$(pid_of cell3) server=$(host_field cell3 server_pid) cycles=$(cycles_of cell3)
unplug cell3
until_true 30 watch_says cell3 silent
until_true 30 sees "${all/cell3 /}"
plug cell3
until_true 30 sees "$all"
until_true 30 watch_says cell3 alive
is "$(pid_of cell3),$(host_field cell3 server_pid)" "$before,$server" || fail "cell3 is not what it was"
[ "$(cycles_of cell3)" -gt "$cycles" ] || fail "cell3 stood still while nobody saw it"

echo "- a killed server is back, a killed manager's instances run on"
server=$(host_field cell4 server_pid)
kill -KILL "$server"
other_server() { [ "$(host_field cell4 server_pid)" != "$server" ]; }
until_true 30 other_server
before=$(pid_of cell5) cycles=$(cycles_of cell5)
kill -KILL "${managers[4]}"
wait "${managers[4]}" 2>/dev/null || true
until_true 30 sees "${all/cell5 /}"
kill -0 "$before" || fail "the instance of a killed manager has ended"
start_manager_within cell5
until_true 30 sees "$all"
adopted() { is "$(pid_of cell5)" "$before"; }
until_true 30 adopted
[ "$(cycles_of cell5)" -gt "$cycles" ] || fail "cell5 stood still without a manager"

echo "- a second cell1 is refused; the first one goes on, and tells of it"
write_member twin
sed -i 's/^name = "twin"/name = "cell1"/' "$cell/twin.toml"
start_manager_within twin
twin=${managers[-1]}
until_true 30 grep -q "another host has the name 'cell1'; asks for it again" "$cell/twin.log"
is "$(host_field cell1 manager_pid)" "${managers[0]}" || fail "cell1 was disturbed"
tells_of_rival() { host_field cell1 problem | grep -q 'another host wants this name'; }
until_true 30 tells_of_rival
plc_of_twin() { is "$(pgrep -c -P "$twin" plc-instance)" 1; }
until_true 30 plc_of_twin
kill -TERM "$twin"
wait "$twin" || fail "the manager of the second cell1 ended with $?"
unset 'managers[-1]'

echo "- a divided network: each half goes on; when it is mended, all are seen again, and one of two cell1"
ip -n "$(space switch)" link add name far type bridge
ip -n "$(space switch)" link set far up
for name in cell5 cell6 cell7 cell8 twin; do ip -n "$(space switch)" link set "to-$name" master far; done
until_true 30 sees "cell1 cell2 cell3 cell4"
start_manager_within twin
twin=${managers[-1]}
far_sees() { within cell5 "$BIN/plcctl" --timeout 3 --interface cable list hosts --json | jq -r '[.[].host] | join(" ")' | grep -qx "$1"; }
until_true 30 far_sees "cell1 cell5 cell6 cell7 cell8"
for name in cell5 cell6 cell7 cell8 twin; do ip -n "$(space switch)" link set "to-$name" master bridge; done
until_true 60 sees "$all"
refused_twice() { [ "$(grep -c "another host has the name 'cell1'; asks for it again" "$cell/twin.log")" -ge 2 ]; }
until_true 30 refused_twice
until_true 30 sees "$all"
is "$(host_field cell1 manager_pid)" "${managers[0]}" || fail "the younger cell1 has won: $(desk list hosts)"
of cell1 list tasks >/dev/null || fail "cell1 is not complete"
kill -TERM "$twin"
wait "$twin" || fail "the manager of the second cell1 ended with $?"
unset 'managers[-1]'

echo "- a link of 50 ms that loses 10 % each way"
ip -n "$(space switch)" link set to-cell8 nomaster
ip -n "$(space switch)" link add name slow type veth peer name slow-port
ip -n "$(space switch)" link set slow-port master bridge
ip -n "$(space switch)" link set slow-port up
ip -n "$(space switch)" link set slow up
ip netns exec "$(space switch)" python3 "$(dirname "$0")/slow_link.py" to-cell8 slow 50 10 >"$cell/slow.log" 2>&1 &
others+=($!)
until_true 10 grep -q carries "$cell/slow.log"
until_true 60 sees "$all"
lossy() { within desk "$BIN/plcctl" --timeout 60 --interface cable --host cell8 "$@"; }
posts() { lossy list events --json | jq -r '.[] | select(.event == "product") | .posts'; }
before=$(posts)
is "$(lossy post event line1/product --count 500)" "500 posted" || fail "posts over the slow link"
counted() { [ "$(posts)" = $((before + 500)) ]; }
until_true 30 counted
lossy stop instance line1
is "$(lossy list instances --json | jq -r '.[0].state')" stopped || fail "stop over the slow link"
lossy start instance line1
lossy list hosts
slow_clock() {
  hosts=$(lossy list hosts --json)
  jq -e '.[0].clock_offset_us != null' <<<"$hosts"
}
until_true 30 slow_clock
jq -e '.[0] | .clock_uncertainty_us >= 50000 and (.clock_offset_us | fabs) <= .clock_uncertainty_us' <<<"$hosts" >/dev/null ||
  fail "the clock over the slow link: $hosts"

for manager in "${managers[@]}"; do
  kill -TERM "$manager" 2>/dev/null || continue
  wait "$manager" || fail "a manager ended with $?"
done
nothing_left
