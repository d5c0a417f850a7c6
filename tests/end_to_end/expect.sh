# To be sourced from the root of the checkout: functions that print "ok $what: NAME" or "not ok $what: NAME: why"
# (without $what only the name) and count the latter in $failures. Uses $tmp.
# shellcheck shell=bash disable=SC2154

tell() { # NAME WHY: not ok where WHY says something
    if [ -z "$2" ]; then echo "ok ${what:+$what: }$1"; else
        echo "not ok ${what:+$what: }$1: $2"
        failures=$((failures + 1))
    fi
}
expect() { # NAME STATUS PATTERN COMMAND...: a status of 3 comes with one line on stderr
    local name=$1 status=$2 pattern=$3 why="" lines=()
    shift 3
    "$@" >"$tmp/out" 2>"$tmp/err" </dev/null
    local got=$?
    [ "$status" -ne 3 ] || mapfile lines <"$tmp/err"
    [ $got -eq "$status" ] && grep -q -- "$pattern" "$tmp/out" "$tmp/err" && { [ "$status" -ne 3 ] || [[ ${#lines[@]} -eq 1 && ${lines[0]} == *$'\n' ]]; } ||
        why="status $got, no '$pattern' or more than a line: $(head -c 1000 "$tmp/out" "$tmp/err")"
    tell "$name" "$why"
}
