#!/usr/bin/env bash
# A gate that checks nothing is green for ever. Here each one is shown a planted fault and must turn red.
# Usage: prove.sh [BUILD] (a configured build, for clang-tidy's proof)
set -uo pipefail
cd "$(dirname "$0")/../.."
gates=$PWD/tests/gates
plot=$(mktemp -d)
trap 'rm -rf "$plot"' EXIT
failed=0

# must_be_red NAME DIAGNOSTIC COMMAND...: the command has to fail, and to say DIAGNOSTIC
must_be_red() {
  local name=$1 diagnostic=$2 output
  shift 2
  if output=$("$@" 2>&1); then
    echo "the gate '$name' did not see the planted fault"
    failed=1
  elif ! grep -qF -- "$diagnostic" <<<"$output"; then
    printf "the gate '%s' does not say '%s' but:\n%s\n" "$name" "$diagnostic" "$output"
    failed=1
  fi
}
# The proof itself: a gate that fails for another reason, or not at all, proves nothing.
must_be_red proof "a diagnostic" bash -c 'echo another one; exit 1' >/dev/null
[ "$failed" -eq 1 ] || { echo "the proof takes any failure for the diagnostic"; exit 1; }
failed=0
must_be_red proof "a diagnostic" echo "a diagnostic" >/dev/null
[ "$failed" -eq 1 ] || { echo "the proof takes a success for a failure"; exit 1; }
failed=0

new_tree() {
  rm -rf "$plot/tree"
  mkdir -p "$plot/tree"/{shm/base,shm/pool,schedulers,instances,api,manager,tests}
  cp .clang-format .clang-tidy "$plot/tree/"
}
commit_tree() { git -C "$plot/tree" init -q && git -C "$plot/tree" add -A; }

# The whole tree: the drawings of the layers are held against each other, too.
rm -rf "$plot/tree" && mkdir "$plot/tree"
git ls-files -z '*.hpp' '*.cpp' '*.h' '*.c' '*README.md' | tar -c --null -T - | tar -x -C "$plot/tree"
"$gates/layers.sh" "$plot/tree" || { echo "the tree of the layers' proofs is wrong before anything is planted"; failed=1; }

mkdir "$plot/empty" && git -C "$plot/empty" init -q
must_be_red "layers: nothing" "no drawing and no folder of the code was found" "$gates/layers.sh" "$plot/empty"
must_be_red "prose: nothing" "no text was found" "$gates/prose.py" "$plot/empty"

# must_not_include FILE HEADER DIAGNOSTIC: the include is planted in a header of a lower layer, and taken away again
must_not_include() {
  printf '#include "%s"\n' "$2" >"$plot/tree/$1"
  must_be_red "layers: $1" "$1:1: $3" "$gates/layers.sh" "$plot/tree"
  rm "$plot/tree/$1"
}
must_not_include shm/base/planted.hpp shm/files/lock_file.hpp "shm/base/ may not include shm/files/"
must_not_include shm/base/planted.hpp shm/operations/operations.hpp "shm/base/ may not include shm/operations/"
must_not_include shm/pool/planted.cpp shm/pages/host_page.hpp "shm/pool/ may not include shm/pages/"
must_not_include schedulers/tick/planted.hpp schedulers/task_set.hpp "schedulers/tick/ may not include schedulers/"
must_not_include schedulers/planted.hpp shm/pool/object_pool.hpp "schedulers/ may not include shm/pool/"
must_not_include instances/runtime/settings/planted.hpp instances/runtime/application/application.hpp \
  "instances/runtime/settings/ may not include instances/runtime/application/"
must_not_include api/dds/planted.hpp api/client/control_client.hpp "api/dds/ may not include api/client/"
must_not_include manager/system/planted.hpp manager/config/load_config.hpp "manager/system/ may not include manager/config/"
must_not_include manager/planted.hpp instances/runtime/settings/settings.hpp "manager/ may not include instances/runtime/settings/"
must_not_include tests/unit/base/planted.cpp shm/pool/object_pool.hpp "tests/unit/base/ may not include shm/pool/"
for way in '"../pool/object_pool.hpp"' '<shm/pool/object_pool.hpp>' '"../../shm/base/../pool/object_pool.hpp"' '"./../pool/object_pool.hpp"'; do
  printf '#  include  %s\n' "$way" >"$plot/tree/shm/base/planted.hpp"
  must_be_red "layers: include of $way" "shm/base/planted.hpp:1: shm/base/ may not include shm/pool/" "$gates/layers.sh" "$plot/tree"
done
rm "$plot/tree/shm/base/planted.hpp"
must_not_include shm/base/planted.hpp plc_app.h "shm/base/ may not include instances/ (plc_app.h)"
must_not_include schedulers/tasks/planted.hpp schedulers/tasks/kinds/kind.hpp "schedulers/tasks/ may not include schedulers/tasks/kinds/"
must_not_include shm/files/planted.hpp tests/support/own_name.hpp "shm/files/ may not include tests/support/own_name"
mkdir "$plot/tree/shm/attic" && touch "$plot/tree/shm/attic/planted.hpp"
must_be_red "layers: folder" "shm/attic: it is not in the drawing of shm/README.md" "$gates/layers.sh" "$plot/tree"
rm -r "$plot/tree/shm/attic"

# must_not_draw LINE DIAGNOSTIC: the line is planted in the drawing of shm, and taken away again
must_not_draw() {
  cp shm/README.md "$plot/README.md"
  sed -i "s|^\`\`\`layers\$|&\n$1|" "$plot/tree/shm/README.md"
  must_be_red "layers: drawing" "$2" "$gates/layers.sh" "$plot/tree"
  mv "$plot/README.md" "$plot/tree/shm/README.md"
}
must_not_draw "base/ ─► library/" "shm/base/ ─► shm/library/ ─► shm/pool/"
must_not_draw "attic/ ─► base/" "shm/README.md: there is no layer shm/attic/, or no file in it"
must_not_draw "block_driver/ ─► toml/" "no include uses the arrow shm/block_driver/ ─► shm/toml/"
rm "$plot/tree/shm/README.md"
must_be_red "layers: no drawing" "shm/README.md: it has no drawing of its layers" "$gates/layers.sh" "$plot/tree"

