#!/bin/bash
# tests/studies/scale/slurm.sh BUILD: a Slurm cluster of four nodes on this machine, in a directory of its own: munged, slurmctld, and a slurmd for each
# node in a process namespace of its own, so that killing its first process takes everything on the node, like a plug that is pulled.
# On it: a render of which a node is killed in the middle, the controller is restarted, and the follower is killed and
# begun again; a grading batch; a validation; replicates of a reference; a job that cannot be made. Results have the bits of the local commands, and nothing is
# made twice but what was lost. As root. Prints "ok NAME" or "not ok NAME: why".
set -u
build=$(realpath "${1:?usage: tests/studies/scale/slurm.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay scene=$PWD/reference/scenes/41_cornell.dae
failures=0
for program in munged slurmctld slurmd unshare; do
    command -v $program >/dev/null || { echo "not ok slurm: no $program" && exit 1; }
done
[ "$(id -u)" = 0 ] || { echo "not ok slurm: slurmd has to be started by root" && exit 1; }
tmp=$(mktemp -d)
chmod 755 "$tmp"
export SLURM_CONF=$tmp/slurm.conf
declare -A daemon

cleanup() {
    for d in "${!daemon[@]}"; do kill -9 "${daemon[$d]}" 2>/dev/null; done
    wait 2>/dev/null
    rm -rf "$tmp"
}
trap cleanup EXIT
trap 'exit 1' INT TERM

what=slurm
. tests/end_to_end/expect.sh
# until SECONDS COMMAND...: waits until the command succeeds, SECONDS at most
until_so() {
    local end=$((SECONDS + $1))
    shift
    until "$@" >/dev/null 2>&1; do
        [ $SECONDS -lt $end ] || return 1
        sleep 0.2
    done
}
start_node() {
    unshare --pid --fork --kill-child --mount-proc slurmd -D -N "$1" -f "$SLURM_CONF" >"$tmp/$1.out" 2>&1 &
    daemon[$1]=$!
}
start_controller() {
    slurmctld -D -f "$SLURM_CONF" >"$tmp/slurmctld.out" 2>&1 &
    daemon[ctld]=$!
}
idle_nodes() { [ "$(sinfo -h -N -t idle -o %N | wc -l)" -eq "$1" ]; }

port=$((20000 + RANDOM % 10000)) host=$(hostname -s)
mkdir "$tmp/state" "$tmp/spool"
head -c 32 /dev/urandom >"$tmp/munge.key" && chmod 600 "$tmp/munge.key"
munged --foreground --key-file="$tmp/munge.key" --socket="$tmp/munge.sock" --pid-file="$tmp/munged.pid" --log-file="$tmp/munged.log" \
    --seed-file="$tmp/munge.seed" >"$tmp/munged.out" 2>&1 &
daemon[munged]=$!
cat >"$SLURM_CONF" <<CONF
ClusterName=assay
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
AuthType=auth/munge
AuthInfo=socket=$tmp/munge.sock
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$tmp/state
SlurmdSpoolDir=$tmp/spool/%n
SlurmctldPidFile=$tmp/slurmctld.pid
SlurmdPidFile=$tmp/%n.pid
SlurmctldLogFile=$tmp/slurmctld.log
SlurmdLogFile=$tmp/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SlurmdTimeout=5
MessageTimeout=3
KillWait=1
MinJobAge=2
ReturnToService=2
SchedulerParameters=sched_interval=1
NodeName=n[1-4] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 4))] CPUs=1 RealMemory=512
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
until_so 10 test -S "$tmp/munge.sock"
start_controller
for n in n1 n2 n3 n4; do mkdir "$tmp/spool/$n" && start_node $n; done
until_so 60 idle_nodes 4
tell "a cluster of four nodes on this machine" "$(idle_nodes 4 || { sinfo -N; tail -n 5 "$tmp"/*.log "$tmp"/*.out; } 2>&1 | tr '\n' ' ')"
[ $failures -eq 0 ] || exit 1

