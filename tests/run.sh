#!/usr/bin/env bash
# All tests, from nothing: packages, gates, build, tests, sanitizers, fuzzers.
#   tests/run.sh           everything (what CI runs)
#   tests/run.sh --quick   build and the tests that take seconds: the round after an edit
#   tests/run.sh --threads  more integration tests with the thread sanitizer than everything has (README.md)
#   tests/run.sh --files   clang-tidy, and each file by itself, over all of the code
#   tests/run.sh NAME...   only tests whose name matches one of these (ctest -R), in the plain build
#   tests/run.sh --help    this text
# A test has one attempt, unless tests/retries.txt says why it has two. Up to three others of a build have two if the machine stood
# still while they ran. The end of the log names each second run, each further round within a test, and each test that was skipped or
# left out by a build. It says how long the machine stood still. A test that is skipped or left out and not listed in tests/skips.txt
# fails the run.
# Each step says how long it took, and the seconds of all processors together. With PLCHOST_MINUTES, as in CI, the last steps are left
# out, each by name, on a machine so slow that the run would take longer.
set -uo pipefail
cd "$(dirname "$0")/.."
self=tests/run.sh
case "${1:-}" in
  "" | --quick | --threads | --files | --step | --fuzz) ;;
  -h | --help)
    sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$self"
    exit
    ;;
  -*)
    echo "$self: unknown option $1; allowed are --quick, --threads, --files and --help" >&2
    exit 2
    ;;
