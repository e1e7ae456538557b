#!/usr/bin/env bash
# Each program has a manual page that man(1) finds, and it has each option that --help has. The table of the commands in
# api/plcctl.md is that of plcctl.
. "$(dirname "$0")/common.sh"
for program in plcctl plchostd plchost-dds plc-instance plchost-modbus; do
  page=$(find "$BIN/../share/man" -name "$program.[18]")
  [ -n "$page" ] || fail "no manual page of $program"
  grep -q '^\.SH NAME' "$page" || fail "$page has no NAME"
  text=$(sed 's/\\f[A-Z]//g; s/\\,//g; s/\\-/-/g; s/\\\///g' "$page")
  options=$("$BIN/$program" --help | grep -oE '^ +(-[a-zA-Z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+')
  [ "$(wc -l <<<"$options")" -ge 3 ] || fail "options of $program: $options"
  for option in $options; do
    grep -qF -- "$option" <<<"$text" || fail "$page does not say $option"
  done
done
"$(dirname "$0")/../../gates/documents.py" --programs "$BIN" || fail "the documents are not those of the programs"
