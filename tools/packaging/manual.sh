#!/bin/bash
# tools/packaging/manual.sh BUILD OUT: makes manual pages and shell completions from the programs' --help (which is
# printed from the table of options): OUT/man1/assay.1 and assay-VERB.1, OUT/bash-completion/assay and pathtracer,
# OUT/zsh/_assay and _pathtracer.
set -euo pipefail
build=${1:?usage: tools/packaging/manual.sh BUILD OUT} out=${2:?usage: tools/packaging/manual.sh BUILD OUT}
assay=$build/assay
mkdir -p "$out/man1" "$out/bash-completion" "$out/zsh"

# "VERB what it is for"
verbs=$("$assay" --help | sed -nE 's/^  ([a-z-]+) +(.*)/\1 \2/p')

# man_page NAME WHAT: from the help on stdin.
man_page() {
    printf '.TH %s 1 "" "Assay" "User Commands"\n.SH NAME\n%s \\- %s\n.SH SYNOPSIS\n.nf\n' "${1^^}" "$1" "$2"
    sed 's/\\/\\e/g; s/-/\\-/g' | awk '
        function text(line) { return line ~ /^[.'\'']/ ? "\\&" line : line }
        part == "" && /^(usage:| +assay )/ { sub(/^usage: | +/, ""); print text($0); next }
        part == "" { print ".fi"; part = "usage" }
        part == "usage" && /^[^ ]/ { print ".SH DESCRIPTION"; part = "description" }
        part == "usage" && /^$/ { next }
        /^ +(\\-., )?\\-\\-[a-z]/ && match($0, /[^ ]/) < 8 { # else it goes on about the one before
            if (part != "options") print ".SH OPTIONS"
            part = "options"
            left = substr($0, 1, 1); sub(/^ +/, "")
            n = match($0, /  +/)                      # two blanks end the option, or one where it is long
            option = n ? substr($0, 1, n - 1) : $0; help = n ? substr($0, n + RLENGTH) : ""
            print ".TP"; print ".B " option; if (help != "") print text(help)
            next
        }
        part == "options" && /^ / { sub(/^ +/, ""); print text($0); next }
        part == "options" { print ".SH NOTES"; part = "notes" }
        /^$/ { print ".PP"; next }
        { if (indented || /^ /) print ".br"; indented = /^ /; sub(/^ +/, ""); print text($0) }'
}

{
    printf '.TH ASSAY 1 "" "Assay" "User Commands"\n.SH NAME\nassay \\- prove a path tracer right\n.SH SYNOPSIS\n.B assay\n.I VERB\n.RI [ options ]\n'
    printf '.SH DESCRIPTION\nCompares renders, of its own path tracer or of any other program, with references, and says with a stated error rate\n'
    printf 'whether they agree and what difference could have been missed.\nEach verb has a page of its own.\n.SH VERBS\n'
    while read -r verb what; do printf '.TP\n.BR assay\\-%s (1)\n%s\n' "${verb//-/\\-}" "$what"; done <<<"$verbs"
    printf '.SH EXIT STATUS\n'
    "$assay" --help | sed -n '/^Exit code/,$p' | sed 's/^Exit code: //'
    printf '.SH SEE ALSO\n.BR pathtracer (1)\n'
} >"$out/man1/assay.1"
while read -r verb what; do
    "$assay" "$verb" --help | man_page "assay-$verb" "$what" >"$out/man1/assay-$verb.1"
done <<<"$verbs"

# "-o --out x" for each option of the help on stdin: short name or -, long name, x if it takes an argument.
options() {
    sed -nE 's/^ {2,6}(-., )?--([a-z0-9-]+)( [A-Z[][^ ]*)?.*/\1|\2|\3/p' | awk -F '|' '{ sub(/, /, "", $1); print ($1 == "" ? "-" : $1), "--" $2, ($3 == "" ? "" : "x") }'
}
long() { options | awk '{ printf "%s ", $2 }'; }

{
    printf '# bash completion of assay, made by tools/packaging/manual.sh\n_assay() {\n    local word=${COMP_WORDS[COMP_CWORD]} options\n    COMPREPLY=()\n'
    printf '    if [ "$COMP_CWORD" -eq 1 ]; then\n        mapfile -t COMPREPLY < <(compgen -W "%s--help --version" -- "$word")\n        return\n    fi\n' "$(awk '{ printf "%s ", $1 }' <<<"$verbs")"
    printf '    [[ $word == -* ]] || return\n    case ${COMP_WORDS[1]} in\n'
    while read -r verb _; do printf '    %s) options="%s" ;;\n' "$verb" "$("$assay" "$verb" --help | long)"; done <<<"$verbs"
    printf '    esac\n    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$word")\n}\ncomplete -o default -F _assay assay\n'
} >"$out/bash-completion/assay"
{
    printf '# bash completion of pathtracer, made by tools/packaging/manual.sh\n_pathtracer() {\n    local word=${COMP_WORDS[COMP_CWORD]}\n    COMPREPLY=()\n'
    printf '    [[ $word == -* ]] && mapfile -t COMPREPLY < <(compgen -W "%s" -- "$word")\n}\ncomplete -o default -F _pathtracer pathtracer\n' "$("$build/pathtracer" --help | long)"
} >"$out/bash-completion/pathtracer"

zsh_options() { options | awk -v q="'" '{ printf "%s%s%s ", q, $2 ($3 == "x" ? ":value:_files" : ""), q }'; }
{
    printf '#compdef assay\nlocal -a verbs\nverbs=(\n'
    while read -r verb what; do printf "    '%s:%s'\n" "$verb" "${what//\'/}"; done <<<"$verbs"
    printf ')\nif ((CURRENT == 2)); then\n    _describe verb verbs\n    return\nfi\ncase $words[2] in\n'
    while read -r verb _; do printf '%s) _arguments -S : %s"*:file:_files" ;;\n' "$verb" "$("$assay" "$verb" --help | zsh_options)"; done <<<"$verbs"
    printf 'esac\n'
} >"$out/zsh/_assay"
printf '#compdef pathtracer\n_arguments -S : %s"*:scene:_files"\n' "$("$build/pathtracer" --help | zsh_options)" >"$out/zsh/_pathtracer"
