#!/usr/bin/env bash
# A start that its client was told has failed is never done, whichever of the processes on its way stood still: the API
# server, the manager or the instance.
. "$(dirname "$0")/common.sh"

write_host cell1 "$first_core"
write_instance cell1 line1 "$first_core" bottling_line
start_manager cell1
until_true 20 state_is line1 running
plcctl stop instance line1

server() { pgrep -f "plchost-dds --host cell1 .*$pool-cell1 "; }
for process in server manager instance; do
  case $process in
    server) pid=$(server) ;;
    manager) pid=${managers[-1]} ;;
    instance) pid=$(instance line1 pid) ;;
  esac
  for seconds in 1.2 2.5; do
    for try in 1 2 3 4 5; do
      kill -STOP "$pid"
      code=0
      "$BIN/plcctl" --timeout 1 start instance line1 >"$cell/said" 2>&1 || code=$?
      # Asked so late that it was in exception by then: that shows nothing.
      [ "$process" = instance ] && [ "$code" -eq 1 ] && grep -q 'in exception' "$cell/said" || break
      kill -CONT "$pid"
      until_true 20 state_is line1 stopped
    done
    is "$code" 3 || fail "$process stood still: start ends with $code"
    sleep "$(awk "BEGIN { print $seconds - 1 }")"
    kill -CONT "$pid"
    # Another request goes the same way, behind it.
    until_true 10 plcctl reset statistics line1
    sleep 0.3
    is "$(instance line1 state)" stopped || fail "$process stood still for $seconds s: the machine has started"
  done
done
plcctl start instance line1
until_true 10 state_is line1 running
