#define _GNU_SOURCE
#include "process.h"

#include "renderer/base/progress.h"

#include <assert.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

enum {
    POLL_MS = 100,       /* longest sleep between two looks at the child */
    GRACE_S = 2,         /* from SIGTERM to SIGKILL */
    LAST_LINES = 6,      /* quoted in the error line */
    LAST_CHARS = 640,    /* of that at most */
    LOG_MAX = 64 << 20,  /* bytes; a flood must not fill the disk */
    TAIL_SIZE = 16 << 10 /* bytes of output kept in memory */
};

/* The last bytes a program printed. */
struct tail {
    char data[TAIL_SIZE];
    size_t size;
};

bool process_find(const char *argv0, char *path, size_t size)
{
    const char *dirs = getenv("PATH");
    if (strchr(argv0, '/') != NULL || dirs == NULL)
        dirs = "";
    while (*argv0 != '\0') {
        size_t n = strcspn(dirs, ":");
        char cwd[4096] = "", relative[4096];
        int len = strchr(argv0, '/') != NULL || n == 0
                      ? snprintf(relative, sizeof relative, "%s", argv0)
                      : snprintf(relative, sizeof relative, "%.*s/%s", (int)n, dirs, argv0);
        if (len < 0 || (size_t)len >= sizeof relative)
            return false;
        if (relative[0] != '/' && getcwd(cwd, sizeof cwd) == NULL)
            return false;
        len = snprintf(path, size, "%s%s%s", cwd, relative[0] == '/' ? "" : "/", relative);
        struct stat st;
        if (len > 0 && (size_t)len < size && stat(path, &st) == 0 && S_ISREG(st.st_mode) &&
            access(path, X_OK) == 0)
            return true;
        if (dirs[n] == '\0')
            return false;
        dirs += n + 1;
    }
    return false;
}

bool process_find_or_say(const char *argv0, char *path, size_t size, struct err *e)
{
    struct stat st;
    const bool is_path = strchr(argv0, '/') != NULL;
    if (process_find(argv0, path, size))
        return true;
    if (is_path && stat(argv0, &st) == 0 && S_ISREG(st.st_mode))
        return err_set(e, "%s: is not executable (chmod +x)", argv0);
    return err_set(e, "%s: no such program%s", argv0, is_path ? "" : " in PATH");
}

/* ThreadSanitizer would attribute the accesses of a process that shares our memory to us. */
#ifdef __SANITIZE_THREAD__
#define IN_OUR_MEMORY 0
#else
#define IN_OUR_MEMORY CLONE_VM
#endif

/* The guard is a process that leads the process group. If its parent dies, even by SIGKILL, the kernel sends the guard
 * SIGUSR1, and the guard kills the group. It also keeps the group's id from being reused until we have killed the group.
 * It shares our memory, as a copy takes longer the more we have, and with it our thread's errno, which only calls that
 * fail write: the one that waits fails where the group is stopped and goes on. */
__attribute__((no_sanitize("address"))) static int guard_main(void *parent)
{
    sigset_t wake;
    if (setpgid(0, 0) != 0)
        _exit(1);
    close_range(0, ~0U, 0);
    prctl(PR_SET_PDEATHSIG, SIGUSR1);
    sigemptyset(&wake);
    sigaddset(&wake, SIGUSR1);
    while (getppid() == *(const pid_t *)parent &&
           syscall(SYS_rt_sigtimedwait, &wake, NULL, NULL, _NSIG / 8) < 0)
        ;
    kill(0, SIGKILL);
    _exit(1);
}

/* The arguments of child_main(); if exec fails, errno is written to the pipe `status`. */
struct child {
    const struct process *p;
    const char *path;
    pid_t group;
    int out, status;
};