new_tree
printf 'int  main( ){return 0;}\n' >"$plot/tree/shm/base/ugly.cpp"
must_be_red format "shm/base/ugly.cpp:1:11: error: code should be clang-formatted" "$gates/format.sh" "$plot/tree"

new_tree
mkdir "$plot/tree/utilities" && touch "$plot/tree/utilities/x.txt" && commit_tree
must_be_red "house: top level" "utilities: not one of the eight entries of the top level" "$gates/house.sh" "$plot/tree"
new_tree
seq -f '// %g' 501 >"$plot/tree/shm/base/long.cpp" && commit_tree
must_be_red "house: long file" "shm/base/long.cpp: 501 lines" "$gates/house.sh" "$plot/tree"
new_tree
touch "$plot/tree/shm/base/crowd"{1..36}.cpp && commit_tree
must_be_red "house: crowded folder" "shm/base: 36 names of sources; at most 35" "$gates/house.sh" "$plot/tree"
new_tree
mkdir -p "$plot/tree/tests" && printf '#!/bin/sh\necho building\n' >"$plot/tree/tests/run.sh" && chmod +x "$plot/tree/tests/run.sh" && commit_tree
must_be_red "house: script without help" "tests/run.sh --nonsense does not say what there is" "$gates/house.sh" "$plot/tree"
new_tree
mkdir -p "$plot/tree/tests/fuzz/corpus/other" && echo 'plchost_fuzzer(planted)' >"$plot/tree/tests/fuzz/CMakeLists.txt" && touch "$plot/tree/tests/fuzz/parsers.txt" && commit_tree
must_be_red "house: fuzzer without an input" "tests/fuzz/corpus/planted: no input for the fuzzer" "$gates/house.sh" "$plot/tree"
must_be_red "house: fuzzer without a line" "tests/fuzz/parsers.txt: planted has no line" "$gates/house.sh" "$plot/tree"
new_tree
echo "// TO""DO" >"$plot/tree/shm/base/later.cpp" && commit_tree
must_be_red "house: unfinished" "the lines above are unfinished" "$gates/house.sh" "$plot/tree"
new_tree
echo '// /ho''me/somebody/x' >"$plot/tree/shm/base/path.cpp" && commit_tree
must_be_red "house: path" "the lines above name a path of one machine" "$gates/house.sh" "$plot/tree"

new_tree
echo 'int fd = open(path, O_RDWR | O_CR''EAT);' >"$plot/tree/shm/base/link.cpp" && commit_tree
must_be_red "house: file through a link" "the lines above make files through links" "$gates/house.sh" "$plot/tree"
new_tree
echo 'bool f() { if (a && !co_aw''ait b()) co_return true; }' >"$plot/tree/api/await.cpp" && commit_tree
must_be_red "house: await in a condition" "the lines above await within a condition" "$gates/house.sh" "$plot/tree"
new_tree
echo 'std::copy_n(name, n, address.sun_path + 1);' >"$plot/tree/shm/base/name.cpp" && commit_tree
must_be_red "house: abstract socket" "the lines above use names that anybody can take" "$gates/house.sh" "$plot/tree"
new_tree
echo 'void f() { dds_unregister_ins''tance(1, nullptr); }' >"$plot/tree/shm/base/leak.cpp" && commit_tree
must_be_red "house: leaked instance" "the lines above leak" "$gates/house.sh" "$plot/tree"
new_tree
mkdir -p "$plot/tree/instances/runtime/"{abi,tasks} && printf '{\n  plc_call;\n};\n' >"$plot/tree/instances/runtime/exported_symbols.txt"
echo 'void* plc_call(int x) {}' | tee "$plot/tree/instances/runtime/abi/calls.cpp" >"$plot/tree/instances/runtime/tasks/table.cpp" && commit_tree
must_be_red "house: function of plc_app.h" "instances/runtime/tasks/table.cpp:1:void* plc_call(int x) {}" "$gates/house.sh" "$plot/tree"
new_tree
mkdir -p "$plot/tree/instances/runtime/"{abi,debug} && printf '{\n  plc_call;\n};\n' >"$plot/tree/instances/runtime/exported_symbols.txt"
printf '  plc_call(1);\n' >"$plot/tree/instances/runtime/debug/service.cpp" && commit_tree
must_be_red "house: use of abi/ from below" "instances/runtime/debug/service.cpp:1:  plc_call(1);" "$gates/house.sh" "$plot/tree"
new_tree
mkdir -p "$plot/tree/instances/runtime/abi" && touch "$plot/tree/instances/runtime/"{exported_symbols.txt,abi/calls.cpp} && commit_tree
must_be_red "house: empty exported_symbols.txt" "exported_symbols.txt: it does not list the functions of plc_app.h" "$gates/house.sh" "$plot/tree"
new_tree
echo 'void* library = dlop''en(path, RTLD_NOW);' >"$plot/tree/api/library.cpp" && commit_tree
must_be_red "house: library without a cause" "the lines above do not tell a shortage from a wrong file: use open_library" "$gates/house.sh" "$plot/tree"

new_tree
echo 'if (page->magic != kOwnMagic) return wrong_page();' >"$plot/tree/api/own_page.cpp" && commit_tree
must_be_red "house: another check of a page" "the lines above check or make a page" "$gates/house.sh" "$plot/tree"
new_tree
printf '// clang-format off\n// A table. clang-''format on\n' >"$plot/tree/shm/base/joined.hpp" && commit_tree
must_be_red "house: joined comment" "shm/base/joined.hpp:2:// A table. clang-format on" "$gates/house.sh" "$plot/tree"
new_tree
echo 'bool is_newer(const plc_Presence& one, const Seen& seen) { return one.epoch > seen.epoch; }' >"$plot/tree/api/newer.cpp" && commit_tree
must_be_red "house: another rule for epochs" "the lines above compare epochs: use NewestEpoch" "$gates/house.sh" "$plot/tree"

