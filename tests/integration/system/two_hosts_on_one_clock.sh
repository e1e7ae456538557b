#!/usr/bin/env bash
# Two managers on one simulated PTP device that drifts. Their cycles start together, the status tells how far they are apart,
# and the device is set and taken from one of them.
. "$(dirname "$0")/common.sh"

phc=$cell/phc
# write_phc DRIFT_PPB OFFSET_NS: in one step, the instances read it all the time
write_phc() {
  echo "$1 $2 extended" >"$phc.new"
  mv "$phc.new" "$phc"
}
write_phc 120000 0

# start_side HOST CORE
start_side() {
  write_host "$1" "$2"
  printf '[DistributedClock]\nReference=ptp:/dev/ptp-of-a-test\nHoldOverMs=1000\n' >"$cell/$1.cfg"
  write_instance "$1" "drive_$1" "$2" drive_axis 'scheduler = "CmpScheduleOneShot"' 'share_core = true' \
    "settings = \"$cell/$1.cfg\""
  LD_PRELOAD=$APPLICATIONS/simulated_phc.so ASAN_OPTIONS=verify_asan_link_order=0 SIMULATED_PHC_PATH=/dev/ptp-of-a-test \
    SIMULATED_PHC_FILE=$phc SIMULATED_PHC_GONE=$cell/$1.gone start_manager "$1"
}
start_side north "$first_core"
start_side south "$last_core"

# on HOST FIELD: of the list of hosts
on() { plcctl --host "$1" list hosts --json | jq -r ".[0].$2"; }
# drive HOST FIELD: of its instance
drive() { plcctl --host "$1" list instances --json | jq -r ".[0].$2"; }
in_sync() { [ "$(on "$1" grid_in_sync)" = true ]; }
out_of_sync() { [ "$(on "$1" grid_in_sync)" = false ]; }
# phase HOST: by the clock itself, where the releases of its 1 ms task are
phase() { "$BIN/grid_phase" "$phc" "$pool-$1" "drive_$1" Position; }
# within BOUND_NS A B: how far they are apart
within() { [ $(($2 - $3)) -le "$1" ] && [ $(($3 - $2)) -le "$1" ]; }
# together BOUND_NS: both hosts on the clock's grid, and on the same one
together() {
  local north south
  north=$(phase north) && south=$(phase south) || return 1
  within "$1" "$north" 0 && within "$1" "$south" 0 && within "$1" "$north" "$south"
}
# The distance of the two grids by the figures that the hosts publish, in ns.
published_distance() { plcctl list hosts --json | jq 'map(.grid_offset_us * 1000) | max - min | round'; }
near_by_the_status() { within 25000 "$(published_distance)" 0; }

for host in north south; do until_true 30 in_sync "$host"; done
is "$(on north grid_reference),$(on south grid_reference)" "ptp:/dev/ptp-of-a-test,ptp:/dev/ptp-of-a-test" ||
  fail "they follow $(on north grid_reference) and $(on south grid_reference)"
until_true 20 together 25000
until_true 20 near_by_the_status
echo "apart by the clock: north $(phase north) ns, south $(phase south) ns from the grid; by the status: $(published_distance) ns"
plcctl list hosts | head -n 1 | grep -q 'GRID(us) *IN-SYNC' || fail "no columns: $(plcctl list hosts)"
both_locked() { is "$(drive north clock_state),$(drive south clock_state)" locked,locked; }
until_true 20 both_locked

echo "- the clock is set forward by 0.3 ms: both go there"
write_phc 120000 300000
for host in north south; do
  stepped() { [ "$(drive "$host" clock_steps)" -ge 1 ]; }
  until_true 20 stepped
  until_true 20 in_sync "$host"
done
until_true 20 together 25000

echo "- one of them loses its device, and says so"
touch "$cell/south.gone"
until_true 20 out_of_sync south
until_true 20 in_sync north
[[ "$(drive south clock_problem)" == *"/dev/ptp-of-a-test"* ]] || fail "problem: $(drive south clock_problem)"
rm "$cell/south.gone"
until_true 20 in_sync south
until_true 20 together 25000

for manager in "${managers[@]}"; do
  kill -TERM "$manager"
  wait "$manager" || fail "a manager ended with $?"
done
nothing_left
