#define _GNU_SOURCE
#include "sandbox.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"

#include <assert.h>
#include <errno.h>
#include <glob.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_ARGS = 512, TEXT = 16 << 10, NOBODY = 65534, ALSO_NOBODY = 65533, MAX_PATH = 4096 };

const struct sandbox_limits sandbox_default = {.wall_s = 120,
                                               .cpu_s = 120,
                                               .memory = (size_t)4 << 30,
                                               .disk = (size_t)512 << 20,
                                               .file = (size_t)128 << 20,
                                               .processes = 64};

const char *const sandbox_end_name[] = {
    [SANDBOX_OK] = "ok",          [SANDBOX_FAILED] = "failed",
    [SANDBOX_WALL] = "wall time", [SANDBOX_CPU] = "processor time",
    [SANDBOX_MEMORY] = "memory",  [SANDBOX_FILE_SIZE] = "file size",
    [SANDBOX_DISK] = "disk full", [SANDBOX_UNPACK] = "cannot be unpacked",
    [SANDBOX_LOST] = "lost",
};

/* Around the program; its arguments are the command that runs it. What it reports goes to a file that the
 * program cannot see. AS: "" or what runs the program as somebody else, where there is no machine around it. TREE, SCENE, KEEP_TREE: "" or not; WATCH: KiB, "" where other people's processes are
 * visible. bwrap does not wait for the process that it starts, so the program's processor time is found with
 * the one that inherits it, number 1 of the outer machine: cutime and cstime, fields 16 and 17 of its stat. */
static const char supervisor[] =
    "set -u\n"
    "umask 022\n"
    "cd \"$BOX\" || exit 125\n"
    "if [ -n \"$TREE\" ] && ! tar -xf \"$TREE\"; then echo '125 unpack' >\"$OUT/.report\"; exit 125; fi\n"
    "[ -z \"$AS\" ] || chown -hR 65533:65533 .\n"
    "rm -rf ./scene\n"
    "if [ -n \"$SCENE\" ] && ! cp -R \"$SCENE\" ./scene; then echo '125 unpack' >\"$OUT/.report\"; exit 125; fi\n"
    "$AS \"$@\" &\n"
    "pid=$!\n"
    "if [ -n \"$WATCH\" ]; then\n"
    "  while sleep 0.2; do\n"
    "    used=$(cat /proc/[0-9]*/statm 2>/dev/null | awk -v page=\"$PAGE\" '{ s += $2 } END { printf \"%d\", s * page }')\n"
    "    [ \"${used:-0}\" -le \"$WATCH\" ] || { : >\"$OUT/.memory\"; kill -9 $pid; exit; }\n"
    "  done &\n"
    "  watch=$!\n"
    "fi\n"
    "wait $pid\n"
    "status=$? word=ended\n"
    "[ -z \"$WATCH\" ] || kill $watch 2>/dev/null\n"
    "[ ! -e \"$OUT/.memory\" ] || word=memory\n"
    "if [ $status -ne 0 ] && [ $word = ended ] && [ \"$(df --output=avail . | tail -n 1)\" -eq 0 ]; then word=disk; fi\n"
    "for name in $KEEP; do\n"
    "  [ ! -f \"$name\" ] || [ -L \"$name\" ] || $AS head -c $((FILE + 1)) \"./$name\" >\"$OUT/$name\"\n"
    "done\n"
    "cpu=0\n"
    "if [ -n \"$WATCH\" ]; then\n"
    "  i=0\n"
    "  while [ $i -lt 40 ] && grep -qsE '^NSpid:.*[0-9]\\s+[0-9]' /proc/[0-9]*/status; do sleep 0.05; i=$((i + 1)); done\n"
    "  read -r stat </proc/1/stat && set -- ${stat##*)} && cpu=$((${14} + ${15}))\n"
    "fi\n"
    "rm -rf ./scene\n"
    "[ -z \"$KEEP_TREE\" ] || $AS tar -cSf - . | head -c $((DISK + 1)) >\"$OUT/tree.tar\"\n"
    "echo \"$status $word $cpu\" >\"$OUT/.report\"\n"
    "exit $status\n";

/* A command line under construction. Texts that are made for it live in `text`. */
struct line {
    const char *arg[MAX_ARGS];
    int num;
    char text[TEXT];
    size_t used;
    bool overflow;
};

static void add(struct line *l, const char *arg)
{
    if (l->num == MAX_ARGS - 1)
        l->overflow = true;
    else
        l->arg[l->num++] = arg;
}

