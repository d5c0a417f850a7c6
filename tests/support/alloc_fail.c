#define _GNU_SOURCE
#include "alloc_fail.h"

#include <dirent.h>
#include <errno.h>
#include <execinfo.h>
#include <jansson.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <unwind.h>

#include <cmocka.h>

/* Where the memory comes from: AddressSanitizer if it is there, so that it sees every block as ever, else the C library. */
#define UNDER(type, name, ...)                                                                     \
    extern type __interceptor_##name(__VA_ARGS__) __attribute__((weak));                           \
    extern type __libc_##name(__VA_ARGS__);
UNDER(void *, malloc, size_t)
UNDER(void *, calloc, size_t, size_t)
UNDER(void *, realloc, void *, size_t)
UNDER(void *, memalign, size_t, size_t)
UNDER(void, free, void *)
#define BELOW(name) (__interceptor_##name != NULL ? __interceptor_##name : __libc_##name)

extern void __lsan_disable(void) __attribute__((weak));
extern void __lsan_enable(void) __attribute__((weak));

enum { MAX_FRAMES = 24 };

/* The allocators of a process are one for all its threads. */
static atomic_long blocks; /* that live */
static atomic_bool armed;
static atomic_long count; /* of the calls while armed */
static long fail_at;      /* 0: none */
static enum alloc_by counted;
static void *frame[MAX_FRAMES];
static int num_frames;

static enum alloc_json json_way;
static const char *json_output;
static atomic_long json_calls, json_too_early;

static const char *case_name; /* NULL between cases */
static struct {
    long cases, allocations, lines, right, json;
} sum;

extern const char __executable_start[], etext[];

/* backtrace() would want memory. */
static _Unwind_Reason_Code keep_frame(struct _Unwind_Context *context, void *arg)
{
    (void)arg;
    frame[num_frames] = (void *)_Unwind_GetIP(context);
    return ++num_frames < MAX_FRAMES ? _URC_NO_REASON : _URC_END_OF_STACK;
}

static bool fails(const void *caller)
{
    if (!armed)
        return false;
    if (counted == ALLOC_OURS &&
        ((const char *)caller < __executable_start || (const char *)caller >= etext))
        return false;
    if (atomic_fetch_add(&count, 1) + 1 != fail_at)
        return false;
    _Unwind_Backtrace(keep_frame, NULL);
    errno = ENOMEM;
    return true;
}

static void *counted_in(void *p)
{
    if (p != NULL)
        atomic_fetch_add(&blocks, 1);
    return p;
}

#define CALLER __builtin_return_address(0)

void *malloc(size_t size)
{
    return fails(CALLER) ? NULL : counted_in(BELOW(malloc)(size));
}

void *calloc(size_t n, size_t size)
{
    return fails(CALLER) ? NULL : counted_in(BELOW(calloc)(n, size));
}

void free(void *p)
{
    if (p != NULL)
        atomic_fetch_sub(&blocks, 1);
    BELOW(free)(p);
}

/* No code here asks for 0 bytes, which would free p. */
void *realloc(void *p, size_t size)
{
    if (fails(CALLER))
        return NULL;
    void *q = BELOW(realloc)(p, size);
    return p == NULL ? counted_in(q) : q;
}

void *reallocarray(void *p, size_t n, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(n, size, &bytes) || fails(CALLER)) {
        errno = ENOMEM;
        return NULL;
    }
    void *q = BELOW(realloc)(p, bytes);
    return p == NULL ? counted_in(q) : q;
}

void *memalign(size_t alignment, size_t size)
{
    return fails(CALLER) ? NULL : counted_in(BELOW(memalign)(alignment, size));
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return fails(CALLER) ? NULL : counted_in(BELOW(memalign)(alignment, size));
}

int posix_memalign(void **p, size_t alignment, size_t size)
{
    void *q = fails(CALLER) ? NULL : counted_in(BELOW(memalign)(alignment, size));
    if (q == NULL)
        return ENOMEM;
    *p = q;
    return 0;
}

static char *copy(const char *s, size_t length)
{
    char *p = counted_in(BELOW(malloc)(length + 1));
    if (p == NULL)
        return NULL;
    memcpy(p, s, length);
    p[length] = '\0';
    return p;
}

char *strdup(const char *s)
{
    return fails(CALLER) ? NULL : copy(s, strlen(s));
}

char *strndup(const char *s, size_t n)
{
    return fails(CALLER) ? NULL : copy(s, strnlen(s, n));
}

static void *json_memory(size_t size)
{
    if (json_way == ALLOC_JSON_FAILS && fails(__executable_start))
        return NULL;
    if (json_way == ALLOC_JSON_ENDS && armed) {
        atomic_fetch_add(&json_calls, 1);
        if (json_output != NULL && access(json_output, F_OK) == 0)
            atomic_fetch_add(&json_too_early, 1);
    }
    return counted_in(BELOW(malloc)(size));
}

void alloc_json(enum alloc_json how, const char *output)
{
    json_way = how;
    json_output = output;
    json_set_alloc_funcs(json_memory, free);
}

