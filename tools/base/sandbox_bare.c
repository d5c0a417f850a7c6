/* Runs a program where namespaces are forbidden: a user of its own, seccomp, Landlock. */
#define _GNU_SOURCE
#include "confine.h"
#include "run_user.h"
#include "sandbox_internal.h"

#include "reference/base/process.h"
#include "renderer/base/fs.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

enum { OURS_S = 120 /* time limit of what we run as the program's user */, ROOM = 1 << 20 };

/* One run. The program's user owns only box and temp, not the directory that contains them, so that it cannot replace
 * them; its group may pass through that directory. */
struct bare {
    const struct sandbox *s;
    const struct sandbox_job *job;
    struct run_user user; /* id 0: we are not root */
    struct path dir, box, temp;
    bool made_dir;
    struct confine c;
};

static bool give(const struct bare *b, const char *path, struct err *e)
{
    return (mkdir(path, 0700) == 0 &&
            (b->user.id == 0 || chown(path, b->user.id, b->user.id) == 0)) ||
           err_set(e, "%s: %s", path, strerror(errno));
}

static bool make_dirs(struct bare *b, struct err *e)
{
    const char *tree = b->job->tree;
    if (tree == NULL) {
        b->dir = fs_path("%s/run.XXXXXX", b->s->dir.path);
        if (mkdtemp(b->dir.s) == NULL)
            return err_set(e, "%s: %s", b->dir.s, strerror(errno));
        b->made_dir = true;
    } else {
        b->dir = fs_path("%.*s", (int)(fs_base(tree) - tree), tree);
    }
    b->box = fs_path("%s/box", b->dir.s);
    b->temp = fs_path("%s/box.tmp", b->dir.s);
    if (b->user.id != 0 && (chown(b->dir.s, 0, b->user.id) != 0 || chmod(b->dir.s, 0710) != 0))
        return err_set(e, "%s: %s", b->dir.s, strerror(errno));
    return fs_remove_tree(b->box.s, e) && fs_remove_tree(b->temp.s, e) && give(b, b->box.s, e) &&
           give(b, b->temp.s, e) && (!b->job->fill_cache || fs_make_dirs(b->job->cache, e)) &&
           (!b->job->fill_cache || b->user.id == 0 ||
            chown(b->job->cache, b->user.id, b->user.id) == 0 ||
            err_set(e, "%s: %s", b->job->cache, strerror(errno)));
}

/* What the program sees of the machine: as in a sandbox, but all of /usr except what is hidden. */
static bool show_files(struct bare *b, struct err *e)
{
    const char *hidden[sizeof b->s->hidden / sizeof *b->s->hidden + 1] = {NULL};
    const char *cache = b->job->cache;
    for (int i = 0; i < b->s->num_hidden; i++)
        hidden[i] = b->s->hidden[i];
    return confine_files((const char *const[]){"/usr", "/lib", "/lib32", "/lib64", "/bin", "/sbin",
                                               "/etc", "/proc", "/sys/devices/system", b->box.s,
                                               b->job->scene != NULL ? b->job->scene : cache, cache,
                                               NULL},
                         (const char *const[]){b->box.s, b->temp.s, "/dev/null", "/dev/zero",
                                               "/dev/full", "/dev/random", "/dev/urandom",
                                               b->job->fill_cache ? cache : NULL, NULL},
                         hidden, &b->c.files, e);
}

/* Runs a shell as the program's user in the box, for work that would follow the program's links if root did it. word:
 * $1; fsize: limit of a file that it writes; *done: it exited with 0. False only if it could not be started. */
