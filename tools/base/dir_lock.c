#define _GNU_SOURCE
#include "dir_lock.h"

#include "renderer/base/fs.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOST_TRIES = 100, WAIT_US = 20000 };

/* Does the path still lead to the locked file? Its previous owner may have removed it meanwhile. */
static bool is_there(const struct dir_lock *l)
{
    struct stat held, now;
    return fstat(l->fd, &held) == 0 && lstat(l->path, &now) == 0 && held.st_ino == now.st_ino &&
           held.st_dev == now.st_dev;
}

static bool refuse(const struct dir_lock *l, const char *dir, struct err *e)
{
    char who[HOST_NAME_MAX + 32] = "";
    ssize_t n = pread(l->fd, who, sizeof who - 1, 0);
    who[n > 0 ? n : 0] = '\0';
    return err_set(e, "%s: another run writes there%s%s", dir, who[0] != '\0' ? ": process " : "",
                   who);
}

bool dir_lock_take(struct dir_lock *l, const char *dir, struct err *e)
{
    char host[HOST_NAME_MAX + 1] = "";
    e->msg[0] = '\0';
    *l = (struct dir_lock){.fd = 0, .made = access(dir, F_OK) != 0};
    if (!fs_make_dirs(dir, e))
        return false;
    snprintf(l->path, sizeof l->path, "%.4000s/.assay-lock", dir);
    for (int i = 0; i < MOST_TRIES; i++) {
        l->fd = open(l->path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644);
        if (l->fd < 0) {
            l->fd = 0;
            return err_set(e, "%s: cannot write: %s", l->path, strerror(errno));
        }
        bool held = flock(l->fd, LOCK_EX | LOCK_NB) == 0;
        bool taken = !held && errno == EWOULDBLOCK;
        if (!taken && (!held || is_there(l)))
            break;
        if (taken && i == MOST_TRIES - 1)
            refuse(l, dir, e);
        close(l->fd);
        l->fd = 0;
        if (taken) /* a run that was killed may not be gone yet */
            usleep(WAIT_US);
    }
    if (l->fd == 0)
        return e->msg[0] != '\0' ? false : err_set(e, "%s: cannot lock", l->path);
    gethostname(host, sizeof host - 1);
    if (ftruncate(l->fd, 0) != 0 || dprintf(l->fd, "%ld on %s", (long)getpid(), host) < 0) {
        dir_lock_release(l);
        return err_set(e, "%s: cannot write: %s", l->path, strerror(errno));
    }
    return true;
}

void dir_lock_release(struct dir_lock *l)
{
    if (l->fd > 0) {
        unlink(l->path);
        close(l->fd);
        *strrchr(l->path, '/') = '\0';
        if (l->made)
            rmdir(l->path);
    }
    l->fd = 0;
}
