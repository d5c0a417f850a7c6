#define _GNU_SOURCE
#include "fs.h"

#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct path fs_path(const char *format, ...)
{
    struct path p;
    va_list args;
    va_start(args, format);
    vsnprintf(p.s, sizeof p.s, format, args);
    va_end(args);
    return p;
}

bool out_open(struct out_file *o, const char *path, struct err *e)
{
    if (strlen(path) >= sizeof o->path)
        return err_set(e, "%.64s...: path too long", path);
    strcpy(o->path, path);
    snprintf(o->temp, sizeof o->temp, "%s.tmp%ld", path, (long)getpid());
    o->f = fopen(o->temp, "wb");
    if (o->f == NULL)
        return err_set(e, "%s: cannot write: %s", path, strerror(errno));
    return true;
}

bool out_commit(struct out_file *o, struct err *e)
{
    bool ok = fflush(o->f) == 0 && !ferror(o->f) && fsync(fileno(o->f)) == 0;
    int saved = errno;
    if (fclose(o->f) != 0 && ok) {
        ok = false;
        saved = errno;
    }
    o->f = NULL;
    if (ok && rename(o->temp, o->path) != 0) {
        ok = false;
        saved = errno;
    }
    if (!ok) {
        unlink(o->temp);
        return err_set(e, "%s: cannot write: %s", o->path, strerror(saved));
    }
    return true;
}

void out_abandon(struct out_file *o)
{
    if (o->f != NULL)
        fclose(o->f);
    o->f = NULL;
    unlink(o->temp);
}

bool out_check(const char *path, struct err *e)
{
    struct out_file o;
    struct stat st;
    if (stat(path, &st) == 0 && S_ISDIR(st.st_mode))
        return err_set(e, "%s: cannot write: %s", path, strerror(EISDIR));
    if (!out_open(&o, path, e))
        return false;
    out_abandon(&o);
    return true;
}

bool fs_make_dirs(const char *path, struct err *e)
{
    char p[4096];
    if (strlen(path) >= sizeof p)
        return err_set(e, "%.64s...: path too long", path);
    strcpy(p, path);
    for (char *s = p + 1;; s++) {
        if (*s != '/' && *s != '\0')
            continue;
        char c = *s;
        *s = '\0';
        if (mkdir(p, 0777) != 0 && errno != EEXIST)
            return err_set(e, "%s: cannot make directory: %s", p, strerror(errno));
        *s = c;
        if (c == '\0')
            break;
    }
    struct stat st;
    if (stat(path, &st) != 0 || !S_ISDIR(st.st_mode))
        return err_set(e, "%s: not a directory", path);
    return true;
}

int fs_open_fd(const char *path)
{
    struct stat st;
    int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return -1;
    if (fstat(fd, &st) != 0 || (!S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode))) {
        close(fd);
        errno = ENOTSUP;
        return -1;
    }
    return fd;
}

FILE *fs_open(const char *path)
{
    int fd = fs_open_fd(path);
    FILE *f = fd >= 0 ? fdopen(fd, "rb") : NULL;
    if (f == NULL && fd >= 0)
        close(fd);
    return f;
}

bool fs_make_parent_dirs(const char *path, struct err *e)
{
    const char *slash = strrchr(path, '/');
    if (slash == NULL || slash == path)
        return true;
    char dir[4096];
    size_t n = (size_t)(slash - path);
    if (n >= sizeof dir)
        return err_set(e, "%.64s...: path too long", path);
    memcpy(dir, path, n);
    dir[n] = '\0';
    return fs_make_dirs(dir, e);
}

enum { DEEP = 16 };

/* Removes the file or folder `name` in the open directory `dir`. Follows no path and no link, since another process may
 * replace parts of the tree meanwhile. Folders DEEP levels down are moved to `top` first, so that neither descriptors
 * nor the stack run out. False with errno. */
static bool remove_at(int top, int dir, const char *name, int depth, unsigned *moved)
{
    struct stat st;
    if (fstatat(dir, name, &st, AT_SYMLINK_NOFOLLOW) != 0)
        return errno == ENOENT;
    if (!S_ISDIR(st.st_mode))
        return unlinkat(dir, name, 0) == 0 || errno == ENOENT;
    if (depth == DEEP) {
        char to[32];
        do
            snprintf(to, sizeof to, ".deep-%u", (*moved)++);
        while (faccessat(top, to, F_OK, AT_SYMLINK_NOFOLLOW) == 0);
        return renameat(dir, name, top, to) == 0;
    }
    int fd = openat(dir, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *d = fd >= 0 ? fdopendir(fd) : NULL;
    if (d == NULL) {
        if (fd >= 0)
            close(fd);
        return false;
    }
    bool ok = true;
    struct dirent *entry;
    while (ok && (entry = readdir(d)) != NULL)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            ok = remove_at(depth == 0 ? fd : top, fd, entry->d_name, depth + 1, moved);
    int saved = errno;
    closedir(d);
    errno = saved;
    return ok && (unlinkat(dir, name, AT_REMOVEDIR) == 0 || errno == ENOENT);
}

bool fs_remove_tree(const char *path, struct err *e)
{
    unsigned moved = 0, before;
    bool ok;
    do { /* readdir() may have missed folders that were moved to the top */
        before = moved;
        ok = remove_at(-1, AT_FDCWD, path, 0, &moved);
    } while (!ok && moved > before);
    return ok || err_set(e, "%s: cannot remove: %s", path, strerror(errno));
}

bool fs_copy(const char *from, const char *to, struct err *e)
{
    char buffer[1 << 16];
    FILE *in = fs_open(from), *out = in != NULL ? fopen(to, "wb") : NULL;
    bool ok = in != NULL && out != NULL;
    for (size_t n; ok && (n = fread(buffer, 1, sizeof buffer, in)) > 0;)
        ok = fwrite(buffer, 1, n, out) == n;
    ok = ok && ferror(in) == 0;
    ok = out != NULL && fclose(out) == 0 && ok && chmod(to, 0644) == 0;
    if (!ok)
        err_set(e, "cannot copy %s to %s: %s", from, to, strerror(errno));
    if (!ok && out != NULL)
        remove(to);
    if (in != NULL)
        fclose(in);
    return ok;
}

const char *fs_base(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

struct path fs_beside_file(const char *path, const char *name)
{
    return fs_path("%.*s%s", (int)(fs_base(path) - path), path, name);
}

struct path fs_beside_program(const char *name)
{
    char self[PATH_MAX];
    Dl_info library;
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    self[n > 0 ? n : 0] = '\0';
    /* In libassay.so, /proc/self/exe is the program of whoever loaded the library. */
    if (dladdr((const void *)fs_beside_program, &library) != 0 &&
        strstr(fs_base(library.dli_fname), ".so") != NULL)
        if (realpath(library.dli_fname, self) == NULL)
            self[0] = '\0';
    char *slash = strrchr(self, '/');
    if (slash != NULL)
        *slash = '\0';
    return fs_path("%s/%s", slash != NULL ? self : ".", name);
}