/* The child until exec. It may share our memory, in which AddressSanitizer would track frames that never return. */
__attribute__((no_sanitize("address"))) static int child_main(void *arg)
{
    const struct child *c = arg;
    const struct process *p = c->p;
    static const int reset[] = {SIGINT, SIGQUIT, SIGTERM, SIGHUP, SIGPIPE, SIGCHLD, SIGUSR1};
    for (size_t i = 0; i < sizeof reset / sizeof *reset; i++)
        signal(reset[i], SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
    /* Where memory runs out, the kernel kills all processes that share ours: the guard, too. */
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    /* Move the descriptors above 2 first: the parent may have been started with stdin, stdout or stderr closed. */
    const int status = fcntl(c->status, F_DUPFD_CLOEXEC, 3),
              out = fcntl(c->out, F_DUPFD_CLOEXEC, 3);
    int null = fcntl(open("/dev/null", O_RDONLY | O_CLOEXEC), F_DUPFD_CLOEXEC, 3);
    if (setpgid(0, c->group) == 0 && dup2(null, 0) >= 0 && dup2(out, 1) >= 0 && dup2(out, 2) >= 0 &&
        (p->cwd == NULL || chdir(p->cwd) == 0) && (p->before == NULL || p->before(p->before_ctx)))
        execv(c->path, (char *const *)p->argv);
    int saved = errno;
    ssize_t ignored = write(status, &saved, sizeof saved);
    (void)ignored;
    _exit(127);
}

/* clone() with all signals blocked, so that no signal handler of ours runs in the new process. */
static pid_t clone_blocked(int (*main)(void *), void *arg, char *stack_end, int flags)
{
    sigset_t all, old;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &old);
    const pid_t pid = clone(main, stack_end, SIGCHLD | flags, arg);
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    return pid;
}

/* Shares our memory until exec; not with p->before, which might change that memory. */
static pid_t start_child(struct child *c)
{
    _Alignas(64) char stack[1 << 16];
    return clone_blocked(child_main, c, stack + sizeof stack,
                         c->p->before == NULL ? IN_OUR_MEMORY | CLONE_VFORK : 0);
}

static void close_if_open(int *fd)
{
    if (*fd >= 0)
        close(*fd);
    *fd = -1;
}

static pid_t wait_for(pid_t pid, int *status, int flags, struct rusage *usage)
{
    pid_t r;
    do
        r = wait4(pid, status, flags, usage);
    while (r < 0 && errno == EINTR);
    return r;
}

static void tail_add(struct tail *t, const char *data, size_t n)
{
    if (n > TAIL_SIZE) {
        data += n - TAIL_SIZE;
        n = TAIL_SIZE;
    }
    size_t keep = t->size + n > TAIL_SIZE ? TAIL_SIZE - n : t->size;
    memmove(t->data, t->data + t->size - keep, keep);
    memcpy(t->data + keep, data, n);
    t->size = keep + n;
}

/* The last non-empty lines joined by " | ", at most LAST_CHARS characters of printable ASCII:
 * the line goes to terminals, JSON and XML. */
static void tail_quote(const struct tail *t, char out[LAST_CHARS + 8])
{
    size_t begin = t->size;
    for (int lines = 0; begin > 0; begin--) {
        bool ends = t->data[begin - 1] == '\n';
        if (ends && begin < t->size && t->data[begin] != '\n' && ++lines == LAST_LINES)
            break;
    }
    char joined[3 * TAIL_SIZE + 1];
    size_t n = 0;
    bool fresh = false;
    for (size_t i = begin; i < t->size; i++) {
        char c = t->data[i];
        if (c == '\n') {
            fresh = n > 0;
            continue;
        }
        if (fresh) {
            memcpy(joined + n, " | ", 3);
            n += 3;
            fresh = false;
        }
        joined[n++] = c >= ' ' && c <= '~' ? c : c == '\t' || c == '\r' ? ' ' : '?';
    }
    joined[n] = '\0';
    size_t skip = n > LAST_CHARS ? n - LAST_CHARS : 0, dots = skip > 0 ? 3 : 0;
    memcpy(out, "...", dots);
    memcpy(out + dots, joined + skip, n - skip + 1);
}