new_tree
mkdir "$plot/tree/schedulers/policies" && echo '    PolicyName<class Second>{"Second"},' >"$plot/tree/schedulers/policies/registry.hpp"
echo 'auto* name = "Second";' | tee "$plot/tree/schedulers/policies/second.cpp" >"$plot/tree/api/words.cpp" && commit_tree
must_be_red "house: name of a scheduler" "api/words.cpp:1:auto* name" "$gates/house.sh" "$plot/tree"
git -C "$plot/tree" mv -f api/words.cpp api/words.h
must_be_red "house: name of a scheduler in C" "api/words.h:1:auto* name" "$gates/house.sh" "$plot/tree"
new_tree
mkdir "$plot/tree/schedulers/policies" && touch "$plot/tree/schedulers/policies/registry.hpp" && commit_tree
must_be_red "house: empty registry" "schedulers/policies/registry.hpp: it does not list the schedulers" "$gates/house.sh" "$plot/tree"
new_tree
echo 'bool late = kind == Task''Kind::cyclic;' >"$plot/tree/instances/late.cpp" && commit_tree
must_be_red "house: kind of a task" "the lines above know a kind of task" "$gates/house.sh" "$plot/tree"

new_tree
echo 'int result = pthread_cond_timed''wait(&changed, &mutex, &until);' >"$plot/tree/api/wait.cpp" && commit_tree
must_be_red "house: wait by the clock on the wall" "the lines above wait by a clock that can be set" "$gates/house.sh" "$plot/tree"
new_tree
mkdir -p "$plot/tree/tests/unit" && touch "$plot/tree/tests/unit/lost_test.cpp" && commit_tree
must_be_red "house: a test in no list" "tests/unit/lost_test.cpp: not in the CMakeLists.txt beside it" "$gates/house.sh" "$plot/tree"
new_tree
echo 'std::string name = "pool-" + std::to_string(::get''pid());' >"$plot/tree/tests/name.cpp" && commit_tree
must_be_red "house: name of a test's own making" "the lines above make names that nobody clears away" "$gates/house.sh" "$plot/tree"

# contract_with NAME EXPRESSION [--write]: the contract with that change (of sed), and with a reference made anew
contract_with() {
  new_tree
  mkdir -p "$plot/tree/shm/operations"
  cp shm/operations/operations.def "$plot/tree/shm/operations/"
  cp api/control.idl api/reference.md "$plot/tree/api/"
  sed -i -E "$2" "$plot/tree/api/control.idl" "$plot/tree/shm/operations/operations.def"
  cmp -s api/control.idl "$plot/tree/api/control.idl" && cmp -s shm/operations/operations.def "$plot/tree/shm/operations/operations.def" &&
    { echo "nothing was planted for '$1'"; failed=1; }
  [ "${3:-}" != --write ] || api/reference.py --root "$plot/tree/api" --write >/dev/null || true
}
# plant_in_contract NAME DIAGNOSTIC EXPRESSION [--write]
plant_in_contract() {
  contract_with "$1" "$3" "${4:-}"
  must_be_red "$1" "$2" "$gates/contract.sh" "$plot/tree"
}
# allowed_in_contract NAME EXPRESSION: the first version is frozen, but not the contract
allowed_in_contract() {
  contract_with "$1" "$2" --write
  "$gates/contract.sh" "$plot/tree" || { echo "the gate 'contract' refuses $1"; failed=1; }
}
plant_in_contract "contract: old reference" "reference.md is not up to date" 's,// of plchost-dds,// of the server,'
allowed_in_contract "a better comment" 's,// of plchost-dds,// of the server,'
allowed_in_contract "a word more for a code" 's/0 memory, 1 semaphore, 2 event, 3 mutex/&, 4 latch/'
allowed_in_contract "an operation more" 's/^OPERATION.stop, 2,/OPERATION(plant, 99, "a plant", .verb_word = "plant")\n&/'
plant_in_contract "contract: no comment" "Presence.pid has no comment" 's,^( *long pid;) *// of plchost-dds,\1,'
plant_in_contract "contract: no QoS" "LogPage has no 'qos:'" '/qos: as ObjectPage/d'
plant_in_contract "contract: QoS that the generator does not know" "this QoS is not understood: RELIABLE 1 ms" 's/qos: RELIABLE \(1 ms\), KEEP_LAST 16/qos: RELIABLE 1 ms, KEEP_LAST 16/'
plant_in_contract "contract: text without a bound" "Transition.reason has no bound" 's/string<191> reason/string reason/'
plant_in_contract "contract: version 1 has another type" "member string<191> reason is now string<192> reason" 's/string<191> reason/string<192> reason/' --write
plant_in_contract "contract: version 1 has another member" "member unsigned long credits is now unsigned long credit" 's/unsigned long credits;/unsigned long credit;/' --write
plant_in_contract "contract: version 1 has one more member" "type EventAck: member sequence<KeyValue, 16> ext is now long more" 's,^( *)unsigned long credits;.*,&\n\1long more; // more,' --write
plant_in_contract "contract: an operation that its row does not have so" "control.idl is not up to date" 's/(OPERATION_STOP +=) 2;/\1 102;/'
plant_in_contract "contract: version 1 has another code" "constant OPERATION_STOP = 2 is not what it was" 's/^(OPERATION.stop,) 2,/\1 60,/' --write
plant_in_contract "contract: a row that nobody understands" "operations.def: a row is not understood" 's/^(OPERATION.stop,) 2,/\1 two,/'
plant_in_contract "contract: a record that cannot grow" "LogRecord does not end with ext" '/struct LogRecord/,/^  };/{/ext;/d}'
plant_in_contract "contract: version 1 has another QoS" "type Transition: its QoS is 'RELIABLE (1 ms), KEEP_LAST 8, TRANSIENT_LOCAL" 's/KEEP_LAST 64, TRANSIENT_LOCAL, autodispose off/KEEP_LAST 8, TRANSIENT_LOCAL, autodispose off/' --write
plant_in_contract "contract: version 1 has another partition" "type Presence: its writer is 'host, in partition n.<host>', was" '/topic: plc.v1.presence/,/reader:/s/partition s/partition n/' --write
plant_in_contract "contract: version 1 has another reader" "type NameClaim: its reader is 'all', was 'hosts of that name'" 's/reader: hosts of that name/reader: all/' --write
plant_in_contract "contract: version 1 has another word for a code" "type TaskStatus: the codes of state are created, waiting, stopped, exception, were created, running" 's/0 created, 1 running, 2 stopped/0 created, 1 waiting, 2 stopped/' --write
plant_in_contract "contract: version 1 has another topic" "type Reply is of topic plc/v1/answer, was of plc/v1/reply" 's,topic: plc/v1/reply,topic: plc/v1/answer,' --write

