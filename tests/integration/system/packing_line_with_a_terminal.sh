#!/usr/bin/env bash
# The packing line of the examples, from its Structured Text to the coils of its terminal on Modbus, by way of each compiler that
# is there. It needs one.
. "$(dirname "$0")/common.sh"
example=$(cd "$(dirname "$0")/../../../instances/examples/packing" && pwd)

"$BIN/plchost-modbus" --check-config "$example/modbus.toml" | grep -q 'ok, 1 device, 2 images' || fail "the file is refused"
compilers=()
[ -z "${PLCHOST_MATIEC:-}" ] || compilers+=(matiec)
[ -z "${PLCHOST_STRUCPP:-}" ] || compilers+=(strucpp)
[ ${#compilers[@]} -gt 0 ] || { echo "left out: it needs a compiler (PLCHOST_MATIEC, PLCHOST_STRUCPP)"; exit 77; }

# start_line HOST: builds the program by the compiler of that name, and runs it beside a terminal of its own
start_line() {
  local host=$1
  "$BIN/plcctl" build application "$example/packing.st" -o "$cell/$host.so" --compiler "$host" 2>"$cell/build.log" || fail "not built by $host"
  mkfifo "$cell/$host.told"
  shown=$cell/$host.shown
  "$example/terminal.py" --port 0 <"$cell/$host.told" >"$shown" 2>"$cell/terminal.log" &
  terminal=$!
  others+=("$terminal")
  exec {told}>"$cell/$host.told"
  until_true 20 test -s "$shown"

  configuration=$cell/$host.modbus.toml
  sed -e "s/127.0.0.1:1502/127.0.0.1:$(head -n 1 "$shown")/" "$example/modbus.toml" >"$configuration"
  printf '\n[modbus]\npool = "%s"\n' "$pool-$host" >>"$configuration"
  write_host "$host" "$first_core"
  APPLICATIONS=$cell write_instance "$host" packing1 "$first_core" "$host" "settings = \"$example/packing.cfg\""
  start_modbus
  start_manager "$host"
  until_true 40 state_is packing1 running
}
start_modbus() {
  "$BIN/plchost-modbus" --config "$configuration" 2>>"$cell/modbus.log" &
  modbus=$!
  others+=("$modbus")
}
tell() { echo "$*" >&"$told"; }
is() { [ "$(asked plcctl read variable packing1 "conveyor1.$1" --json | jq -r ".[0].value")" = "$2" ]; }
stop_is() { [ "$(asked plcctl read variable packing1 emergency_stop --json | jq -r ".[0].value")" = "$1" ]; }
motor_is() { is motor "$1"; }
shows() { [[ $(tail -n 1 "$shown") == *"$1"* ]]; }

for compiler in "${compilers[@]}"; do
  echo "- by $compiler: the terminal enables the motor, which turns as fast as is wanted"
  start_line "$compiler"
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

  echo "- a break of the connection does not acknowledge an emergency stop, though the button is held"
  tell stop 1
  until_true 40 shows "motor 0, fault 1, carton 0, speed 0, products 25, cartons 2, stops 2"
  tell acknowledge 0
  until_true 40 is acknowledge FALSE
  tell acknowledge 1
  until_true 40 is acknowledge TRUE
  tell stop 0
  until_true 40 stop_is FALSE
  kill -STOP "$terminal"
  until_true 40 is quality 2
  until_true 40 is acknowledge FALSE
  kill -CONT "$terminal"
  until_true 40 is acknowledge TRUE
  until_true 40 is quality 1
  plcctl post event packing1/product
  until_true 40 shows "refused 2"
  shows "motor 0, fault 1" || fail "acknowledged by a break: $(tail -n 1 "$shown")"
  tell acknowledge 0
  until_true 40 is acknowledge FALSE
  tell acknowledge 1
  until_true 40 shows "motor 1, fault 0, carton 0, speed 300"

  echo "- plchost-modbus is killed: the motor stops, and goes on when it is started again"
  until_true 40 motor_is TRUE
  kill -KILL "$modbus"
  wait "$modbus" 2>/dev/null || true
  until_true 40 motor_is FALSE
  until_true 40 is quality 0
  tell speed 100
  start_modbus
  until_true 40 shows "motor 1, fault 0, carton 0, speed 100"

  echo "- after a restart the products of before are no new carton"
  before=$(wc -l <"$shown")
  plcctl restart instance packing1
  until_true 40 shows "motor 1, fault 0, carton 0, speed 100, products 25, cartons 2"
  tail -n "+$((before + 1))" "$shown" | grep -q "carton 1" && fail "a carton is full: $(tail -n "+$((before + 1))" "$shown")"

  kill "$modbus"
  wait "$modbus" || fail "plchost-modbus ends with exit code $?"
  shows "motor 0" || fail "the outputs of the terminal are $(tail -n 1 "$shown")"
  kill -TERM "${managers[-1]}"
  wait "${managers[-1]}" || true
  managers=()
  exec {told}>&-
done
nothing_left
