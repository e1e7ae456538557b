#!/usr/bin/env bash
# 'plcctl check host --fix' below the root of an image: the files that it prints, writes and takes away, and the states of that
# root in which it writes nothing. No test writes in the /etc of this machine.
. "$(dirname "$0")/common.sh"

image=$cell/image
config=$image/etc/plchost/plchost.toml
# new_image CORES: a root with grub's files, with four cores of which each instance has one
new_image() {
  rm -rf "$image"
  mkdir -p "$image"/etc/{plchost,default/grub.d,sysctl.d,udev/rules.d,systemd/system/multi-user.target.wants} "$image/sys/devices/system/cpu"
  echo 'GRUB_CMDLINE_LINUX_DEFAULT="quiet"' >"$image/etc/default/grub"
  echo 'GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT splash"' >"$image/etc/default/grub.d/50-image.cfg"
  echo 0-3 >"$image/sys/devices/system/cpu/online"
  printf '[host]\nname = "press"\n' >"$config"
  for core; do
    printf '\n[[instance]]\nname = "line%s"\ncore = %s\napplication = "/opt/line.so"\n' "$core" "$core" >>"$config"
  done
}
fix() { plcctl check host --fix --root "$image" "$@"; }
# All that is in the image, with contents, rights, targets, and the moments of the last change.
state() { (cd "$image" && find . -printf '%p %y %m %l %C@\n' | sort && find . -type f -exec sha256sum {} + | sort); }
# refused TEXT OPTION...: with exit code 1 and this text, and nothing is changed
refused() {
  local text=$1 before code=0 said
  shift
  before=$(state)
  said=$(fix "$@" 2>&1) || code=$?
  is "$code" 1 || fail "exit code $code instead of 1, of '$text': $said"
  grep -qF -- "$text" <<<"$said" || fail "instead of '$text': $said"
  is "$(state)" "$before" || fail "'$text' has changed the image"
}
# As grub-mkconfig reads them.
kernel_line() { sh -ec '. "$0/etc/default/grub"; for x in "$0"/etc/default/grub.d/*.cfg; do . "$x"; done; echo "$GRUB_CMDLINE_LINUX_DEFAULT"' "$image"; }
words="isolcpus=managed_irq,domain,2-3 nohz_full=2-3 rcu_nocbs=2-3 irqaffinity=0-1 preempt=full"
files=(/etc/default/grub.d/plchost.cfg /etc/sysctl.d/60-plchost.conf /etc/systemd/system/plchost-tuning.service
  /etc/systemd/system/multi-user.target.wants/plchost-tuning.service /etc/systemd/system/irqbalance.service.d/60-plchost.conf
  /etc/udev/rules.d/60-plchost.rules)

# It prints and writes nothing; then it writes what it has printed; then nothing more.
new_image 2 3
before=$(state)
plan=$(fix)
is "$(state)" "$before" || fail "--fix alone has written"
for file in "${files[@]}"; do grep -qxF "new: $image$file" <<<"$plan" || fail "the plan has no $file: $plan"; done
grep -q '^not looked at: .*memory_lock' <<<"$plan" || fail "no reasons: $plan"
applied=$(fix --apply)
for file in "${files[@]}"; do grep -qxF "written: $image$file" <<<"$applied" || fail "not written: $file: $applied"; done
grep -qx 'to run in it: update-grub' <<<"$applied" || fail "nothing is to be run: $applied"
! grep -q 'try-restart irqbalance' <<<"$applied" || fail "irqbalance is not there, and would be started anew"
mkdir -p "$image/lib/systemd/system"
touch "$image/lib/systemd/system/irqbalance.service"
grep -qx 'to run: systemctl try-restart irqbalance.service' < <(fix) || fail "irqbalance would go on with all cores"
rm -r "$image/lib"
is "$(kernel_line)" "quiet splash $words" || fail "the command line of the kernel: $(kernel_line)"
while read -r line; do
  grep -qxF "    $line" <<<"$plan" || fail "was not in the plan: $line"
done < <(cat "$image/etc/default/grub.d/plchost.cfg" "$image/etc/sysctl.d/60-plchost.conf" "$image/etc/udev/rules.d/60-plchost.rules")
! command -v systemd-analyze >/dev/null || { said=$(SYSTEMD_LOG_TARGET=console systemd-analyze verify "$image/etc/systemd/system/plchost-tuning.service" 2>&1 || true)
  ! grep -q 'plchost-tuning.service:[0-9]' <<<"$said" || fail "systemd does not read the unit: $said"; }
# Its commands, as systemd hands them to the shell.
while read -r command; do
  sh -nc "$command" || fail "no shell reads: $command"
done < <(sed -n "s/^ExecStart=-\/bin\/sh -c '\(.*\)'$/\1/p" "$image/etc/systemd/system/plchost-tuning.service" | sed 's/\$\$/$/g')
after=$(state)
is "$(fix --apply | grep -c '^is there: ')" 6 || fail "the second --apply has written"
is "$(state)" "$after" || fail "the second --apply has changed something"

# Other cores, and a file that lost its end.
sed -i 's/core = 2/core = 1/' "$config"
truncate -s 60 "$image/etc/sysctl.d/60-plchost.conf"
echo half >"$image/etc/udev/rules.d/60-plchost.rules.plchost-new"
fix --apply >"$cell/said" || fail "other cores: $(cat "$cell/said")"
is "$(kernel_line)" "quiet splash isolcpus=managed_irq,domain,1,3 nohz_full=1,3 rcu_nocbs=1,3 irqaffinity=0,2 preempt=full" || fail "$(kernel_line)"
grep -q 'watchdog_cpumask = 0,2' "$image/etc/sysctl.d/60-plchost.conf" || fail "the file that lost its end is not mended"