# plant_in_picture NAME DIAGNOSTIC FILE EXPRESSION: that picture with that change (of sed)
plant_in_picture() {
  new_tree
  sed -E "$4" "$3" >"$plot/tree/manager/planted.svg"
  cmp -s "$3" "$plot/tree/manager/planted.svg" && { echo "nothing was planted for '$1'"; failed=1; }
  commit_tree
  must_be_red "$1" "$2" "$gates/pictures.py" "$plot/tree"
}
plant_in_picture "pictures: text wider than its box" "spins to its time' crosses the edge of a box" manager/system.svg 's,woken early,& by its own guard,'
plant_in_picture "pictures: texts on each other" "lie on each other" manager/system.svg 's,(<text [^>]*y=")70(">plchostd),\194\2,'
plant_in_picture "pictures: a line crosses a text" "a line crosses 'plchostd spawns each of them'" manager/system.svg 's,L966\,390,L966\,405,; s,L80\,390,L80\,405,'
plant_in_picture "pictures: no arrow" "the process at 374,456 has no arrow" manager/system.svg '/M(400\,390|435|470)/d'
plant_in_picture "pictures: hidden arrow" "a box hides an end of the arrow M115,331 L115,454" manager/system.svg '/class="core".*y="422"/d; s,</svg>,<rect class="core" x="40" y="422" width="284" height="166"/>&,'
plant_in_picture "pictures: no background" "no rectangle of a colour lies behind everything" manager/system.svg '/<rect width="1000" height="650"/d'
plant_in_picture "pictures: no general font" "do not end with sans-serif" manager/system.svg 's/Arial, sans-serif/Arial/'
plant_in_picture "pictures: axis without a title" "an axis has no title" tests/bench/cyclic.svg '/class="axis" transform/d'
plant_in_picture "pictures: curves that only colours tell" "6 kinds of curves, 6 lines of legend, 4 shapes" tests/bench/corun.svg 's,m-3.6[^"]*,m-4\,0 a4\,4 0 1\,0 8\,0 a4\,4 0 1\,0 -8\,0,'
plant_in_picture "pictures: outside of the picture" "does not fit into the picture" tests/bench/cyclic.svg 's/Start latency of/& each single cycle, one after the other, of this and of that task, and of/'

# plant_in_prose NAME DIAGNOSTIC FILE TEXT: that file with that text, beside the glossary
plant_in_prose() {
  new_tree
  mkdir -p "$plot/tree/$(dirname "$3")"
  cp manager/glossary.md "$plot/tree/manager/"
  printf '%s\n' "$4" >"$plot/tree/$3" && commit_tree
  must_be_red "$1" "$2" "$gates/prose.py" "$plot/tree"
}
plant_in_prose "prose: who" "shm/planted.md:1: begins with 'Who': Who asks" shm/planted.md "Who asks is answered."
plant_in_prose "prose: what, behind a colon" "shm/planted.md:2: begins with 'what': what it says" shm/planted.md "The manager answers
and tells the client: what it says is final."
plant_in_prose "prose: what, in a cell" "shm/planted.md:3: begins with 'what': what it holds" shm/planted.md "| place | holds |
| --- | --- |
| shm | what it holds |"
plant_in_prose "prose: long cell" "shm/planted.md:3: 37 words in a cell, at most 36" shm/planted.md "| place | holds |
| --- | --- |
| shm | A$(printf ' word%.0s' {1..18}). A$(printf ' word%.0s' {1..17}). |"
plant_in_prose "prose: long cell behind a table that is made" "shm/planted.md:6: 37 words in a cell, at most 36" shm/planted.md "<!-- generated: planted -->
| place |
| --- |
<!-- end of generated -->

| A$(printf ' word%.0s' {1..18}). A$(printf ' word%.0s' {1..17}). |"
plant_in_prose "prose: who, within a sentence" "shm/planted.md:1: a clause begins with 'by who'" shm/planted.md "It is answered by who asks."
plant_in_prose "prose: long sentence" "shm/planted.md:1: 31 words in a sentence, at most 30" shm/planted.md "A$(printf ' word%.0s' {1..30})."
plant_in_prose "prose: who, behind an and" "shm/planted.md:1: a clause begins with 'and who'" shm/planted.md "The task waits, and who asked hears of it."
plant_in_prose "prose: what in the place of a noun" "shm/planted.md:1: a noun instead of 'of what was posted" shm/planted.md "The manager keeps a list of what was posted."
plant_in_prose "prose: long sentence with a colon" "shm/planted.md:1: 31 words in a sentence, at most 30" shm/planted.md "A$(printf ' word%.0s' {1..18}): a$(printf ' word%.0s' {1..11})."
plant_in_prose "prose: whom" "shm/planted.md:1: a clause begins with 'whom'" shm/planted.md "The log tells for whom the host posts."
plant_in_prose "prose: whether who" "shm/planted.md:1: a clause begins with 'whether who'" shm/planted.md "The host checks whether who asks may post."
plant_in_prose "prose: who, apart from its nobody" "shm/planted.md:1: a clause begins with 'nobody is served who'" shm/planted.md "Here nobody is served who has no key."
plant_in_prose "prose: long sentence of parts" "shm/planted.md:1: 31 words in a sentence, at most 30" shm/planted.md "A$(printf ' word%.0s' {1..10}): a$(printf ' word%.0s' {1..9}); a$(printf ' word%.0s' {1..9})."
plant_in_prose "prose: long line of a message" "shm/base/planted.cpp:1: 31 words in a sentence, at most 30" shm/base/planted.cpp \
  "const char* m = \"line one\\nA$(printf ' word%.0s' {1..18}): a$(printf ' word%.0s' {1..11})\";"
plant_in_prose "prose: synonym in plural" "shm/planted.md:1: 'missed cycles' is not a word of manager/glossary.md" shm/planted.md "The missed cycles are counted."
plant_in_prose "prose: synonym with -ed" "shm/planted.md:1: 'hot swapped' is not a word of manager/glossary.md" shm/planted.md "The program is hot swapped."
plant_in_prose "prose: tag of a type behind a sentence" "api/planted.idl:2: begins with 'who'" api/planted.idl "// It is written for each host
// reader: who asks"
plant_in_prose "prose: synonym" "shm/planted.md:1: 'DDS server' is not a word of manager/glossary.md" shm/planted.md "The DDS server answers."
plant_in_prose "prose: comment in C++" "shm/base/planted.cpp:2: begins with 'What': What is read" shm/base/planted.cpp "int planted = 0;
// What is read is checked."
plant_in_prose "prose: comment in C" "shm/planted.h:2: begins with 'Whose': Whose it" shm/planted.h "/**
 * Whose it is, the kernel knows. */"
