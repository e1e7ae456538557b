#!/usr/bin/env bash
# Not part of the test run, because of what it takes: BIN and APPLICATIONS as for the stories, then the numbers of hosts and
# of instances in all (default 8 and 500). Each host in a namespace of its own on one switch. Says what they cost.
. "$(dirname "$0")/fleet.sh"

host_count=${1:-8} instance_count=${2:-500}
names=()
for number in $(seq "$host_count"); do names+=("cell$number"); done
make_spaces "${names[@]}" desk
switch "${names[@]}" desk
made=0
for name in "${names[@]}"; do
  write_host "$name" "$first_core"
  printf '[dds]\ninterface = "cable"\nallow_unsecured = true\n' >>"$cell/$name.toml"
  share=$(((instance_count - made + host_count - 1) / host_count))
  for number in $(seq "$share"); do
    write_instance "$name" "line$number" "$first_core" packer 'share_core = true' "settings = \"$cell/idle.cfg\""
  done
  made=$((made + share)) host_count=$((host_count - 1))
done
free_mib() { awk '/MemAvailable/ { print int($2 / 1024) }' /proc/meminfo; }
before=$(free_mib) start=$SECONDS
for name in "${names[@]}"; do start_manager_within "$name"; done
running() { desk list hosts --json | jq 'map(.running) | add'; }
all_run() { is "$(running)" "$instance_count"; }
until_true 900 all_run
echo "$instance_count instances on ${#names[@]} hosts run after $((SECONDS - start)) s"
sleep 10
echo "memory: $((before - $(free_mib))) MiB in all; $(((before - $(free_mib)) * 1024 / instance_count)) KiB for each instance"
desk list hosts
# share PROGRAM: processor time of all processes of that name in 10 s, in ms
ticks() { cat $(printf '/proc/%s/stat ' $(pgrep -x "$1")) 2>/dev/null | awk '{ sum += $14 + $15 } END { print sum }'; }
for program in plchostd plchost-dds plc-instance; do
  first=$(ticks "$program")
  sleep 10
  echo "$program: $((($(ticks "$program") - first) * 10)) ms of processor time in 10 s, resident $(ps -C "$program" -o rss= | awk '{ sum += $1 } END { printf "%d KiB on average", sum / NR }')"
done
timed() { # WHAT COMMAND...
  local what=$1 begin end
  shift
  begin=$(date +%s%N)
  "$@" >/dev/null || fail "$*"
  end=$(date +%s%N)
  echo "$what: $(((end - begin) / 1000000)) ms"
}
timed "list hosts" desk list hosts
timed "list instances, of all" desk list instances
is "$(desk list instances --json | jq 'length')" "$instance_count" || fail "not all are listed"
for name in "${names[@]}"; do
  printf '[[host]]\nname = "%s"\n' "$name"
  for number in $(seq "$(grep -c '^\[\[instance' "$cell/$name.toml")"); do
    printf '[[host.instance]]\nname = "line%s"\nstate = "stopped"\n' "$number"
  done
done >"$cell/plant.toml"
begin=$(date +%s%N)
desk --timeout 120 apply -f "$cell/plant.toml" >"$cell/apply.log" || fail "apply: $(tail -n 5 "$cell/apply.log")"
echo "apply, all stopped: $((($(date +%s%N) - begin) / 1000000)) ms, $(grep -c ': done' "$cell/apply.log") changes"
is "$(running)" 0 || fail "some still run"
for manager in "${managers[@]}"; do kill -TERM "$manager"; done
for manager in "${managers[@]}"; do wait "$manager" || fail "a manager ended with $?"; done
nothing_left