static void add_all(struct line *l, const char *const *args)
{
    for (; *args != NULL; args++)
        add(l, *args);
}

static void add_text(struct line *l, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void add_text(struct line *l, const char *format, ...)
{
    va_list ap;
    va_start(ap, format);
    int n = vsnprintf(l->text + l->used, TEXT - l->used, format, ap);
    va_end(ap);
    if (n < 0 || (size_t)n >= TEXT - l->used) {
        l->overflow = true;
        return;
    }
    add(l, l->text + l->used);
    l->used += (size_t)n + 1;
}

static const char search_path[] = "/usr/local/bin:/usr/bin:/bin";

/* The program's environment, as bwrap is told it or as env(1) is. box, cache: where the program sees them. */
static void add_environment(struct line *l, const struct sandbox *s, const struct sandbox_job *job,
                            const char *box, const char *cache)
{
    /* Hits must depend neither on where the sources lie nor on when they were unpacked. */
    const char *const variable[][2] = {
        {"PATH", search_path},
        {"HOME", box},
        {"TMPDIR", "/tmp"},
        {"LD_LIBRARY_PATH", job->library},
        {"CCACHE_DIR", cache},
        {"CCACHE_BASEDIR", box},
        {"CCACHE_NOHASHDIR", "1"},
        {"CCACHE_SLOPPINESS", "include_file_ctime,include_file_mtime"},
        {"CCACHE_TEMPDIR", "/tmp"},
        {"CCACHE_UMASK", "022"},
        {"CCACHE_NOSTATS", "1"},
        {job->fill_cache ? "CCACHE_MAXSIZE" : "CCACHE_READONLY", job->fill_cache ? "2G" : "1"},
    };
    for (size_t i = 0; i < sizeof variable / sizeof *variable; i++) {
        const char *name = variable[i][0], *value = variable[i][1];
        if (value == NULL || (cache == NULL && strncmp(name, "CCACHE", 6) == 0))
            continue;
        const char *before = i == 0 && cache != NULL ? "/usr/lib/ccache:/usr/lib64/ccache:" : "";
        if (s->unsafe) {
            add_text(l, "%s=%s%s", name, before, value);
            continue;
        }
        add_all(l, (const char *const[]){"--setenv", name, NULL});
        add_text(l, "%s%s", before, value);
    }
}

/* What a program may need that is no compiler: a shell, and what scripts are made of. */
static const char *const programs[] = {
    "sh",  "bash",  "env", "prlimit", "python3",  "awk",    "basename", "cat",   "chmod", "cp",
    "cut", "date",  "dd",  "dirname", "echo",     "expr",   "false",    "find",  "grep",  "head",
    "id",  "ln",    "ls",  "mkdir",   "mkfifo",   "mktemp", "mv",       "nproc", "od",    "printf",
    "pwd", "rm",    "sed", "seq",     "setsid",   "sleep",  "sort",     "tail",  "tee",   "test",
    "[",   "touch", "tr",  "true",    "truncate", "uname",  "uniq",     "wc",
};

/* All of /usr; or its libraries and `programs`, without what compilers keep among the libraries. Neither another renderer
 * that is installed here nor ours is a part of either's machine: a program might run it. */
static void add_usr(struct line *l, bool tools)
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

/* What both machines have: programs and libraries, no environment, nothing else. */
static void add_system(struct line *l, const struct sandbox *s, const struct sandbox_limits *limit,
                       bool tools)
{
    static const char *const roots[] = {"bin", "sbin", "lib", "lib32", "lib64"};
    static const char *const etc[] = {"/etc/ld.so.cache", "/etc/alternatives"};
    add_all(l,
            (const char *const[]){"bwrap", "--unshare-user", "--unshare-all", "--die-with-parent",
                                  "--new-session", "--clearenv", "--hostname", "box", NULL});
    add_usr(l, tools);
    for (int i = 0; i < s->num_hidden; i++)
        add_all(l, (const char *const[]){"--size", "4096", "--tmpfs", s->hidden[i], "--remount-ro",
                                         s->hidden[i], NULL});
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
    for (size_t i = 0; i < sizeof etc / sizeof *etc; i++)
        add_all(l, (const char *const[]){"--ro-bind-try", etc[i], etc[i], NULL});
    add_all(l, (const char *const[]){"--proc", "/proc", "--dev", "/dev", "--size", NULL});
    add_text(l, "%zu", limit->disk);
    add_all(l, (const char *const[]){"--tmpfs", "/tmp", NULL});
    add_all(l, (const char *const[]){"--setenv", "PATH", search_path, "--setenv", "LANG", "C.UTF-8",
                                     NULL});
}

static void add_limits(struct line *l, const struct sandbox_job *job)
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

static void add_inner(struct line *l, const struct sandbox *s, const struct sandbox_job *job)
{
    const char *cache = job->cache != NULL ? "/cache" : NULL;
    add_system(l, s, &job->limit, job->tools);
    if (cache != NULL)
        add_all(
            l, (const char *const[]){job->fill_cache ? "--bind" : "--ro-bind", cache, cache, NULL});
    add_all(l, (const char *const[]){"--disable-userns", "--bind", "/box", "/box", "--size", NULL});
    add_text(l, "%zu", job->limit.disk);
    add_all(l, (const char *const[]){"--tmpfs", "/dev/shm", "--remount-ro", "/dev", "--remount-ro",
                                     "/", NULL});
    add_environment(l, s, job, "/box", cache);
    add_all(l, (const char *const[]){"--chdir", "/box", "--", NULL});
    add_limits(l, job);
}

/* Not the nobody of sandboxes, whose processes the kernel would count with these. */
static const char as_nobody[] = "setpriv --reuid 65533 --regid 65533 --clear-groups --no-new-privs";

/* The supervisor, with what it is told in variables that the program does not get. */
static void add_supervisor(struct line *l, const struct sandbox *s, const struct sandbox_job *job,
                           const char *keep, const char *const where[4])
{
    static const char *const name[4] = {"BOX", "OUT", "TREE", "SCENE"};
    add_all(l, (const char *const[]){"env", "-i", NULL});
    add_text(l, "PATH=%s", search_path);
    for (int i = 0; i < 4; i++)
        add_text(l, "%s=%s", name[i], where[i] != NULL ? where[i] : "");
    add_text(l, "KEEP=%s", keep);
    add_text(l, "AS=%s", s->unsafe && s->drop ? as_nobody : "");
    add(l, job->keep_tree ? "KEEP_TREE=1" : "KEEP_TREE=");
    add_text(l, "FILE=%zu", job->limit.file);
    add_text(l, "DISK=%zu", job->limit.disk);
    add_text(l, "PAGE=%ld", sysconf(_SC_PAGESIZE) / 1024);
    if (s->unsafe)
        add(l, "WATCH=");
    else
        add_text(l, "WATCH=%zu", job->limit.memory / 1024);
    add_all(l, (const char *const[]){"/bin/sh", "-c", supervisor, "box", NULL});
}

static void compose(struct line *l, const struct sandbox *s, const struct sandbox_job *job,
                    const char *keep, const char *box)
{
    if (s->unsafe) {
        add_supervisor(l, s, job, keep,
                       (const char *const[]){box, job->out, job->tree, job->scene});
        add_all(l, (const char *const[]){"env", "-i", NULL});
        add_environment(l, s, job, box, job->cache);
        add_limits(l, job);
        return;
    }
    if (s->drop)
        add_all(l, (const char *const[]){"setpriv", "--reuid", "65534", "--regid", "65534",
                                         "--clear-groups", "--no-new-privs", NULL});
    add_system(l, s, &job->limit, true);
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
    add_all(l, (const char *const[]){"--remount-ro", "/", "--", NULL});
    add_supervisor(l, s, job, keep,
                   (const char *const[]){"/box", "/out", job->tree != NULL ? "/in/tree.tar" : NULL,
                                         job->scene != NULL ? "/in/scene" : NULL});
    add_inner(l, s, job);
}

static bool join_names(const char *const *keep, char *out, size_t size, struct err *e)
{
    size_t n = 0;
    out[0] = '\0';
    for (; keep != NULL && *keep != NULL; keep++) {
        size_t length = strlen(*keep);
        assert(length > 0 && (*keep)[0] != '.' && (*keep)[0] != '-' &&
               (*keep)[strspn(
                   *keep, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-")] ==
                   '\0');
        if (n + length + 2 > size)
            return err_set(e, "too many files to keep");
        n += (size_t)sprintf(out + n, "%s ", *keep);
    }
    return true;
}

/* What the supervisor says it was; without a word of it, the clock or the machine. */
static void conclude(const char *out, const struct sandbox_job *job, const struct err *last,
                     struct sandbox_result *r)
{
    char path[MAX_PATH], word[16] = "";
    snprintf(path, sizeof path, "%s/.report", out);
    FILE *f = fopen(path, "r");
    long ticks = 0;
    bool known = f != NULL && fscanf(f, "%9d %15s %18ld", &r->status, word, &ticks) >= 2;
    if (ticks > 0)
        r->cpu_s = (double)ticks / (double)sysconf(_SC_CLK_TCK);
    if (f != NULL)
        fclose(f);
    unlink(path);
    snprintf(path, sizeof path, "%s/.memory", out);
    unlink(path);
    int signal = known && r->status > 128 ? r->status - 128 : 0;
    const struct sandbox_limits *l = &job->limit;
    char what[96] = "";
    if (!known) {
        r->end = r->wall_s >= l->wall_s ? SANDBOX_WALL : SANDBOX_LOST;
        snprintf(what, sizeof what,
                 r->end == SANDBOX_WALL ? "no end after %g s"
                                        : "the sandbox was killed (out of memory?)",
                 l->wall_s);
    } else if (strcmp(word, "unpack") == 0) {
        r->end = SANDBOX_UNPACK;
        snprintf(what, sizeof what, "cannot be unpacked into %zu MiB", l->disk >> 20);
    } else if (strcmp(word, "memory") == 0) {
        r->end = SANDBOX_MEMORY;
        snprintf(what, sizeof what, "its processes use more than %zu MiB of memory",
                 l->memory >> 20);
    } else if (signal == SIGXCPU || (signal == SIGKILL && r->cpu_s >= l->cpu_s)) {
        r->end = SANDBOX_CPU;
        snprintf(what, sizeof what, "more than %g s of processor time", l->cpu_s);
    } else if (signal == SIGXFSZ) {
        r->end = SANDBOX_FILE_SIZE;
        snprintf(what, sizeof what, "a file of more than %zu MiB", l->file >> 20);
    } else if (strcmp(word, "disk") == 0) {
        r->end = SANDBOX_DISK;
        snprintf(what, sizeof what, "all %zu MiB of its directory are full", l->disk >> 20);
    } else if (r->status != 0) {
        r->end = SANDBOX_FAILED;
        if (signal > 0)
            snprintf(what, sizeof what, "killed by signal %d (%s)", signal, strsignal(signal));
        else
            snprintf(what, sizeof what, "exit status %d", r->status);
    } else {
        r->end = SANDBOX_OK;
    }
    /* process_run()'s line is "bwrap: exit status 1: last lines". */
    const char *lines = strstr(last->msg, ": ");
    lines = lines != NULL ? strstr(lines + 2, ": ") : NULL;
    if (r->end != SANDBOX_OK)
        snprintf(r->why, sizeof r->why, "%s%.400s", what, lines != NULL ? lines : "");
}

/* Files that are too large are no output. */
static void drop_large(const char *out, const struct sandbox_job *job)
{
    char path[MAX_PATH];
    struct stat st;
    for (const char *const *name = job->keep; name != NULL && *name != NULL; name++) {
        snprintf(path, sizeof path, "%s/%s", out, *name);
        if (lstat(path, &st) == 0 && (size_t)st.st_size > job->limit.file)
            unlink(path);
    }
    snprintf(path, sizeof path, "%s/tree.tar", out);
    if (job->keep_tree && lstat(path, &st) == 0 && (size_t)st.st_size > job->limit.disk)
        unlink(path);
}

/* A directory that what runs in the sandbox may write. */
static bool make_dir_for(const struct sandbox *s, const char *dir, bool program, struct err *e)
{
    unsigned user = s->unsafe ? ALSO_NOBODY : NOBODY;
    if (!fs_make_dirs(dir, e))
        return false;
    if (s->drop && (!s->unsafe || program) && chown(dir, user, user) != 0)
        return err_set(e, "%s: cannot give it to nobody: %s", dir, strerror(errno));
    return true;
}

/* What stands for /box, where nothing but a directory does. */
static bool make_box(const struct sandbox *s, const char *tree, char *box, size_t size,
                     struct err *e)
{
    if (tree == NULL) {
        snprintf(box, size, "%s/box.XXXXXX", s->dir.path);
        if (mkdtemp(box) == NULL)
            return err_set(e, "%s: %s", box, strerror(errno));
    } else {
        const char *slash = strrchr(tree, '/');
        snprintf(box, size, "%.*sbox", slash != NULL ? (int)(slash - tree) + 1 : 0, tree);
        if (!fs_remove_tree(box, e))
            return false;
    }
    return make_dir_for(s, box, true, e);
}

bool sandbox_run(const struct sandbox *s, const struct sandbox_job *job, struct sandbox_result *out,
                 struct err *e)
{
    char keep[4096], box[MAX_PATH] = "";
    struct line *l = calloc(1, sizeof *l);
    bool ok = (l != NULL || err_set(e, "out of memory")) &&
              join_names(job->keep, keep, sizeof keep, e) && make_dir_for(s, job->out, false, e) &&
              (!job->fill_cache || make_dir_for(s, job->cache, true, e)) &&
              (!s->unsafe || make_box(s, job->tree, box, sizeof box, e));
    if (ok) {
        compose(l, s, job, keep, box);
        ok = !l->overflow || err_set(e, "%s: the command is too long", job->argv[0]);
    }
    if (ok) {
        struct process_usage usage = {0};
        struct err last = {""};
        *out = (struct sandbox_result){.end = SANDBOX_OK};
        const struct process p = {.argv = l->arg, .log = job->log, .timeout_s = job->limit.wall_s};
        if (!process_run(&p, &usage, &last) && usage.wall_s == 0)
            ok = err_set(e, "%.500s", last.msg);
        out->wall_s = usage.wall_s;
        out->cpu_s = usage.cpu_s;
        if (ok)
            conclude(job->out, job, &last, out);
        drop_large(job->out, job);
    }
    struct err ignored;
    if (box[0] != '\0' && !fs_remove_tree(box, &ignored))
        ok = ok && err_set(e, "%s", ignored.msg);
    free(l);
    return ok;
}

static bool add_hidden(struct sandbox *s, const char *const *hidden, struct err *e)
{
    for (; hidden != NULL && *hidden != NULL; hidden++) {
        char real[PATH_MAX];
        if (realpath(*hidden, real) == NULL || strncmp(real, "/usr/", 5) != 0)
            continue;
        if (s->num_hidden == (int)(sizeof s->hidden / sizeof *s->hidden) ||
            strlen(real) >= sizeof *s->hidden)
            return err_set(e, "%s: cannot be hidden from programs", real);
        strcpy(s->hidden[s->num_hidden++], real);
    }
    return true;
}

bool sandbox_open(bool unsafe, const char *const *hidden, struct sandbox *out, struct err *e)
{
    *out = (struct sandbox){.unsafe = unsafe, .drop = geteuid() == 0};
    if (!add_hidden(out, hidden, e))
        return false;
    if (!temp_dir_open(&out->dir, "sandbox", e))
        return false;
    chmod(out->dir.path, 0755);
    const struct path probe = fs_path("%s/probe", out->dir.path);
    struct sandbox_result r = {0};
    const struct sandbox_job job = {
        .argv = (const char *const[]){"true", NULL}, .out = probe.s, .limit = sandbox_default};
    struct err why = {""};
    if (unsafe || (sandbox_run(out, &job, &r, &why) && r.end == SANDBOX_OK))
        return true;
    sandbox_close(out);
    return err_set(
        e,
        "no sandbox for other people's programs on this machine: %s (Debian package bubblewrap; user "
        "namespaces must be allowed)",
        why.msg[0] != '\0' ? why.msg : r.why);
}

void sandbox_close(struct sandbox *s)
{
    struct err ignored;
    bool removed = temp_dir_close(&s->dir, &ignored);
    (void)removed; /* what stays is removed by the next run */
}

bool sandbox_pack(const char *path, const char *tar, size_t most, struct err *e)
{
    struct stat st;
    if (stat(path, &st) != 0)
        return err_set(e, "%s: %s", path, strerror(errno));
    char parent[MAX_PATH];
    const char *slash = strrchr(path, '/'), *name = ".";
    if (S_ISDIR(st.st_mode))
        snprintf(parent, sizeof parent, "%s", path);
    else {
        name = slash != NULL ? slash + 1 : path;
        snprintf(parent, sizeof parent, "%.*s", slash != NULL ? (int)(slash - path) + 1 : 2,
                 slash != NULL ? path : "./");
    }
    char limit[64];
    snprintf(limit, sizeof limit, "--fsize=%zu", most);
    const char *const argv[] = {"prlimit",
                                limit,
                                "--",
                                "tar",
                                "-C",
                                parent,
                                "--mode=u+rwX",
                                "--sort=name",
                                "--owner=0",
                                "--group=0",
                                "--numeric-owner",
                                "-cSf",
                                tar,
                                "--",
                                name,
                                NULL};
    const struct process p = {.argv = argv, .timeout_s = 120};
    struct err why;
    if (process_run(&p, NULL, &why))
        return chmod(tar, 0644) == 0 || err_set(e, "%s: %s", tar, strerror(errno));
    unlink(tar);
    return err_set(e, "%s: cannot be packed into %zu MiB: %.400s", path, most >> 20, why.msg);
}
