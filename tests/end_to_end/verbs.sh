#!/bin/bash
# tests/end_to_end/verbs.sh BUILD: verbs and options that the other end-to-end runs leave out: references of a live
# engine, the matrix of a validation, further looks, rubrics that accept deviations and count samples, locks, Slurm.
# Prints "ok NAME", "not ok NAME: why" or "skip NAME".
set -u
build=$(realpath "${1:?usage: tests/end_to_end/verbs.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0

what=""
. tests/end_to_end/expect.sh
scene=$PWD/reference/scenes/13_square_patch.dae
sum() { sha256sum "$1" | cut -d ' ' -f 1; }

# assay reference: what is up to date is not rendered again, the same seed gives the same bits, and a candidate older
# than the stored reference is removed. In place of Blender our own program writes an image for each seed.
mkdir "$tmp/suite" "$tmp/work" "$tmp/bin"
cp reference/scenes/13_square_patch.dae "$tmp/suite"
sed 's/"width": 64, "height": 64/"width": 16, "height": 16/; s/"tile": 16/"tile": 8/; s/"replicates": [0-9]*, "spp": [0-9]*/"replicates": 3, "spp": 4/' \
    reference/scenes/13_square_patch.json >"$tmp/suite/13_square_patch.json"
cat >"$tmp/bin/blender" <<END
#!/bin/bash
k=0
for seed in \$(grep -o '[0-9]*' seeds.json); do
    "$pathtracer" -q -r 16 16 -s 4 -m 1 --seed \$seed -f "replicate_\$(printf %04d \$k).exr" "$PWD/reference/scenes/13_square_patch.dae" || exit 1
    k=\$((k + 1))
done
echo 'ASSAY OK {"version": "none", "settings": {}}'
END
chmod +x "$tmp/bin/blender"
export PATH="$tmp/bin:$PATH"
reference=("$assay" reference --suite "$tmp/suite" --work "$tmp/work" -t 1 --engine cycles)
image=$tmp/new/13_square_patch/cycles.exr
right() { # NAME COMMAND...
    local name=$1
    shift
    if "$@"; then echo "ok $name"; else
        echo "not ok $name: $*"
        failures=$((failures + 1))
    fi
}
expect "reference: help" 0 "assay reference \[options\] *the same" "$assay" reference --help
expect "reference: unknown engine" 3 "none of" "${reference[@]}" --engine mitsuba
expect "reference: unknown scene" 3 "no scene 'x'" "${reference[@]}" --only x
expect "reference: an argument" 3 "takes no argument 'x'" "${reference[@]}" x
expect "reference: no program" 3 "blender: no such program" env PATH=/nowhere "${reference[@]}" -o "$tmp/new"
expect "reference: Cycles" 0 "cycles.exr: 16 x 16 pixels, 3 x replicate" "${reference[@]}" -o "$tmp/new"
first=$(sum "$image")
expect "reference: up to date" 0 "cycles.exr: up to date" "${reference[@]}" -o "$tmp/new"
expect "reference: approved" 0 "1 approved" "$assay" golden approve --new --suite "$tmp/suite" --from "$tmp/new" --golden "$tmp/store" 13_square_patch/cycles
expect "reference: fresh" 0 "3 x replicate" "${reference[@]}" -o "$tmp/new" --fresh
right "reference: the same seed, the same bits" test "$(sum "$image")" = "$first"
expect "reference: another seed" 0 "3 x replicate" "${reference[@]}" -o "$tmp/new" --seed 2
right "reference: another seed, other bits" test "$(sum "$image")" != "$first"
expect "reference: what is stored is up to date" 0 "store/13_square_patch/cycles.exr: up to date" "${reference[@]}" -o "$tmp/new" --golden "$tmp/store"
right "reference: an older candidate goes" test ! -e "$image"
expect "validate: no program" 3 "blender: no such program" env PATH=/nowhere "$assay" validate -q --live --only 13_square_patch -o "$tmp/live"

# A validation takes further looks where 16 samples do not decide, adding to what was rendered before.
expect "validate: looks" 0 "33_sphere_light" "$assay" validate -q --budget 5m --only 33_sphere_light --out "$tmp/report"
right "validate: one look of 16 samples, another with 64" grep -q '"n_a": 16.0' "$tmp/report/results.json"
right "validate: and a third with 256" test "$(grep -c '"n_a": \(64\|256\).0' "$tmp/report/results.json")" -gt 1
expect "report: matrix" 0 "^| 33_sphere_light | [+-][0-9.]* ± [0-9.]*, [0-9.]* | [+-][0-9.]* ± [0-9.]*, [0-9.]* | [+-][0-9.]* ± [0-9.]*, [0-9.]* |$" \
    "$assay" report --matrix "$tmp/report/results.json"
expect "report: a folder" 3 "$tmp: cannot read: Is a directory" "$assay" report "$tmp"

# A rubric that counts samples, accepts what the starter code does wrong, and builds source trees.
cat >"$tmp/counts.rubric" <<'END'
rubric Counts
curve srgb
command {program} -q -t {threads} -s {spp} -l {lights} -m {bounces} -r {width} {height} --seed {seed} {options} -f {out} {scene}
program pathtracer
build sh make.sh
limit wall 20
limit cpu 20
limit memory 1024
limit disk 64
total 10
accept light_pdf --starter light-pdf
image adaptive
  scene 13_square_patch
  size 64 64
  spp 256
  bounces 1
  options --direct light -a 32 0.1
  reference ours 64
image area
  scene 13_square_patch
  size 64 64
  spp 64
  bounces 1
  options --direct light
  reference ours 256 --direct light
part 1 All
check batches 4 rates adaptive
  batch 32
  share 0.01 0.3
  count 0.03 0.2
check light 6 equal area
  image 0.02 0.08
  tile 0.08 0.3
END
# Source trees whose build wraps our program; WORDS, run for each index i, changes the words "${a[@]}" of its command.
sub() { # NAME WORDS
    mkdir -p "$tmp/subs/$1"
    cp "$pathtracer" "$tmp/subs/$1/tracer"
    printf '#!/bin/bash\na=("$@")\nfor i in "${!a[@]}"; do\n%s\ndone\nexec ./tracer "${a[@]}"\n' "$2" >"$tmp/subs/$1/source"
    echo 'cp source pathtracer && chmod +x pathtracer' >"$tmp/subs/$1/make.sh"
}
sub right :
sub starter '[ "${a[i]}" = --direct ] && a+=(--starter light-pdf)'
sub batches '[ "${a[i]}" = 32 ] && a[i]=20'
sub no_rates '[ "${a[i]}" = -a ] && unset "a[i]" "a[i+1]" "a[i+2]"'
mkdir "$tmp/subs/broken"
echo 'echo no compiler; exit 1' >"$tmp/subs/broken/make.sh"
if "$assay" grade -q -o "$tmp/probe" tests/end_to_end/quick.rubric "$pathtracer" >"$tmp/out" 2>&1; then
    expect "grade: rates, a build, a deviation" 2 "right" "$assay" grade -j 2 -o "$tmp/grades" "$tmp/counts.rubric" "$tmp/subs"/*
    points() { awk -F, -v id="\"$1\"" '$1 == id { print $2 }' "$tmp/grades/grades.csv"; }
    for good in right starter; do
        right "grade: $good has all points" test "$(points $good)" = 10.00
    done
    for bad in batches no_rates; do
        right "grade: $bad has those of the light alone" test "$(points $bad)" = 6.00
    done
    right "grade: what cannot be built has none" test "$(points broken)" = 0.00
    expect "grade: why it cannot be built" 0 "It does not build: no compiler" cat "$tmp/grades/broken/results.json"
    expect "grade: why batches are wrong" 0 "pixels stand for no multiple of 32" cat "$tmp/grades/batches/results.json"
    expect "grade: no rate image" 0 "there is no rate image" cat "$tmp/grades/no_rates/results.json"
    expect "grade: the deviation is named" 0 "light_pdf" cat "$tmp/grades/starter/results.json"
else
    echo "skip grade: $(tail -n 1 "$tmp/out")"
fi
# One run at a time in a directory of outputs. A kill gives it back.
mkdir -p "$tmp/taken"
"$assay" validate -q -o "$tmp/taken" --only 45_many_lights >/dev/null 2>&1 &
pid=$!
for i in $(seq 200); do [ -s "$tmp/taken/.assay-lock" ] && break || sleep 0.05; done
kill -STOP $pid # it stays there, however fast this machine is
expect "two validations in one directory" 3 "another run writes there: process $pid on" "$assay" validate -q -o "$tmp/taken" --only 12_point_plane
expect "a grading in it" 3 "another run writes there: process $pid on" "$assay" grade --unsafe-no-sandbox -o "$tmp/taken" tests/end_to_end/quick.rubric "$pathtracer"
kill -9 $pid && wait $pid 2>/dev/null
expect "after a kill it is free" 0 "EQUIVALENT" "$assay" validate -q -o "$tmp/taken" --only 11_furnace
right "and no lock stays" test ! -e "$tmp/taken/.assay-lock"

# Jobs on a cluster, by stand-ins for Slurm's programs that run an array here, a task after the other. Of the first array task 2 is
# lost like a plug that is pulled; a real cluster: make slurm.
mkdir "$tmp/slurm" "$tmp/queue" "$tmp/began"
cat >"$tmp/slurm/sbatch" <<END
#!/bin/bash
for word; do
    case \$word in
    --job-name=*) name=\${word#*=} ;;
    --array=1-*) tasks=\${word#*=1-} ;;
    --output=*) output=\${word#*=} ;;
    esac
done
for ((k = 1; k <= tasks; k++)); do echo PENDING >"$tmp/queue/\$name \$k"; done
[ -z "\${CHANGE:-}" ] || echo >>"\$CHANGE"
[ -z "\${HOLD:-}" ] || exit 0
setsid "$tmp/run" "\$name" \$tasks "\$output" "\${@: -1}" </dev/null >/dev/null 2>&1 &
# Before it has a session of its own it would be killed with this script's group.
until [ -e "$tmp/began/\$name" ]; do sleep 0.01; done
END
cat >"$tmp/run" <<END
#!/bin/bash
: >"$tmp/began/\$1"
for ((k = 1; k <= \$2; k++)); do
    echo RUNNING >"$tmp/queue/\$1 \$k"
    [[ \$1 = *-1 && \$k = "\${LOST:-}" ]] || SLURM_ARRAY_TASK_ID=\$k sh -c "\$4" >"\${3/\%a/\$k}" 2>&1
    rm -f "$tmp/queue/\$1 \$k"
done
END
printf '#!/bin/sh\ncd "%s" && for task in *; do [ ! -e "$task" ] || echo "$task $(cat "$task")"; done\n' "$tmp/queue" >"$tmp/slurm/squeue"
printf '#!/bin/sh\nrm -f "%s/$2 "*\n' "$tmp/queue" >"$tmp/slurm/scancel"
chmod +x "$tmp/slurm"/* "$tmp/run"
slurm() { (PATH=$tmp/slurm:$PATH exec timeout --foreground 60 "$assay" slurm "$@"); }
said() { "$@" 2>"$tmp/said" || { local status=$?; tail -n 1 "$tmp/said" >&2; return $status; }; } # its last line alone
render=(pathtracer -q -t 1 -r 32 32 -s 16)
"$pathtracer" "${render[@]:1}" -f "$tmp/here.exr" -f "$tmp/here.png" "$scene" >"$tmp/out"
LOST=2 expect "slurm: a lost task is run again" 0 "4 of 4 jobs made.*some submitted again" slurm --plan "$tmp/plan" --parts 4 "${render[@]}" -f "$tmp/there.exr" -f "$tmp/there.png" "$scene"
right "slurm: the image is the one made here" cmp "$tmp/here.png" "$tmp/there.png"
right "slurm: nothing else is run twice" test "$(cat "$tmp"/plan/log/assay-*.txt | grep -c begins)" = 4
cp "$scene" "$tmp/other.dae"
CHANGE=$tmp/other.dae expect "slurm: a job that cannot be made is tried three times" 3 "job 0 came back 3 times without its artefact: .*other.dae" \
    said slurm --plan "$tmp/changed" --parts 1 "${render[@]}" -f "$tmp/z.exr" "$tmp/other.dae"
HOLD=1 slurm --plan "$tmp/stop" --parts 2 "${render[@]}" -f "$tmp/z.exr" "$scene" >"$tmp/out" 2>"$tmp/err" &
follower=$!
for ((i = 0; i < 300; i++)); do grep -q "2 waiting" "$tmp/err" && break || sleep 0.1; done
pkill -TERM -P $follower timeout
wait $follower
right "slurm: one that is stopped cancels its jobs" test "$?:$(ls "$tmp/queue")" = 3:
right "slurm: and says how to go on" grep -q "interrupted with 0 of 2 jobs made; the same command goes on" "$tmp/err"

# make waits for other installations of packages to end, and for nothing else.
mkdir "$tmp/stub"
printf '#!/bin/sh\nexit 1\n' >"$tmp/stub/dpkg-query"
printf '#!/bin/sh\nexec "$@"\n' >"$tmp/stub/sudo"
cat >"$tmp/stub/apt-get" <<END
#!/bin/sh
echo "\$*" >>"$tmp/asked"
[ \$(wc -l <"$tmp/asked") -gt 2 ] && exit 0
echo "E: \$REASON" >&2
exit 100
END
chmod +x "$tmp/stub"/*
locked="Could not get lock /var/lib/apt/lists/lock. It is held by process 123 (apt-get)"
REASON=$locked expect "make: a package lock is waited for" 0 "waiting: E: $locked" env PATH="$tmp/stub:$PATH" make BUILD="$tmp/b" "$tmp/b/deps"
right "make: then it installs" grep -q -- '-qq install -y --no-install-recommends .*gcc' "$tmp/asked"
rm "$tmp/asked"
REASON="Unable to locate package" expect "make: another fault ends it" 2 "cannot install: .*gcc" env PATH="$tmp/stub:$PATH" make BUILD="$tmp/c" "$tmp/c/deps"
right "make: at once" test "$(wc -l <"$tmp/asked")" = 1
[ $failures -eq 0 ]
