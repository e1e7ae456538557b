#!/usr/bin/env bash
# Programs that were built from the first version of the contract talk to today's, and the other way round.
. "$(dirname "$0")/common.sh"

write_host cell "$first_core"
write_instance cell packer1 "$first_core" packer 'share_core = true' 'autostart = false'
start_manager cell
until_true 20 state_is packer1 offline

echo "- an old client and today's host"
said=$("$BIN/old_version" client "$PLCHOST_DOMAIN" packer1 product 100) || fail "old client: $said"
is "$said" "host cell api 1
instance packer1
start 0 
post accepted 100 rejected 0
objects listed" || fail "old client: $said"
state_is packer1 running || fail "packer1 is $(instance packer1 state)"
ran() { is "$(task packer1/Product cycles)" 100; }
until_true 20 ran

echo "- today's client and an old host, beside today's"
"$BIN/old_version" host "$PLCHOST_DOMAIN" 2>"$cell/old.log" &
old=$!
others+=("$old")
both() { is "$(plcctl list hosts --json | jq -r '[.[].host] | sort | join(" ")')" "cell old"; }
until_true 20 both
state_of_press() { plcctl --host old list instances --json | jq -r '.[] | .name + " " + .state'; }
is "$(state_of_press)" "press stopped" || fail "instances: $(state_of_press)"
plcctl --host old start instance press || fail "start"
is "$(state_of_press)" "press running" || fail "instances: $(state_of_press)"
is "$(plcctl --host old post event press/full --count 50)" "50 posted" || fail "post"

echo "- fields that the old host does not know are told"
refused "unknown operation" plcctl --host old stop instance press

kill -TERM "$old"
wait "$old" || fail "the old host ended with $?"
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
