#!/usr/bin/env bash
# `cmake --install` puts the files of manager/install.md below a prefix, and a user needs no more: programs of others are built
# with it, and run with it.
. "$(dirname "$0")/common.sh"
source=$(cd "$(dirname "$0")/../../.." && pwd)
build=$(cd "$BIN/.." && pwd)
prefix=$cell/usr
documents=$prefix/share/doc/plchost

echo "- the files are those of manager/install.md"
cmake --install "$build" --prefix "$prefix" >"$cell/install.log" || fail "not installed"
# block FIRST: the block of code of install.md that begins with FIRST
block() { awk -v first="$1" '/^```/ { inside = !inside; begins = inside; wanted = 0; next }
  begins { wanted = index($0, first) == 1; begins = 0 } inside && wanted' "$source/manager/install.md"; }
files() { (cd "$1" && find . \( -type f -o -type l \) ! -path './share/doc/*' | sed 's|^\./||; s|/plchost_client\..*\.so$|/plchost_client.*.so|' | LC_ALL=C sort); }
block bin/ | awk '{ print $1 }' | LC_ALL=C sort >"$cell/said"
[ "$(wc -l <"$cell/said")" -gt 30 ] || fail "install.md has no list"
files "$prefix" >"$cell/there"
diff "$cell/said" "$cell/there" >"$cell/files.log" || fail "install.md says <, installed is >"
packages=$("$source/.ci/packages" --list need | LC_ALL=C sort | xargs)
is "$(block 'apt install' | sed 's/^apt install //')" "$packages" || fail "install.md does not name the packages $packages"

echo "- a package of a distribution: another prefix, below DESTDIR"
DESTDIR=$cell/stage cmake --install "$build" --prefix /usr >"$cell/stage.log" || fail "not staged"
files "$cell/stage/usr" | diff "$cell/there" - >"$cell/files.log" || fail "staged is >"
grep -q '^ExecStart=/usr/bin/plchostd ' "$cell/stage/usr/lib/systemd/system/plchostd.service" || fail "the unit of /usr"

echo "- each unit names what is there"
for unit in "$prefix"/lib/systemd/system/*.service; do
  ! grep -q '@[a-z_]*@' "$unit" || fail "$(grep '@' "$unit")"
  program=$(sed -n 's/^ExecStart=\([^ ]*\).*/\1/p' "$unit")
  case $(basename "$unit") in
    plchostd.service) is "$program" "$prefix/bin/plchostd" ;;
    plchost-instances.service) is "$program" /bin/sh ;;
    *) is "$program" "$prefix/bin/$(basename "$unit" @.service)" && [ -x "$program" ] ;;
  esac || fail "$unit starts $program"
  for document in $(grep -oE 'file:[^ ]+' "$unit" | cut -d: -f2); do [ -f "$document" ] || fail "no $document"; done
done
for link in $(grep -oE '\]\([^)#: ]+[)#]' "$documents/README.md" | tr -d '])(#'); do
  [ -e "$documents/$link" ] || case "$link" in *.h | *.hpp) ;; *) fail "README.md links to $link, which is not installed" ;; esac
done

echo "- completions are found in the folders of the shells"
bash -c 'source "$1"; complete -p plcctl' - "$prefix/share/bash-completion/completions/plcctl" | grep -q _plcctl || fail "bash"
fish --no-execute "$prefix/share/fish/vendor_completions.d/plcctl.fish" || fail "fish"
cat >"$cell/typed.zsh" <<'END'
zmodload zsh/zpty
zpty shell "TERM=dumb zsh -f -i"
zpty -w shell "stty cols 200; PS1=; unsetopt zle_bracketed_paste; fpath=($1 \$fpath); autoload -U compinit; compinit -u -D; print READ''Y"
zpty -r shell seen '*READY*'
zpty -w -n shell $'plcctl sh\t'
screen=
for (( i = 0; i < 200; i++ )); do
  zpty -r -t shell seen && screen+=$seen
  [[ $screen != *"plcctl show "* ]] || { zpty -d shell; exit 0; }
  sleep 0.05
done
print -r -- "$screen"
exit 1
END
HOME=$cell PATH=$prefix/bin:$PATH zsh -f "$cell/typed.zsh" "$prefix/share/zsh/site-functions" || fail "zsh"

