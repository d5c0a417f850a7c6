/* Unpacks and builds a submission, and runs its program, in the sandbox. */
#include "kept_run.h"
#include "submission.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
    NO_TOOL = 95,
    NO_UNZIP = 96,
    UNPACK = 97,
    NO_PROGRAM = 98,
    BUILD = 99,
    /* above: exit statuses of the scripts; below: seconds, processes */ PROBE_S = 10,
    FILL_S = 3600,
    BUILD_PROCESSES = 512
};

/* Unpacks archives, moves the folder of the sources to the top, so that its name does not matter,
 * and removes what another machine left there: its CMakeCache.txt stops CMake, its objects would be
 * linked. Files from another time zone may be younger than now, which make(1) takes for built. The
 * last line printed is the reason of a failure. The build's objects are removed, as every run
 * unpacks the tree. */
static const char build_script[] =
    "set -u\n"
    "lift() {\n" /* a folder takes the place of everything */
    "  mv -- \"$1\" .lifted && find . -mindepth 1 -maxdepth 1 ! -name .lifted -exec rm -rf {} + &&\n"
    "    find .lifted -mindepth 1 -maxdepth 1 -exec mv -t . -- {} + && rmdir .lifted\n"
    "}\n"
    "i=0\n"
    "while [ $i -lt 8 ]; do\n"
    "  i=$((i + 1))\n"
    "  find . \\( -name __MACOSX -o -name .git -o -name .DS_Store -o -name '._*' \\) -prune -exec rm -rf {} +\n"
    "  [ ! -e \"$PROGRAM\" ] && [ \"$(find . -mindepth 1 -maxdepth 1 -printf .)\" = . ] || break\n"
    "  one=$(find . -mindepth 1 -maxdepth 1)\n"
    "  case $one in\n"
    "    *.[zZ][iI][pP] | *.tar | *.tar.* | *.t[gbx]z | *.7z | *.rar)\n"
    "      mkdir .new || exit 97\n"
    "      case $one in\n"
    "        *.7z | *.rar) why='such archives are not read here, but .zip and .tar.gz are'; false ;;\n"
    "        *.[zZ][iI][pP]) command -v unzip >/dev/null || exit 96\n"
    "          why=$(unzip -q -o \"$one\" -d .new 2>&1); code=$?\n"
    "          [ $code -ne 9 ] || why='it is damaged, or no zip archive'; [ $code -le 1 ] ;;\n"
    "        *) why=$(tar -xf \"$one\" -C .new 2>&1) || { why=$(echo \"$why\" | head -n 1); false; } ;;\n"
    "      esac || { echo \"${one#./} cannot be unpacked: $(echo \"$why\" | tail -n 1)\"; exit 97; }\n"
    "      chmod -R u+rwX .new && lift .new || exit 97 ;;\n"
    "    *) [ -d \"$one\" ] && [ ! -L \"$one\" ] || break\n"
    "      lift \"$one\" || exit 97 ;;\n"
    "  esac\n"
    "done\n"
    "[ -n \"$BUILD\" ] || { chmod u+x \"$PROGRAM\" 2>/dev/null; exit 0; }\n"
    "case \" $(echo \"$BUILD\" | tr '\\n;&|()' '      ') \" in\n" /* as a word: not make.sh */
    "  *' cmake '*) marker=CMakeLists.txt named=$marker ;;\n"
    "  *' make '*) marker=[Mm]akefile named=Makefile ;; *) marker= ;; esac\n"
    "if [ -n \"$marker\" ]; then\n"
    "  find . -name CMakeCache.txt -printf '%h\\n' | while IFS= read -r dir; do\n"
    "    if [ -e \"$dir/CMakeLists.txt\" ]; then rm -rf \"$dir/CMakeCache.txt\" \"$dir/CMakeFiles\"; else rm -rf \"$dir\"; fi\n"
    "  done\n"
    "  root=$(find . -name \"$marker\" -printf '%d %P\\n' | sort -n |\n"
    "    awk 'NR == 1 { d = $1 } $1 == d { sub(/^[0-9]+ /, \"\"); sub(/\\/?[^\\/]*$/, \"\"); print }')\n"
    "  if [ -z \"$(find . -name \"$marker\" -print -quit)\" ]; then\n"
    "    top=${PROGRAM##*/}\n" /* it was built before */
    "    [ -e \"$PROGRAM\" ] || { [ -f \"$top\" ] && mkdir -p \"${PROGRAM%/*}\" && ln -s \"$PWD/$top\" \"$PROGRAM\"; } ||\n"
    "      { [ -n \"$(find . -type f -print -quit)\" ] && echo \"there is no $named in it\" || echo \"there is no file in it\"; exit 97; }\n"
    "    exit 0\n"
    "  fi\n"
    "  [ \"$(echo \"$root\" | wc -l)\" = 1 ] ||\n"
    "    { echo \"more than one folder holds a $named:\" $root; exit 97; }\n"
    "  [ -z \"$root\" ] || lift \"./$root\" || exit 97\n"
    "fi\n"
    "find . -newermt now -exec touch -h {} +\n"
    "began=$(date +%s)\n"
    "LC_ALL=C sh -exc \"$BUILD\" || { [ $? -ne 127 ] || exit 95; exit 99; }\n"
    "if [ ! -f \"$PROGRAM\" ]; then\n"
    "  echo \"building it made no ${PROGRAM#./}, but\" $(find . -type f -perm -u+x -newermt \"@$began\" \\\n"
    "    ! -path '*/CMakeFiles/*' -printf '%P\\n' | head -n 5)\n"
    "  exit 98\n"
    "fi\n"
    "find . \\( -name '*.o' -o -name '*.a' -o -name CMakeFiles \\) -prune -exec rm -rf {} +\n"
    "exit 0\n";

