#!/usr/bin/env bash
# The packing line of the examples, from its Structured Text to the coils of its terminal on Modbus. It needs a compiler.
. "$(dirname "$0")/common.sh"
example=$(cd "$(dirname "$0")/../../../instances/examples/packing" && pwd)
host=line

"$BIN/plchost-modbus" --check-config "$example/modbus.toml" | grep -q 'ok, 1 device, 2 images' || fail "the file is refused"
[ -n "${PLCHOST_MATIEC:-}${PLCHOST_STRUCPP:-}" ] || { echo "left out: it needs a compiler (PLCHOST_MATIEC, PLCHOST_STRUCPP)"; exit 77; }
"$BIN/plcctl" build application "$example/packing.st" -o "$cell/packing.so" 2>"$cell/build.log" || fail "not built"

mkfifo "$cell/told"
"$example/terminal.py" --port 0 <"$cell/told" >"$cell/shown" 2>"$cell/terminal.log" &
others+=($!)
exec {told}>"$cell/told"
tell() { echo "$*" >&"$told"; }
until_true 20 test -s "$cell/shown"
port=$(head -n 1 "$cell/shown")
shows() { [[ $(tail -n 1 "$cell/shown") == *"$1"* ]]; }

sed -e "s/127.0.0.1:1502/127.0.0.1:$port/" "$example/modbus.toml" >"$cell/modbus.toml"
printf '\n[modbus]\npool = "%s"\n' "$pool-$host" >>"$cell/modbus.toml"
write_host $host "$first_core"
APPLICATIONS=$cell write_instance $host packing1 "$first_core" packing "settings = \"$example/packing.cfg\""
"$BIN/plchost-modbus" --config "$cell/modbus.toml" 2>"$cell/modbus.log" &
modbus=$!
others+=("$modbus")
start_manager $host
until_true 40 state_is packing1 running

echo "- the terminal enables the motor, which turns as fast as is wanted"
tell speed 300
tell enable 1
until_true 40 shows "motor 1, fault 0, carton 0, speed 300, products 0"

echo "- products become cartons"
plcctl post event packing1/product --count 25
until_true 40 shows "carton 0, speed 300, products 25, cartons 2, stops 0, refused 0"

echo "- the emergency stop"
tell stop 1
until_true 40 shows "motor 0, fault 1, carton 0, speed 0, products 25, cartons 2, stops 1"
plcctl post event packing1/product
until_true 40 shows "refused 1"
tell stop 0
tell acknowledge 1
until_true 40 shows "motor 1, fault 0, carton 0, speed 300"

echo "- plchost-modbus is killed, and goes on when it is started again"
kill -KILL "$modbus"
wait "$modbus" 2>/dev/null || true
tell speed 100
"$BIN/plchost-modbus" --config "$cell/modbus.toml" 2>>"$cell/modbus.log" &
modbus=$!
others+=("$modbus")
until_true 40 shows "motor 1, fault 0, carton 0, speed 100"

kill "$modbus"
wait "$modbus" || fail "plchost-modbus ends with exit code $?"
shows "motor 0" || fail "the outputs of the terminal are $(tail -n 1 "$cell/shown")"
kill -TERM "${managers[0]}"
wait "${managers[0]}" || true
nothing_left
