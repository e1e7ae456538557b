#!/usr/bin/env bash
# Two managers, one DDS domain: both are seen, each is addressed by name, both by a pattern or a label.
. "$(dirname "$0")/common.sh"

for host in north south; do
  write_host "$host" "$first_core"
  echo "labels = [\"hall1\", \"$host-wing\"]" >>"$cell/$host.toml"
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

state() { plcctl list instances --json | jq -r ".[] | select(.host == \"$1\") | .state"; }
echo "- several at once: all, by pattern, by label"
is "$(plcctl --host all restart instance packer1)" $'north: packer1: restarted\nsouth: packer1: restarted' || fail "not both"
is "$(state north),$(state south)" running,running || fail "$(plcctl list instances)"
plcctl --host 'n?rth' stop instance packer1
is "$(state north),$(state south)" stopped,running || fail "a pattern: $(plcctl list instances)"
plcctl --label hall1 --label south-wing stop instance packer1
is "$(state north),$(state south)" stopped,stopped || fail "two labels: $(plcctl list instances)"
is "$(plcctl --label hall1 start instance packer1 --json | jq -r 'map(.host + " " + (.done | tostring)) | join(",")')" "north true,south true" ||
  fail "a label"
is "$(plcctl --label north-wing list hosts --json | jq -r '.[].labels')" hall1,north-wing || fail "$(plcctl list hosts)"
if said=$(plcctl --label cellar stop instance packer1 2>&1); then fail "a label that no host has"; fi
grep -qF "north (hall1, north-wing), south (hall1, south-wing)" <<<"$said" || fail "$said"
is "$(plcctl --host all load application packer1 "$APPLICATIONS/drive_axis.so" | sort)" \
  $'north: version 1 (drive_axis.so) is loaded\nsouth: version 1 (drive_axis.so) is loaded' || fail "$(plcctl list applications)"
is "$(plcctl list applications --json | jq -r 'map(.host + " " + .loaded) | join(",")')" "north loaded,south loaded" ||
  fail "not on both: $(plcctl list applications)"
is "$(plcctl --host all rollback application packer1 --json | jq -r 'map(.done | tostring) | join(",")')" true,true || fail "rollback"
code=0
plcctl --host all stop instance nowhere >/dev/null 2>&1 || code=$?
is "$code" 1 || fail "exit code $code where no host has the instance"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "north ended with $?"
plcctl --host south list tasks >/dev/null || fail "south does not answer when north is gone"
kill -TERM "${managers[1]}"
wait "${managers[1]}" || fail "south ended with $?"
nothing_left