# A job takes a few seconds on its one thread. The follower is killed and begun again, the controller restarted, and a node killed
# while it runs a job, whose number the log of its task says.
words=(-q -r 160 128 -s 1600 --aov --keep-state)
"$pathtracer" "${words[@]}" -f "$tmp/l.exr" -f "$tmp/l.png" "$scene" >/dev/null
cd "$tmp" || exit 1
follow() { "$assay" slurm --plan "$tmp/plan" pathtracer "${words[@]}" --slurm 8 -f x.exr -f x.png "$scene"; }
follow >"$tmp/out" 2>"$tmp/err" &
follower=$!
one_runs() { [ -n "$(squeue -h -t R -o %N)" ]; }
until_so 30 one_runs
kill -9 $(pgrep -P $follower) $follower 2>/dev/null
wait $follower 2>/dev/null
follow >"$tmp/out" 2>"$tmp/err" &
follower=$!
# Shut down in order: after a kill -9 the controller forgets what it heard in the last seconds.
{ kill "${daemon[ctld]}" && wait "${daemon[ctld]}"; } 2>/dev/null
sleep 1
start_controller
until_so 30 one_runs
# The task that has begun last will run longest from now on.
victim="" lost=""
begun() {
    local task log node
    while read -r task node; do
        for log in "$tmp"/plan/log/assay-*-1-"$task".txt; do
            if grep -q begins "$log" 2>/dev/null && ! grep -q ': made' "$log"; then victim=$node lost=$(sed -n 's/^job \([0-9]*\): begins/\1/p' "$log"); fi
        done
    done < <(squeue -h -r -t R -o '%K %N' | sort -n)
    [ -n "$lost" ]
}
until_so 60 begun && { kill -9 "${daemon[$victim]}" && wait "${daemon[$victim]}"; } 2>/dev/null
wait $follower
status=$?
why=""
[ $status -eq 0 ] || why="status $status: $(tail -n 3 "$tmp/err" | tr '\n' ' ')"
for f in png exr.state; do cmp "l.$f" "x.$f" >"$tmp/cmp" 2>&1 || why="$why $(cat "$tmp/cmp")"; done
tell "a render with a node killed in the middle has the bits of one here" "$why"
why=""
grep -h begins plan/log/assay-* | sort | uniq -c | awk '{print $3, $1}' | tr -d : >begun
while read -r job times; do
    if [ "$job" = "$lost" ]; then [ "$times" -eq 2 ] || why="$why lost job $job began $times times;"; elif [ "$times" -ne 1 ]; then why="$why job $job began $times times;"; fi
done <begun
[ "$(wc -l <begun)" -eq 8 ] || why="$why $(wc -l <begun) jobs began"
[ -n "$lost" ] || why="$why no job was lost"
tell "nothing was made twice but what node $victim lost, job $lost, though follower and controller were killed too" "$why"
why=$(cd / && "$assay" reproduce "$tmp/x.exr" 2>&1 | grep -q "the same bits" || echo "not the image that its words make")
tell "the image says how it was made" "$why"
why=$([ -e plan/assay-*-2 ] && echo "" || echo "no second round: $(ls plan)")
tell "what was lost was submitted again" "$why"

[ -n "$victim" ] && start_node "$victim"
until_so 60 idle_nodes 4

# pathtracer submits by itself; its plan is removed when all is done.
"$pathtracer" -q -r 64 64 -s 16 -f l2.exr -f l2.png "$scene" >/dev/null
why=$("$pathtracer" -q -r 64 64 -s 16 --slurm 3 -f x2.exr -f x2.png "$scene" 2>&1 >/dev/null) && why=""
cmp -s l2.png x2.png || why="another image: $why"
[ -e x2.exr.plan ] && why="$why the plan was left"
tell "pathtracer --slurm" "$why"

"$assay" slurm --parts 1 --ranges 3 pathtracer -q -r 64 64 -s 16 -f x3.exr "$scene" >"$tmp/out" 2>"$tmp/err" && "$assay" reproduce x3.exr >"$tmp/out" 2>>"$tmp/err" &&
    grep -q "3 of 3 jobs made" "$tmp/err" && why="" || why="$(tail -n 2 "$tmp/out" "$tmp/err" | tr '\n' ' ')"
tell "sample ranges are what their jobs make here" "$why"

