#define _GNU_SOURCE
#include "sandbox_internal.h"

#include "confine.h"
#include "memory_group.h"

#include "reference/base/process.h"
#include "reference/suite/engine_table.h"
#include "renderer/base/fs.h"

#include <assert.h>
#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_PATH = 4096 };

const struct sandbox_limits sandbox_default = {.wall_s = 120,
                                               .cpu_s = 120,
                                               .memory = (size_t)4 << 30,
                                               .disk = (size_t)512 << 20,
                                               .file = (size_t)128 << 20,
                                               .processes = 64};

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

/* The clock ticks that a run had used when the supervisor last looked, removed with the file; 0: unknown. */
static long take_ticks(const char *out)
{
    const struct path path = fs_path("%s/.cpu", out);
    long ticks = 0;
    FILE *f = fopen(path.s, "r");
    for (long t; f != NULL && fscanf(f, "%18ld", &t) == 1;)
        ticks = t > ticks ? t : ticks;
    if (f != NULL)
        fclose(f);
    unlink(path.s);
    return ticks;
}

/* How the run ended, from the supervisor's report or, without one, from its time. A report written while the whole run
 * was being killed does not count: the program may have failed because its log was gone. no_memory: the kernel killed a
 * process for memory. */
static void read_report(const char *out, const struct sandbox_job *job, bool killed, bool no_memory,
                        const struct err *last, struct sandbox_result *r)
{
    const struct path report = fs_path("%s/.report", out), memory = fs_path("%s/.memory", out);
    char word[16] = "";
    FILE *f = fopen(report.s, "r");
    const long seen = take_ticks(out);
    long ticks = 0;
    bool known = f != NULL && fscanf(f, "%9d %15s %18ld", &r->status, word, &ticks) >= 2 && !killed;
    if (!known)
        ticks = seen;
    if (ticks > 0)
        r->cpu_s = (double)ticks / (double)sysconf(_SC_CLK_TCK);
    if (f != NULL)
        fclose(f);
    unlink(report.s);
    unlink(memory.s);
    if (no_memory && (!known || r->status != 0))
        sandbox_conclude(job, "memory", last, r);
    else
        sandbox_conclude(job, known ? word : NULL, last, r);
}

/* Removes output files that are too large. */
static void drop_large(const char *out, const struct sandbox_job *job)
{
    const struct path tree = fs_path("%s/tree.tar", out);
    struct stat st;
    for (const char *const *name = job->keep; name != NULL && *name != NULL; name++) {
        const struct path path = fs_path("%s/%s", out, *name);
        if (lstat(path.s, &st) == 0 && (size_t)st.st_size > job->limit.file)
            unlink(path.s);
    }
    if (job->keep_tree && lstat(tree.s, &st) == 0 && (size_t)st.st_size > job->limit.disk)
        unlink(tree.s);
}

/* Makes a directory that programs in the sandbox may write to. */
static bool make_dir_for(const struct sandbox *s, const char *dir, struct err *e)
{
    if (!fs_make_dirs(dir, e))
        return false;
    if (s->drop && chown(dir, SANDBOX_NOBODY, SANDBOX_NOBODY) != 0)
        return err_set(e, "%s: cannot give it to nobody: %s", dir, strerror(errno));
    return true;
}

static bool run_boxed(const struct sandbox *s, const struct sandbox_job *job,
                      struct sandbox_result *out, struct err *e)
{
    char keep[MAX_PATH];
    struct sandbox_line *l = calloc(1, sizeof *l);
    bool ok = (l != NULL || err_set(e, "out of memory")) &&
              join_names(job->keep, keep, sizeof keep, e) && make_dir_for(s, job->out, e) &&
              (!job->fill_cache || make_dir_for(s, job->cache, e));
    if (ok) {
        sandbox_line_boxed(l, s, job, keep);
        ok = !l->overflow || err_set(e, "%s: the command is too long", job->argv[0]);
    }
    if (ok) {
        struct process_usage usage = {0};
        struct memory_group group;
        struct err last = {""};
        const struct process p = {.argv = l->arg,
                                  .log = job->log,
                                  .log_most = SANDBOX_LOG,
                                  .timeout_s = job->limit.wall_s,
                                  .before = memory_group_enter,
                                  .before_ctx = &group};
        memory_group_open(&group, sandbox_all_memory(&job->limit));
        if (!process_run(&p, &usage, &last) && usage.wall_s == 0)
            ok = err_set(e, "%.500s", last.msg);
        bool no_memory = memory_group_close(&group);
        out->wall_s = usage.wall_s;
        out->cpu_s = usage.cpu_s;
        if (ok)
            read_report(job->out, job, usage.exit_status < 0, no_memory, &last, out);
        drop_large(job->out, job);
    }
    free(l);
    return ok;
}

bool sandbox_run(const struct sandbox *s, const struct sandbox_job *job, struct sandbox_result *out,
                 struct err *e)
{
    *out = (struct sandbox_result){.end = SANDBOX_OK};
    return s->unsafe ? sandbox_run_bare(s, job, out, e) : run_boxed(s, job, out, e);
}

/* Writes the system call filter to a file for bwrap; to none if the kernel has no seccomp. */
static bool write_filter(struct sandbox *s, struct err *e)
{
    unsigned char filter[CONFINE_FILTER];
    size_t size = confine_filter(false, filter);
    if (size == 0)
        return true;
    snprintf(s->filter, sizeof s->filter, "%s/filter", s->dir.path);
    FILE *f = fopen(s->filter, "wb");
    bool ok = f != NULL && fwrite(filter, 1, size, f) == size && fchmod(fileno(f), 0644) == 0;
    if (f != NULL && fclose(f) != 0)
        ok = false;
    return ok || err_set(e, "%s: cannot write: %s", s->filter, strerror(errno));
}