esac
build=.build/tests
export PYTHONDONTWRITEBYTECODE=1  # the tree of the sources stays as it was
export CCACHE_SLOPPINESS=pch_defines,time_macros  # or it would not cache what uses precompiled headers
jobs=$(nproc)
step=0
steps=13
# Programs that the tests crash on purpose must end by their signal, not by a sanitizer's report.
# One of them is preloaded with a clock device, before the sanitizer's own library. Each control program has a
# plc_app_abi, also where one is loaded for all others to see. One test forks beside threads of others, and starts one.
# The thread sanitizer sees nothing of the locks in Debian's Cyclone, so it judges only what is compiled for it.
# Files and lines are told by binutils, which g++ needs anyway: clang's own symbolizer would be a large package more.
# A second stack for each thread, and long traces of each allocation, take a third of a process that lives for a moment. So only
# shares of cases look for uses of a stack that was left (cases.py).
symbols=external_symbolizer_path=/usr/bin/addr2line
export ASAN_OPTIONS=detect_stack_use_after_return=0:malloc_context_size=8:handle_segv=0:handle_sigbus=0:verify_asan_link_order=0:detect_odr_violation=0:$symbols UBSAN_OPTIONS=print_stacktrace=1:$symbols
export TSAN_OPTIONS=handle_segv=0:handle_sigbus=0:die_after_fork=0:ignore_noninstrumented_modules=1:$symbols LSAN_OPTIONS=print_suppressions=0
if [ "${1:-}" != --step ] && [ "${1:-}" != --fuzz ]; then
  [ -n "${PLCHOST_OWN_ROOT:-}" ] || PLCHOST_OWN_ROOT=1 exec tests/own_root.sh "$BASH" "$self" "$@"
  # By these the last step finds what the tests have left behind. The name is short: sockets lie in it.
  own=$(mktemp -d "${TMPDIR:-/tmp}/plc.XXXXXX")
  mkdir "$own/t"
  chmod 711 "$own" "$own/t"  # tests start programs as other users
  export TMPDIR=$own/t PLCHOST_RUN=${own##*/}
  log=$own/log
  notes=$own/notes
  touch "$notes"
  ahead=  # process group of the steps that run ahead
  trap '[ -z "$ahead" ] || kill -- "-$ahead" 2>/dev/null; rm -rf "$own"' EXIT
  trap 'exit 130' INT TERM
fi

say() { # say WHAT: the line of a step, before its result
  step=$((step + 1))
  printf '[%d/%d] %s ...' "$step" "$steps" "$1"
}
end_step() { # end_step WHAT CODE SECONDS PROCESSOR_SECONDS LOG: the whole output only if it failed
  if [ "$2" -eq 0 ]; then
    printf ' ok (%d s, %d core-s)\n' "$3" "$4"
  else
    printf ' FAILED\n'
    tail -n 300 "$5"
    echo "failed: $1"
    exit 1
  fi
}
# The processor time of all children so far, in seconds. Not printed: a shell made for that would have no children.
processor_seconds() {
  local file=$own/times.$BASHPID
  times >"$file"
  used=$(awk 'NR == 2 { for (i = 1; i <= 2; i++) { split($i, part, /[ms]/); sum += part[1] * 60 + part[2] } printf "%d", sum }' "$file")
}
# run WHAT COMMAND...
run() {
  local what=$1 began=$SECONDS code=0 before
  shift
  say "$what"
  processor_seconds
  before=$used
  "$@" >"$log" 2>&1 || code=$?
  processor_seconds
  end_step "$what" "$code" $((SECONDS - began)) $((used - before)) "$log"
}
# Gates use one core, and tests wait most of the time. Steps that depend on neither run beside them, one after the other.
# run_ahead STEP...: functions of this script, later join STEP WHAT
run_ahead() {
  set -m  # as a process group, which can be ended as one
  (
    for ahead_step; do
      began=$SECONDS
      code=0
      processor_seconds
      before=$used
      nice -n 19 "$BASH" "$self" --step "$ahead_step" >"$own/$ahead_step.log" 2>&1 || code=$?
      processor_seconds
      echo "$code $((SECONDS - began)) $((used - before))" >"$own/$ahead_step.end"
      [ "$code" -eq 0 ] || exit "$code"
    done
  ) &
  ahead=$!
  set +m
}
join() {
  local code=1 seconds=0 processors=0
  say "$2"
  until [ -s "$own/$1.end" ] || ! kill -0 "$ahead" 2>/dev/null; do sleep 0.2; done
  read -r code seconds processors <"$own/$1.end" || code=1
  end_step "$2" "$code" "$seconds" "$processors" "$own/$1.log"
}

# CI ends a run after 90 minutes, and nothing of it counts then. A machine three times slower than two quiet cores comes near that.
# in_time MINUTES WHAT: whether what takes so long there still fits in
in_time() {
  [ -n "${PLCHOST_MINUTES:-}" ] || return 0
  [ $((SECONDS / 60 + $1)) -gt "$PLCHOST_MINUTES" ] || return 0
  say "$2"
  printf ' LEFT OUT: %d of %d minutes have passed\n' $((SECONDS / 60)) "$PLCHOST_MINUTES"
  echo "left out: $2: this machine is too slow for a run of $PLCHOST_MINUTES minutes" >>"$notes"
  return 1
}

configure() { # configure DIR OPTIONS...
  local dir=$1
  shift
  local launcher=()
  command -v ccache >/dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DCMAKE_C_COMPILER_LAUNCHER=ccache)
  # lld links in a fifth of the time of binutils, by which the demo is linked, as users do.
  cmake -S . -B "$dir" -G Ninja -DCMAKE_COMPILE_WARNING_AS_ERROR=ON "${launcher[@]}" \
    -DCMAKE_EXE_LINKER_FLAGS=-fuse-ld=lld -DCMAKE_SHARED_LINKER_FLAGS=-fuse-ld=lld -DCMAKE_MODULE_LINKER_FLAGS=-fuse-ld=lld "$@"
}
# Several files at a time, as most of the work is the headers of others. Where one is compiled again after an edit these are a few,
# elsewhere all of a library.
unity=(-DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=20)
whole_unity=(-DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=0)
# Parts that a user may do without are required: with one of them its proof would go, and nobody would see it.
# Collecting garbage takes a tenth of the time of g++, so it does that less often.
build_plain() {
  configure "$build" -DPLCHOST_TESTS=ON -DPLCHOST_PYTHON=ON -DPLCHOST_OTHER_VENDOR=ON -DPLCHOST_MANUALS=ON -DPLCHOST_MODBUS=ON "${unity[@]}" \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O2 -g1 -DNDEBUG --param ggc-min-heapsize=1000000" && cmake --build "$build" -j "$jobs"
}
# By clang, which takes half of g++'s time for it; so a second compiler has seen everything. Not position independent: a sanitizer
# adds so many addresses to a program that relocating them is half of its start.
build_sanitized() { # build_sanitized DIR SANITIZERS TARGET OPTIONS...
  local dir=$1 sanitizers=$2 target=$3
  shift 3
  configure "$dir" -DCMAKE_C_COMPILER=clang-19 -DCMAKE_CXX_COMPILER=clang++-19 -DSANITIZER="$sanitizers" -DPLCHOST_TESTS=ON \
    -DCMAKE_EXE_LINKER_FLAGS="-fuse-ld=lld -no-pie" \
    -DPLCHOST_MODBUS=ON -DPLCHOST_BENCH=OFF "${whole_unity[@]}" \
    -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O0 -g1" -DCMAKE_C_FLAGS_DEBUG="-O0 -g1" "$@" &&
    cmake --build "$dir" -j "$jobs" --target "$target"
}
build_asan() { build_sanitized .build/asan "address;undefined" all; }
build_tsan() { build_sanitized .build/tsan thread plchost_tests -DPLCHOST_PLCCTL="$PWD/$build/bin/plcctl"; }
build_threads() { build_sanitized .build/threads thread plchost_tests -DPLCHOST_ALL_THREADS=ON; }
gates() { tests/gates/layers.sh && tests/gates/house.sh && tests/gates/format.sh && tests/gates/c_files.sh && tests/gates/contract.sh && tests/gates/pictures.py && tests/gates/documents.py && tests/gates/prose.py && tests/gates/prove.sh; }

