#!/usr/bin/env bash
# The shortcomings of this host: told by a real manager, over DDS, whatever this host is like. And the idle states of a core
# that an instance holds, which are as before when it was killed.
. "$(dirname "$0")/common.sh"

core=$first_core
printf '[SysTimer]\nLinux.IdleStates=HoldCore\n' >"$cell/packer1.cfg"
write_host north "$core"
write_instance north packer1 "$core" packer 'settings = "packer1.cfg"' 'restart = "never"'
latency=/sys/devices/system/cpu/cpu$core/power/pm_qos_resume_latency_us
if [ -w "$latency" ]; then
  exec {turn}<"$latency"
  flock "$turn" # tests with the real file take turns
  before=$(cat "$latency")
fi
start_manager north
until_true 20 state_is packer1 running

code=0
findings=$(plcctl check host --json --all) || code=$?
case "$(jq -r '[.[].level] | if index("problem") then 1 elif index("warning") then 4 else 0 end' <<<"$findings")" in
  "$code") ;;
  *) fail "exit code $code does not fit: $findings" ;;
esac
[ "$(jq length <<<"$findings")" -ge 25 ] || fail "not all checks have said something: $findings"
is "$(jq -r '[.[].id] | unique | length' <<<"$findings")" "$(jq length <<<"$findings")" || fail "a check is there twice"
is "$(jq '[.[] | select(.found == "" or .why == "" or .subject == "")] | length' <<<"$findings")" 0 || fail "empty: $findings"
for id in real_time_class memory_lock preemption isolated_cores siblings idle_states governor throttling timer_slack \
  priority_limit interrupts swap; do
  jq -e --arg id $id 'any(.[]; .id == $id)' <<<"$findings" >/dev/null || fail "no finding of $id"
done
for worse in $(jq -r '.[] | select(.level == "warning" or .level == "problem") | .subject | split(" ")[0]' <<<"$findings" | sort -u); do
  grep -q "host: .*$worse" "$cell/north.log" || fail "the log of the manager does not name '$worse'"
done

idle() { instance_field packer1 idle_states; }
instance_field() { plcctl show instance "$1" --json | jq -r ".[0].$2"; }
if [ -w "$latency" ]; then
  is "$(idle)" "held for core $core" || fail "idle states: $(idle)"
  is "$(cat "$latency")" n/a || fail "core $core may sleep: $(cat "$latency")"
  kill -KILL "$(instance packer1 pid)"
  restored() { [ "$(cat "$latency")" = "$before" ]; }
  until_true 10 restored
  until_true 10 test ! -e "$cell/north/core$core.latency"
else
  grep -qE '^(held for all cores; not for each core|not held): ' <<<"$(idle)" || fail "idle states: $(idle)"
fi
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "north ended with $?"
nothing_left