/* Would the program start? Looked at where it will run, without running it: ld.so(8) lists the libraries. One that is not found
 * is looked for in the submission by its name, so that a program linked elsewhere with a library of its own finds it. */
static const char probe_script[] =
    "set -u\n"
    "rm -rf assay-library\n"
    "fail() { echo \"$1\"; exit 98; }\n"
    "missing() { LD_TRACE_LOADED_OBJECTS=1 \"$PROGRAM\" 2>&1 | sed -n 's/^[[:space:]]*\\(.*\\) => not found.*/\\1/p'; }\n"
    "[ -f \"$PROGRAM\" ] || fail \"there is no program ${PROGRAM#./} in it\"\n"
    "magic=$(head -c 4 \"$PROGRAM\" | od -An -tx1 | tr -d ' ')\n"
    "case $magic in\n"
    "  cffaedfe | cafebabe) fail \"${PROGRAM#./} is a program for macOS\" ;;\n"
    "  4d5a*) fail \"${PROGRAM#./} is a program for Windows\" ;;\n"
    "  504b0304 | 52617221 | 377abcaf | 1f8b*)\n"
    "    fail \"${PROGRAM#./} is an archive: it is unpacked if its name ends in .zip, .tar.gz or the like\" ;;\n"
    "  2321*) head -n 1 \"$PROGRAM\" | grep -q \"$(printf '\\r')\" || exit 0\n"
    "    fail \"the first line of ${PROGRAM#./} ends as on Windows (CR LF), so its interpreter is not found\" ;;\n"
    "  7f454c46) ;;\n"
    "  *) exit 0 ;;\n"
    "esac\n"
    "machine() { od -An -j18 -N2 -tx1 \"$1\"; }\n"
    "[ \"$(machine \"$PROGRAM\")\" = \"$(machine /bin/sh)\" ] || fail \"${PROGRAM#./} is a program for another processor\"\n"
    "[ -x \"$PROGRAM\" ] || fail \"${PROGRAM#./} is not executable\"\n"
    "grep -aq ld-linux \"$PROGRAM\" || exit 0\n" /* linked statically: it would run */
    "path=\n"
    "for lib in $(missing); do\n"
    "  found=$(find . -name \"$lib\" ! -type d -print -quit)\n"
    "  [ -z \"$found\" ] || path=$path${path:+:}$PWD/${found%/*}\n"
    "done\n"
    "[ -z \"$path\" ] || export LD_LIBRARY_PATH=\"$path\"\n"
    "for lib in $(missing); do fail \"the shared library $lib is missing\"; done\n"
    "why=$(LD_TRACE_LOADED_OBJECTS=1 \"$PROGRAM\" 2>&1 | grep ' not found (required by' | head -n 1)\n"
    "[ -z \"$why\" ] || fail \"$why\"\n"
    "echo \"$path\" >assay-library\n";