# ctest's own lines, and at the end what CI reads
passed=0
failed=0
tests() { # tests DIR OPTIONS...
  # A sanitizer's report of a process that a test started would be lost if the test looks only at its effects.
  local reports=$own/reports/r code=0 per_core=4
  mkdir -p -m 1777 "${reports%/*}"
  # ctest counts quarters of a core (tests/CMakeLists.txt): on each core four tests that wait, or one that computes. Processes
  # with the address sanitizer take seconds to begin, so two tests fill a core. So do hosts with the thread sanitizer.
  case "$1" in .build/asan | .build/threads) per_core=2 ;; esac
  ASAN_OPTIONS=$ASAN_OPTIONS:log_path=$reports UBSAN_OPTIONS=$UBSAN_OPTIONS:log_path=$reports TSAN_OPTIONS=$TSAN_OPTIONS:log_path=$reports \
    tests/suite.py --jobs $((per_core * jobs)) "$@" || code=1
  head -n 60 "$reports".* 2>/dev/null && code=1
  return "$code"
}
whole=(-C whole -LE case)  # programs whose cases follow each other in one process
count() { # adds up the summary of the step that just ran
  local summary
  summary=$(grep -E '^[0-9]+ passed, [0-9]+ failed' "$log" | tail -n 1)
  passed=$((passed + $(cut -d' ' -f1 <<<"${summary:-0}")))
  failed=$((failed + $(cut -d' ' -f3 <<<"${summary:-0 - 0}")))
  grep -E '^(skipped|left out|second run|further round|stalls): ' "$log" >>"$notes" || true
}

# Over the product's code; the tests are compiled with all warnings as errors like everything else. clang-tidy and the check of
# single files take too long for all of it. Each commit has an eighth, and what was changed last; --files has all.
share=${PLCHOST_SHARE:-8}
tidy() {
  configure .build/tidy -DPLCHOST_TESTS=OFF -DPLCHOST_BENCH=OFF -DPLCHOST_PYTHON=ON -DPLCHOST_MODBUS=ON -DCMAKE_BUILD_TYPE=Debug \
    -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON "${unity[@]}" &&
    cmake --build .build/tidy --target plchost_idl_generate plchost_generated && tests/gates/tidy.sh --share "$share" "$PWD/.build/tidy"
}

