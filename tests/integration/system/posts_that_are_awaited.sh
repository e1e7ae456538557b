#!/usr/bin/env bash
# Posts that wait for the task's cycle, posts of several events at once, and what the host counts of each client's posts.
. "$(dirname "$0")/common.sh"

write_host cell "$first_core"
for name in packer1 packer2; do
  write_instance cell "$name" "$first_core" packer 'share_core = true'
done
start_manager cell
both_running() { state_is packer1 running && state_is packer2 running; }
until_true 20 both_running
cycles() { task "$1/Product" cycles; }

echo "- a post that is awaited has run when it returns"
said=$(plcctl post event packer1/product --wait=run --json) || fail "post: $said"
is "$(jq -r '.[0] | "\(.posts) \(.tasks) \(.last_task)"' <<<"$said")" "1 1 packer1/Product" || fail "$said"
jq -e '.[0] | .end_median_us > 0 and .start_median_us < .end_median_us and .end_median_us < .round_trip_max_us' <<<"$said" >/dev/null ||
  fail "figures: $said"
ran() { is "$(cycles packer1)" "$1"; }
until_true 20 ran 1
plcctl post event packer1/product --wait=run --count 200 >"$cell/runs" || fail "200 posts that are awaited"
grep -q '^200 posted and run, last by packer1/Product: .* us from here and back (median; ' "$cell/runs" || fail "$(cat "$cell/runs")"
cat "$cell/runs"
until_true 20 ran 201
is "$(plcctl post event packer1/product --wait)" "1 posted" || fail "--wait"

echo "- the answer is no when there is nothing to wait for"
refused "no external event 'packer1/produkt'" plcctl post event packer1/produkt --wait=run
plcctl stop instance packer2
refused "no task was bound to the event" plcctl post event packer2/product --wait=run
plcctl start instance packer2
if said=$(plcctl post event packer1/product --wait=walk 2>&1); then fail "--wait=walk: $said"; fi
grep -q 'pool.*run' <<<"$said" || fail "--wait=walk: $said"

echo "- several at once: all or none"
before=$(cycles packer2)
is "$(plcctl post events packer1/product packer2/product packer2/product)" "3 posted" || fail "post events"
two_more() { is "$(cycles packer2)" $((before + 2)); }
until_true 20 two_more
refused "packer2/produkt' (event number 2 of the batch of 2; none was posted)" plcctl post events packer2/product packer2/produkt
sleep 0.5
is "$(cycles packer2)" $((before + 2)) || fail "$(cycles packer2) cycles of packer2"

echo "- the host has counted all of that"
# 1 + 200 + 1 single posts, 1 that was not run, 1 batch; the rejected ones: an unknown event, a batch
all() { plcctl list writers --json | jq -r '.[] | select(.writer == "all") | "\(.received - .duplicate) \(.delivered) \(.rejected) \(.lost)"'; }
counted() { is "$(all)" "206 204 2 0"; }
until_true 20 counted
[ "$(plcctl list writers | wc -l)" -gt 5 ] || fail "writers: $(plcctl list writers)"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