/* A line fit for a student: the first error of the build, else the last line. */
static void reason_in(const char *log, bool first_error, char *out, size_t size)
{
    static const char *const words[] = {"rror: ",          "CMake Error",  "undefined reference",
                                        "No rule to make", "cannot find ", "ut of memory",
                                        "annot allocate"};
    char line[400];
    bool more = false; /* CMake says what, then, indented, why */
    out[0] = '\0';
    FILE *f = fopen(log, "r");
    while (f != NULL && fgets(line, sizeof line, f) != NULL) {
        const bool indented = line[0] == ' ';
        size_t n = 0;
        for (const char *c = line + strspn(line, " \t"); *c != '\0' && *c != '\n'; c++)
            line[n++] = *c >= ' ' && *c <= '~' ? *c : '?';
        line[n] = '\0';
        if (n == 0)
            continue;
        if (more && !indented)
            break;
        bool error = false;
        for (size_t i = 0; first_error && i < sizeof words / sizeof *words; i++)
            error = error || strstr(line, words[i]) != NULL;
        size_t used = more ? strlen(out) : 0;
        snprintf(out + used, size - used, "%s%s", used > 0 ? " " : "", line);
        more = more || (error && strncmp(line, words[1], strlen(words[1])) == 0);
        if (error && !more)
            break;
    }
    if (f != NULL)
        fclose(f);
}

static void fails(struct submission *s, enum submission_state state, const char *what,
                  const char *why)
{
    s->state = state;
    snprintf(s->why, sizeof s->why, "It %s: %.500s", what, why);
}

/* Runs a job; fails if the run was lost for a reason that is not the program's. */
static bool run(const struct sandbox *box, const struct submission *s,
                const struct sandbox_job *job, struct sandbox_result *out, struct err *e)
{
    return sandbox_run(box, job, out, e) &&
           (out->end != SANDBOX_LOST || err_set(e, "%s: %s", s->id, out->why));
}

bool submission_run(const struct rubric *r, const struct sandbox *box, const struct submission *s,
                    const struct sandbox_job *job, const char *const *inputs,
                    struct sandbox_result *out, struct err *e)
{
    char of[3072];
    struct path dir;
    if (s->runs == NULL)
        return run(box, s, job, out, e);
    snprintf(of, sizeof of, "%s %s %s %s", s->id, s->sha256,
             s->kind == SUBMISSION_SOURCE ? r->build : "", fs_base(job->log));
    return kept_run_path(s->runs, of, box, job, inputs, &dir, e) &&
           ((!s->runs_again && kept_run_read(dir.s, job, out)) ||
            (run(box, s, job, out, e) && kept_run_write(dir.s, job, out, e)));
}