plant_in_prose "prose: comment in Python" "tests/planted.py:1: begins with 'what': what it does" tests/planted.py "# Of the gate: what it does and sees."
plant_in_prose "prose: comment in a script" "tests/planted.sh:2: begins with 'Whoever': Whoever asks" tests/planted.sh "true
# W""hoever asks is answered."
plant_in_prose "prose: long comment with a colon" "shm/base/planted.hpp:2: 31 words in a sentence, at most 30" shm/base/planted.hpp "int planted = 0;
// A$(printf ' word%.0s' {1..18}): a$(printf ' word%.0s' {1..11})."
plant_in_prose "prose: long comment of parts in a table" "shm/base/planted.def:1: 31 words in a sentence, at most 30" shm/base/planted.def "// A$(printf ' word%.0s' {1..10}); a$(printf ' word%.0s' {1..9}): a$(printf ' word%.0s' {1..9})."
plant_in_prose "prose: long comment in a script" "tests/planted.sh:1: 31 words in a sentence, at most 30" tests/planted.sh "# A$(printf ' word%.0s' {1..18}): a
#$(printf ' word%.0s' {1..11})."
plant_in_prose "prose: long docstring" "tests/planted.py:2: 31 words in a sentence, at most 30" tests/planted.py "def planted():
    \"\"\"A$(printf ' word%.0s' {1..18}): a$(printf ' word%.0s' {1..11}).\"\"\""
plant_in_prose "prose: comment in a unit" "manager/planted.service.in:1: begins with 'What': What it needs" manager/planted.service.in "# What it needs: a core."
plant_in_prose "prose: message" "shm/base/planted.cpp:1: begins with 'what': what the client asks" shm/base/planted.cpp 'const char* m = "refused: what the client asks";'
plant_in_prose "prose: imperative in an error" "shm/base/planted.cpp:1: an error begins with an imperative: \"open \"" shm/base/planted.cpp \
  'return check_errno(::open(path.c_str(), O_RDONLY), "open " + path);'
plant_in_prose "prose: imperative in the format of an error" "shm/base/planted.cpp:2: an error begins with an imperative: \"make topic {}\"" shm/base/planted.cpp \
  'return failure(code(error),
      fmt::format("make topic {}", name));'
plant_in_prose "prose: message of a script" "tests/planted.sh:1: begins with 'who': who asks" tests/planted.sh 'fa''il "who asks is refused"'
plant_in_prose "prose: string of CMake" "api/CMakeLists.txt:2: 'DDS server' is not a word of manager/glossary.md" api/CMakeLists.txt 'project(planted)
plchost_manual(planted "the DDS server of a host")'
plant_in_prose "prose: text of a picture" "api/planted.svg:2: 'DDS server' is not a word of manager/glossary.md" api/planted.svg '<svg>
<text x="1">the DDS <tspan>server</tspan></text></svg>'
new_tree
echo "Who asks? The manager answers the client, and says what is wrong: \`what\` is code." >"$plot/tree/shm/planted.md"
echo "Nobody waits. A client$(printf ' word%.0s' {1..9}): a$(printf ' word%.0s' {1..9}); a$(printf ' word%.0s' {1..8})." >>"$plot/tree/shm/planted.md"
echo "| A$(printf ' word%.0s' {1..18}). A$(printf ' word%.0s' {1..16}). |
<!-- generated: planted -->
| A$(printf ' word%.0s' {1..18}). A$(printf ' word%.0s' {1..18}). |
<!-- end of generated -->" >>"$plot/tree/shm/planted.md"
echo "// Takes$(printf ' word%.0s' {1..28}). timed_out: after$(printf ' word%.0s' {1..28})." >"$plot/tree/shm/planted.hpp"
printf '%s\n' "const char* m = \"A$(printf ' word%.0s' {1..29})\\nA$(printf ' word%.0s' {1..29})\\n\";" >"$plot/tree/shm/planted.cpp"
echo "PLANTED = r\"(?P<word>a)$(printf ' word%.0s' {1..31})\"" >"$plot/tree/tests/planted.py"
echo "// row: host$(printf '; word%.0s' {1..40})" >"$plot/tree/api/planted.idl" && commit_tree
"$gates/prose.py" "$plot/tree" || { echo "good prose does not pass its gate"; failed=1; }

