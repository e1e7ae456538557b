#!/usr/bin/env bash
# A client of the Debug Adapter Protocol halts a program in Structured Text at a line of its source, by way of each compiler
# that is there. The neighbour on the same host loses no cycle by it. It needs a compiler.
. "$(dirname "$0")/common.sh"

compilers=()
[ -z "${PLCHOST_MATIEC:-}" ] || compilers+=(matiec)
[ -z "${PLCHOST_STRUCPP:-}" ] || compilers+=(strucpp)
[ ${#compilers[@]} -gt 0 ] || { echo "left out: it needs a compiler (PLCHOST_MATIEC, PLCHOST_STRUCPP)"; exit 77; }

# Its lines are those of text() in dap_client.py.
cat >"$cell/press.st" <<'EOT'
FUNCTION Twice : INT
  VAR_INPUT x : INT; END_VAR
  Twice := x * 2;
END_FUNCTION

FUNCTION_BLOCK Counter
  VAR_INPUT inc : INT; END_VAR
  VAR_OUTPUT n : INT; END_VAR
  IF n > 10000 THEN
    n := 0;
  END_IF;
  n := n + inc;
END_FUNCTION_BLOCK

PROGRAM Press
  VAR
    one : Counter; doubled : INT; last : ARRAY [1..3] OF INT;
  END_VAR VAR_EXTERNAL most : INT; END_VAR
  one(inc := 1);
  doubled := Twice(one.n);
  IF doubled > most THEN
    doubled := 0;
  END_IF;
  last[2] := doubled;
END_PROGRAM

CONFIGURATION cell
  VAR_GLOBAL most : INT := 20000; END_VAR
  RESOURCE line ON PLC
    TASK Main (INTERVAL := T#10ms, PRIORITY := 1);
    PROGRAM press1 WITH Main : Press;
  END_RESOURCE
END_CONFIGURATION
EOT

write_host cell $(seq "$first_core" "$last_core")
write_instance cell neighbour "$last_core" bottling_line 'share_core = true'
for compiler in "${compilers[@]}"; do
  "$BIN/plcctl" build application "$cell/press.st" -o "$cell/$compiler.so" --compiler "$compiler" --debug >"$cell/build-$compiler.log" 2>&1 ||
    fail "not built by $compiler"
  APPLICATIONS=$cell write_instance cell "$compiler" "$first_core" "$compiler" 'share_core = true'
done
start_manager cell
until_true 20 state_is neighbour running

for compiler in "${compilers[@]}"; do
  echo "- one engineer's story on what $compiler has made"
  until_true 20 state_is "$compiler" running
  serve_dap "$compiler"
  story() { python3 "$(dirname "$0")/dap_client.py" "$port" text "$cell/press.st" || fail "the story over DAP"; }
  costs_no_cycle neighbour/Fill story
  runs_on() { local before; before=$(task "$compiler/Main" cycles); sleep 1.2; [ "$(task "$compiler/Main" cycles)" -gt "$before" ]; }
  until_true 10 runs_on
done

kill -TERM "${managers[-1]}"
wait "${managers[-1]}" || fail "the manager ended with $?"
managers=()
nothing_left
