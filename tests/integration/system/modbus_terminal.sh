#!/usr/bin/env bash
# A packer with a terminal on Modbus: its figures reach the terminal's registers, and the terminal's answer reaches the packer.
# Each process of the chain is killed, and the device stalls, answers garbage and goes away: the packer loses no product.
. "$(dirname "$0")/common.sh"
host=line

write_host $host "$first_core"
sed -e "s/terminal1/$host/" "$(dirname "$0")/../../../instances/examples/packer/packer.cfg" >"$cell/packer.cfg"
write_instance $host packer1 "$first_core" packer "settings = \"$cell/packer.cfg\"" 'restart_delay_ms = 100'

coproc terminal { exec "$BIN/modbus_terminal"; }
others+=("$terminal_PID")
read -r port <&"${terminal[0]}"
tell() { echo "$*" >&"${terminal[1]}"; }
# The register as the device has it.
holding() {
  local value
  tell holding "$1"
  read -r value <&"${terminal[0]}"
  echo "$value"
}
register_is() { [ "$(holding "$1")" = "$2" ]; }

cat >"$cell/modbus.toml" <<END
[modbus]
pool = "$pool-$host"

[[image]]
name = "$host.in"
direction = "input"
size = 128

[[image]]
name = "$host.out"
direction = "output"
size = 128

[[device]]
name = "panel"
tcp = "127.0.0.1:$port"
poll_ms = 20
timeout_ms = 300
reconnect_ms = 100
reconnect_max_ms = 400
silent_after_ms = 2000
status_image = "$host.in"
status_offset = 120

[[device.read]]
kind = "input_register"
address = 0
count = 3
image = "$host.in"

[[device.write]]
kind = "holding_register"
address = 0
count = 3
image = "$host.out"
END
"$BIN/plchost-modbus" --check-config "$cell/modbus.toml" | grep -q 'ok, 1 device, 2 images' || fail "the file is refused"
"$BIN/plchost-modbus" --check-config "$(dirname "$0")/../../../instances/examples/packing/modbus.toml" | grep -q 'ok, 1 device, 2 images' ||
  fail "the file of the packing line is refused"
start_modbus() {
  "$BIN/plchost-modbus" --config "$cell/modbus.toml" 2>>"$cell/modbus.log" &
  modbus=$!
  others+=("$modbus")
}
start_modbus
start_manager $host
until_true 40 state_is packer1 running

made=0
# produce CARTONS: so many more; their number is shown at the terminal
produce() {
  made=$((made + $1))
  plcctl post event packer1/product --count $(($1 * 12))
  until_true 40 register_is 0 $made
}
panel_shows() { plcctl logs packer1 | tail -n 1 | grep -q "pallets $1, panel $1\$"; }

echo "- there and back"
produce 60
until_true 40 panel_shows 2

echo "- the device stalls, answers garbage, refuses and goes away"
for fault in stalls garbage refuses away; do
  tell $fault
  plcctl post event packer1/product --count 12
  made=$((made + 1))
  sleep 1
  ! grep -q ' error plchost-modbus' "$cell/modbus.log" || fail "an error"
  tell echoes
  until_true 40 register_is 0 $made
done
grep -q "device 'panel' is lost" "$cell/modbus.log" || fail "the log does not tell of it"

echo "- plchost-modbus is killed"
kill -9 "$modbus"
wait "$modbus" 2>/dev/null || true
plcctl post event packer1/product --count 12
made=$((made + 1))
start_modbus
until_true 40 register_is 0 $made

echo "- the instance is killed"
old=$(instance packer1 pid)
kill -9 "$old"
comes_again() { state_is packer1 running && ! is "$(instance packer1 pid)" "$old"; }
until_true 40 comes_again
produce 1

echo "- the manager is killed"
kill -9 "${managers[0]}"
wait "${managers[0]}" 2>/dev/null || true
start_manager $host
until_true 40 state_is packer1 running
produce 1

echo "- the instance is stopped: the outputs of the terminal get the safe state of its settings, and come back"
plcctl stop instance packer1
until_true 40 register_is 0 0
plcctl start instance packer1
until_true 40 register_is 0 $made

echo "- the end"
kill "$modbus"
wait "$modbus" || fail "plchost-modbus ends with exit code $?"
until_true 20 register_is 0 0
kill "${managers[-1]}"
wait "${managers[-1]}" || true
nothing_left
