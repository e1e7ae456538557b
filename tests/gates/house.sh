#!/usr/bin/env bash
# The house from outside: its eight entries, small files, no crowded folder, nothing unfinished. No path of a developer's
# machine, no file that is made through a link, no instance of DDS that stays in memory.
# Usage: house.sh [ROOT] (a git checkout); prints each fault.
set -euo pipefail
cd "${1:-$(dirname "$0")/../..}"
wrong=0
fault() { echo "$1"; wrong=1; }

while read -r entry; do
  case "$entry" in
    .* | CMakeLists.txt | manager | schedulers | instances | shm | api | tests | README.md) ;;
    *) fault "$entry: not one of the eight entries of the top level" ;;
  esac
done < <(git ls-files | cut -d/ -f1 | sort -u)

while read -r file; do
  lines=$(wc -l <"$file")
  [ "$lines" -le 500 ] || fault "$file: $lines lines; what is the second thing in it?"
done < <(git ls-files '*.cpp' '*.hpp' '*.h' '*.c')

# A header and its source file have one name.
while read -r count folder; do
  [ "$count" -le 35 ] || fault "$folder: $count names of sources; at most 35: which of them are a room of their own?"
done < <(git ls-files shm schedulers instances api manager | grep -E '\.(cpp|hpp|h|c)$' | sed -E 's,\.[a-z]+$,,' | sort -u |
  sed 's,/[^/]*$,,' | uniq -c)

# A test that is in no list is never run.
while read -r test; do
  grep -qE "$(basename "$test")|GLOB" "$(dirname "$test")/CMakeLists.txt" 2>/dev/null || fault "$test: not in the CMakeLists.txt beside it"
done < <(git ls-files 'tests/*_test.cpp')

# A fuzzer begins with the inputs of its corpus, and somebody says which files it is for.
while read -r fuzzer; do
  [ -n "$(git ls-files "tests/fuzz/corpus/$fuzzer")" ] || fault "tests/fuzz/corpus/$fuzzer: no input for the fuzzer (coverage.py --grow 60 $fuzzer)"
  grep -qE "^$fuzzer( |$)" tests/fuzz/parsers.txt || fault "tests/fuzz/parsers.txt: $fuzzer has no line"
done < <(sed -nE 's/^ *plchost_fuzzer\(([a-z_]+).*/\1/p' tests/fuzz/CMakeLists.txt 2>/dev/null)

marker='TO''DO|FIX''ME|X''XX'
git grep -nE "\b($marker)\b" -- ':!*.md' && fault "the lines above are unfinished" || true
home_path='/(work|home|root)/[a-z]'
git grep -nE "$home_path" -- ':!tests/gates' && fault "the lines above name a path of one machine" || true

# Of a comment that is joined with the line before it clang-format knows nothing, and lets the rest of the file be.
git grep -nE 'clang-format (on|off)' -- '*.cpp' '*.hpp' '*.h' '*.c' | grep -vE ':[0-9]+: *// clang-format (on|off)$' &&
  fault "the lines above do not switch clang-format: give the comment a line of its own" || true

# These can be put in a program's way by any user of the machine: a link where it makes a file, a name in a space of all.
sources=(shm schedulers instances manager api)
git grep -nE '\bO_CREAT\b' -- "${sources[@]}" | grep -vE 'O_NOFOLLOW|O_EXCL' && fault "the lines above make files through links" || true
git grep -nE 'shm_open|sun_path *(\+ *1\b|\[0\])' -- "${sources[@]}" && fault "the lines above use names that anybody can take" || true
# The C functions of plc_app.h lie in one room.
symbols=instances/runtime/exported_symbols.txt
if [ -d instances/runtime/abi ]; then
  [ -s "$symbols" ] || fault "$symbols: it does not list the functions of plc_app.h"
  exported=$(sed -nE 's/^  ([A-Za-z_]+);$/\1/p' "$symbols" | paste -sd'|')
  git grep -nE "^[A-Za-z_].*[ *]($exported)\(" -- 'instances/runtime/*.cpp' ':!instances/runtime/abi' &&
    fault "the lines above define functions of plc_app.h outside of instances/runtime/abi" || true
  # Rooms below abi/ use none of these names, where no include tells it either, unless debug/ has the variable. Texts may.
  own=$(git grep -hoE '^unsigned int plc_debug[a-z_]+' -- instances/runtime/debug | sed 's,.* ,,' || true)
  git grep -nwE "$exported" -- 'instances/runtime/*/*.[ch]pp' ':!instances/runtime/'{abi,instance,trial} | sed -E 's,"[^"]*"|//.*,,g' |
    grep -wE "$exported" | grep -v "^instances/runtime/debug/.*${own:-no name}" &&
    fault "the lines above use what abi/ has, from a room below it" || true
