#!/usr/bin/env bash
# A client of another vendor (Fast DDS), generated from api/control.idl, does what plcctl does. It sees the host and
# its instances, starts one, posts events to it with acknowledgement, and reads its status.
. "$(dirname "$0")/common.sh"

write_host cell "$first_core"
write_instance cell packer1 "$first_core" packer 'share_core = true' 'autostart = false'
write_instance cell line1 "$first_core" bottling_line 'share_core = true' 'autostart = false'
start_manager cell
until_true 20 state_is packer1 offline

vendor() { "$BIN/fastdds_client" --domain "$PLCHOST_DOMAIN" "$@"; }
# states: the numbers of InstanceStatus.state: 0 offline, 2 running, 3 stopped
vendors_state() { vendor instances | awk -v name="$1" '$1 == name { print $2 }'; }

echo "- sees the host"
read -r host pid version count < <(vendor hosts)
is "$host $count" "cell 2" || fail "hosts: $host $pid $version $count"
is "$pid" "$(pgrep -P "${managers[0]}" -x plchost-dds)" || fail "presence of process $pid"
is "$version" "$(plcctl list hosts --json | jq -r '.[0].version')" || fail "version $version"

echo "- sees all instances, as plcctl does"
is "$(vendor instances | awk '{ print $1 }' | tr '\n' ' ')" "line1 packer1 " || fail "instances: $(vendor instances)"
is "$(vendors_state packer1)" 0 || fail "instances: $(vendor instances)"

echo "- starts one"
said=$(vendor start packer1) || fail "start: $said"
is "$(vendors_state packer1)" 2 || fail "instances: $(vendor instances)"
state_is packer1 running || fail "packer1 is $(instance packer1 state)"

echo "- a refusal has its code and says why"
if said=$(vendor start packer9); then fail "packer9 was started: $said"; fi
case "$said" in "2 "*packer9*line1*) ;; *) fail "start packer9: $said" ;; esac

echo "- posts, acknowledged, and the task runs once for each"
before=$(task packer1/Product cycles)
is "$(vendor post packer1/product 1000)" "accepted 1000 no_task 0 rejected 0 " || fail "post"
ran() { [ "$(vendor task packer1/Product | cut -d' ' -f1)" = $((before + 1000)) ]; }
until_true 20 ran
is "$(vendor task packer1/Product | cut -d' ' -f2-)" "2 product" || fail "task: $(vendor task packer1/Product)"
is "$(task packer1/Product cycles)" $((before + 1000)) || fail "$(task packer1/Product cycles) cycles"

echo "- a post to no event is rejected by name"
if said=$(vendor post packer1/produkt); then fail "posted: $said"; fi
grep -qF "rejected 1 no external event 'packer1/produkt'" <<<"$said" || fail "post packer1/produkt: $said"

echo "- goes on with the next API server"
kill -KILL "$(pgrep -P "${managers[0]}" -x plchost-dds)"
is "$(vendor post packer1/product 10)" "accepted 10 no_task 0 rejected 0 " || fail "post after the server was replaced"

echo "- stops it"
said=$(vendor stop packer1) || fail "stop: $said"
is "$(vendors_state packer1)" 3 || fail "instances: $(vendor instances)"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