# The way back, also without a configuration. Folders and the files of others stay.
rm "$config"
fix --revert >"$cell/said" || fail "the way back: $(cat "$cell/said")"
grep -q '^with a reboot: ' "$cell/said" || fail "it does not say what a reboot brings: $(cat "$cell/said")"
is "$(cd "$image" && find . ! -type d | sort | paste -sd' ')" "./etc/default/grub ./etc/default/grub.d/50-image.cfg ./sys/devices/system/cpu/online" ||
  fail "after --revert: $(cd "$image" && find . ! -type d)"
[ ! -e "$image/etc/systemd/system/irqbalance.service.d" ] || fail "a folder is left"
is "$(fix --revert)" "plchost has no file here" || fail "the second --revert"

# An empty root without grub: another boot loader has to give the words.
new_image 2 3
rm -r "$image/etc/default" "$image/etc/udev" "$image/etc/systemd" "$image/etc/sysctl.d"
fix --apply >"$cell/said" || fail "an empty root: $(cat "$cell/said")"
grep -qxF "by hand: there is no grub: let the boot loader give the kernel: $words" "$cell/said" || fail "$(cat "$cell/said")"
[ ! -e "$image/etc/default" ] || fail "a file for a grub that is not there"

# With any of these in the way, nothing is written at all.
for file in "${files[@]}"; do
  new_image 2 3
  mkdir -p "$image$(dirname "$file")"
  echo "# of another" >"$image$file"
  refused "$file is" --apply
  fix --apply >/dev/null 2>&1 || true
  is "$(cat "$image$file")" "# of another" || fail "$file was written over"
done
fix --revert >/dev/null 2>"$cell/said" && fail "--revert takes the file of another away"
grep -qF "left as it is: $image${files[-1]}" "$cell/said" || fail "$(cat "$cell/said")"
new_image 2 3
ln -s "$cell/outside" "$image/etc/sysctl.d/60-plchost.conf"
refused "no plain file" --apply
new_image 2 3
rmdir "$image/etc/udev/rules.d"
mkdir -p "$cell/outside"
ln -s "$cell/outside" "$image/etc/udev/rules.d"
refused "where a folder has to be" --apply
[ -z "$(ls "$cell/outside")" ] || fail "written outside of the image"
new_image 2 3
echo 'GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT isolcpus=1"' >"$image/etc/default/grub.d/99-mine.cfg"
refused "99-mine.cfg has isolcpus= too" --apply
new_image 0 2
refused "core 0 stays with the kernel, and line0 has it" --apply
new_image
refused "no instance has a core" --apply
new_image 2 7
refused "core" --apply
new_image 2 3
mkdir "$image/run"
touch "$image/run/.containerenv"
refused "this is a container" --apply
fix >"$cell/said" || fail "a container: $(cat "$cell/said")"
grep -q 'has to be done outside, on the host' "$cell/said" || fail "$(cat "$cell/said")"
refused "there is no file $cell/none.toml" --config "$cell/none.toml"

# A folder that cannot be written: it tells which files are written, and the next --apply goes on there.
may_not_write=(setpriv --bounding-set=-dac_override --inh-caps=-dac_override)
if [ "$(id -u)" -eq 0 ] && "${may_not_write[@]}" true 2>/dev/null; then
  new_image 2 3
  chmod 555 "$image/etc/sysctl.d"
  ! "${may_not_write[@]}" "$BIN/plcctl" check host --fix --root "$image" --apply >"$cell/said" 2>&1 || fail "written in a folder that is only read"
  grep -q "^written: $image/etc/default/grub.d/plchost.cfg" "$cell/said" || fail "$(cat "$cell/said")"
  grep -q "cannot make $image/etc/sysctl.d/60-plchost.conf: Permission denied (EACCES); the files above are written" "$cell/said" || fail "$(cat "$cell/said")"
  [ -z "$(ls -A "$image/etc/sysctl.d")" ] || fail "half a file is left"
  chmod 755 "$image/etc/sysctl.d"
  is "$(fix --apply | grep -c '^written: ')" 5 || fail "--apply does not go on"
fi

# wrong_use OPTION...
wrong_use() {
  local code=0
  plcctl check host "$@" >"$cell/said" 2>&1 || code=$?
  is "$code" 2 || fail "plcctl check host $*: exit code $code: $(cat "$cell/said")"
}
wrong_use --apply
wrong_use --root "$image"
wrong_use --fix --apply --revert --root "$image"
wrong_use --fix --host press --root "$image"
wrong_use --fix --json --root "$image"
wrong_use --fix --root "$cell/no_such_folder"
cp "$BIN/plcctl" "$cell/plcctl"
! "$cell/plcctl" check host --fix >"$cell/said" 2>&1 || fail "--fix works without plchostd"
grep -q 'works on a controller only' "$cell/said" || fail "$(cat "$cell/said")"
if [ "$(id -u)" -eq 0 ] && setpriv --reuid 65534 --regid 65534 --clear-groups test -x "$BIN/plcctl" 2>/dev/null; then
  ! setpriv --reuid 65534 --regid 65534 --clear-groups "$BIN/plcctl" check host --fix --apply >"$cell/said" 2>&1 || fail "others than root may write"
  grep -q 'only root may write in /etc' "$cell/said" || fail "$(cat "$cell/said")"
fi
