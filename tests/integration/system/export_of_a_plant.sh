#!/usr/bin/env bash
# Running instances become a file of PLCopen: tasks, programs and variables. Where a compiler for Structured Text is, a build
# takes the tasks of that file, and they are those that run.
. "$(dirname "$0")/common.sh"
examples=$(dirname "$0")/../../../instances/examples

compilers=()
[ -z "${PLCHOST_MATIEC:-}" ] || compilers+=(matiec)
[ -z "${PLCHOST_STRUCPP:-}" ] || compilers+=(strucpp)

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" line_variables 'share_core = true'
write_instance cell line2 "$first_core" bottling_line 'share_core = true'
if [ ${#compilers[@]} -gt 0 ]; then
  "$BIN/plcctl" build application "$examples/packing/packing.st" -o "$cell/packing.so" --compiler "${compilers[0]}" 2>"$cell/packing.log" ||
    fail "the example is not built"
  APPLICATIONS=$cell write_instance cell line3 "$first_core" packing 'share_core = true' "settings = \"$examples/packing/packing.cfg\""
fi
start_manager cell
until_true 20 state_is line1 running
until_true 20 state_is line2 running
[ ${#compilers[@]} -eq 0 ] || until_true 20 state_is line3 running

# in_file EXPRESSION: of the file as Python reads it, whose elements have no name space
in_file() {
  python3 - "$cell/plant.xml" "$1" <<'END'
import re, sys
import xml.etree.ElementTree as tree
text = re.sub(r'xmlns(:xhtml)?="[^"]*"', '', open(sys.argv[1], encoding="utf-8").read()).replace("xhtml:", "")
root = tree.fromstring(text)
def names(path, attribute="name"):
    return " ".join(one.get(attribute, "-") for one in root.findall(path))
print(eval(sys.argv[2]))
END
}
file_has() { is "$(in_file "$1")" "$2" || fail "$1: $(in_file "$1") instead of $2"; }

echo "- tasks, programs and variables of two instances"
plcctl export plant line1 line2 >"$cell/plant.xml" 2>"$cell/said" || fail "not exported"
grep -q "not exported, .*bodies" "$cell/said" || fail "it does not say that bodies are missing: $(cat "$cell/said")"
file_has 'root.find("contentHeader/Comment").text[:12]' "not exported"
file_has 'names(".//configuration") + ": " + names(".//resource")' "cell: line1 line2"
file_has 'names(".//resource[@name=\"line1\"]/task", "interval") + " " + names(".//resource[@name=\"line1\"]/task")' "T#2ms T#20ms Fast Slow"
file_has 'names(".//pou[@name=\"fast_type\"]//localVars/variable")' "count twice"
file_has 'names(".//resource[@name=\"line1\"]/globalVars/variable")' "grid line"
file_has 'names(".//dataType[@name=\"line_type\"]//variable")' "label setpoint stopped total"
file_has 'names(".//resource[@name=\"line1\"]//dimension", "upper")' "2 2"
file_has 'names(".//dataType[@name=\"line_type\"]//string", "length")' 15
file_has 'names(".//resource[@name=\"line2\"]/task")' "$(plcctl list tasks line2 --json | jq -r 'map(.task) | join(" ")')"
file_has 'names(".//resource[@name=\"line2\"]/task//PlchostTask", "external_event")' stop
refused "'line7'" plcctl export plant line7

# tasks_of FILE: as a check tells them
tasks_of() { "$BIN/plc-instance" --check-application "$1" | tail -n +2 | LC_ALL=C sort; }
if [ ${#compilers[@]} -eq 0 ]; then
  echo "- left out: builds of the file, which need a compiler (PLCHOST_MATIEC, PLCHOST_STRUCPP)"
else
  plcctl export plant >"$cell/plant.xml"
  file_has 'names(".//resource[@name=\"line3\"]/task")' "$(plcctl list tasks line3 --json | jq -r 'map(.task) | join(" ")')"
  for compiler in "${compilers[@]}"; do
    echo "- a build of the file by $compiler"
    for one in "line1 $APPLICATIONS/line_variables.so" "line2 $APPLICATIONS/bottling_line.so" "line3 $cell/packing.so"; do
      plcctl export plant "${one%% *}" >"$cell/one.xml"
      "$BIN/plcctl" build application "$cell/one.xml" -o "$cell/one.so" --compiler "$compiler" >"$cell/build.log" 2>&1 || fail "not built"
      grep -q "its body has no statement" "$cell/build.log" || fail "the build does not say that bodies are missing"
      diff <(tasks_of "${one#* }") <(tasks_of "$cell/one.so") >"$cell/tasks.log" || fail "tasks of ${one%% *}"
    done
  done
fi
if [ ${#compilers[@]} -gt 0 ]; then
  echo "- programs and located variables of Structured Text"
  file_has 'names(".//resource[@name=\"line3\"]//pouInstance")' "halt1 product1 conveyor1"
  file_has 'names(".//resource[@name=\"line3\"]//pouInstance", "typeName")' "Halt Product Conveyor"
  file_has '" ".join(task.get("name") for task in root.iter("task") if task.find("pouInstance[@name=\"product1\"]") is not None)' counting
  file_has 'root.find(".//pou[@name=\"Conveyor\"]//variable[@name=\"motor\"]").get("address")' "%QX0.0"
  file_has 'names(".//globalVars[@retain=\"true\"]/variable")' products
  file_has 'names(".//dataType[@name=\"pulse_type\"]//variable")' "ET IN PT Q"
fi
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
