#!/usr/bin/env bash
# The main job, shown: builds plchost, runs three control programs on this machine's cores, each under a scheduler of
# its own, posts events over DDS, kills an instance, switches a scheduler, and stops everything.
#   manager/demo.sh          the show, below two minutes after the build
#   manager/demo.sh --keep   leaves it running, and says what to try
set -euo pipefail
cd "$(dirname "$0")/.."
keep=no
case "${1:-}" in
  "") ;;
  --keep) keep=yes ;;
  *) sed -n '2,5s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac

build=.build/demo
plcctl="$PWD/$build/bin/plcctl"
work=$(mktemp -d "${TMPDIR:-/tmp}/plchost-demo.XXXXXX")
manager=
export PLCHOST_DOMAIN=${PLCHOST_DOMAIN:-42}
export PLCHOST_HOST=demo

title() { printf '\n\033[1m== %s\033[0m\n' "$*"; }
show() { printf '$ plcctl %s\n' "$*"; "$plcctl" "$@"; }
fail() { echo "demo: $*" >&2; [ -f "$work/log" ] && tail -n 20 "$work/log" >&2; exit 1; }
field() { # field list-arguments.. -- jq filter
  local arguments=()
  while [ "$1" != -- ]; do arguments+=("$1"); shift; done
  "$plcctl" "${arguments[@]}" --json | jq -r "$2"
}
instance() { field list instances -- ".[] | select(.instance == \"$1\" or .name == \"$1\") | .$2"; }
task() { field list tasks -- ".[] | select(.instance == \"${1%/*}\" and .task == \"${1#*/}\") | .$2"; }
lost() { field list tasks -- "[.[] | select(.instance == \"$1\") | .lost_cycles] | add"; }
ran() { field list tasks -- "[.[] | select(.instance == \"$1\") | .cycles] | add"; }
until_true() { # until_true SECONDS WHAT COMMAND...
  local end=$((SECONDS + $1)) what=$2
  shift 2
  until "$@"; do
    [ "$SECONDS" -lt "$end" ] || fail "$what did not happen in time"
    sleep 0.1
  done
}

stop_manager() {
  if [ -n "$manager" ] && kill -TERM "$manager" 2>/dev/null; then wait "$manager" || true; fi
  manager=
}
clean_up() {
  stop_manager
  rm -rf "$work"
}
trap clean_up EXIT
trap 'exit 130' INT TERM

.ci/packages build
printf 'building (a few minutes the first time) ...'
began=$SECONDS
if ! { cmake -S . -B "$build" -G Ninja -DPLCHOST_TESTS=OFF -DPLCHOST_BENCH=OFF &&
  cmake --build "$build"; } >"$work/build.log" 2>&1; then
  echo " FAILED"
  tail -n 60 "$work/build.log"
  exit 1
fi
echo " ok ($((SECONDS - began)) s)"