static bool probe(const struct rubric *r, const struct sandbox *box, const char *work,
                  struct submission *s, struct err *e)
{
    char program[sizeof s->program + 16];
    snprintf(program, sizeof program, "PROGRAM=%s", s->program);
    const struct path out = fs_path("%s/probe", work), library = fs_path("%s/assay-library", out.s);
    struct sandbox_job job = {
        .argv = (const char *const[]){"env", program, "sh", "-c", probe_script, NULL},
        .tree = s->tree,
        .keep = (const char *const[]){"assay-library", NULL},
        .out = out.s,
        .limit = r->limit};
    struct sandbox_result result;
    job.limit.wall_s = job.limit.cpu_s = PROBE_S;
    if (!run(box, s, &job, &result, e))
        return false;
    if (result.end == SANDBOX_FAILED && result.status == NO_PROGRAM)
        fails(s, SUBMISSION_NOT_STARTED, "does not start",
              result.why + strcspn(result.why, ":") + strlen(": "));
    FILE *f = fopen(library.s, "r");
    if (f != NULL) {
        if (fgets(s->library, sizeof s->library, f) != NULL)
            s->library[strcspn(s->library, "\n")] = '\0';
        fclose(f);
    }
    return fs_remove_tree(out.s, e);
}

static bool build(const struct rubric *r, const struct sandbox *box, const char *cache, bool fill,
                  const char *work, const char *log, struct submission *s, struct err *e)
{
    char program[sizeof s->program + 16], words[sizeof r->build + 16], why[500];
    snprintf(program, sizeof program, "PROGRAM=%s", s->program);
    snprintf(words, sizeof words, "BUILD=%s", s->kind == SUBMISSION_SOURCE ? r->build : "");
    const struct path out = fs_path("%s/build", work), built = fs_path("%s/tree.tar", out.s);
    struct sandbox_job job = {
        .argv = (const char *const[]){"env", program, words, "sh", "-c", build_script, NULL},
        .tree = s->tree,
        .keep_tree = true,
        .tools = true,
        .cache = cache,
        .fill_cache = fill,
        .out = out.s,
        .log = log,
        .limit = r->limit};
    struct sandbox_result result;
    job.limit.wall_s = job.limit.cpu_s = fill ? FILL_S : r->build_s;
    job.limit.memory = r->build_memory;
    job.limit.processes = BUILD_PROCESSES;
    if (!submission_run(r, box, s, &job, (const char *const[]){NULL}, &result, e))
        return false;
    if (result.end == SANDBOX_FAILED && result.status == NO_UNZIP)
        return err_set(e, "%s: there is no unzip on this machine", s->path);
    if (result.end == SANDBOX_FAILED && result.status == NO_TOOL) {
        reason_in(log, false, why, sizeof why);
        if (strchr(why, '/') == NULL) /* a word of the rubric's, in no folder of the submission */
            return err_set(e, "%s: this machine lacks what the rubric builds with: %s", s->path,
                           why);
        result.status = BUILD;
    }
    if (result.end != SANDBOX_OK) {
        bool told =
            result.end == SANDBOX_FAILED && result.status >= UNPACK && result.status <= BUILD;
        reason_in(log, result.status == BUILD, why, sizeof why);
        result.why[strcspn(result.why, ":")] = '\0'; /* its last words are no reason */
        bool no_program = told && result.status == NO_PROGRAM;
        fails(s, no_program ? SUBMISSION_NOT_STARTED : SUBMISSION_NOT_BUILT,
              no_program ? "does not start" : "does not build", told ? why : result.why);
    } else if (access(built.s, R_OK) != 0) {
        snprintf(why, sizeof why, "what was made is larger than %zu MiB", r->limit.disk >> 20);
        fails(s, SUBMISSION_NOT_BUILT, "does not build", why);
    } else if (rename(built.s, s->tree) != 0 || chmod(s->tree, 0644) != 0) {
        return err_set(e, "%s: %s", s->tree, strerror(errno));
    }
    return fs_remove_tree(out.s, e);
}

bool submission_build(const struct rubric *r, const struct sandbox *box, const char *cache,
                      bool fill, const char *work, const char *log, struct submission *s,
                      struct err *e)
{
    if (s->kind == SUBMISSION_IMAGES || s->state != SUBMISSION_GRADED)
        return true;
    if ((s->kind == SUBMISSION_SOURCE || s->packed) && !build(r, box, cache, fill, work, log, s, e))
        return false;
    return s->state != SUBMISSION_GRADED || strstr(r->command, "{program}") == NULL ||
           probe(r, box, work, s, e);
}