fi
# A scheduler and a kind of task are named in one table, and in their own file. The settings are exempt: a file says
# [SysTimer] TimerMode instead of a name, and each of its two values stands for a scheduler.
registry=schedulers/policies/registry.hpp
if [ -d schedulers/policies ]; then
  names=$(sed -nE 's/^ *PolicyName<class [A-Za-z]+>\{"([A-Za-z]+)"\},$/\1/p' "$registry" | paste -sd'|')
  [ -n "$names" ] || fault "$registry: it does not list the schedulers"
  git grep -nE "\"($names)\"" -- "${sources[@]/%//*.[ch]pp}" "${sources[@]/%//*.h}" ':!schedulers/policies' ':!instances/runtime/settings' &&
    fault "the lines above name a scheduler: ask the registry or the host" || true
fi
git grep -nE '\bTaskKind::' -- "${sources[@]/%//*.[ch]pp}" ':!shm/base/task_kind.hpp' ':!schedulers/tasks/kinds' &&
  fault "the lines above know a kind of task: ask its row in shm/base/task_kind.hpp, or its object" || true
# dlopen() tells its cause in words only.
git grep -nE '\bdlopen\(' -- "${sources[@]/%//*.[ch]pp}" ':!shm/process/dynamic_loader.*' &&
  fault "the lines above do not tell a shortage from a wrong file: use open_library" || true
# One header opens, makes and checks pages. These are no pages of ours: the pool, whose magic is an atomic, and files that it may
# adopt. Nor are retained variables in a memory of the pool or in a file, packets with values, and a clock that programs in C make.
git grep -nE '\w(\.|->)magic\b(\.(load|store)\(| *(==|!=|=[^=])|, __ATOMIC)' -- "${sources[@]/%//*.[ch]pp}" ':!shm/files/fixed_page.hpp' \
  ':!shm/pool/pool_'{segment,header,adoption}.cpp ':!instances/runtime/memory/retain_'{memory,image}.cpp ':!shm/variables/value_message.cpp' \
  ':!shm/pages/reference_clock.cpp' && fault "the lines above check or make a page: use shm/files/fixed_page.hpp" || true
# DDS alone keeps the keys of unregistered instances in memory.
git grep -nE '\bdds_unregister_instance' -- '*.cpp' '*.hpp' ':!api/dds/instances.*' ':!tests' && fault "the lines above leak: use dds::unregister_instance" || true
# One rule says which server of a host counts, also after its clock was set back.
git grep -nE '\bepoch(_|\(\))? [<>]=? ' -- 'api/*.cpp' 'api/*.hpp' ':!api/client/newest_epoch.hpp' &&
  fault "the lines above compare epochs: use NewestEpoch" || true
# g++ 12 makes an instruction that ends the program of an await that is not always reached within its expression.
git grep -nE '(&&|\|\|) *!?co_await' -- '*.cpp' '*.hpp' && fault "the lines above await within a condition: use a statement of its own" || true
# If the clock on the wall is set back, a wait for a time of it gets longer.
git grep -nE '\b(sem_timedwait|pthread_(cond|mutex|rwlock)_timed[a-z]+|pthread_timedjoin_np)\(|SYS_futex,.*FUTEX_LOCK_PI,|(timerfd_create|clock_nanosleep|timer_create)\(CLOCK_REALTIME' \
  -- "${sources[@]}" && fault "the lines above wait by a clock that can be set" || true
# A killed test's files in /dev/shm can only be removed by the next one if it knows the name.
git grep -nE 'to_string\(::getpid\(\)|"[^"(]*\{\}[^"]*", *::getpid\(\)' -- tests ':!tests/support/own_name.hpp' | grep -vE 'HasSubstr|"/proc/' &&
  fault "the lines above make names that nobody clears away: use own_name() or own_path()" || true
# A question, or a word that is mistyped, starts no run of hours.
for script in "tests/run.sh --help" "tests/run.sh --nonsense" "tests/bench/run.sh --help"; do
  [ ! -x "${script% *}" ] && continue
  text=$(timeout 10 $script 2>&1) || true
  [[ $text == *--quick* ]] || fault "$script does not say what there is"
done
exit $wrong
