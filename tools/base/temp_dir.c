#include "temp_dir.h"

#include "renderer/base/fs.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

enum { RANDOM = 6 /* letters that mkdtemp() puts at the end */, MOST_TRIES = 100 };

/* Opens and locks a directory of this user. Returns 0; EWOULDBLOCK if another process holds it; ENOENT if it no longer
 * exists; else another errno, for example where locks are not supported. *fd: -1, or a descriptor that the caller
 * closes; the lock ends with it, and so with the process, however that ends. Children do not inherit it. */
static int lock_dir(const char *path, int *fd)
{
    struct stat held, now;
    *fd = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (*fd < 0 || fstat(*fd, &held) != 0)
        return errno;
    if (held.st_uid != geteuid())
        return EPERM;
    if (flock(*fd, LOCK_EX | LOCK_NB) != 0)
        return errno;
    /* Between opening and locking it may have been removed. */
    bool same = lstat(path, &now) == 0 && now.st_ino == held.st_ino && now.st_dev == held.st_dev;
    return same ? 0 : ENOENT;
}

static void remove_old(const char *temp, const char *start)
{
    size_t length = strlen(start);
    DIR *d = opendir(temp);
    struct dirent *entry;
    while (d != NULL && (entry = readdir(d)) != NULL) {
        struct err ignored;
        if (strncmp(entry->d_name, start, length) != 0 || strlen(entry->d_name) != length + RANDOM)
            continue;
        const struct path path = fs_path("%s/%s", temp, entry->d_name);
        int fd;
        bool removed = lock_dir(path.s, &fd) == 0 && fs_remove_tree(path.s, &ignored);
        (void)removed; /* what stays does no harm */
        if (fd >= 0)
            close(fd);
    }
    if (d != NULL)
        closedir(d);
}

bool temp_dir_open(struct temp_dir *d, const char *name, struct err *e)
{
    const char *temp = getenv("TMPDIR");
    char host[HOST_NAME_MAX + 1] = "", start[NAME_MAX];
    if (temp == NULL)
        temp = "/tmp";
    *d = (struct temp_dir){.lock = -1};
    if (gethostname(host, sizeof host - 1) != 0)
        host[0] = '\0';
    snprintf(start, sizeof start, "assay-%s-%s.", name, host);
    remove_old(temp, start);
    for (int i = 0; i < MOST_TRIES; i++) {
        int n = snprintf(d->path, sizeof d->path, "%s/%sXXXXXX", temp, start);
        if (n < 0 || (size_t)n >= sizeof d->path || mkdtemp(d->path) == NULL)
            break;
        int why = lock_dir(d->path, &d->lock);
        if (why != EWOULDBLOCK && why != ENOENT)
            return true;
        /* Another run that looks for old directories found this one before it was locked, and removes it. */
        if (d->lock >= 0)
            close(d->lock);
    }
    *d = (struct temp_dir){.lock = -1};
    return err_set(e, "%s: no temporary directory in it: %s", temp, strerror(errno));
}

bool temp_dir_close(struct temp_dir *d, struct err *e)
{
    bool ok = true;
    if (d->path[0] != '\0') {
        ok = fs_remove_tree(d->path, e);
        if (d->lock >= 0)
            close(d->lock);
    }
    *d = (struct temp_dir){.lock = -1};
    return ok;
}
