/* LD_PRELOAD: lets the allocation number NO_MEMORY_AT since main() began fail, whoever asks for it, the libraries included,
 * but not while one is being loaded: C++ libraries end the program where their own beginnings find no memory;
 * with NO_MEMORY_AFTER set, all that follow too. Writes how many there were into the file NO_MEMORY_COUNT. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *p, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

static atomic_long count;
static long fail_at;
static _Bool counting, all_that_follow;

static _Bool fails(void)
{
    if (!counting)
        return 0;
    long n = atomic_fetch_add(&count, 1) + 1;
    if (fail_at == 0 || (all_that_follow ? n < fail_at : n != fail_at))
        return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size)
{
    return fails() ? NULL : __libc_malloc(size);
}
void *calloc(size_t n, size_t size)
{
    return fails() ? NULL : __libc_calloc(n, size);
}
void *realloc(void *p, size_t size)
{
    return fails() ? NULL : __libc_realloc(p, size);
}
void *aligned_alloc(size_t alignment, size_t size)
{
    return fails() ? NULL : __libc_memalign(alignment, size);
}
int posix_memalign(void **p, size_t alignment, size_t size)
{
    if (fails())
        return ENOMEM;
    *p = __libc_memalign(alignment, size);
    return *p == NULL ? ENOMEM : 0;
}

void *dlopen(const char *name, int flags)
{
    void *(*next)(const char *, int);
    *(void **)&next = dlsym(RTLD_NEXT, "dlopen");
    _Bool was = counting;
    counting = 0;
    void *module = next(name, flags);
    counting = was;
    return module;
}

static void write_count(void)
{
    counting = 0;
    const char *path = getenv("NO_MEMORY_COUNT");
    FILE *f = path != NULL ? fopen(path, "w") : NULL;
    if (f == NULL)
        return;
    fprintf(f, "%ld\n", (long)count);
    fclose(f);
}

static int (*real_main)(int, char **, char **);
static int counted_main(int argc, char **argv, char **env)
{
    const char *at = getenv("NO_MEMORY_AT");
    fail_at = at != NULL ? atol(at) : 0;
    all_that_follow = getenv("NO_MEMORY_AFTER") != NULL;
    counting = 1;
    int status = real_main(argc, argv, env);
    write_count();
    return status;
}

typedef int start_main(int (*)(int, char **, char **), int, char **, void (*)(void), void (*)(void),
                       void (*)(void), void *);
int __libc_start_main(int (*main)(int, char **, char **), int argc, char **argv, void (*init)(void),
                      void (*fini)(void), void (*rtld_fini)(void), void *stack_end)
{
    start_main *next;
    *(void **)&next = dlsym(RTLD_NEXT, "__libc_start_main");
    real_main = main;
    return next(counted_main, argc, argv, init, fini, rtld_fini, stack_end);
}
