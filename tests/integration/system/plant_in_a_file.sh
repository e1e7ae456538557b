#!/usr/bin/env bash
# How two controllers are to be stands in a file: `diff` shows what is not so, `apply` brings them there, and there is nothing
# left for a second one. A change that fails at one is reported, and done at the others.
. "$(dirname "$0")/common.sh"

for host in north south; do
  write_host "$host" "$first_core"
  write_instance "$host" line1 "$first_core" packer 'share_core = true'
  write_instance "$host" line2 "$first_core" packer 'share_core = true' 'autostart = false'
  start_manager "$host"
done
field() { plcctl --host "$1" list instances --json | jq -r ".[] | select(.name == \"$2\") | .$3"; }
is_field() { is "$(field "$1" "$2" "$3")" "$4"; }
until_true 20 is_field north line1 state running
until_true 20 is_field south line1 state running

# The same program under another name, so that there is something to load.
cp "$APPLICATIONS/packer.so" "$cell/packer2.so"
cat >"$cell/plant.toml" <<END
[[host]]
name = "north"
[[host.instance]]
name = "line1"
scheduler = "CmpScheduleTimer"
application = "$cell/packer2.so"
state = "running"
events = ["product", "stop"]
[[host.instance]]
name = "line2"
state = "running"

[[host]]
name = "south"
[[host.instance]]
name = "line1"
application = "$APPLICATIONS/packer.so"
state = "stopped"
END
# exits CODE COMMAND...: its output goes to $said
exits() {
  local wanted=$1 code=0
  shift
  said=$("$@" 2>&1) || code=$?
  [ "$code" -eq "$wanted" ] || fail "exit code $code instead of $wanted: $* ($said)"
}

echo "- the changes to come"
registered() { plcctl --host north list events --json | jq -e 'any(.[]; .instance == "line1" and .event == "product" and .registered)' >/dev/null; }
until_true 20 registered
differences="north/line1: application: $APPLICATIONS/packer.so -> $cell/packer2.so
north/line1: scheduler: CmpSchedule -> CmpScheduleTimer
north/line1: event stop: not registered -> registered
north/line2: state: offline -> running
south/line1: state: running -> stopped"
exits 1 plcctl diff -f "$cell/plant.toml"
is "$said" "$differences" || fail "diff: $said"
exits 1 plcctl apply --dry-run -f "$cell/plant.toml"
is "$said" "$differences" || fail "with --dry-run: $said"
is_field north line1 scheduler CmpSchedule || fail "--dry-run changes things"
exits 1 plcctl diff -f - <"$cell/plant.toml"
is "$(plcctl diff -f "$cell/plant.toml" --json | jq -r '.[1] | [.host, .instance, .what, .is, .wanted, .result, .line] | join(" ")')" \
  "north line1 scheduler CmpSchedule CmpScheduleTimer differs 3" || fail "as JSON: $(plcctl diff -f "$cell/plant.toml" --json)"

echo "- it is changed, once"
exits 0 plcctl apply -f "$cell/plant.toml"
echo "$said"
is "$(grep -c ': done' <<<"$said")" 5 || fail "apply: $said"
for wanted in "north line1 scheduler CmpScheduleTimer" "north line1 application $cell/packer2.so" "north line1 state running" \
  "north line2 state running" "south line1 state stopped" "south line2 state offline"; do
  is_field $wanted || fail "not so: $wanted"
done
process=$(field north line1 pid)
exits 0 plcctl diff -f "$cell/plant.toml"
is "$said" "" || fail "a difference is left: $said"
exits 0 plcctl apply -f "$cell/plant.toml"
is "$said" "nothing to change" || fail "the second time: $said"
is "$(field north line1 pid)" "$process" || fail "a second apply has restarted it"

echo "- of one host only; a host that is not there and an instance that is not there are told, the others go on"
plcctl --host north stop instance line2
plcctl --host south start instance line1
exits 1 plcctl --host south diff -f "$cell/plant.toml"
is "$said" "south/line1: state: running -> stopped" || fail "of one host: $said"
printf '[[host.instance]]\nname = "line9"\nstate = "running"\n[[host]]\nname = "west"\n' >>"$cell/plant.toml"
lines=$(wc -l <"$cell/plant.toml")
exits 2 "$BIN/plcctl" --timeout 1 diff -f "$cell/plant.toml"
exits 1 "$BIN/plcctl" --timeout 8 apply -f "$cell/plant.toml"
grep -qF "$cell/plant.toml:$((lines - 1)): west: no host 'west' answers; those that do: north, south" <<<"$said" || fail "$said"
grep -qF "$cell/plant.toml:$((lines - 4)): south/line9: no instance 'line9' on host 'south' (did you mean 'line1'?)" <<<"$said" || fail "$said"
grep -qF "north/line2: state: stopped -> running: done" <<<"$said" || fail "north was not brought there: $said"
is_field south line1 state stopped || fail "south was not brought there: $said"
printf '[[host]]\nname = "west"\n' >"$cell/west.toml"
exits 3 "$BIN/plcctl" --timeout 1 apply -f "$cell/west.toml"

echo "- a refusal of a host is told with the line, and what counts on it is not done"
printf '[[host]]\nname = "north"\n[[host.instance]]\nname = "line1"\napplication = "/nowhere.so"\nscheduler = "CmpSchedule"\n' >"$cell/wrong.toml"
exits 1 plcctl apply -f "$cell/wrong.toml"
grep -qF "$cell/wrong.toml:3: north/line1: application: $cell/packer2.so -> /nowhere.so: /nowhere.so is refused" <<<"$said" || fail "$said"
is_field north line1 scheduler CmpScheduleTimer || fail "it went on after a refusal"
printf '[[host]]\nname = "north"\n[[host.instance]]\nname = "line1"\nscheduler = "CmpShedule"\n' >"$cell/wrong.toml"
printf '[[host.instance]]\nname = "line2"\nstate = "stopped"\n' >>"$cell/wrong.toml"
for verb in diff apply; do
  exits 2 plcctl $verb -f "$cell/wrong.toml"
  grep -qF "$cell/wrong.toml:3: north/line1: " <<<"$said" || fail "the place is not told: $said"
  grep -qF "did you mean 'CmpSchedule'?" <<<"$said" || fail "the schedulers of the host are not listed: $said"
done
is_field north line2 state running || fail "a file with a scheduler that the host does not have changed something"

echo "- a file that is not right changes nothing"
printf '[[host]]\nname = "north"\n[[host.instance]]\nname = "line1"\nstate = "runing"\nshedule = "x"\n' >"$cell/wrong.toml"
exits 2 plcctl apply -f "$cell/wrong.toml"
grep -qF "$cell/wrong.toml:5: [[host.instance]] of 'north' 'line1' state: \"runing\" is not known; allowed are running, stopped" <<<"$said" || fail "$said"
grep -qF "$cell/wrong.toml:6: " <<<"$said" || fail "only the first error: $said"

for manager in "${managers[@]}"; do
  kill -TERM "$manager"
  wait "$manager" || fail "a manager ended with $?"
done
nothing_left
