#!/usr/bin/env bash
# The output of an application, up to its last lines before a crash: read from anywhere, after the instance and the manager were
# restarted.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" manager_last_words 'share_core = true' 'restart_delay_ms = 3000'
start_manager cell

said() { plcctl logs line1 "$@"; }
crashed() { said | grep -q 'manager *process [0-9]*: killed by SIGSEGV'; }
until_true 20 crashed

echo "- the last words, each with its process"
"$BIN/plcctl" --timeout 20 logs line1 -f >"$cell/followed.txt" &
others+=($!)
said | grep -qE 'Z  error +application +valve 7 is stuck|Z  info +application +valve 7 is stuck' || fail "$(said)"
said | grep -qE 'output +last words: pressure 9 bar$' || fail "$(said)"
is "$(said --json | jq -r 'map(select(.text | startswith("last words"))) | .[0].source')" output || fail "$(said --json)"
is "$(said -n 2 --json | jq length)" 2 || fail "$(said -n 2)"
first_words() { said --json | jq -r '.[0] | "\(.sequence) \(.text)"'; }
first=$(first_words)

echo "- the manager is killed, and the next one restarts the instance: the words are still there"
kill -KILL "${managers[0]}"
wait "${managers[0]}" 2>/dev/null || true
start_manager cell
# Not that it is running: it crashes within half a second, which a slow client never sees.
still_first() { is "$(first_words)" "$first"; }
until_true 20 still_first
twice() { [ "$(said | grep -c 'last words')" -ge 2 ]; }
until_true 20 twice

echo "- a follower saw all of it"
followed() { [ "$(grep -c 'last words' "$cell/followed.txt")" -ge 2 ]; }
until_true 20 followed
grep -q 'last words' "$cell/cell.log" || fail "they are missing in the log of the manager"

kill -TERM "${managers[-1]}"
wait "${managers[-1]}" || fail "the manager ended with $?"
managers=()
nothing_left
