#define _GNU_SOURCE
#include "run_user.h"

#include "renderer/base/fs.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ipc.h>
#include <sys/msg.h>
#include <sys/random.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

enum { FIRST = 60578, NUM = 61184 - FIRST, TRIES = 500, WAIT_US = 10000 };

static const char lock_dir[] = "/run/assay-users";

/* Does any process run as this user? Zombies do not count: in a container they may never be reaped. */
static bool has_processes(unsigned id)
{
    DIR *d = opendir("/proc");
    bool found = d == NULL; /* not known: assume so */
    struct dirent *entry;
    while (d != NULL && !found && (entry = readdir(d)) != NULL) {
        char line[256];
        unsigned real = 0, effective = 0, saved = 0;
        FILE *f = isdigit((unsigned char)entry->d_name[0])
                      ? fopen(fs_path("/proc/%s/status", entry->d_name).s, "r")
                      : NULL;
        char state = ' ';
        while (f != NULL && fgets(line, sizeof line, f) != NULL && strncmp(line, "Gid:", 4) != 0) {
            if (strncmp(line, "State:", 6) == 0)
                sscanf(line + 6, " %c", &state);
            if (strncmp(line, "Uid:", 4) == 0)
                sscanf(line + 4, "%10u %10u %10u", &real, &effective, &saved);
        }
        if (f != NULL)
            fclose(f);
        found = state != 'Z' && (real == id || effective == id || saved == id);
    }
    if (d != NULL)
        closedir(d);
    return found;
}

/* In a child that becomes this user: kill(2) with -1 reaches all processes that it may signal at once, which a fork
 * bomb cannot outrun. Only async-signal-safe calls, as there may be threads; the C library's setresuid() would signal
 * these. */
static void kill_all(unsigned id)
{
    int status;
    pid_t pid = fork();
    if (pid == 0) {
        if (syscall(SYS_setgroups, 0, NULL) == 0 && syscall(SYS_setresgid, id, id, id) == 0 &&
            syscall(SYS_setresuid, id, id, id) == 0)
            kill(-1, SIGKILL);
        _exit(0);
    }
    while (pid > 0 && waitpid(pid, &status, 0) < 0 && errno == EINTR)
        ;
}

bool run_user_end(const struct run_user *u, struct err *e)
{
    for (int i = 0; i < TRIES; i++) {
        kill_all(u->id);
        if (!has_processes(u->id))
            return true;
        usleep(WAIT_US);
    }
    return err_set(e, "processes of user %u do not end", u->id);
}

static void remove_objects(unsigned id)
{
    static const char *const kinds[] = {"shm", "sem", "msg"};
    for (int kind = 0; kind < 3; kind++) {
        char line[512];
        FILE *f = fopen(fs_path("/proc/sysvipc/%s", kinds[kind]).s, "r");
        char *end = f != NULL ? fgets(line, sizeof line, f) : NULL; /* skip the header */
        while (end != NULL && (end = fgets(line, sizeof line, f)) != NULL) {
            /* key id perms, then columns of each kind's own, uid, gid, cuid */
            static const int skip[] = {4, 1, 4};
            unsigned owner = 0, creator = 0;
            int object = -1, at = 0;
            if (sscanf(line, "%*d %10d %*o%n", &object, &at) != 1)
                continue;
            char *rest = line + at;
            for (int i = 0; i < skip[kind]; i++)
                strtoull(rest, &rest, 10);
            if (sscanf(rest, "%10u %*u %10u", &owner, &creator) != 2 ||
                (owner != id && creator != id))
                continue;
            if (kind == 0)
                shmctl(object, IPC_RMID, NULL);
            else if (kind == 1)
                semctl(object, 0, IPC_RMID);
            else
                msgctl(object, IPC_RMID, NULL);
        }
        if (f != NULL)
            fclose(f);
    }
}

static bool remove_files(unsigned id, struct err *e)
{
    static const char *const shared[] = {"/tmp", "/var/tmp", "/dev/shm", "/dev/mqueue",
                                         "/run/lock"};
    bool ok = true;
    for (size_t i = 0; i < sizeof shared / sizeof *shared; i++) {
        DIR *d = opendir(shared[i]);
        struct dirent *entry;
        if (d == NULL && errno != ENOENT)
            ok = err_set(e, "%s: %s", shared[i], strerror(errno));
        while (d != NULL && (entry = readdir(d)) != NULL) {
            struct stat st;
            if (fstatat(dirfd(d), entry->d_name, &st, AT_SYMLINK_NOFOLLOW) == 0 && st.st_uid == id)
                ok = fs_remove_tree(fs_path("%s/%s", shared[i], entry->d_name).s, e) && ok;
        }
        if (d != NULL)
            closedir(d);
    }
    return ok;
}

static bool leave_nothing(const struct run_user *u, struct err *e)
{
    bool ok = run_user_end(u, e);
    remove_objects(u->id);
    return remove_files(u->id, e) && ok;
}

/* Makes the directory of locks, which must belong to root and be writable by root alone. */
static bool make_lock_dir(struct err *e)
{
    struct stat st;
    if ((mkdir(lock_dir, 0700) == 0 || errno == EEXIST) && lstat(lock_dir, &st) == 0 &&
        S_ISDIR(st.st_mode) && st.st_uid == 0 && (st.st_mode & 022) == 0)
        return true;
    return err_set(e, "%s: cannot be used to lock users of runs", lock_dir);
}

bool run_user_take(struct run_user *u, struct err *e)
{
    unsigned start = 0;
    *u = (struct run_user){.lock = -1};
    if (!make_lock_dir(e))
        return false;
    if (getrandom(&start, sizeof start, 0) != (ssize_t)sizeof start)
        start = (unsigned)getpid();
    for (unsigned i = 0; i < NUM; i++) {
        struct err ignored;
        u->id = FIRST + (start + i) % NUM;
        u->lock = open(fs_path("%s/%u", lock_dir, u->id).s,
                       O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (u->lock < 0)
            return err_set(e, "%s/%u: %s", lock_dir, u->id, strerror(errno));
        if (flock(u->lock, LOCK_EX | LOCK_NB) == 0 && leave_nothing(u, &ignored))
            return true;
        close(u->lock);
    }
    u->lock = -1;
    return err_set(e, "no user is free for a run: all %d of %d to %d have something left", NUM,
                   FIRST, FIRST + NUM - 1);
}

bool run_user_release(struct run_user *u, struct err *e)
{
    bool ok = leave_nothing(u, e);
    close(u->lock);
    u->lock = -1;
    return ok;
}
