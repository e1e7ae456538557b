#!/usr/bin/env bash
# Not part of the test run, because of what it takes. Arguments: BIN and APPLICATIONS as for the stories, then the numbers of
# hosts and of instances in all (default 8 and 500). Each host in a namespace of its own on one switch. `plcctl apply` runs
# all of them, those of a host one after the other. 500 that start at once on two cores fail: the holder of the lock of their
# pool for set-up calls does not get a core within 100 ms. Says what they cost.
. "$(dirname "$0")/fleet.sh"

host_count=${1:-8} instance_count=${2:-500}
names=()
for number in $(seq "$host_count"); do names+=("cell$number"); done
make_spaces "${names[@]}" desk
switch "${names[@]}" desk
made=0
cores=("$first_core" "$last_core")
[ "$first_core" != "$last_core" ] || cores=("$first_core")
for name in "${names[@]}"; do
  write_host "$name" "${cores[@]}"
  printf '[dds]\ninterface = "cable"\nallow_unsecured = true\n' >>"$cell/$name.toml"
  share=$(((instance_count - made + host_count - 1) / host_count))
  for number in $(seq "$share"); do
    write_instance "$name" "line$number" "${cores[number % ${#cores[@]}]}" packer 'share_core = true' "settings = \"$cell/idle.cfg\"" 'autostart = false'
  done
  made=$((made + share)) host_count=$((host_count - 1))
done
free_mib() { awk '/MemAvailable/ { print int($2 / 1024) }' /proc/meminfo; }
before=$(free_mib)
for name in "${names[@]}"; do start_manager_within "$name"; done
running() { desk list hosts --json | jq 'map(.running) | add'; }
known() { is "$(desk list hosts --json | jq 'map(.instances) | add')" "$instance_count"; }
until_true 60 known
# plant STATE: that all are to be in
plant() {
  local name number
  for name in "${names[@]}"; do
    printf '[[host]]\nname = "%s"\n' "$name"
    for number in $(seq "$(grep -c '^\[\[instance' "$cell/$name.toml")"); do
      printf '[[host.instance]]\nname = "line%s"\nstate = "%s"\n' "$number" "$1"
    done
  done >"$cell/$1.toml"
}
# brought_to STATE
brought_to() {
  plant "$1"
  local begin=$SECONDS code=0
  desk --timeout 60 apply -f "$cell/$1.toml" >"$cell/apply.log" 2>&1 || code=$?
  [ "$code" = 0 ] || fail "apply: $(grep -v ': done' "$cell/apply.log" | head -n 5)"
  echo "apply, all $1: $((SECONDS - begin)) s, $(grep -c ': done' "$cell/apply.log") changes"
}
brought_to running
is "$(running)" "$instance_count" || fail "$(running) run"
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
timed() { # NAME COMMAND...
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
brought_to stopped
is "$(running)" 0 || fail "some still run"
for manager in "${managers[@]}"; do kill -TERM "$manager"; done
for manager in "${managers[@]}"; do wait "$manager" || fail "a manager ended with $?"; done
nothing_left