static bool as_user(struct bare *b, const char *script, const char *word, size_t fsize, int in,
                    int out, bool *done, struct err *e)
{
    char limit[48];
    struct process_usage usage = {0};
    struct err why = {""};
    struct confine c = b->c; /* in no group: none is open */
    c.in = in;
    c.out = out;
    snprintf(limit, sizeof limit, "--fsize=%zu", fsize);
    const char *const argv[] = {"prlimit", limit, "--", "sh", "-c", script, "sh", word, NULL};
    const struct process p = {.argv = argv,
                              .cwd = b->box.s,
                              .timeout_s = OURS_S,
                              .before = confine_enter,
                              .before_ctx = &c};
    *done = process_run(&p, &usage, &why);
    return *done || usage.wall_s > 0 || err_set(e, "%.500s", why.msg);
}

/* If the machine's own disk is full, a program's failure says nothing about the program. */
static bool has_room(const struct bare *b, struct err *e)
{
    struct statvfs v;
    return statvfs(b->box.s, &v) != 0 || (double)v.f_bavail * (double)v.f_frsize >= ROOM ||
           err_set(e, "%s: no space left for what programs write", b->s->dir.path);
}

static bool unpack(struct bare *b, struct sandbox_result *r, bool *done, struct err *e)
{
    static const char script[] = "umask 022; tar -xf - || exit 1\n"
                                 "rm -rf ./scene; [ -z \"$1\" ] || exec cp -R -- \"$1\" ./scene";
    static const char no_tree[] = "umask 022; [ -z \"$1\" ] || exec cp -R -- \"$1\" ./scene";
    const struct sandbox_job *job = b->job;
    struct err nothing = {""};
    int in = job->tree != NULL ? open(job->tree, O_RDONLY | O_CLOEXEC) : -1;
    if (job->tree != NULL && in < 0)
        return err_set(e, "%s: %s", job->tree, strerror(errno));
    bool ok = as_user(b, in >= 0 ? script : no_tree, job->scene != NULL ? job->scene : "",
                      job->limit.disk, in, -1, done, e);
    if (in >= 0)
        close(in);
    if (ok && !*done) {
        FILE *log = job->log != NULL ? fopen(job->log, "w") : NULL; /* an empty one */
        ok = has_room(b, e) && (job->log == NULL || (log != NULL && fclose(log) == 0) ||
                                err_set(e, "%s: cannot write: %s", job->log, strerror(errno)));
        sandbox_conclude(job, "unpack", &nothing, r);
    }
    return ok;
}