# One core each where there are enough; on a small machine the bottling line and the packer share one.
mapfile -t cores < <(taskset -cp $$ | sed 's/.*: //' | tr , '\n' | awk -F- '{ for (i = $1; i <= ($2 == "" ? $1 : $2); i++) print i }')
count=${#cores[@]}
drive_core=${cores[$((count - 1))]}
line_core=${cores[$((count > 2 ? count - 2 : 0))]}
packer_core=${cores[$((count > 3 ? count - 3 : 0))]}
applications="$PWD/$build/applications"
cat >"$work/demo.toml" <<EOF
[host]
name = "demo"
dds_domain = $PLCHOST_DOMAIN
run_directory = "$work/run"
pool = "plchost-demo-$$"
cores = [$(IFS=,; echo "${cores[*]}")]

[[instance]]
name = "drive1"
core = $drive_core
scheduler = "CmpScheduleOneShot"
priority_band = "high"
application = "$applications/drive_axis.so"
share_core = true

[[instance]]
name = "line1"
core = $line_core
scheduler = "CmpSchedule"
application = "$applications/bottling_line.so"
share_core = true

[[instance]]
name = "packer1"
core = $packer_core
scheduler = "CmpScheduleTimer"
priority_band = "low"
settings = "packer1.cfg"
application = "$applications/packer.so"
after = ["line1"]
share_core = true
EOF

printf '[CmpSchedule]\nTask.Freewheeling.Cycletime=5\n' >"$work/packer1.cfg"

title "start: one manager, three control programs, three schedulers, cores ${cores[*]}"
"$build/bin/plchostd" --config "$work/demo.toml" 2>"$work/log" &
manager=$!
all_running() { [ "$(field list instances -- '[.[] | select(.state == "running")] | length' 2>/dev/null)" = 3 ]; }
until_true 20 "the start of all three instances" all_running
sleep 2
show list instances

title "live figures of their tasks"
show list tasks

title "1,000 external events from another process, over DDS, to the packer"
before=$(task packer1/Product cycles)
show post event packer1/product --count 1000
packed() { [ "$(task packer1/Product cycles)" -ge $((before + 1000)) ]; }
until_true 20 "the run of 1,000 cycles" packed
sleep 0.5
after=$(task packer1/Product cycles)
echo "cycles of packer1/Product: $before before, $after after: $((after - before)) ran, $(task packer1/Product lost_events) events lost"
[ $((after - before)) -eq 1000 ] || fail "not exactly 1,000 cycles"

title "SIGKILL to an instance: it comes back, the others do not notice"
# A stall of the whole machine loses cycles everywhere, with or without us: then the show is repeated.
for attempt in 1 2 3; do
  pid=$(instance line1 pid)
  restarts=$(instance line1 restarts)
  drive_lost=$(lost drive1) drive_ran=$(ran drive1) packer_lost=$(lost packer1)
  kill -KILL "$pid"
  back() { [ "$(instance line1 state)" = running ] && [ "$(instance line1 restarts)" -gt "$restarts" ]; }
  until_true 20 "the restart of line1" back
  drive_more=$(($(lost drive1) - drive_lost)) packer_more=$(($(lost packer1) - packer_lost))
  echo "line1: pid $pid killed, back as pid $(instance line1 pid), restarts $(instance line1 restarts)"
  echo "meanwhile drive1 ran $(($(ran drive1) - drive_ran)) cycles and lost $drive_more; packer1 lost $packer_more"
  [ $((drive_more + packer_more)) -eq 0 ] && break
  echo "(lost cycles: was the machine stalled? attempt $attempt of 3)"
done
[ $((drive_more + packer_more)) -eq 0 ] || fail "the others lost cycles three times"

title "another scheduler for the bottling line, while it runs"
before=$(ran line1)
show set scheduler line1 CmpScheduleOneShot
further_cycles() { [ "$(ran line1)" -gt $((before + 100)) ]; }
until_true 5 "further cycles of line1" further_cycles
show list tasks line1

if [ "$keep" = yes ]; then
  title "left running (--keep)"
  cat <<EOF
In another terminal:
  export PLCHOST_DOMAIN=$PLCHOST_DOMAIN PLCHOST_HOST=demo PATH=$PWD/$build/bin:\$PATH
  plcctl watch tasks                          live figures
  plcctl post event line1/stop                the emergency stop of the bottling line
  plcctl stop instance line1; plcctl start instance line1
  plcctl set scheduler drive1 CmpSchedule     then compare the latency in: plcctl show task drive1/Position
  plcctl list events; plcctl list objects
  kill -9 \$(pgrep -x plchost-dds)             the API server comes back by itself
Configuration: $work/demo.toml, log: $work/log. Ctrl-C here stops everything.
EOF
  wait "$manager" || true
  manager=
  exit 0
fi

title "stop"
stop_manager
if ls /dev/shm | grep -q "plchost-demo-$$"; then fail "something was left in /dev/shm"; fi
echo "manager, instances and API server ended; nothing is left in /dev/shm"
