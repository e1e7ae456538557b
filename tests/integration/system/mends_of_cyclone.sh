#!/usr/bin/env bash
# Functions of Cyclone's that api/dds replaces: Cyclone calls them in each program that opens a domain, and in programs of others,
# in C++ and in Python, by the client library.
. "$(dirname "$0")/common.sh"
source=$(cd "$(dirname "$0")/../../.." && pwd)

functions=$(sed -nE 's/^extern "C" __attribute__\(\(visibility\("default"\)\)\) \w+ (dds\w+)\(.*/\1/p' "$source"/api/dds/*.cpp)
[ "$(wc -l <<<"$functions")" -ge 3 ] || fail "found only: $functions"

# is_mended FILE PROGRAM [ARGUMENT...]: Cyclone in that program is bound to the functions of FILE
is_mended() {
  local file=$1 function
  shift
  rm -f "$cell"/bindings.*
  LD_BIND_NOW=1 LD_DEBUG=bindings LD_DEBUG_OUTPUT=$cell/bindings "$@" >"$cell/said.log" 2>&1 || true
  grep -q 'binding file [^ ]*libddsc' "$cell"/bindings.* || fail "$* does not load Cyclone"
  for function in $functions; do
    grep -qE "binding file [^ ]*libddsc[^ ]* \[0\] to [^ ]*$file[^ ]* \[0\]: normal symbol .$function'" "$cell"/bindings.* ||
      fail "$*: Cyclone has its own $function: $(grep -h "libddsc.* symbol .$function'" "$cell"/bindings.*)"
  done
}

is_mended plchost-dds "$BIN/plchost-dds" --version
is_mended plcctl "$BIN/plcctl" --version
is_mended libplchost-client "$BIN/post_event"
PYTHONPATH=$BIN/../python is_mended libplchost-client python3 -c 'import plchost_client'
