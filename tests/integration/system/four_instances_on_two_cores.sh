#!/usr/bin/env bash
# The main job as a user does it: own configuration, four instances on the machine's cores, every verb.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
number=0
for entry in line1:bottling_line:CmpSchedule drive1:drive_axis:CmpScheduleOneShot packer1:packer:CmpScheduleTimer line2:bottling_line:CmpSchedule; do
  IFS=: read -r name application scheduler <<<"$entry"
  write_instance cell "$name" $((number % 2 == 0 ? first_core : last_core)) "$application" \
    "scheduler = \"$scheduler\"" 'share_core = true'
  number=$((number + 1))
done
"$BIN/plchostd" --check-config "$cell/cell.toml" >/dev/null || fail "the configuration is refused"
start_manager cell
manager=${managers[0]}
four_running() { [ "$(plcctl list instances --json | jq '[.[] | select(.state == "running")] | length')" = 4 ]; }
until_true 20 four_running

echo "- every instance is on its core, as the kernel says"
for name in line1 drive1 packer1 line2; do
  pid=$(instance "$name" pid)
  for thread in /proc/"$pid"/task/*; do
    granted=$(grep Cpus_allowed_list "$thread/status" | cut -f2)
    is "$granted" "$(instance "$name" core)" || fail "thread of $name may run on $granted"
  done
done

echo "- tasks cycle, and every field is there"
fields='["instance","task","kind","priority","interval_us","state","cycles","lost_cycles","lost_events","exec_last_us","exec_avg_us","exec_min_us","exec_max_us","latency_p50_us","latency_p99_us","latency_max_us","jitter_max_us"]'
is "$(plcctl list tasks --json | jq "map(. as \$t | $fields | map(in(\$t)) | all) | all")" true || fail "a field is missing"
is "$(plcctl list instances --json | jq 'map(has("host") and has("name") and has("state") and has("pid") and has("core") and has("scheduler") and has("application") and has("restarts")) | all')" true || fail "a field is missing"

echo "- 10,000 posts while the scheduler is switched again and again: 10,000 cycles"
before=$(task packer1/Product cycles)
plcctl post event packer1/product --count 10000 --interval-us 300 >"$cell/post.log" 2>&1 &
poster=$!
others+=("$poster")
switches=0
while kill -0 "$poster" 2>/dev/null; do
  for scheduler in CmpScheduleOneShot CmpSchedule CmpScheduleTimer; do
    plcctl set scheduler packer1 "$scheduler" >/dev/null
    switches=$((switches + 1))
  done
done
wait "$poster" || fail "the poster failed: $(cat "$cell/post.log")"
pack_ran() { [ "$(task packer1/Product cycles)" -ge $((before + $1)) ]; }
until_true 20 pack_ran 10000
sleep 0.5
is "$(task packer1/Product cycles)" $((before + 10000)) || fail "$(($(task packer1/Product cycles) - before)) cycles for 10,000 posts, $switches switches"
[ "$switches" -ge 6 ] || fail "only $switches switches"

echo "- 100,000 posts at full rate"
before=$(task packer1/Product cycles)
plcctl --timeout 60 post event packer1/product --count 100000 >/dev/null || fail "posting failed"
until_true 60 pack_ran 100000
sleep 0.5
is "$(task packer1/Product cycles)" $((before + 100000)) || fail "$(($(task packer1/Product cycles) - before)) cycles for 100,000 posts"

echo "- kill -9 of an instance under load: it is back, with a new pid, and the others stay"
old=$(instance line1 pid)
drive=$(instance drive1 pid)
read -r cycles lost <<<"$(totals drive1)"
kill -KILL "$old"
line1_is_back() { state_is line1 running && [ "$(instance line1 pid)" != "$old" ] && [ "$(instance line1 restarts)" -ge 1 ]; }
until_true 20 line1_is_back
is "$(instance drive1 pid)" "$drive" || fail "drive1 is another process"
undisturbed drive1 "$cycles" "$lost"

echo "- kill -9 of the API server costs a reconnect: the PLCs go on"
read -r cycles lost <<<"$(totals drive1)"
kill -KILL "$(pgrep -P "$manager" -x plchost-dds)"
until_true 20 state_is drive1 running
is "$(instance drive1 pid)" "$drive" || fail "drive1 is another process"
undisturbed drive1 "$cycles" "$lost"

echo "- life cycle: stop, start, reset, restart"
plcctl stop instance line2 && state_is line2 stopped || fail "line2 is not stopped"
plcctl start instance line2 && state_is line2 running || fail "line2 does not run"
old=$(instance line2 pid)
plcctl reset instance line2 && state_is line2 stopped || fail "reset leaves line2 stopped"
[ "$(instance line2 pid)" != "$old" ] || fail "reset is a fresh process"
plcctl restart instance line2 && state_is line2 running || fail "restart lets line2 run"

echo "- load another program; wrong files are refused and what runs, runs on"
plcctl load application line2 "$APPLICATIONS/drive_axis.so" && state_is line2 running || fail "loading failed"
pid=$(instance line2 pid)
refused "common.sh" plcctl load application line2 "$(dirname "$0")/common.sh"
refused "nowhere.so" plcctl load application line2 "$cell/nowhere.so"
is "$(instance line2 pid)" "$pid" || fail "a refused file disturbed line2"

echo "- things that do not exist are named"
refused nobody plcctl start instance nobody
refused nothing plcctl post event packer1/nothing
refused CmpScheduleTimer plcctl set scheduler line1 CmpSchedul
plcctl register event line1/later && plcctl post event line1/later || fail "register and post"
plcctl unregister event line1/later
refused later plcctl post event line1/later

echo "- SIGTERM ends all of it and leaves nothing"
kill -TERM "$manager"
wait "$manager" || fail "the manager ended with $?"
nothing_left
