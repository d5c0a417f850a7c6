#!/bin/bash
# tests/mutants.sh [--build-only] BUILD [NAME...]: builds each bug of tests/mutants into a renderer of its
# own, BUILD/mutants/NAME/pathtracer, runs it through the suite, and says which verdict gave it away. A
# patch that does not apply, or a mutant that does not compile, is a failure.
# Prints a line for each and "N caught, N missed", and exits 1 if one was missed.
set -u
export LC_ALL=C
build_only=
[ "${1:-}" = --build-only ] && build_only=1 && shift
build=$(realpath "${1:?usage: tests/mutants.sh [--build-only] BUILD [NAME...]}")
shift
names=("$@")
[ ${#names[@]} -gt 0 ] || names=($(basename -s .patch -a tests/mutants/*.patch))
# The flags that make compiled the renderer with.
read -r -a compile < <(make -s --no-print-directory BUILD="$build" print-compile)
read -r -a libs < <(make -s --no-print-directory BUILD="$build" print-libs)
caught=0 missed=0

# build_mutant NAME: into $build/mutants/NAME/pathtracer
build_mutant() {
    local dir=$build/mutants/$1 changed file objects=()
    rm -rf "$dir"
    mkdir -p "$dir"
    cp -r renderer "$dir/renderer"
    patch --quiet --fuzz=0 --no-backup-if-mismatch -p1 -d "$dir" <"tests/mutants/$1.patch" || return 1
    changed=$(sed -n 's,^+++ b/,,p' "tests/mutants/$1.patch")
    # A header changes all that includes it: make's dependency files know.
    case $changed in
    *.h) changed=$(cd "$build" && grep -l "$changed" renderer/*.c.d | sed 's,\.d$,,') ;;
    esac
    [ -n "$changed" ] || return 1
    case " $(echo $changed) " in
    *" renderer/main.c "*) ;;
    *) objects=("$build/renderer/main.c.o") ;;
    esac
    for file in $changed; do
        "${compile[@]}" -c -o "$dir/$(basename "$file").o" "$dir/$file" || return 1
        objects+=("$dir/$(basename "$file").o")
    done
    g++ -o "$dir/pathtracer" "${objects[@]}" "$build/libassay.a" "${libs[@]}"
}

mkdir -p "$build/mutants"
for name in "${names[@]}"; do
    if ! build_mutant "$name" 2>"$build/mutants/$name.log"; then
        echo "$name: does not apply or compile (see $build/mutants/$name.log)"
        missed=$((missed + 1))
        continue
    fi
    [ -n "$build_only" ] && continue
    before=$SECONDS
    "$build/assay" validate --until-different --pathtracer "$build/mutants/$name/pathtracer" \
        -o "$build/mutants/$name/report" -q >"$build/mutants/$name.out" 2>"$build/mutants/$name.log"
    status=$?
    # The table's row: scene, tested, against.
    by=$(grep ' DIFFERENT ' "$build/mutants/$name.out" | grep -v ' ok$' | head -1 | awk '{print $1, "against", $3}')
    if [ $status -eq 1 ] && [ -n "$by" ]; then
        caught=$((caught + 1))
        printf '%-30s caught in %3d s by %s\n' "$name" $((SECONDS - before)) "$by"
    else
        missed=$((missed + 1))
        printf '%-30s MISSED after %3d s (exit status %d)\n' "$name" $((SECONDS - before)) $status
    fi
done
[ -n "$build_only" ] || echo "$caught caught, $missed missed"
[ $missed -eq 0 ]