# As users build: file by file.
alone() {
  configure .build/alone -DCMAKE_C_COMPILER=clang-19 -DCMAKE_CXX_COMPILER=clang++-19 -DPLCHOST_TESTS=OFF -DPLCHOST_BENCH=OFF \
    -DPLCHOST_PYTHON=ON -DPLCHOST_MODBUS=ON -DCMAKE_BUILD_TYPE=Debug &&
    cmake --build .build/alone --target plchost_idl_generate plchost_generated plchost_headers && tests/gates/alone.py --share "$share" .build/alone
}

# One fuzzer starts a program that the plain build has made. Optimized, they would take nearly twice as long to compile.
build_fuzzers() {
  configure .build/fuzz -DCMAKE_C_COMPILER=clang-19 -DCMAKE_CXX_COMPILER=clang++-19 -DPLCHOST_FUZZ=ON \
    -DPLCHOST_MODBUS=ON -DPLCHOST_TESTS=OFF -DPLCHOST_BENCH=OFF -DPLCHOST_GATED_CYCLONE="$PWD/$build/bin/gated_cyclone" "${whole_unity[@]}" \
    -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O0 -g1 -DNDEBUG" -DCMAKE_C_FLAGS_DEBUG="-O0 -g1 -DNDEBUG" &&
    cmake --build .build/fuzz -j "$jobs" --target fuzzers
}
fuzz() {
  printf '%s\0' .build/fuzz/bin/fuzz_* | xargs -0 -n 1 -P "$jobs" "$BASH" "$self" --fuzz
}
fuzz_one() {
  local corpus code=0
  corpus=$(mktemp -d)
  # New inputs go to the first folder. The second has those of before.
  "$1" -max_total_time="${FUZZ_SECONDS:-5}" -rss_limit_mb=2048 -print_final_stats=1 "$corpus" "tests/fuzz/corpus/${1##*/fuzz_}" || code=1
  rm -rf "$corpus"
  return "$code"
}

case "${1:-}" in
  --step)  # of this script itself
    "$2"
    exit
    ;;
  --fuzz)
    fuzz_one "$2"
    exit
    ;;
  --quick)
    steps=3
    run "packages" .ci/packages test
    run "build" build_plain
    run "fast tests" tests "$build" -C whole -LE 'case|slow'
    count
    ;;
  --threads)
    steps=3
    run "packages" .ci/packages test
    run "thread sanitizer, all tests: build" build_threads
    run "thread sanitizer, all tests" tests .build/threads "${whole[@]}"
    count
    ;;
  --files)
    steps=3
    export PLCHOST_SHARE=1
    run "packages" .ci/packages test
    run "clang-tidy: all" "$BASH" "$self" --step tidy
    run "files compile by themselves: all" "$BASH" "$self" --step alone
    ;;
  "")
    run "packages" .ci/packages test
    tests/left_behind.py begin "$own/before"
    run_ahead build_asan build_tsan tidy alone build_fuzzers
    run "build" build_plain
    run "gates, each proven by a planted fault" gates  # before the tests: one gate looks for what is left behind
    run "tests" tests "$build" "${whole[@]}"
    count
    join build_asan "address and undefined sanitizers: build"
    run "address and undefined sanitizers: tests" tests .build/asan "${whole[@]}"
    count
    # Of the integration tests a share (tests/README.md, tests/skips.txt).
    join build_tsan "thread sanitizer: build"
    if in_time 20 "thread sanitizer: tests"; then
      run "thread sanitizer: tests" tests .build/tsan "${whole[@]}"
      count
    fi
    join tidy "clang-tidy: an eighth, and what was changed last"
    join alone "files compile by themselves: likewise"
    join build_fuzzers "fuzzers: build"
    ! in_time 6 "fuzzers" || run "fuzzers" fuzz
    run "nothing is left behind" tests/left_behind.py end "$own/before"
    ;;
  *)
    steps=3
    run "packages" .ci/packages test
    run "build" build_plain
    run "tests matching $*" tests "$build" -R "$(IFS='|' && echo "$*")"
    count
    ;;
esac
sort -u "$notes"
echo "$passed passed, $failed failed"
