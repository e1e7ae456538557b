#!/usr/bin/env bash
# Tab, in bash, zsh and fish: words of plcctl, names that there are, and no name that a shell would run. Names are waited
# for as long as --timeout says, which is 1 s if nothing is said.
. "$(dirname "$0")/common.sh"
export PATH=$BIN:$PATH

write_host north "$first_core"
write_instance north packer1 "$first_core" packer 'scheduler = "CmpScheduleTimer"'
start_manager north
until_true 20 state_is packer1 running

# A plcctl that offers a name with a command in it.
mkdir "$cell/stranger"
cat >"$cell/stranger/plcctl" <<EOF
#!/bin/sh
[ "\$1" != completion ] || exec "$BIN/plcctl" "\$@"
printf '%s\t%s\n' 'x\$(touch $cell/was_run);y' 'an object'
EOF
chmod +x "$cell/stranger/plcctl"

echo "- bash"
# bash_offers WORD...: the last one is completed
bash_offers() { bash -c 'source <(plcctl completion bash); COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _plcctl; printf "%s\n" "${COMPREPLY[@]}"' - "$@"; }
is "$(bash_offers plcctl sh)" show || fail "$(bash_offers plcctl sh)"
is "$(bash_offers plcctl --timeout 20 show instance p)" packer1 || fail "$(bash_offers plcctl --timeout 20 show instance p)"
is "$(bash_offers plcctl --timeout 20 post event packer1/p)" packer1/product || fail "$(bash_offers plcctl --timeout 20 post event packer1/p)"
is "$(bash_offers plcctl --timeout 20 set scheduler packer1 CmpScheduleT)" CmpScheduleTimer || fail "$(bash_offers plcctl --timeout 20 set scheduler packer1 C)"

echo "- fish"
fish_offers() { HOME=$cell fish -c "plcctl completion fish | source; complete -C '$*'"; }
is "$(fish_offers plcctl sh | cut -f1)" show || fail "$(fish_offers plcctl sh)"
is "$(fish_offers plcctl --timeout 20 show instance p)" $'packer1\trunning' || fail "$(fish_offers plcctl --timeout 20 show instance p)"
is "$(fish_offers plcctl --timeout 20 post event packer1/p | cut -f1)" packer1/product || fail "$(fish_offers plcctl --timeout 20 post event packer1/p)"
PATH=$cell/stranger:$PATH fish_offers plcctl show object x >/dev/null
[ ! -e "$cell/was_run" ] || fail "fish has run a name"

echo "- zsh, typed into a terminal"
# typed TEXT WANTED: Tab behind TEXT makes WANTED of the line
cat >"$cell/typed.zsh" <<'EOF'
zmodload zsh/zpty
zpty shell "TERM=dumb zsh -f -i"
zpty -w shell "stty cols 200; PS1=; unsetopt zle_bracketed_paste; autoload -U compinit; compinit -u -D; source <(plcctl completion zsh); print READ''Y"
zpty -r shell seen '*READY*'
zpty -w -n shell "$1"$'\t'
screen=
for (( i = 0; i < 200; i++ )); do
  zpty -r -t shell seen && screen+=$seen
  [[ $screen != *"$2"* ]] || { zpty -d shell; exit 0; }
  sleep 0.05
done
print -r -- "$screen"
exit 1
EOF
typed() { HOME=$cell zsh -f "$cell/typed.zsh" "$@" || fail "zsh does not make '$2' of '$1'"; }
typed "plcctl sh" "plcctl show "
typed "plcctl --timeout 20 show instance p" "plcctl --timeout 20 show instance packer1 "
typed "plcctl --timeout 20 post event packer1/p" "plcctl --timeout 20 post event packer1/product "
PATH=$cell/stranger:$PATH typed "plcctl show object x" 'x\$\(touch\ '"$cell"'/was_run\)\;y'
[ ! -e "$cell/was_run" ] || fail "zsh has run a name"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
