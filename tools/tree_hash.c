#define _GNU_SOURCE
#include "tree_hash.h"

#include "../renderer/sha256.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_PATH = 4096 };

/* strcoll(), which alphasort() goes by, would depend on who asks. */
static int by_bytes(const struct dirent **a, const struct dirent **b)
{
    return strcmp((*a)->d_name, (*b)->d_name);
}

static bool hash_entry(const char *path, char *kind, char hex[65], struct err *e)
{
    struct stat st;
    char target[MAX_PATH];
    if (lstat(path, &st) != 0)
        return err_set(e, "%s: %s", path, strerror(errno));
    *kind = S_ISDIR(st.st_mode) ? 'd' : S_ISLNK(st.st_mode) ? 'l' : S_ISREG(st.st_mode) ? 'f' : 'o';
    if (*kind == 'd')
        return tree_hash(path, NULL, hex, e);
    if (*kind == 'f')
        return sha256_file(path, hex, e);
    target[0] = '\0';
    if (*kind == 'l') {
        ssize_t n = readlink(path, target, sizeof target - 1);
        if (n < 0)
            return err_set(e, "%s: %s", path, strerror(errno));
        target[n] = '\0';
    }
    sha256_text(target, hex);
    return true;
}

static bool hash_list(const char *path, struct dirent **list, int num, const char *except,
                      char hex[65], struct err *e)
{
    char *text = NULL, below[MAX_PATH], kind = 'o';
    size_t size;
    FILE *f = open_memstream(&text, &size);
    bool ok = f != NULL || err_set(e, "%s: out of memory", path);
    for (int i = 0; ok && i < num; i++) {
        const char *name = list[i]->d_name;
        if (strcmp(name, ".") == 0 || strcmp(name, "..") == 0 ||
            (except != NULL && strcmp(name, except) == 0))
            continue;
        int n = snprintf(below, sizeof below, "%s/%s", path, name);
        ok = (n > 0 && (size_t)n < sizeof below) || err_set(e, "%.64s...: path too long", path);
        ok = ok && hash_entry(below, &kind, hex, e);
        if (ok)
            fprintf(f, "%c %s %s\n", kind, hex, name);
    }
    if (f != NULL && fclose(f) != 0 && ok)
        ok = err_set(e, "%s: out of memory", path);
    if (ok)
        sha256_text(text, hex);
    free(text);
    return ok;
}

bool tree_hash(const char *path, const char *except, char hex[65], struct err *e)
{
    struct stat st;
    struct dirent **list;
    if (stat(path, &st) != 0)
        return err_set(e, "%s: %s", path, strerror(errno));
    if (!S_ISDIR(st.st_mode))
        return sha256_file(path, hex, e);
    int num = scandir(path, &list, NULL, by_bytes);
    if (num < 0)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    bool ok = hash_list(path, list, num, except, hex, e);
    for (int i = 0; i < num; i++)
        free(list[i]);
    free(list);
    return ok;
}
