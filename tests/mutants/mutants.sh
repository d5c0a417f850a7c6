#!/bin/bash
# tests/mutants/mutants.sh [--build-only | --quick | --table FILE] [--seconds S] [--patches DIR] BUILD [NAME...]
#
# Builds each bug of DIR (tests/mutants; or those named) into a renderer of its own,
# BUILD/mutants/NAME/pathtracer (A+B: both in one), and runs it through the suite against goldens and closed forms until a
# verdict gives it away, or S seconds on one processor are over (120: as much as 60 s on two). As many run at a time
# as there are processors. Mutants run in the widest instructions of this machine, as users do; bugs of
# the binary hierarchy and of its shapes run with --accel sah. "none" is the renderer as it is, of which nothing may differ.
#   --build-only   builds, and that is all
#   --quick        three bugs of different kinds and "none" (or those named), on two scenes, compiled in half the time: for `make check`
#   --table FILE   writes the results as Markdown
# Prints a line for each: caught or MISSED, CPU seconds (renders and harness), by which scene, against
# what, and why. A patch that does not apply, or a mutant that does not compile, is missed. The last line
# is "N caught, N missed"; exits 1 if one was missed.
set -u
export LC_ALL=C
build_only='' quick='' table='' seconds=120 patches=tests/mutants
while [[ ${1:-} == --* ]]; do
    case $1 in
    --build-only) build_only=1 ;;
    --quick) quick=1 ;;
    --table) table=${2:?} && shift ;;
    --seconds) seconds=${2:?} && shift ;;
    --patches) patches=${2:?} && shift ;;
    *) echo "tests/mutants/mutants.sh: unknown option $1" >&2 && exit 3 ;;
    esac
    shift
done
build=$(realpath "${1:?usage: tests/mutants/mutants.sh [--build-only | --quick | --table FILE] [--seconds S] [--patches DIR] BUILD [NAME...]}")
shift
names=("$@") only=()
if [ -n "$quick" ]; then
    # Of the mean, of the noise, of the geometry.
    [ ${#names[@]} -gt 0 ] || names=(none light_pdf_unnormalised samples_repeat pixels_minus_one)
    only=(--only 10_furnace_one --only 12_point_plane)
fi
[ ${#names[@]} -gt 0 ] || names=(none $(basename -s .patch -a "$patches"/*.patch))
# The flags that make compiled the renderer with.
compile=$(make -s --no-print-directory BUILD="$build" print-compile)
[ -n "$quick" ] && compile=${compile/ -O3 / -O1 }
libs=$(make -s --no-print-directory BUILD="$build" print-libs)
grep -q avx512dq /proc/cpuinfo && isa=avx512 || { grep -q avx2 /proc/cpuinfo && isa=avx2 || isa=sse42; }
# "object source flags" of what is compiled once for each instruction set.
kernels=$(make -s --no-print-directory BUILD="$build" print-kernels)

# build_mutant NAME: into $build/mutants/NAME/pathtracer
build_mutant() {
    local dir=$build/mutants/$1 changed file source flags objects=()
    rm -rf "$dir"
    mkdir -p "$dir"
    [ "$1" = none ] && { cp "$build/pathtracer" "$dir" && return; }
    cp -r renderer "$dir/renderer"
    local files
    IFS=+ read -ra files <<<"$1"
    files=("${files[@]/#/$patches/}") && files=("${files[@]/%/.patch}")
    for file in "${files[@]}"; do
        patch --quiet --fuzz=0 --no-backup-if-mismatch -p1 -d "$dir" <"$file" || return 1
    done
    # A changed header means all files that include it, by make's dependency files.
    for file in $(sed -n 's,^+++ b/,,p' "${files[@]}" | sort -u); do
        case $file in
        *.h) changed+=" $(cd "$build" && grep -rl "$file" renderer --include=*.c.d | sed 's,\.d$,,')" ;;
        *) changed+=" $file" ;;
        esac
    done
    # A kernel has an object for each instruction set, of which only this machine's is built.
    changed=$(for file in $changed; do
        awk -v file="$file" -v isa="_$isa.c" '$1 == file || $2 == file { found = 1; if (index($1, isa)) print $1 } END { if (!found) print file }' <<<"$kernels"
    done | sort -u)
    [ -n "$changed" ] || return 1
    case " $(echo $changed) " in
    *" renderer/pathtracer/pathtracer.c "*) ;;
    *) objects=("$build/renderer/pathtracer/pathtracer.c.o") ;;
    esac
    for file in $changed; do
        read -r source flags <<<"$(awk -v file="$file" '$1 == file { $1 = ""; print }' <<<"$kernels")"
        ${compile/ -I. / -I$dir -I. } $flags -c -o "$dir/$(basename "$file").o" "$dir/${source:-$file}" || return 1
        objects+=("$dir/$(basename "$file").o")
    done
    g++ -o "$dir/mutant" "${objects[@]}" "$build/libassay.a" $libs || return 1
    # Only the instructions of this machine have been compiled with the bug.
    local options="--isa ${isa/sse42/sse4.2}"
    grep -q '^+++ b/renderer/\(bvh/bvh\|scene/shape\)\.c' "${files[@]}" && options+=" --accel sah"
    printf '#!/bin/sh\nexec "${0%%/*}/mutant" %s "$@"\n' "$options" >"$dir/pathtracer"
    chmod +x "$dir/pathtracer"
}

