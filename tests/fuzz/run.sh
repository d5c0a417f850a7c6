#!/bin/bash
# tests/fuzz/run.sh [-j JOBS] BUILD SECONDS [NAME...]: runs fuzz_NAME (all of them) for SECONDS each. A run starts from
# the files of the suite and of tests/fuzz/seeds, from tests/fuzz/found/NAME (inputs that failed once and must not
# again) and from the corpus of earlier runs (BUILD/fuzz/NAME.corpus). SECONDS "fixed" is for tests, reproducible: no
# earlier corpus, a fixed seed, and a fixed number of executions, some ten seconds; it does not search.
# A line for each, "ok fuzz NAME: N executions, M inputs kept, S s" or "not ok fuzz NAME: why"; what breaks is kept as
# BUILD/fuzz/NAME-*, and the exit code is 1.
set -u
jobs=$(nproc)
[ "${1:-}" = -j ] && jobs=$2 && shift 2
build=${1:?usage: tests/fuzz/run.sh [-j JOBS] BUILD SECONDS [NAME...]} seconds=${2:?}
shift 2
[ $# -gt 0 ] || set -- $(basename -s .c -a tests/fuzz/fuzz_*.c | sed 's/^fuzz_//')

# The valid files that a target starts from.
seeds() {
    case $1 in
    collada) ls -S reference/scenes/*.dae | tail -n 30 && ls tests/fuzz/seeds/collada* ;;
    suite) ls reference/scenes/*.json reference/starter/suite.json ;;
    *) ls tests/fuzz/seeds/"$1"* ;;
    esac
}

fixed_executions() {
    case $1 in
    collada) echo 20000 ;;
    picture) echo 4000 ;;
    plan) echo 10000 ;;
    rubric) echo 30000 ;;
    results | suite) echo 50000 ;;
    moments) echo 200000 ;;
    *) echo 250000 ;;
    esac
}

fuzz_one() {
    local name=$1 dir=$build/fuzz corpus options places status executions
    if [ "$seconds" = fixed ]; then
        corpus=$dir/$name.fixed options=(-seed=1 -runs="$(fixed_executions "$name")")
        rm -rf "$corpus"
    else
        corpus=$dir/$name.corpus options=(-max_total_time="$seconds")
    fi
    mkdir -p "$corpus" "$dir/$name.seeds"
    seeds "$name" | xargs cp -t "$dir/$name.seeds" || return 1
    places=("$corpus" "$dir/$name.seeds")
    [ -d "tests/fuzz/found/$name" ] && places+=("tests/fuzz/found/$name")
    [ -f "tests/fuzz/$name.dict" ] && options+=(-dict="tests/fuzz/$name.dict")
    "$build/clang/fuzz_$name" "${options[@]}" -max_len=20000 -rss_limit_mb=2048 -timeout=20 \
        -print_final_stats=1 -artifact_prefix="$dir/$name-" "${places[@]}" >"$dir/$name.log" 2>&1
    status=$?
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$dir/$name.log")
    if [ $status -eq 0 ] && [ "${executions:-0}" -gt 0 ]; then
        echo "ok fuzz $name: $executions executions, $(ls "$corpus" | wc -l) inputs kept," \
            "$(sed -n 's/^Done [0-9]* runs in \([0-9]*\) second.*/\1/p' "$dir/$name.log") s"
    else
        echo "not ok fuzz $name: $(grep -m1 -E '^(fuzz: |==[0-9]+== ?ERROR)' "$dir/$name.log"), see $dir/$name.log"
        return 1
    fi
}
export -f fuzz_one fixed_executions seeds
export build seconds
printf '%s\n' "$@" | xargs -P "$jobs" -I{} bash -c 'fuzz_one {}'