/* A running program as the loop below sees it. */
struct run {
    pid_t parent, guard, child;
    _Alignas(64) char guard_stack[1 << 14];
    int out, log, end; /* -1: closed; end: readable when the child has ended */
    size_t logged, log_most;
    bool log_full, clean;
    int log_errno; /* of the first failed write */
    struct tail tail;
};

static void write_all(struct run *r, const char *data, size_t n)
{
    while (n > 0 && r->log_errno == 0) {
        ssize_t w = write(r->log, data, n);
        if (w < 0 && errno != EINTR)
            r->log_errno = errno;
        if (w > 0) {
            data += w;
            n -= (size_t)w;
        }
    }
}

static void log_write(struct run *r, const char *data, size_t n)
{
    static const char full[] = "\n[more output than this log may hold]\n";
    size_t room = r->log_most - r->logged;
    if (r->log < 0 || r->log_full)
        return;
    write_all(r, data, n < room ? n : room);
    r->logged += n < room ? n : room;
    r->log_full = n > room;
    if (r->log_full)
        write_all(r, full, sizeof full - 1);
}

/* Replaces control characters except newline and tab by '?'; a carriage return becomes a newline. UTF-8 bytes stay. */
static void hide_controls(char *text, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        unsigned char c = (unsigned char)text[i];
        text[i] = c == '\r'                                         ? '\n'
                  : (c < ' ' && c != '\n' && c != '\t') || c == 127 ? '?'
                                                                    : text[i];
    }
}

/* Reads what the pipe holds, at most about 1 MiB per call, so that a flood of output cannot delay the time limit. */
static void drain(struct run *r)
{
    char buffer[1 << 16];
    for (int i = 0; i < 16 && r->out >= 0; i++) {
        ssize_t n = read(r->out, buffer, sizeof buffer);
        if (n > 0) {
            if (r->clean)
                hide_controls(buffer, (size_t)n);
            tail_add(&r->tail, buffer, (size_t)n);
            log_write(r, buffer, (size_t)n);
        } else if (n == 0) {
            close_if_open(&r->out);
        } else if (errno != EINTR) {
            return;
        }
    }
}

/* Starts the guard before the child, so that the child never runs unguarded. */
static bool start(const struct process *p, const char *path, struct run *r, struct err *e)
{
    int out[2] = {-1, -1}, status[2] = {-1, -1};
    r->parent = getpid();
    r->guard = clone_blocked(guard_main, &r->parent, r->guard_stack + sizeof r->guard_stack,
                             IN_OUR_MEMORY);
    if (r->guard < 0)
        return err_set(e, "%s: cannot fork: %s", p->argv[0], strerror(errno));
    setpgid(r->guard, r->guard);
    if (pipe2(out, O_CLOEXEC) != 0 || pipe2(status, O_CLOEXEC) != 0) {
        err_set(e, "%s: cannot make a pipe: %s", p->argv[0], strerror(errno));
        goto fail;
    }
    r->child = start_child(&(struct child){p, path, r->guard, out[1], status[1]});
    if (r->child < 0) {
        err_set(e, "%s: cannot fork: %s", p->argv[0], strerror(errno));
        goto fail;
    }
    close_if_open(&out[1]);
    close_if_open(&status[1]);
    int failure = 0;
    ssize_t n;
    do
        n = read(status[0], &failure, sizeof failure);
    while (n < 0 && errno == EINTR);
    if (n != 0) {
        wait_for(r->child, &(int){0}, 0, NULL);
        err_set(e, "%s: cannot run: %s%s", p->argv[0], strerror(failure),
                failure == ENOENT ? ": what its first line names (is there a Windows line end?)"
                                  : "");
        goto fail;
    }
    close_if_open(&status[0]);
    r->out = out[0];
    fcntl(r->out, F_SETFL, O_NONBLOCK);
    r->end = (int)syscall(SYS_pidfd_open, r->child, 0);
    return true;
fail:
    for (int i = 0; i < 2; i++) {
        close_if_open(&out[i]);
        close_if_open(&status[i]);
    }
    kill(-r->guard, SIGKILL);
    wait_for(r->guard, &(int){0}, 0, NULL);
    return false;
}

