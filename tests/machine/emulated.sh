# The machine of run.sh in QEMU: Debian boots with its own kernel. By KVM where that works, else emulated.
# A file that run.sh sources: it has $root, $packages, $applications and $work.
machine_programs=(debootstrap qemu-system-x86_64 mke2fs ssh ssh-keygen python3)
# $kernel: Debian's package of it.
machine_packages=ca-certificates,dbus,initramfs-tools,jq,$kernel,openssh-server,procps,systemd-sysv,udev,zstd
machine_is_emulated=yes

# By ssh, over a network that ends in QEMU.
machine_prepare() {
  ssh-keygen -q -t ed25519 -N '' -f "$work/key"
  install -d -m 700 "$root/root/.ssh"
  install -m 600 "$work/key.pub" "$root/root/.ssh/authorized_keys"
  printf '[Match]\nType=ether\n[Network]\nAddress=10.0.2.15/24\n' >"$root/etc/systemd/network/tests.network"
  chroot "$root" systemctl -q enable systemd-networkd
  echo /dev/vda / ext4 defaults 0 1 >"$root/etc/fstab"
  echo machine >"$root/etc/hostname"
  rm -f "$root/etc/resolv.conf"
  mke2fs -q -t ext4 -d "$root" "$work/disk" 4G >"$log" 2>&1
}

# The same machine by each of them has to come to its first words.
works_with() {
  (exec timeout 15 qemu-system-x86_64 -accel "$1" -cpu max -m 256 -display none -monitor none -serial "file:$work/words" -no-reboot \
    -kernel "$root/vmlinuz" -append "console=ttyS0 panic=-1") >/dev/null 2>&1 </dev/null || true
  grep -q 'Linux version' "$work/words" 2>/dev/null
}

machine_start() {
  accelerator=tcg,thread=multi
  if [ -w /dev/kvm ] && works_with kvm 2>/dev/null; then
    accelerator=kvm
    machine_is_emulated=no
  fi
  port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
  machine_prepare
  machine_boot
  # 20 times slower than a processor, it would do nothing but ticks.
  [ "$machine_is_emulated" = no ] || sed -i 's/^SchedulerInterval=.*/SchedulerInterval=20000/' "$applications"/*.cfg
  tar -C "$packages" -c . | ssh_machine 'mkdir /packages && tar -C /packages -x'
  tar -C "$applications" -c . | ssh_machine 'mkdir /applications && tar -C /applications -x'
}
# With one queue for the disk: the interrupt of a queue that only one core has cannot be moved.
machine_boot() {
  qemu-system-x86_64 -accel "$accelerator" -cpu max -smp 2 -m 2048 -display none -monitor none -serial "file:$work/console" -no-reboot \
    -kernel "$root/vmlinuz" -initrd "$root/initrd.img" -append "root=/dev/vda rw console=ttyS0 panic=-1 $kernel_line" \
    -drive "file=$work/disk,format=raw,if=none,id=disk,cache=unsafe" -device virtio-blk-pci,drive=disk,num-queues=1 \
    -nic "user,model=virtio-net-pci,restrict=on,hostfwd=tcp:127.0.0.1:$port-:22" >"$work/qemu" 2>&1 </dev/null &
  machine=$!
  echo "  QEMU with $accelerator, $kernel${kernel_line:+ $kernel_line}"
  until_true 900 answers  # an emulated machine beside busy ones
}
# The same machine after an end in order, with $kernel_line as it is now.
machine_boot_again() {
  on_machine systemctl poweroff || true
  until_true 600 has_ended
  rm -f "$work/ssh"
  machine_boot
}
has_ended() { ! kill -0 "$machine"; }
answers() {
  kill -0 "$machine" 2>/dev/null || cannot "QEMU ended: $(tail -n 1 "$work/qemu")"
  ssh_machine true </dev/null
}

ssh_machine() {
  ssh -q -p "$port" -i "$work/key" -o BatchMode=yes -o StrictHostKeyChecking=no -o UserKnownHostsFile=/dev/null -o ConnectTimeout=20 \
    -o ControlMaster=auto -o ControlPath="$work/ssh" -o ControlPersist=yes root@127.0.0.1 "$@"
}
on_machine() { ssh_machine "$(printf '%q ' env -i "${machine_environment[@]}" "$@")" </dev/null; }