cd "$OLDPWD" || exit 1
mkdir "$tmp/class"
cp "$pathtracer" "$tmp/class/right" && printf '#!/bin/sh\nexit 3\n' >"$tmp/class/dead" && chmod +x "$tmp/class/dead" && cp "$pathtracer" "$tmp/class/again"
"$assay" grade -q -o "$tmp/g1" tests/end_to_end/quick.rubric "$tmp"/class/* >/dev/null 2>&1
why=$("$assay" grade -q --slurm -o "$tmp/g2" tests/end_to_end/quick.rubric "$tmp"/class/* 2>&1 >/dev/null)
cmp -s "$tmp/g1/grades.csv" "$tmp/g2/grades.csv" && cmp -s "$tmp/g1/right/point.png" "$tmp/g2/right/point.png" && why="" || why="other grades: $why"
tell "a grading batch" "$why"

"$assay" validate -q --only 12_point_plane --only 31_spot_plane --only 10_furnace_one --out "$tmp/v1" >"$tmp/t1" 2>&1
why=$("$assay" validate -q --slurm --only 12_point_plane --only 31_spot_plane --only 10_furnace_one --out "$tmp/v2" 2>&1 >"$tmp/t2")
no_times() { sed -E 's/"(seconds|seconds_a|seconds_b|a)": [0-9.e-]+//; /"(command|date)":/d' "$1"; }
cmp -s <(no_times "$tmp/v1/results.json") <(no_times "$tmp/v2/results.json") && cmp -s <(grep -v index.html "$tmp/t1") <(grep -v index.html "$tmp/t2") && why="" || why="other results: $why"
tell "a validation" "$why"
why=$("$assay" slurm --by claim validate -q --only 12_point_plane --only 31_spot_plane --only 10_furnace_one --out "$tmp/v3" 2>&1 >"$tmp/t3")
cmp -s <(no_times "$tmp/v1/results.json") <(no_times "$tmp/v3/results.json") && cmp -s <(grep -v index.html "$tmp/t1") <(grep -v index.html "$tmp/t3") && why="" || why="other results: $why"
tell "a validation by claims" "$why"

# References, each job some replicates of one, by Blender itself.
if command -v blender >/dev/null; then
    mkdir "$tmp/suite"
    cp "$scene" "$tmp/suite"
    sed 's/"width": [0-9]*, "height": [0-9]*/"width": 16, "height": 16/; s/"tile": 16/"tile": 8/; /"consistency"/d
        s/"replicates": [0-9]*, "spp": [0-9]*/"replicates": 4, "spp": 16/' reference/scenes/41_cornell.json >"$tmp/suite/41_cornell.json"
    words=(reference --suite "$tmp/suite" --work "$tmp/work" --engine cycles)
    why=$("$assay" "${words[@]}" -t 1 --out "$tmp/r1" 2>&1 >/dev/null | grep -v rendering)
    "$assay" "${words[@]}" --slurm --out "$tmp/r2" >"$tmp/out" 2>"$tmp/err" || why="$why $(tail -n 2 "$tmp/err")"
    grep -q "4 of 4 jobs made" "$tmp/err" || why="$why not 4 jobs: $(tail -n 2 "$tmp/err")"
    cmp "$tmp/r1/41_cornell/cycles.exr" "$tmp/r2/41_cornell/cycles.exr" >"$tmp/cmp" 2>&1 || why="$why $(cat "$tmp/cmp")"
    no_times() { sed -E '/"(cpu_s|wall_s|date)":/d' "$1"; }
    cmp -s <(no_times "$tmp/r1/41_cornell/manifest.json") <(no_times "$tmp/r2/41_cornell/manifest.json") || why="$why another manifest"
    tell "replicates of a reference" "$why"
else
    echo "skip slurm: replicates of a reference: no blender in PATH: NOT TESTED"
fi

# A job that cannot be made: its input is another one once it is planned, and before any node may begin.
why=""
cp "$scene" "$tmp/other.dae"
scontrol update PartitionName=all State=DOWN || why="the partition does not close"
"$assay" slurm --plan "$tmp/other" --parts 1 pathtracer -q -r 32 32 -s 1 -f "$tmp/z.exr" "$tmp/other.dae" >"$tmp/out" 2>"$tmp/err" &
follower=$!
until_so 30 test -e "$tmp/other/plan.jsonl"
printf ' ' >>"$tmp/other.dae"
scontrol update PartitionName=all State=UP
wait $follower
status=$?
[ $status -eq 3 ] && grep -q "job 0 came back 3 times without its artefact: .*other.dae is not what was planned with" "$tmp/err" || why="status $status: $(tail -n 2 "$tmp/err")"
tell "a job that cannot be made is tried three times, and said why" "$why"

# Ctrl-C takes the array along.
"$assay" slurm --plan "$tmp/stop" --parts 4 pathtracer -q -r 256 256 -s 100000 -f "$tmp/z.exr" "$scene" >"$tmp/out" 2>"$tmp/err" &
follower=$!
until_so 30 one_runs
kill -TERM $follower
wait $follower
status=$?
empty() { [ -z "$(squeue -h)" ]; }
until_so 20 empty
why=""
[ $status -eq 3 ] && empty && grep -q "interrupted with 0 of 4" "$tmp/err" || why="status $status: $(tail -n 2 "$tmp/err"); $(squeue -h)"
tell "a follower that is stopped cancels its jobs" "$why"
[ $failures -eq 0 ]