# The first claim that differs where it should not, as "scene|against|why", from results.json, which has
# one member on a line, "scene" first and "reason" after "verdict".
find_claim() {
    awk '
        function text() { sub(/^[^:]*: "/, ""); sub(/",?$/, ""); gsub(/[|]/, "/"); return $0 }
        /^ *"scene": / { scene = text(); a = expected = verdict = ""; b = "itself"; next }
        /^ *"a": "/ { a = text(); sub(/^pathtracer-?/, "", a); next }
        /^ *"b": "/ { b = text(); next }
        /^ *"expected": / { expected = text(); next }
        /^ *"verdict": / { verdict = text(); next }
        /^ *"reason": / && verdict == "DIFFERENT" && expected != "DIFFERENT" {
            print scene "|" (a == "" ? b : a " against " b) "|" text()
            exit
        }' "$build/mutants/$1/report/results.json"
}

# run_mutant NAME: "status|cpu|scene|against|why" into $build/mutants/NAME.result
run_mutant() {
    local name=$1 by cpu status line
    if ! build_mutant "$name" >"$build/mutants/$name.log" 2>&1; then
        echo "broken|0|||does not apply or compile: $build/mutants/$name.log" >"$build/mutants/$name.result"
        return
    fi
    [ -n "$build_only" ] && { echo "built|0|||" >"$build/mutants/$name.result" && return; }
    TIMEFORMAT='%U %S'
    { time "$build/assay" validate ${budget:-} $only_scenes --pathtracer "$build/mutants/$name/pathtracer" \
        --threads 1 -o "$build/mutants/$name/report" -q >"$build/mutants/$name.out" 2>"$build/mutants/$name.log"; } 2>"$build/mutants/$name.time"
    status=$?
    cpu=$(tail -1 "$build/mutants/$name.time" | awk '{ printf "%.1f", $1 + $2 }')
    by=$(find_claim "$name" 2>/dev/null)
    rm -rf "$build/mutants/$name/report/data" "$build/mutants/$name/renderer"
    if [ "$name" = none ]; then
        # All as expected, or time was short for some.
        [ -z "$by" ] && { [ $status -eq 0 ] || [ $status -eq 2 ]; } && line="right|$cpu|||exit status $status" ||
            line="accused|$cpu|${by:-||exit status $status}"
    elif [ -n "$by" ]; then
        line="caught|$cpu|$by"
    else
        line="missed|$cpu|||exit status $status"
    fi
    echo "$line" >"$build/mutants/$name.result"
}

one_and_tell() {
    run_mutant "$1"
    echo "$1|$(cat "$build/mutants/$1.result")"
}

mkdir -p "$build/mutants"
export build build_only patches compile libs kernels isa
export only_scenes="${only[*]:-}" budget="--until-different --budget ${seconds}s"
[ -n "$quick" ] && export budget=''
export -f build_mutant find_claim run_mutant one_and_tell

started=$SECONDS done=0 caught=0 missed=0
while IFS='|' read -r name status cpu scene against why; do
    done=$((done + 1))
    case $status in
    caught) caught=$((caught + 1)) ;;
    built | right) ;;
    *) missed=$((missed + 1)) ;;
    esac
    left=$(((SECONDS - started) * (${#names[@]} - done) / done / 60))
    case $status in
    caught) what="caught in $cpu CPU s by $scene against $against: $why" ;;
    right) what="the renderer as it is: nothing differs, $cpu CPU s" ;;
    accused) what="ACCUSED: the renderer as it is, by $scene against $against: $why" ;;
    missed) what="MISSED after $cpu CPU s ($why)" ;;
    broken) what="MISSED: $why" ;;
    built) continue ;;
    esac
    printf '[%d/%d, %d caught, %d min left] %-32s %s\n' $done ${#names[@]} $caught $left "$name" "$what"
done < <(printf '%s\n' "${names[@]}" | xargs -P "$(nproc)" -I{} bash -c 'one_and_tell {}')
[ -n "$build_only" ] || echo "$caught caught, $missed missed"

# The page: each row from the patch's own lines and the result of the run; sections below the table stay as they are.
write_table() {
    local name status cpu scene against why
    cat <<EOF
# Known bugs and what finds them

Each patch is a mistake that students of the assignment make, or that stands in its starter code or in forks of it, built into our renderer.
\`make mutants\` runs each through the suite, few samples of all scenes first, until a claim is DIFFERENT that should not be, and writes
this page. CPU s: all that was rendered until then, and the harness; one thread.

EOF
    for name in "${names[@]}"; do
        [ "$name" = none ] || cat "$build/mutants/$name.result"
    done | sort -t '|' -g -k 2 | awk -F '|' '
        $1 == "caught" { cpu[++n] = $2; early += $2 <= 120 }
        END {
            printf "**Mutation score: %d of %d found, %d of them within 120 CPU s (60 s on two processors).** ", n, NR, early
            printf "Median %.0f CPU s, slowest %.0f.\n", cpu[int((n + 1) / 2)], cpu[n]
        }'
    [ -f "$build/mutants/none.result" ] && awk -F '|' '{
        print "The renderer as it is, looked at in the same way for " int($2) " CPU s: " ($1 == "right" ? "nothing differs." : "ACCUSED.") }' \
        "$build/mutants/none.result"
    printf '\n| bug | where in the assignment | found by | against | why | CPU s |\n|---|---|---|---|---|--:|\n'
    for name in "${names[@]}"; do
        [ "$name" = none ] && continue
        IFS='|' read -r status cpu scene against why <"$build/mutants/$name.result"
        [ "$status" = caught ] || scene="**not found**"
        printf '| %s (`%s`) | %s | %s | %s | %s | %.0f |\n' "$(sed -n 's/^Bug: //p' "$patches/$name.patch")" "$name" \
            "$(sed -n 's/^Where: //p' "$patches/$name.patch")" "$scene" "$against" "${why%%, p = *}" "$cpu"
    done
    echo
    sed -n '/^## /,$p' "$table"
}
if [ -n "$table" ]; then
    write_table >"$table.new" && mv "$table.new" "$table"
fi
[ $missed -eq 0 ]
