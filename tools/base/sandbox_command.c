/* The command lines of the sandbox: bwrap, the supervisor, limits and environment of a run. */
#define _GNU_SOURCE
#include "sandbox_internal.h"

#include <glob.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The supervisor, a shell script that runs in the outer layer; its arguments are the command that
 * runs the program in the inner one. Its report, a line "STATUS WORD TICKS", goes to a file that the
 * program cannot see; if there is no room for what is handed out, there is no report. TREE, SCENE,
 * KEEP_TREE: "" or not; WATCH: KiB. bwrap does not wait for the process that it starts, so the
 * program's processor time is found with process 1 of the outer layer, which inherits it: cutime and
 * cstime, fields 16 and 17 of its stat. For a run that is killed with the supervisor, the watch writes
 * down what all processes but ours have used so far: fields 14 to 17 of their stat; 24 is the memory. */
static const char supervisor[] =
    "set -u\n"
    "umask 022\n"
    "cd \"$BOX\" || exit 125\n"
    "if [ -n \"$TREE\" ] && ! tar -xf \"$TREE\"; then echo '125 unpack' >\"$OUT/.report\"; exit 125; fi\n"
    "rm -rf ./scene $KEEP\n"
    "if [ -n \"$SCENE\" ] && ! cp -R \"$SCENE\" ./scene; then echo '125 unpack' >\"$OUT/.report\"; exit 125; fi\n"
    "if [ -n \"$FILTER\" ]; then \"$@\" 9<\"$FILTER\" & else \"$@\" & fi\n"
    "pid=$!\n"
    "read -r me stat </proc/self/stat\n" /* the watch has another */
    "while sleep 0.2 && read -r watch stat </proc/self/stat; do\n"
    "  used=$(cat /proc/[0-9]*/stat 2>/dev/null | awk -v page=\"$PAGE\" -v me=$me -v watch=$watch '{\n"
    "    pid = $1; sub(/^.*\\) /, \"\"); memory += $22\n"
    "    if (pid != me && pid != watch && $2 != watch) cpu += $12 + $13 + $14 + $15\n"
    "  } END { printf \"%d %d\", memory * page, cpu }')\n"
    "  echo \"${used#* }\" >>\"$OUT/.cpu\"\n"
    "  used=${used% *}\n"
    "  [ \"${used:-0}\" -le \"$WATCH\" ] || { : >\"$OUT/.memory\"; kill -9 $pid; exit; }\n"
    "done &\n"
    "watch=$!\n"
    "wait $pid\n"
    "status=$? word=ended\n"
    "kill $watch 2>/dev/null\n"
    "[ ! -e \"$OUT/.memory\" ] || word=memory\n"
    "if [ $status -ne 0 ] && [ $word = ended ] && [ \"$(df --output=avail . | tail -n 1)\" -eq 0 ]; then word=disk; fi\n"
    "for name in $KEEP; do\n"
    "  [ ! -f \"$name\" ] || [ -L \"$name\" ] || head -c $((FILE + 1)) \"./$name\" >\"$OUT/$name\" || exit\n"
    "done\n"
    "i=0 cpu=0\n"
    "while [ $i -lt 40 ] && grep -qsE '^NSpid:.*[0-9]\\s+[0-9]' /proc/[0-9]*/status; do sleep 0.05; i=$((i + 1)); done\n"
    "read -r stat </proc/1/stat && set -- ${stat##*)} && cpu=$((${14} + ${15}))\n"
    "rm -rf ./scene\n"
    "[ -z \"$KEEP_TREE\" ] || tar -cSf - . | head -c $((DISK + 1)) >\"$OUT/tree.tar\" || exit\n"
    "echo \"$status $word $cpu\" >\"$OUT/.report\"\n"
    "exit $status\n";

static void add(struct sandbox_line *l, const char *arg)
{
    if (l->num == SANDBOX_ARGS - 1)
        l->overflow = true;
    else
        l->arg[l->num++] = arg;
}

