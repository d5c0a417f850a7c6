#include "fuzz.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SUFFIXES = 2 };

/* Files stay open: opening one takes longer than reading it, if it is small. */
static struct {
    char path[64];
    int f;
} files[SUFFIXES];
static char dir[80], in_dir[112];

static void remove_files(void)
{
    for (int i = 0; i < SUFFIXES; i++)
        unlink(files[i].path);
    if (dir[0] != '\0') {
        unlink(in_dir);
        rmdir(dir);
    }
}

void fuzz_require(int ok, const char *what)
{
    if (ok)
        return;
    fprintf(stderr, "fuzz: %s\n", what);
    abort();
}

/* Called by code that is compiled without sanitizers, as no fuzzer should run it
 * (tests/tests.mk). */
void __cyg_profile_func_enter(void *function, void *caller);
void __cyg_profile_func_exit(void *function, void *caller);

void __cyg_profile_func_enter(void *function, void *caller)
{
    fprintf(stderr, "fuzz: %p runs without sanitizers, called from %p\n", function, caller);
    abort();
}

void __cyg_profile_func_exit(void *function, void *caller)
{
    (void)function;
    (void)caller;
}

const char *fuzz_file(const uint8_t *data, size_t size, const char *suffix)
{
    char path[64];
    int i = 0;
    snprintf(path, sizeof path, "/dev/shm/assay_fuzz_%d%s", (int)getpid(), suffix);
    while (i < SUFFIXES - 1 && files[i].path[0] != '\0' && strcmp(files[i].path, path) != 0)
        i++;
    fuzz_require(files[i].path[0] == '\0' || strcmp(files[i].path, path) == 0,
                 "more suffixes than there is room for");
    if (files[i].path[0] == '\0') {
        if (i == 0)
            atexit(remove_files);
        strcpy(files[i].path, path);
        files[i].f = creat(path, 0600);
    }
    fuzz_require(files[i].f >= 0 && pwrite(files[i].f, data, size, 0) == (ssize_t)size &&
                     ftruncate(files[i].f, (off_t)size) == 0,
                 "cannot write to /dev/shm");
    return files[i].path;
}

const char *fuzz_dir(const char *file, const char *name)
{
    if (dir[0] == '\0') {
        snprintf(dir, sizeof dir, "%s.d", file);
        snprintf(in_dir, sizeof in_dir, "%s/%s", dir, name);
        fuzz_require((mkdir(dir, 0700) == 0 || errno == EEXIST) &&
                         (symlink(file, in_dir) == 0 || errno == EEXIST),
                     "cannot make a directory");
    }
    return dir;
}

void fuzz_check_line(const struct err *e, const char *name)
{
    fuzz_require(e->msg[0] != '\0', "a failure without a line");
    fuzz_require(strchr(e->msg, '\n') == NULL, "a failure of more than one line");
    for (const char *c = e->msg; *c != '\0'; c++)
        fuzz_require((unsigned char)*c >= ' ' && *c != 127,
                     "control characters in a failure's line");
    fuzz_require(name == NULL || strncmp(e->msg, name, strlen(name)) == 0,
                 "a failure that does not begin with the file's name");
}
