#!/usr/bin/env bash
# Hosts and clients of three versions of the contract in one domain. They are the first one, today's, and one that is still
# to come, with a topic, an operation, fields and a code more. The promises:
# * A client of any version sees, commands and posts to hosts of all versions with the topics and fields that both know.
# * A host answers an operation that it does not know with code 10, without delay.
# * The counts tell a client that a host does not have a topic; it does not wait. A client ignores a topic that it does not know.
# * A host skips a field of a request or a post that it does not know. A client skips such a field, or shows it by its name.
# * A client shows a code that it does not know as its number.
. "$(dirname "$0")/common.sh"

write_host cell "$first_core"
write_instance cell packer1 "$first_core" packer 'share_core = true' 'autostart = false'
start_manager cell
until_true 20 state_is packer1 offline

echo "- an old client and today's host"
said=$("$BIN/old_version" client "$PLCHOST_DOMAIN" cell packer1 product 100) || fail "old client: $said"
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

echo "- a client that is still to come and today's host"
plcctl --host cell stop instance packer1
said=$("$BIN/next_version" client "$PLCHOST_DOMAIN" cell packer1 product 50) || fail "next client: $said"
is "$said" "host cell api 1
bake 10 unknown operation
recipes: no such topic
recipe of packer1: not known
start 0 
post accepted 50 rejected 0" || fail "next client: $said"

echo "- today's client and a host that is still to come, beside the others"
"$BIN/next_version" host "$PLCHOST_DOMAIN" 2>"$cell/next.log" &
next=$!
others+=("$next")
three() { is "$(plcctl list hosts --json | jq -r '[.[].host] | sort | join(" ")')" "cell next old"; }
until_true 20 three
press_of_next() { plcctl --host next list instances --json | jq -r '.[] | [.name, .state, .recipe] | join(" ")'; }
is "$(press_of_next)" "press 77 rye" || fail "instances: $(press_of_next)"
plcctl --host next start instance press || fail "start"
is "$(press_of_next)" "press running rye" || fail "instances: $(press_of_next)"
is "$(plcctl --host next post event press/full --count 50)" "50 posted" || fail "post"
refused "of another version" plcctl --host next list tasks
is "$(plcctl --host next logs press --json | jq -r '.[] | [.text, .recipe] | join(": ")')" "the oven is hot: rye" ||
  fail "a field of a record: $(plcctl --host next logs press --json)"
if compgen -G "$BIN/../python/plchost_client*" >/dev/null; then
  said=$(PYTHONPATH=$BIN/../python python3 -c "
import plchost_client
client = plchost_client.Client(domain=$PLCHOST_DOMAIN, timeout=20.0)
record = client.status('instance', 'next')[0]
print(record['instance'], record['state'], record['recipe'], list(record)[-1])
print('recipe' in client.status('instance', 'cell')[0])" 2>&1) || fail "the client library: $said"
  is "$said" "press running rye recipe
False" || fail "the client library: $said"
fi

echo "- the first and the last version, without today's"
said=$("$BIN/old_version" client "$PLCHOST_DOMAIN" next press full 20) || fail "old client: $said"
is "$said" "host next api 1
instance press
start 0 
post accepted 20 rejected 0
objects: code 10" || fail "old client: $said"
said=$("$BIN/next_version" client "$PLCHOST_DOMAIN" old press full 20) || fail "next client: $said"
is "$said" "host old api 1
bake 10 unknown operation
recipes: no such topic
recipe of press: not known
start 0 
post accepted 20 rejected 0" || fail "next client: $said"
said=$("$BIN/next_version" client "$PLCHOST_DOMAIN" next press full 20) || fail "next client: $said"
is "$said" "host next api 1
bake 0 baked rye
recipe rye loaves 1
recipe of press: rye
start 0 
post accepted 20 rejected 0" || fail "the additions do not work: $said"

for host in "$old" "$next"; do
  kill -TERM "$host"
  wait "$host" || fail "a host of another version ended with $?"
done
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