static void add_all(struct sandbox_line *l, const char *const *args)
{
    for (; *args != NULL; args++)
        add(l, *args);
}

static void add_text(struct sandbox_line *l, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static void add_text(struct sandbox_line *l, const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    int n = vsnprintf(l->text + l->used, SANDBOX_TEXT - l->used, format, ap);
    va_end(ap);
    if (n < 0 || (size_t)n >= SANDBOX_TEXT - l->used) {
        l->overflow = true;
        return;
    }
    add(l, l->text + l->used);
    l->used += (size_t)n + 1;
}

static const char search_path[] = "/usr/local/bin:/usr/bin:/bin";

/* The program's environment, as options of bwrap or, if by_env, of env(1). box, temp, cache: paths as the program sees
 * them. */
static void add_environment(struct sandbox_line *l, bool by_env, const struct sandbox_job *job,
                            const char *box, const char *temp, const char *cache)
{
    /* Cache hits must depend neither on where the sources are nor on when they were unpacked. */
    const char *const variable[][2] = {
        {"PATH", search_path},
        {"HOME", box},
        {"TMPDIR", temp},
        {"LD_LIBRARY_PATH", job->library},
        {"CCACHE_DIR", cache},
        {"CCACHE_BASEDIR", box},
        {"CCACHE_NOHASHDIR", "1"},
        {"CCACHE_SLOPPINESS", "include_file_ctime,include_file_mtime"},
        {"CCACHE_TEMPDIR", temp},
        {"CCACHE_UMASK", "022"},
        {"CCACHE_NOSTATS", "1"},
        {job->fill_cache ? "CCACHE_MAXSIZE" : "CCACHE_READONLY", job->fill_cache ? "2G" : "1"},
    };
    for (size_t i = 0; i < sizeof variable / sizeof *variable; i++) {
        const char *name = variable[i][0], *value = variable[i][1];
        if (value == NULL || (cache == NULL && strncmp(name, "CCACHE", 6) == 0))
            continue;
        const char *before = i == 0 && cache != NULL ? "/usr/lib/ccache:/usr/lib64/ccache:" : "";
        if (by_env) {
            add_text(l, "%s=%s%s", name, before, value);
            continue;
        }
        add_all(l, (const char *const[]){"--setenv", name, NULL});
        add_text(l, "%s%s", before, value);
    }
}

/* What a program may need besides compilers: a shell, and the common tools of scripts. */
static const char *const programs[] = {
    "sh",  "bash",  "env", "prlimit", "python3",  "awk",    "basename", "cat",   "chmod", "cp",
    "cut", "date",  "dd",  "dirname", "echo",     "expr",   "false",    "find",  "grep",  "head",
    "id",  "ln",    "ls",  "mkdir",   "mkfifo",   "mktemp", "mv",       "nproc", "od",    "printf",
    "pwd", "rm",    "sed", "seq",     "setsid",   "sleep",  "sort",     "tail",  "tee",   "test",
    "[",   "touch", "tr",  "true",    "truncate", "uname",  "uniq",     "wc",
};

/* With tools, all of /usr; else its libraries and `programs`, without the compilers' files among the
 * libraries. Renderers that are installed here, ours included, are hidden afterwards (add_hidden()): a
 * program might run them. */
static void add_usr(struct sandbox_line *l, bool tools)
{
    if (tools) {
        add_all(l, (const char *const[]){"--ro-bind", "/usr", "/usr", NULL});
        return;
    }
    static const char *const libraries[] = {"/usr/lib", "/usr/lib32", "/usr/lib64", "/usr/libx32",
                                            "/usr/local/lib"};
    for (size_t i = 0; i < sizeof libraries / sizeof *libraries; i++)
        add_all(l, (const char *const[]){"--ro-bind-try", libraries[i], libraries[i], NULL});
    glob_t found = {0};
    if (glob("/usr/lib{,64}/{gcc,llvm*,clang,ccache}", GLOB_BRACE, NULL, &found) == GLOB_NOSPACE)
        l->overflow = true;
    for (size_t i = 0; i < found.gl_pathc; i++) {
        struct stat st;
        if (lstat(found.gl_pathv[i], &st) != 0 || !S_ISDIR(st.st_mode))
            continue;
        add_all(l, (const char *const[]){"--size", "4096", "--tmpfs", NULL});
        add_text(l, "%s", found.gl_pathv[i]);
    }
    globfree(&found);
    for (size_t i = 0; i < sizeof programs / sizeof *programs; i++) {
        add(l, "--ro-bind-try");
        add_text(l, "/usr/bin/%s", programs[i]);
        add_text(l, "/usr/bin/%s", programs[i]);
    }
}

/* Hides a path if it would be visible. */
static void add_hidden(struct sandbox_line *l, const char *path, bool tools)
{
    struct stat st;
    if (lstat(path, &st) != 0 ||
        (!tools && strncmp(path, "/usr/lib", 8) != 0 && strncmp(path, "/usr/local/lib", 14) != 0))
        return;
    if (S_ISDIR(st.st_mode))
        add_all(l, (const char *const[]){"--size", "4096", "--tmpfs", path, "--remount-ro", path,
                                         NULL});
    else
        add_all(l, (const char *const[]){"--ro-bind", "/dev/null", path, NULL});
}

/* What both layers have: programs and libraries, an empty environment, nothing else. libraries: the layer's path of the
 * loader's list. */
static void add_system(struct sandbox_line *l, const struct sandbox *s, const char *libraries,
                       const struct sandbox_limits *limit, bool tools)
{
    static const char *const roots[] = {"bin", "sbin", "lib", "lib32", "lib64"};
    add_all(l,
            (const char *const[]){"bwrap", "--unshare-user", "--unshare-all", "--die-with-parent",
                                  "--new-session", "--clearenv", "--hostname", "box", NULL});
    add_usr(l, tools);
    for (int i = 0; i < s->num_hidden; i++)
        add_hidden(l, s->hidden[i], tools);
    for (size_t i = 0; i < sizeof roots / sizeof *roots; i++) {
        struct stat st;
        char path[16];
        snprintf(path, sizeof path, "/%s", roots[i]);
        if (lstat(path, &st) != 0)
            continue;
        add(l, S_ISLNK(st.st_mode) ? "--symlink" : "--ro-bind");
        add_text(l, S_ISLNK(st.st_mode) ? "usr/%s" : "/%s", roots[i]);
        add_text(l, "/%s", roots[i]);
    }
    add_all(l,
            (const char *const[]){"--ro-bind-try", libraries, "/etc/ld.so.cache", "--ro-bind-try",
                                  "/etc/alternatives", "/etc/alternatives", NULL});
    add_all(l, (const char *const[]){"--proc", "/proc", "--dev", "/dev", "--size", NULL});
    add_text(l, "%zu", limit->disk);
    add_all(l, (const char *const[]){"--tmpfs", "/tmp", NULL});
    add_all(l, (const char *const[]){"--setenv", "PATH", search_path, "--setenv", "LANG", "C.UTF-8",
                                     NULL});
}

static void add_limits(struct sandbox_line *l, const struct sandbox_job *job)
{
    long cpu = (long)ceil(job->limit.cpu_s);
    add(l, "prlimit");
    add_text(l, "--cpu=%ld:%ld", cpu, cpu + 1);
    add_text(l, "--data=%zu", job->limit.memory);
    add_text(l, "--fsize=%zu", job->limit.file);
    add_text(l, "--nproc=%d", job->limit.processes);
    add_all(l, (const char *const[]){"--nofile=256", "--core=0", "--", NULL});
    add_all(l, job->argv);
}

static void add_inner(struct sandbox_line *l, const struct sandbox *s,
                      const struct sandbox_job *job)
{
    const char *cache = job->cache != NULL ? "/cache" : NULL;
    add_system(l, s, "/etc/ld.so.cache", &job->limit, job->tools);
    if (cache != NULL)
        add_all(
            l, (const char *const[]){job->fill_cache ? "--bind" : "--ro-bind", cache, cache, NULL});
    add_all(l, (const char *const[]){"--disable-userns", "--bind", "/box", "/box", "--size", NULL});
    add_text(l, "%zu", job->limit.disk);
    add_all(l, (const char *const[]){"--tmpfs", "/dev/shm", "--remount-ro", "/dev", "--remount-ro",
                                     "/", NULL});
    if (s->filter[0] != '\0')
        add_all(l, (const char *const[]){"--seccomp", "9", NULL});
    add_environment(l, false, job, "/box", "/tmp", cache);
    add_all(l, (const char *const[]){"--chdir", "/box", "--", NULL});
    add_limits(l, job);
}

/* The supervisor, with its parameters in environment variables that the program does not get. */
static void add_supervisor(struct sandbox_line *l, const struct sandbox_job *job, const char *keep,
                           const char *const where[5])
{
    static const char *const name[5] = {"BOX", "OUT", "TREE", "SCENE", "FILTER"};
    add_all(l, (const char *const[]){"env", "-i", NULL});
    add_text(l, "PATH=%s", search_path);
    for (int i = 0; i < 5; i++)
        add_text(l, "%s=%s", name[i], where[i] != NULL ? where[i] : "");
    add_text(l, "KEEP=%s", keep);
    add(l, job->keep_tree ? "KEEP_TREE=1" : "KEEP_TREE=");
    add_text(l, "FILE=%zu", job->limit.file);
    add_text(l, "DISK=%zu", job->limit.disk);
    add_text(l, "PAGE=%ld", sysconf(_SC_PAGESIZE) / 1024);
    add_text(l, "WATCH=%zu", job->limit.memory / 1024);
    add_all(l, (const char *const[]){"/bin/sh", "-c", supervisor, "box", NULL});
}

void sandbox_line_boxed(struct sandbox_line *l, const struct sandbox *s,
                        const struct sandbox_job *job, const char *keep)
{
    if (s->drop)
        add_all(l, (const char *const[]){"setpriv", "--reuid", "65534", "--regid", "65534",
                                         "--clear-groups", "--no-new-privs", NULL});
    add_system(l, s, s->libraries, &job->limit, true);
    add(l, "--size");
    add_text(l, "%zu", job->limit.disk);
    add_all(l, (const char *const[]){"--tmpfs", "/box", "--bind", job->out, "/out", NULL});
    if (job->tree != NULL)
        add_all(l, (const char *const[]){"--ro-bind", job->tree, "/in/tree.tar", NULL});
    if (job->scene != NULL)
        add_all(l, (const char *const[]){"--ro-bind", job->scene, "/in/scene", NULL});
    if (job->cache != NULL)
        add_all(l, (const char *const[]){job->fill_cache ? "--bind" : "--ro-bind", job->cache,
                                         "/cache", NULL});
    if (s->filter[0] != '\0')
        add_all(l, (const char *const[]){"--ro-bind", s->filter, "/in/filter", NULL});
    add_all(l, (const char *const[]){"--remount-ro", "/", "--", NULL});
    add_supervisor(l, job, keep,
                   (const char *const[]){"/box", "/out", job->tree != NULL ? "/in/tree.tar" : NULL,
                                         job->scene != NULL ? "/in/scene" : NULL,
                                         s->filter[0] != '\0' ? "/in/filter" : NULL});
    add_inner(l, s, job);
}

void sandbox_line_bare(struct sandbox_line *l, const struct sandbox_job *job, const char *box,
                       const char *temp)
{
    add_all(l, (const char *const[]){"env", "-i", NULL});
    add_environment(l, true, job, box, temp, job->cache);
    add_limits(l, job);
}