# plant_in_documents NAME DIAGNOSTIC FILE EXPRESSION: the whole tree, one file of it with that change (of sed)
new_tree
git ls-files -z -c -o --exclude-standard | xargs -0 cp --parents -t "$plot/tree" && commit_tree
plant_in_documents() {
  sed -i -E "$4" "$plot/tree/$3"
  cmp -s "$3" "$plot/tree/$3" && { echo "nothing was planted for '$1'"; failed=1; }
  must_be_red "$1" "$2" "$gates/documents.py" "$plot/tree"
  cp "$3" "$plot/tree/$3"
}
"$gates/documents.py" "$plot/tree" || { echo "the documents do not pass their gate"; failed=1; }
plant_in_documents "documents: file of a link" "leads to no file" README.md 's,\(api/fleet.md\),(api/float.md),'
plant_in_documents "documents: heading of a link" "leads to no heading" api/plcctl.md 's,#a-changed-configuration,#a-changed-file,'
plant_in_documents "documents: page without a link" "no link leads here from README.md" README.md 's,\[glossary\]\(manager/glossary.md\),glossary,'
plant_in_documents "documents: long README" "lines; at most 250" README.md '1s,$,\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n\n,'
plant_in_documents "documents: old figures" "is not up to date" README.md 's,^\| the same beside.*,| the same | 0.1 | 0.2 | 1 | 2 |,'
plant_in_documents "documents: edited row of the benchmark" "is not up to date" tests/bench/figures.md '0,/\| idle \| [0-9.]+/s//| idle | 0.01/'
plant_in_documents "documents: figures of another revision" "tests/bench/figures.md: a generated table is not up to date" tests/bench/figures.json 's,"conditions":\{,&"revision":"planted"\,,'
plant_in_documents "documents: old topics" "is not up to date" api/contract.md '/`plc\/v1\/reply`/d'
plant_in_documents "documents: setting without a row" "no row for the key [Retain] PostponeMs" instances/settings.md '/PostponeMs. \|/d'
plant_in_documents "documents: unknown setting" "the code has no key [Retain] PostponeUs" instances/settings.md 's,(\[Retain\] Postpone)Ms,\1Us,'
plant_in_documents "documents: another meaning" "another meaning than in the code" instances/settings.md 's,phase of the task on its grid,phase of the task,'
plant_in_documents "documents: key without a row" "no row for the key [host] keep_pool" manager/configuration.md '/^. `keep_pool`/d'
plant_in_documents "documents: unknown key" "the code has no key [dds] unsecured" manager/configuration.md 's,`allow_unsecured`,`unsecured`,'
plant_in_documents "documents: unknown key in a text" "the code has no key Stop.OutputLimitMs" instances/states.md 's,Stop.OutputsLimitMs,Stop.OutputLimitMs,'
plant_in_documents "documents: unknown section and key in a text" "the code has no key [dds] peer" shm/blocks.md 's,\[dds\] peers,[dds] peer,'
plant_in_documents "documents: key that is read and has no row" "is read outside of the table" manager/config/load_config.cpp 's|  check_identity\(reader\);|  reader.truth("keep", kept);|'
plant_in_documents "documents: another meaning of a key" "[host] pool_objects has another meaning than in the code" manager/configuration.md 's,room in the pool,room in pools,'
plant_in_documents "documents: message that is gone" "no message has 'needs SCHED_FIFO prio '" manager/troubleshooting.md 's,`needs SCHED_FIFO priority`,`needs SCHED_FIFO prio `,'
plant_in_documents "documents: file that is gone" "there is no file schedulers/register.hpp" schedulers/README.md 's,`schedulers/policies/registry.hpp`,`schedulers/register.hpp`,'
plant_in_documents "documents: room without a box" "rooms.svg: the room debug/ of instances/README.md is missing" instances/rooms.svg '/>debug\/</d'
plant_in_documents "documents: unknown unit" "no unit of systemd is called plchost" manager/troubleshooting.md 's,systemctl status plchostd,systemctl status plchost,'
plant_in_documents "documents: function that is gone" "the code has no TaskSet::switch_planted" schedulers/mechanisms.md 's,TaskSet::switch_to,TaskSet::switch_planted,'
plant_in_documents "documents: unknown command" "plcctl has no command 'list writer'" api/plcctl.md 's,^\| `list writers` \| Posts,| `list writer` | Posts,'
plant_in_documents "documents: step of a walk that the code lacks" "has no function EventIntake::try_posting" manager/walks.md 's,EventIntake::try_post ,EventIntake::try_posting ,'
plant_in_documents "documents: step of a walk that only a comment names" "Task::run_cycle does not call work_between_cycles" schedulers/tasks/task.cpp 's,work_between_cycles\(\);,// &,'
plant_in_documents "documents: step of a walk that its caller does not call" "Task::run_cycle does not call before_cycle" manager/walks.md 's,as before_entry,as before_cycle,'

# Of each thing that the READMEs tell how to add, one is added; here their tables go stale.
"$gates/places.py" || { echo "things cannot be added as the READMEs say"; failed=1; }
sed -i '/^| `schedulers\/policies\/registry.hpp` |/d' "$plot/tree/schedulers/README.md"
must_be_red "places: file without a row" "'To add a scheduler' does not name schedulers/policies/registry.hpp" "$gates/places.py" "$plot/tree" scheduler
cp schedulers/README.md "$plot/tree/schedulers/"
sed -i 's,^| `schedulers/policies/registry.hpp` |,| `schedulers/policies/registry.hpp`\, `schedulers/activation/scheduler.hpp` |,' "$plot/tree/schedulers/README.md"
must_be_red "places: row without a use" "'To add a scheduler' names schedulers/activation/scheduler.hpp, which need not be touched" \
  "$gates/places.py" "$plot/tree" scheduler
cp schedulers/README.md "$plot/tree/schedulers/"

# Units are joined, and read one by one where two of them use a name.
new_tree
mkdir -p "$plot/tidy/shm"
units=()
for name in planted other; do
  echo "#include \"$plot/tree/shm/base/$name.cpp\"" >"$plot/tidy/shm/$name.cxx"
  units+=("{\"directory\": \"$plot\", \"command\": \"g++ -std=c++23 -c $plot/tidy/shm/$name.cxx\", \"file\": \"$plot/tidy/shm/$name.cxx\"}")
done
echo "[${units[0]}, ${units[1]}]" >"$plot/tidy/compile_commands.json"
echo 'static int f(int* p) { return p == 0 ? 1 : 2; } int planted(int* p) { return f(p); }' >"$plot/tree/shm/base/planted.cpp"
echo 'int other(int n) { return n; }' >"$plot/tree/shm/base/other.cpp"
must_be_red clang-tidy "shm/base/planted.cpp:1:36: error: use nullptr [modernize-use-nullptr" "$gates/tidy.sh" "$plot/tidy"
echo 'static int f(int n) { return n; } static int f(int* p) { return *p; } int other(int n) { return f(n) + f(&n); }' \
  >"$plot/tree/shm/base/other.cpp"
must_be_red "clang-tidy: one name twice" "shm/base/planted.cpp:1:36: error: use nullptr [modernize-use-nullptr" "$gates/tidy.sh" "$plot/tidy"
sed -i 's/p == 0/p == nullptr/' "$plot/tree/shm/base/planted.cpp"
"$gates/tidy.sh" "$plot/tidy" || { echo "units that use a name twice do not pass clang-tidy"; failed=1; }
echo '[]' >"$plot/tidy/compile_commands.json"
must_be_red "clang-tidy: nothing" "there is no unit in" "$gates/tidy.sh" "$plot/tidy"