/* Waits until the child has ended, enforcing the time limit; true if that was reached. */
static bool watch(const struct process *p, struct run *r, double t0, int *status,
                  struct rusage *usage)
{
    bool late = false;
    double kill_at = 0, ticked = t0;
    for (;;) {
        struct pollfd fds[] = {{.fd = r->out, .events = POLLIN}, {.fd = r->end, .events = POLLIN}};
        poll(fds, 2, r->out >= 0 || r->end >= 0 ? POLL_MS : POLL_MS / 10);
        drain(r);
        if (wait_for(r->child, status, WNOHANG, usage) == r->child)
            return late;
        double t = progress_seconds();
        if (!late && p->timeout_s > 0 && t - t0 >= p->timeout_s) {
            late = true;
            kill_at = t + GRACE_S;
            kill(-r->guard, SIGTERM);
        } else if (late && t >= kill_at) {
            kill(-r->guard, SIGKILL);
        }
        if (p->tick != NULL && t - ticked >= 1e-3 * POLL_MS) {
            ticked = t;
            p->tick(p->tick_ctx);
        }
    }
}

bool process_run(const struct process *p, struct process_usage *usage, struct err *e)
{
    assert(p->argv != NULL && p->argv[0] != NULL && p->timeout_s >= 0);
    char path[4096];
    if (!process_find_or_say(p->argv[0], path, sizeof path, e))
        return false;
    struct run r = {.out = -1,
                    .log = -1,
                    .end = -1,
                    .clean = p->log_most > 0,
                    .log_most = p->log_most > 0 ? p->log_most : (size_t)LOG_MAX};
    if (p->log != NULL &&
        (r.log = open(p->log, O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0666)) < 0)
        return err_set(e, "%s: cannot write: %s", p->log, strerror(errno));
    double t0 = progress_seconds();
    if (!start(p, path, &r, e)) {
        close_if_open(&r.log);
        return false;
    }
    int status = 0;
    struct rusage ru = {0};
    bool late = watch(p, &r, t0, &status, &ru);
    kill(-r.guard, SIGKILL);
    wait_for(r.guard, &(int){0}, 0, NULL);
    drain(&r);
    close_if_open(&r.out);
    close_if_open(&r.end);
    if (r.log >= 0 && close(r.log) != 0 && r.log_errno == 0)
        r.log_errno = errno;
    double wall = progress_seconds() - t0;
    if (usage != NULL)
        *usage = (struct process_usage){
            .wall_s = wall,
            .exit_status = late || WIFSIGNALED(status) ? -1 : WEXITSTATUS(status),
            .signal = !late && WIFSIGNALED(status) ? WTERMSIG(status) : 0,
            .cpu_s = (double)(ru.ru_utime.tv_sec + ru.ru_stime.tv_sec) +
                     1e-6 * (double)(ru.ru_utime.tv_usec + ru.ru_stime.tv_usec)};

    char last[LAST_CHARS + 8];
    tail_quote(&r.tail, last);
    const char *sep = last[0] != '\0' ? ": " : "";
    if (late)
        return err_set(e, "%s: no end after %g s%s%s", p->argv[0], p->timeout_s, sep, last);
    if (WIFSIGNALED(status))
        return err_set(e, "%s: killed by signal %d (%s)%s%s", p->argv[0], WTERMSIG(status),
                       strsignal(WTERMSIG(status)), sep, last);
    if (WEXITSTATUS(status) != 0)
        return err_set(e, "%s: exit status %d%s%s", p->argv[0], WEXITSTATUS(status), sep, last);
    if (r.log_errno != 0)
        return err_set(e, "%s: cannot write: %s", p->log, strerror(r.log_errno));
    return true;
}
