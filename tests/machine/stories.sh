# For scripts of stories, which source it and have fail().
story() { echo "- $*"; }
until_true() { # until_true SECONDS COMMAND...
  local end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -lt "$end" ] || fail "did not happen in time: $*"
    sleep 0.2
  done
}
# asked COMMAND...: again while nobody answers (exit code 3): a machine beside busy ones may stand still for so long
asked() {
  local try code
  for try in 1 2 3 4 5; do
    code=0
    "$@" || code=$?
    [ "$code" -eq 3 ] || break
  done
  return "$code"
}
