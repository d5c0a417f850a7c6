#define _GNU_SOURCE
#include "hash_tree.h"

#include "renderer/base/sha256.h"

#include <dirent.h>
#include <errno.h>
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_PATH = 4096 };

/* Not alphasort(): its strcoll() depends on the locale. */
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
        return hash_tree(path, NULL, hex, e);
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
    char below[MAX_PATH], line[MAX_PATH], kind = 'o';
    uint8_t digest[SHA256_DIGEST_SIZE];
    struct sha256_ctx all;
    bool ok = true;
    sha256_init(&all);
    for (int i = 0; ok && i < num; i++) {
        const char *name = list[i]->d_name;
        if (strcmp(name, ".") == 0 || strcmp(name, "..") == 0 ||
            (except != NULL && strcmp(name, except) == 0))
            continue;
        int n = snprintf(below, sizeof below, "%s/%s", path, name);
        ok = (n > 0 && (size_t)n < sizeof below) || err_set(e, "%.64s...: path too long", path);
        ok = ok && hash_entry(below, &kind, hex, e);
        if (ok) {
            n = snprintf(line, sizeof line, "%c %s %s\n", kind, hex, name);
            sha256_update(&all, (size_t)n, (const uint8_t *)line);
        }
    }
    if (!ok)
        return false;
    sha256_digest(&all, sizeof digest, digest);
    base16_encode_update(hex, sizeof digest, digest);
    hex[64] = '\0';
    return true;
}

bool hash_tree(const char *path, const char *except, char hex[65], struct err *e)
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