void alloc_fail_off(void)
{
    armed = false;
}

void alloc_fail_on(void)
{
    armed = true;
}

void alloc_fail_output(const char *path, bool there)
{
    char parent[4096];
    snprintf(parent, sizeof parent, "%s", path);
    *strrchr(parent, '/') = '\0';
    if ((access(path, F_OK) == 0) != there)
        fail_msg("%s: %s is %s", case_name, path, there ? "missing" : "there");
    if (there && unlink(path) != 0)
        fail_msg("%s: cannot be removed", path);
    DIR *d = opendir(parent);
    assert_non_null(d);
    for (const struct dirent *f = readdir(d); f != NULL; f = readdir(d))
        if (strcmp(f->d_name, ".") != 0 && strcmp(f->d_name, "..") != 0)
            fail_msg("%s: %s/%s is left", case_name, parent, f->d_name);
    closedir(d);
}

/* One call; what it left behind may not be more than what it found. */
static bool call_once(bool (*call)(void *ctx, struct err *e), void *ctx, long at, struct err *e)
{
    *e = (struct err){0};
    count = 0;
    fail_at = at;
    num_frames = 0;
    json_calls = json_too_early = 0;
    const long before = blocks;
    const bool lossy = counted == ALLOC_LOSSY && __lsan_disable != NULL;
    if (lossy)
        __lsan_disable();
    armed = true;
    const bool ok = call(ctx, e);
    armed = false;
    if (lossy)
        __lsan_enable();
    if (blocks != before && counted != ALLOC_LOSSY)
        fail_msg("%s: %ld blocks are left (it said '%s')", case_name, blocks - before,
                 ok ? "done" : e->msg);
    if (json_too_early > 0)
        fail_msg("%s: %s was there before all of jansson's memory was", case_name, json_output);
    if (ok && e->msg[0] != '\0')
        fail_msg("%s: done, but for '%s'", case_name, e->msg);
    return ok;
}

static void check_line(const struct err *e)
{
    if (e->msg[0] == '\0')
        fail_msg("%s: failed without a line", case_name);
    if (strchr(e->msg, '\n') != NULL)
        fail_msg("%s: more than one line: '%s'", case_name, e->msg);
    /* The last two are OpenEXR's words; of zlib, which it asks, it does not know why. */
    static const char *const word[] = {"memory", "Unable to allocate", "Unable to decompress"};
    bool says_so = false;
    for (size_t i = 0; i < sizeof word / sizeof word[0]; i++)
        says_so |= strstr(e->msg, word[i]) != NULL;
    if (!says_so)
        fail_msg("%s: speaks of no memory: '%s'", case_name, e->msg);
}

void alloc_fail_each(const char *name, enum alloc_by by, bool (*call)(void *ctx, struct err *e),
                     void *ctx)
{
    static struct err e;
    case_name = name;
    counted = ALLOC_ALL;
    /* What libraries keep from their first call on is theirs, not a leak. */
    e = (struct err){0};
    if (!call(ctx, &e) || (counted = by, !call_once(call, ctx, 0, &e)))
        fail_msg("%s: fails anyway: %s", name, e.msg);
    const long n = count, json = json_calls;
    if (n + json == 0)
        fail_msg("%s: no allocation", name);
    long lines = 0;
    for (long i = 1; i <= n; i++) {
        if (!call_once(call, ctx, i, &e)) {
            check_line(&e);
            lines++;
        }
        if (num_frames == 0 && count >= i)
            fail_msg("%s: allocation %ld did not fail", name, i);
    }
    if (!call_once(call, ctx, 0, &e))
        fail_msg("%s: fails afterwards: %s", name, e.msg);
    case_name = NULL;
    sum.cases++;
    sum.allocations += n;
    sum.lines += lines;
    sum.right += n - lines;
    sum.json += json;
    if (getenv("ALLOC_FAIL_TELL") != NULL)
        fprintf(stderr, "  %-40s %6ld allocations, %6ld lines, %ld of jansson\n", name, n, lines,
                json);
}

int alloc_fail_tell(void **state)
{
    (void)state;
    armed = false;
    if (case_name != NULL) {
        fprintf(stderr, "%s, allocation %ld, which was asked for here:\n", case_name, fail_at);
        backtrace_symbols_fd(frame, num_frames, STDERR_FILENO);
    }
    case_name = NULL;
    return 0;
}

int alloc_fail_sum(void **state)
{
    (void)state;
    fprintf(
        stderr,
        "%ld cases, each of %ld allocations failed in turn: %ld times a line, %ld times the right result; %ld calls of jansson "
        "where the program would end\n",
        sum.cases, sum.allocations, sum.lines, sum.right, sum.json);
    return 0;
}

long alloc_fail_file_size(const char *path)
{
    FILE *f = fopen(path, "rb");
    assert_non_null(f);
    assert_int_equal(fseek(f, 0, SEEK_END), 0);
    long size = ftell(f);
    fclose(f);
    return size;
}