/* What was handed in under the name of an output is none; in b->box, which may hold links. */
static void remove_old_outputs(const struct bare *b)
{
    int box = open(b->box.s, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    for (const char *const *name = b->job->keep; name != NULL && *name != NULL; name++)
        unlinkat(box, *name, 0);
    close(box);
}

static bool run_program(struct bare *b, struct sandbox_result *r, struct err *e)
{
    struct sandbox_line *l = calloc(1, sizeof *l);
    struct process_usage usage = {0};
    struct err last = {""};
    if (l == NULL)
        return err_set(e, "out of memory");
    sandbox_line_bare(l, b->job, b->box.s, b->temp.s);
    const struct process p = {.argv = l->arg,
                              .cwd = b->box.s,
                              .log = b->job->log,
                              .log_most = SANDBOX_LOG,
                              .timeout_s = b->job->limit.wall_s,
                              .before = confine_enter,
                              .before_ctx = &b->c};
    bool ok = !l->overflow || err_set(e, "%s: the command is too long", b->job->argv[0]);
    memory_group_open(&b->c.group, sandbox_all_memory(&b->job->limit));
    if (ok && !process_run(&p, &usage, &last) && usage.wall_s == 0)
        ok = err_set(e, "%.500s", last.msg);
    if (b->user.id != 0) /* a process left over could change the output */
        ok = run_user_end(&b->user, e) && ok;
    bool no_memory = memory_group_close(&b->c.group);
    free(l);
    r->wall_s = usage.wall_s;
    r->cpu_s = usage.cpu_s;
    r->status = usage.signal > 0 ? 128 + usage.signal : usage.exit_status;
    if (ok)
        sandbox_conclude(b->job,
                         no_memory && r->status != 0 ? "memory"
                         : r->status >= 0            ? "ended"
                                                     : NULL,
                         &last, r);
    return ok && (r->end == SANDBOX_OK || has_room(b, e));
}

/* Copies an output file, at most limit.file + 1 bytes: only a regular file of the program's user; no link, nothing that
 * blocks. */
static bool hand_out(const struct bare *b, const char *name, struct err *e)
{
    char buffer[1 << 16];
    struct stat st;
    int box = open(b->box.s, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    int in = openat(box, name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    const struct path to = fs_path("%s/%s", b->job->out, name);
    bool ok = true, there = in >= 0 && fstat(in, &st) == 0 && S_ISREG(st.st_mode) &&
                            (b->user.id == 0 || st.st_uid == b->user.id);
    int out = there ? open(to.s, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644) : -1;
    size_t left = b->job->limit.file + 1;
    ssize_t n = 0;
    while (out >= 0 && ok && left > 0 &&
           (n = read(in, buffer, left < sizeof buffer ? left : sizeof buffer)) > 0) {
        left -= (size_t)n;
        ok = write(out, buffer, (size_t)n) == n;
    }
    ok = ok && n >= 0 && (!there || out >= 0);
    ok = ok || err_set(e, "%s: cannot write: %s", to.s, strerror(errno));
    if (out >= 0 && close(out) != 0 && ok)
        ok = err_set(e, "%s: cannot write: %s", to.s, strerror(errno));
    if (in >= 0)
        close(in);
    close(box);
    return ok;
}

static bool hand_out_tree(struct bare *b, struct err *e)
{
    const struct path to = fs_path("%s/tree.tar", b->job->out);
    int out = open(to.s, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    bool done = false, ok = out >= 0 || err_set(e, "%s: cannot write: %s", to.s, strerror(errno));
    ok = ok &&
         as_user(b, "rm -rf ./scene; exec tar -cSf - .", "", b->job->limit.disk, -1, out, &done, e);
    if (out >= 0)
        close(out);
    /* Asked first: what is removed makes room. */
    ok = ok && (done || has_room(b, e));
    if (!done) /* it is too large, or there is no room for it */
        unlink(to.s);
    return ok;
}

static bool run_made(struct bare *b, struct sandbox_result *r, struct err *e)
{
    bool done = false;
    if (!unpack(b, r, &done, e) || !done)
        return e->msg[0] == '\0';
    remove_old_outputs(b);
    bool ok = run_program(b, r, e);
    for (const char *const *name = b->job->keep; ok && name != NULL && *name != NULL; name++)
        ok = hand_out(b, *name, e);
    return ok && (!b->job->keep_tree || hand_out_tree(b, e));
}

bool sandbox_run_bare(const struct sandbox *s, const struct sandbox_job *job,
                      struct sandbox_result *out, struct err *e)
{
    struct bare b = {
        .s = s, .job = job, .c = {.in = -1, .out = -1, .files = -1, .group = {.procs = -1}}};
    struct err why = {""};
    if (s->drop && !run_user_take(&b.user, e))
        return false;
    b.c.user = b.user.id;
    bool ok = fs_make_dirs(job->out, &why) && make_dirs(&b, &why) && show_files(&b, &why) &&
              run_made(&b, out, &why);
    if (b.c.files >= 0)
        close(b.c.files);
    struct err left = {""};
    if (s->drop)
        ok = run_user_release(&b.user, &left) && ok;
    ok = (b.box.s[0] == '\0' || fs_remove_tree(b.box.s, &left)) && ok;
    ok = (b.temp.s[0] == '\0' || fs_remove_tree(b.temp.s, &left)) && ok;
    ok = (!b.made_dir || fs_remove_tree(b.dir.s, &left)) && ok;
    if (s->drop && !b.made_dir && b.dir.s[0] != '\0' && chown(b.dir.s, 0, 0) != 0)
        ok = err_set(&left, "%s: %s", b.dir.s, strerror(errno));
    return ok || err_set(e, "%s", why.msg[0] != '\0' ? why.msg : left.msg);
}