/* Copies the loader's list of libraries: ldconfig(8), run by whoever installs something meanwhile, replaces the file,
 * and bwrap cannot mount one that is replaced. */
static bool copy_libraries(struct sandbox *s, struct err *e)
{
    static const char list[] = "/etc/ld.so.cache";
    snprintf(s->libraries, sizeof s->libraries, "%s/libraries", s->dir.path);
    return access(list, F_OK) != 0 || fs_copy(list, s->libraries, e);
}

static bool is_below(const char *path, const char *dir)
{
    size_t n = strlen(dir);
    return strncmp(path, dir, n) == 0 && (path[n] == '/' || path[n] == '\0');
}

/* Hides a path below /usr; fails for folders that programs and builds need. A path in a hidden folder takes no entry of its own. */
static bool hide(struct sandbox *s, const char *path, struct err *e)
{
    static const char *const parts[] = {"bin",  "include", "lib",     "lib32",     "lib64",
                                        "sbin", "local",   "libexec", "local/bin", "local/lib"};
    const int most = (int)(sizeof s->hidden / sizeof *s->hidden);
    char real[PATH_MAX];
    if (realpath(path, real) == NULL || strncmp(real, "/usr/", 5) != 0)
        return true;
    int kept = 0;
    for (int i = 0; i < s->num_hidden; i++) {
        if (is_below(real, s->hidden[i]))
            return true;
        if (is_below(s->hidden[i], real))
            continue;
        if (kept != i)
            strcpy(s->hidden[kept], s->hidden[i]);
        kept++;
    }
    s->num_hidden = kept;
    bool needed = false;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        needed = needed || strcmp(real + 5, parts[i]) == 0;
    if (needed || strlen(real) >= sizeof *s->hidden || kept == most)
        return err_set(e, "%s: cannot be hidden from programs", real);
    strcpy(s->hidden[s->num_hidden++], real);
    return true;
}

/* Hides what a program could call instead of rendering itself: ours, and other renderers by their installed names. */
static bool hide_renderers(struct sandbox *s, struct err *e)
{
    static const char *const dirs[] = {"/usr/bin", "/usr/local/bin", "/usr/games"};
    static const char *const names[] = {"assay", "pathtracer", ENGINES(ENGINE_PROGRAM)};
    bool ok = hide(s, "/proc/self/exe", e);
    for (size_t i = 0; i < sizeof dirs / sizeof *dirs; i++)
        for (size_t k = 0; ok && k < sizeof names / sizeof *names; k++)
            ok = hide(s, fs_path("%s/%s", dirs[i], names[k]).s, e);
    return ok;
}

bool sandbox_open(bool unsafe, const char *const *hidden, struct sandbox *out, struct err *e)
{
    *out = (struct sandbox){.unsafe = unsafe, .drop = geteuid() == 0};
    for (; hidden != NULL && *hidden != NULL; hidden++)
        if (!hide(out, *hidden, e))
            return false;
    if (!hide_renderers(out, e))
        return false;
    if (!temp_dir_open(&out->dir, "sandbox", e))
        return false;
    const struct path scene = fs_path("%s/probe-scene", out->dir.path);
    /* Without namespaces, programs may pass through this directory to their own files, but not list it. */
    chmod(out->dir.path, unsafe && out->drop ? 0711 : 0755);
    if (!write_filter(out, e) || !copy_libraries(out, e) || !fs_make_dirs(scene.s, e)) {
        sandbox_close(out);
        return false;
    }
    chmod(scene.s, 0755); /* whatever the umask */
    const struct path probe = fs_path("%s/probe", out->dir.path);
    struct sandbox_result r = {0};
    const struct sandbox_job job = {.argv = (const char *const[]){"true", NULL},
                                    .scene = scene.s,
                                    .out = probe.s,
                                    .limit = sandbox_default};
    struct err why = {""};
    if (sandbox_run(out, &job, &r, &why) && r.end == SANDBOX_OK)
        return true;
    const struct path temp =
        fs_path("%.*s", (int)(fs_base(out->dir.path) - out->dir.path), out->dir.path);
    sandbox_close(out);
    if (unsafe)
        return err_set(
            e, "no program can be run in %s (TMPDIR; must all users be able to pass it?): %s",
            temp.s, why.msg[0] != '\0' ? why.msg : r.why);
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

bool sandbox_pack(const char *path, const char *tar, size_t most, bool *too_large, struct err *e)
{
    *too_large = false;
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
    const struct process p = {
        .argv = (const char *const[]){"prlimit", limit, "--", "tar", "-C", parent, "--mode=u+rwX",
                                      "--sort=name", "--owner=0", "--group=0", "--numeric-owner",
                                      "-cSf", tar, "--", name, NULL},
        .timeout_s = 120};
    struct process_usage usage = {0};
    struct err why;
    if (process_run(&p, &usage, &why))
        return chmod(tar, 0644) == 0 || err_set(e, "%s: %s", tar, strerror(errno));
    unlink(tar);
    *too_large = usage.signal == SIGXFSZ;
    if (*too_large)
        return err_set(e, "%s: cannot be packed into %zu MiB", path, most >> 20);
    return err_set(e, "%s: cannot be packed: %.400s", path, why.msg);
}