new_tree
must_be_red "C files: nothing" "no C file was found" bash -c "git -C '$plot/tree' init -q && '$gates/c_files.sh' '$plot/tree'"
printf '#include <stdlib.h>\nint planted(void);\nint planted(void) {\n  int* p = malloc(sizeof *p);\n  if (p == NULL) return 0;\n  free(p);\n  return *p;\n}\n' >"$plot/tree/shm/planted.c"
commit_tree
must_be_red "C files: gcc's analyzer" "analyzer-use-after-free" "$gates/c_files.sh" "$plot/tree"
printf 'int planted(int n);\nint planted(int n) {\n  int a[2] = {0, 0};\n  if (n == 2) return a[n];\n  return a[0];\n}\n' >"$plot/tree/shm/planted.c"
must_be_red "C files: cppcheck" "[arrayIndexOutOfBoundsCond]" "$gates/c_files.sh" "$plot/tree"
printf 'int planted(void);\nint planted(void) { return 1; }\n' >"$plot/tree/shm/planted.c"
"$gates/c_files.sh" "$plot/tree" || { echo "a clean C file does not pass the analyzers"; failed=1; }

# Joined, these two would compile.
mkdir -p "$plot/alone"
echo 'template <class T> T twice(T n);' >"$plot/tree/shm/base/planted.hpp"
echo 'template <class T> T twice(T n) { return n + n; }' >"$plot/tree/shm/base/planted_definition.hpp"
echo "[{\"directory\": \"$plot/tree\", \"command\": \"clang++-19 -std=c++23 -I. -c shm/base/planted.cpp -o planted.o\", \"file\": \"$plot/tree/shm/base/planted.cpp\"}]" \
  >"$plot/alone/compile_commands.json"
printf '#include "shm/base/planted.hpp"\nint planted(int n) { return twice(n); }\n' >"$plot/tree/shm/base/planted.cpp"
must_be_red "alone: template without its definition" "instantiation of function 'twice<int>' required here, but no definition is available" \
  "$gates/alone.py" "$plot/alone"
echo 'int planted(int n) { return twice(n); }' >"$plot/tree/shm/base/planted.cpp"
must_be_red "alone: missing include" "use of undeclared identifier 'twice'" "$gates/alone.py" "$plot/alone"
printf '#include "shm/base/planted.hpp"\n#include "shm/base/planted_definition.hpp"\nint planted(int n) { return twice(n); }\n' >"$plot/tree/shm/base/planted.cpp"
"$gates/alone.py" "$plot/alone" || { echo "a file with all its includes does not compile by itself"; failed=1; }
echo '[]' >"$plot/alone/compile_commands.json"
must_be_red "alone: nothing" "there is no file in" "$gates/alone.py" "$plot/alone"

# The last changes are read, and all files where git knows no change.
turns=$plot/turns
mkdir -p "$turns/tests/gates"
cp "$gates/in_turn.py" "$turns/tests/gates/"
touch "$turns/old.cpp" "$turns/new.cpp" "$turns/new.hpp"
echo '#include "new.hpp"' >"$turns/names_new.cpp"
read_of() { (cd "$turns/tests/gates" && python3 -c 'import in_turn, pathlib; print(*sorted(pathlib.Path(file).name for file in in_turn.in_turn(
  [str(file) for file in in_turn.TOP.glob("*.cpp")], 10**9)))'); }
commit() { git -C "$turns" -c user.name=gate -c user.email=gate@localhost commit -q --allow-empty -m "$1"; }
[ "$(read_of)" = "names_new.cpp new.cpp old.cpp" ] || { echo "without git, not all files are read: $(read_of)"; failed=1; }
git init -q "$turns"
git -C "$turns" add . && commit first
echo '//' | tee "$turns/new.cpp" "$turns/new.hpp" >/dev/null
git -C "$turns" add . && for number in {2..41}; do commit "$number"; done
[ "$(read_of)" = "names_new.cpp new.cpp" ] || { echo "the last changes are not read: $(read_of)"; failed=1; }

cat >"$plot/CMakeLists.txt" <<EOF
cmake_minimum_required(VERSION 3.25)
project(planted C CXX)
set(CMAKE_CXX_STANDARD 23)
include($PWD/.cmake/targets.cmake)
plchost_program(planted SOURCES planted.cpp)
EOF
# build_planted COMPILER SANITIZERS: builds planted.cpp with the project's own flags and runs it
build_planted() {
  rm -rf "$plot/build"
  cmake -S "$plot" -B "$plot/build" -DCMAKE_COMPILE_WARNING_AS_ERROR=ON -DCMAKE_CXX_COMPILER="$1" -DSANITIZER="$2" >/dev/null &&
    cmake --build "$plot/build" 2>&1 && "$plot/build/planted" 2>&1
}
echo 'int main() { return 0; }' >"$plot/planted.cpp"
build_planted g++ "" >/dev/null || { echo "a clean program does not pass the gates"; failed=1; }
echo 'int main() { int unused; return 0; }' >"$plot/planted.cpp"
must_be_red "compiler warnings" "unused variable" build_planted g++ ""
echo 'int main(int n, char**) { int* p = new int[4]; p[n + 3] = 1; const int r = p[n + 3]; delete[] p; return r - 1; }' >"$plot/planted.cpp"
must_be_red "address sanitizer" "AddressSanitizer: heap-buffer-overflow" build_planted clang++-19 "address;undefined"
echo 'int main(int n, char**) { int big = 2147483647; big += n; return big == 0 ? 1 : 0; }' >"$plot/planted.cpp"
must_be_red "undefined sanitizer" "signed integer overflow" build_planted clang++-19 "address;undefined"
cat >"$plot/planted.cpp" <<'EOF'
#include <thread>
int shared = 0;
int main() {
  std::thread other([] { for (int i = 0; i < 1000; ++i) ++shared; });
  for (int i = 0; i < 1000; ++i) ++shared;
  other.join();
  return 0;
}
EOF
must_be_red "thread sanitizer" "ThreadSanitizer: data race" build_planted clang++-19 "thread"

