#!/usr/bin/env bash
# Two managers, one DDS domain: both are seen, each is addressed by name.
. "$(dirname "$0")/common.sh"

for host in north south; do
  write_host "$host" "$first_core"
  write_instance "$host" packer1 "$first_core" packer 'scheduler = "CmpScheduleTimer"'
  start_manager "$host"
done
both_running() { [ "$(plcctl list instances --json | jq '[.[] | select(.state == "running")] | length')" = 2 ]; }
until_true 20 both_running
is "$(plcctl list hosts --json | jq -r '[.[].host // .[].name] | unique | sort | join(",")')" north,south || fail "two hosts"

cycles() { plcctl list tasks --json | jq -r ".[] | select(.host == \"$1\" and .task == \"Product\") | .cycles"; }
before_north=$(cycles north)
before_south=$(cycles south)
code=0
said=$(plcctl post event packer1/product 2>&1) || code=$?
is "$code" 2 || fail "exit code $code where no host is named"
grep -q "north, south" <<<"$said" || fail "the hosts are not listed: $said"
plcctl --host south post event packer1/product --count 50
south_ran() { [ "$(cycles south)" -ge $((before_south + 50)) ]; }
until_true 10 south_ran
is "$(cycles north)" "$before_north" || fail "the post reached the wrong host"

plcctl --host north stop instance packer1
is "$(plcctl list instances --json | jq -r '.[] | select(.host == "north") | .state')" stopped || fail "north runs"
is "$(plcctl list instances --json | jq -r '.[] | select(.host == "south") | .state')" running || fail "south was stopped"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "north ended with $?"
plcctl --host south list tasks >/dev/null || fail "south does not answer when north is gone"
kill -TERM "${managers[1]}"
wait "${managers[1]}" || fail "south ended with $?"
nothing_left
