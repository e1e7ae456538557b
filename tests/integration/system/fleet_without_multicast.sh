#!/usr/bin/env bash
# A network without multicast: hosts and clients find each other by the addresses that they are told, and a name that is given
# twice is refused there, too.
. "$(dirname "$0")/fleet.sh"

names=(cell1 cell2 cell3)
make_spaces "${names[@]}" twin desk
switch "${names[@]}" twin desk
for name in "${names[@]}" twin desk; do
  ip -n "$(space "$name")" link set cable multicast off
  ip -n "$(space switch)" link set "to-$name" multicast off
done
peers='peers = ["10.79.0.1", "10.79.0.2", "10.79.0.3"]'
for name in "${names[@]}"; do
  write_member "$name" "$peers"
  start_manager_within "$name"
done

echo "- without an address nobody is seen"
until_true 30 grep -q "is served in DDS domain" "$cell/cell3.log"
code=0
within desk "$BIN/plcctl" --timeout 2 --interface cable list hosts >/dev/null 2>&1 || code=$?
is "$code" 3 || fail "exit code $code: a host was found without multicast and without an address"

echo "- with addresses all are, and addressed by name"
desk_options+=(--peer 10.79.0.1 --peer 10.79.0.2 --peer 10.79.0.3)
until_true 60 sees "cell1 cell2 cell3"
desk list hosts
runs() { is "$(of "$1" list instances --json | jq -r '.[0].state')" running; }
until_true 30 runs cell2
of cell2 stop instance line1
is "$(of cell2 list instances --json | jq -r '.[0].state')" stopped || fail "cell2 does not obey"
until_true 30 runs cell3

echo "- a second cell2 is refused"
plc=$(of cell2 list instances --json | jq -r '.[0].pid')
write_member twin "$peers"
sed -i 's/^name = "twin"/name = "cell2"/' "$cell/twin.toml"
start_manager_within twin
until_true 30 grep -q "another host has the name 'cell2'; asks for it again" "$cell/twin.log"
# Its server may have begun anew: where the twin's had served for a moment, before it heard of the first one.
of_cell2() { of cell2 list instances --json >/dev/null; }
until_true 30 of_cell2
is "$(of cell2 list instances --json | jq -r '.[0].pid')" "$plc" || fail "cell2 was disturbed"

for manager in "${managers[@]}"; do
  kill -TERM "$manager"
  wait "$manager" || fail "a manager ended with $?"
done
nothing_left