echo "- programs of others, built by CMake and by pkg-config"
mkdir "$cell/project"
cat >"$cell/project/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.25)
project(line C CXX)
find_package(plchost 0.1 REQUIRED COMPONENTS application client pool)
set(examples $documents/instances/examples)
foreach(program packer/packer.c bottling_line/bottling_line.cpp)
  cmake_path(GET program STEM name)
  add_library(\${name} MODULE \${examples}/\${program})
  set_target_properties(\${name} PROPERTIES PREFIX "")
  target_link_libraries(\${name} PRIVATE plchost::application)
endforeach()
add_executable(watch_line $documents/api/library/examples/watch_line.cpp)
target_link_libraries(watch_line PRIVATE plchost::plchost-client)
add_executable(feeder \${examples}/parts_feeder/feeder.c)
target_link_libraries(feeder PRIVATE plchost::plcpool)
END
{ cmake -S "$cell/project" -B "$cell/project/build" -DCMAKE_PREFIX_PATH="$prefix" && cmake --build "$cell/project/build"; } \
  >"$cell/project.log" 2>&1 || fail "not built by CMake"
sed -i 's/ pool)/ pool motion)/' "$cell/project/CMakeLists.txt"
! cmake -S "$cell/project" -B "$cell/project/other" -DCMAKE_PREFIX_PATH="$prefix" >"$cell/motion.log" 2>&1 || fail "an unknown component"
export PKG_CONFIG_PATH=$prefix/lib/pkgconfig
# shellcheck disable=SC2046  # flags are words
{ g++ -std=c++17 "$documents/api/library/examples/post_event.cpp" -o "$cell/post_event" $(pkg-config --cflags --libs plchost-client) &&
  gcc -std=c89 "$documents/instances/examples/parts_feeder/walk.c" -o "$cell/walk" $(pkg-config --cflags --libs plcpool); } \
  2>"$cell/gcc.log" || fail "not built by pkg-config"

echo "- Structured Text, with the installed sources of the adapters"
light=$documents/instances/examples/traffic_light/traffic_light.st
said=$(env -u PLCHOST_MATIEC -u PLCHOST_STRUCPP PATH="$cell" "$prefix/bin/plcctl" build application "$light" -o "$cell/light.so" 2>&1) &&
  fail "built without a compiler"
grep -q "there is no compiler for Structured Text.*PLCHOST_MATIEC.*PLCHOST_STRUCPP" <<<"$said" || fail "$said"
for compiler in matiec strucpp; do
  folder=PLCHOST_${compiler^^}
  [ -n "${!folder:-}" ] || { echo "  left out: a build by $compiler, which needs $folder"; continue; }
  "$prefix/bin/plcctl" build application "$light" -o "$cell/$compiler.so" --compiler $compiler --keep "$cell/$compiler" >"$cell/$compiler.log" 2>&1 ||
    fail "not built by $compiler"
  "$prefix/bin/plc-instance" --check-application "$cell/$compiler.so" | grep -q "lights: cyclic, priority 5, every 20000 us" || fail "$compiler"
done
said=$(PLCHOST_MATIEC='' PLCHOST_STRUCPP="$cell" "$prefix/bin/plcctl" build application "$light" -o "$cell/light.so" 2>&1) && fail "built by no STruC++"
grep -q "npm ci --ignore-scripts && npm run build" <<<"$said" || fail "$said"

echo "- a host of the installed programs runs the control program, and the others reach it"
BIN=$prefix/bin APPLICATIONS=$cell/project/build
write_host north "$first_core"
write_instance north packer1 "$first_core" packer 'scheduler = "CmpScheduleTimer"'
start_manager north
until_true 20 state_is packer1 running
said=$(LD_LIBRARY_PATH=$prefix/lib "$cell/post_event" north packer1/product) || fail "not posted by the client library"
grep -q "^run by packer1/Product" <<<"$said" || fail "$said"
said=$(LD_LIBRARY_PATH=$prefix/lib PLCHOST_POOL=$pool-north "$cell/walk" packer1/product) || fail "not posted by the pool's library"
is "$said" "event, set" || fail "$said"
ran_twice() { is "$(task packer1/Product cycles)" 2; }
until_true 20 ran_twice
PYTHONPATH=$prefix/lib/python3/dist-packages python3 -c 'import plchost_client, os
client = plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=10.0)
assert [instance.name for instance in client.instances("north")] == ["packer1"]' 2>"$cell/python.log" || fail "Python"
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