# left_behind: the last step of a run, with a run directory of its own
export PLCHOST_RUN=planted-$$ TMPDIR=$plot/run
mkdir "$TMPDIR"
left_behind() { tests/left_behind.py end "$plot/before"; }
tests/left_behind.py begin "$plot/before"
left_behind || { echo "something is left behind where nothing was made"; failed=1; }
sleep 60 &
must_be_red "left behind: a process" "process $!: sleep 60" left_behind
kill "$!"
wait "$!" 2>/dev/null
touch "$TMPDIR/planted"
must_be_red "left behind: a file" "file $TMPDIR/planted" left_behind
rm "$TMPDIR/planted"
touch /dev/shm/plchost-planted
must_be_red "left behind: a shared memory" "in /dev/shm: plchost-planted" left_behind
rm /dev/shm/plchost-planted
new_tree
commit_tree
touch "$plot/tree/tests/planted.pyc"
left_in_sources() { (cd "$plot/tree" && "$gates/../left_behind.py" end "$plot/before"); }
must_be_red "left behind: a file among the sources" "in the sources: tests/planted.pyc" left_in_sources
rm "$plot/tree/tests/planted.pyc"
# In a namespace of its own, whose mounts go with it. A user who may not mount cannot leave any behind.
mount_and_look() { unshare --mount "$BASH" -c 'mount -t tmpfs planted "$TMPDIR" && tests/left_behind.py end "$1"' _ "$plot/before"; }
if unshare --mount "$BASH" -c 'mount -t tmpfs planted "$TMPDIR"' 2>/dev/null; then
  must_be_red "left behind: a mount" "mount planted $TMPDIR tmpfs" mount_and_look
fi

# The lists of tests that may be skipped or run again: tests on none of them are reported.
echo 'thread Planted.* planted' >"$plot/list"
reason() { PYTHONPATH=tests python3 -c 'import expected, sys; sys.exit(expected.Expected(sys.argv[1], sys.argv[2]).reason(sys.argv[3]))' "$plot/list" "$@"; }
must_be_red "expected tests" "planted" reason thread Planted.Case
for other in "plain Planted.Case" "address Planted.Case" "thread Other.Case"; do
  reason $other || { echo "the list of expected tests takes '$other'"; failed=1; }
done
echo 'sanitised Planted.* planted' >"$plot/list"
must_be_red "expected tests: unknown kind" "list:1: a line is KIND PATTERN REASON, with one of the kinds any," reason thread Planted.Case

# The suite, with lists of its own, over a build of two tests: one is skipped, one needs a further round.
mkdir -p "$plot/suite" "$plot/two"
cp tests/*.py "$plot/suite/"
echo 'SANITIZER:STRING=' >"$plot/two/CMakeCache.txt"
cat >"$plot/two/CTestTestfile.cmake" <<'EOF'
add_test(Planted.Skip sh -c "exit 77")
set_tests_properties(Planted.Skip PROPERTIES SKIP_RETURN_CODE 77)
add_test(Planted.Round sh -c "echo further round: Planted.Round: a core stood still")
EOF
skip='any Planted.Skip planted' round='any Planted.Round rounds planted'
# suite SKIPS RETRIES: the whole run with these lists
suite() {
  echo "$1" >"$plot/suite/skips.txt"
  echo "$2" >"$plot/suite/retries.txt"
  PYTHONDONTWRITEBYTECODE=1 "$plot/suite/suite.py" "$plot/two"
}
suite "$skip" "$round" >"$plot/log" 2>&1 || { echo "the suite of two listed tests fails:"; cat "$plot/log"; failed=1; }
# Runner.ExcusesAFailureByAStallOnly shows it tests that fail once.
must_be_red "suite: skipped and not listed" "skipped: Planted.Skip: NOT EXPECTED (tests/skips.txt)" suite "" "$round"
must_be_red "suite: skipped and listed for another kind" "skipped: Planted.Skip: NOT EXPECTED" suite "thread Planted.Skip planted" "$round"
must_be_red "suite: further round and not listed" "further round: Planted.Round: a core stood still: NOT EXPECTED (tests/retries.txt)" suite "$skip" ""
must_be_red "suite: further round and listed as a second run" "a core stood still: NOT EXPECTED" suite "$skip" "any Planted.Round time planted"
mkdir "$plot/slow"
cp "$plot/two/CMakeCache.txt" "$plot/slow/"
for i in 1 2 3 4; do
  echo "add_test(Planted.Slow$i sh -c \"[ -e $plot/slow/at$i ] || ! touch $plot/slow/at$i\")"
done >"$plot/slow/CTestTestfile.cmake"
slow_suite() { echo >"$plot/suite/skips.txt"; echo "any * $1 planted" >"$plot/suite/retries.txt"; rm -f "$plot/slow/at"*; PYTHONDONTWRITEBYTECODE=1 "$plot/suite/suite.py" "$plot/slow"; }
must_be_red "suite: four second runs of slow ones" "FAILED: Planted.Slow4: a second run, as were 3 others" slow_suite slow
slow_suite time >"$plot/log" 2>&1 || { echo "the suite fails as four listed tests run again:"; cat "$plot/log"; failed=1; }
must_be_red "suite: listed skip of no test" "skips.txt:2: no test matches Planted.Gone:" suite "$skip
any Planted.Gone planted" "$round"
must_be_red "suite: listed retry of no test" "retries.txt:2: no test matches Planted.Gone:" suite "$skip" "$round
plain Planted.Gone time planted"
suite "$skip
sanitized Planted.Gone planted" "$round" >"$plot/log" 2>&1 || { echo "the plain build holds lines of the sanitizers:"; cat "$plot/log"; failed=1; }
mkdir "$plot/two/tests"
echo "planted/" >"$plot/two/tests/left_out.txt"
suite "$skip
plain planted/ left out: planted" "$round" >"$plot/log" 2>&1 || { echo "the suite fails as the build leaves out what is listed:"; cat "$plot/log"; failed=1; }
grep -qxF "left out: planted/: planted" "$plot/log" || { echo "a folder that the build leaves out is not told:"; cat "$plot/log"; failed=1; }
must_be_red "suite: left out and not listed" "left out: planted/: NOT EXPECTED (tests/skips.txt)" suite "$skip" "$round"
must_be_red "suite: left out and listed as skipped" "left out: planted/: NOT EXPECTED" suite "$skip
any planted/ planted" "$round"
must_be_red "suite: skipped and listed as left out" "skipped: Planted.Skip: NOT EXPECTED" suite "any Planted.Skip left out: planted" "$round"
echo 'SANITIZER:STRING=thread' >"$plot/two/CMakeCache.txt"
must_be_red "suite: nothing of that name left out" "skips.txt:2: no test matches gone/:" suite "$skip
thread gone/ left out: planted" "$round"
exit $failed
