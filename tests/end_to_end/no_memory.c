/* Whole commands while memory runs out. Linked into a program with -Wl,--wrap=main, this file is its malloc(), free()
 * and the like: with NO_MEMORY=DIR in the environment the program runs its command once to count the allocations,
 * those of libraries included, and then once for each of them, which fails. Each run is a fork() in DIR/run, a new
 * copy of DIR/start (if any), which may
 *   - end as the first did, with the same files and the same output, or
 *   - exit 3 with one line that speaks of memory, or 2 with a list that does (a grade that is left to staff); each
 *     file there must then be one of the first run or of DIR/start, or speak of memory itself;
 * it must not crash, hang or (under LeakSanitizer) leak. Prints "ok NAME: ..." or "not ok NAME: why", NAME being
 * NO_MEMORY_NAME. Unless NO_MEMORY_ALL is set, of the allocations with the same call stack only the first and the
 * last fail; of these at most NO_MEMORY_MOST of libraries and three times as many of our own code; and none whose
 * stack is in the file NO_MEMORY_DONE, which earlier commands have filled. NO_MEMORY_FAULT=NAME runs faulty_main() in
 * the program's place: its fault has to be found. Clocks stand still. */
#define _GNU_SOURCE
#include "tests/support/malloc_below.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <limits.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <unwind.h>

enum {
    MAX_ALLOCATIONS = 1 << 20,
    MAX_FRAMES = 48,
    NUM_HASHED = 12,
    CALLER = 2, /* after fails() and malloc() */
    MAX_TOLD = 3,
    MAX_CHOSEN = 1 << 16,
    SECONDS = 60,
    EXIT_FOR_STAFF = 2,
    EXIT_NOT_JUDGED = 3
};

/* State of the allocator, common to all threads. */
static atomic_bool armed;
static atomic_long count; /* of the calls while armed */
static _Thread_local bool spared;
static long fail_at; /* 0: none fails, and `seen` is written */
/* Shared by all runs. Large arrays are here, where LeakSanitizer looks for no pointers: it would touch each of their
 * pages in each run. */
static struct shared {
    long count;
    int num_frames;
    char module[4096];              /* library that the first run loaded late; "": none */
    uintptr_t frame[MAX_FRAMES];    /* of the call that failed */
    uint64_t seen[MAX_ALLOCATIONS]; /* hash of the calls that led to each allocation */
    uint64_t done[MAX_CHOSEN];      /* hashes that earlier commands have tried */
    long chosen[MAX_CHOSEN];
    char text[1 << 18]; /* of a file that a run left */
} * shared;

/* Not backtrace(), which allocates. */
static _Unwind_Reason_Code keep_frame(struct _Unwind_Context *context, void *arg)
{
    struct shared *s = arg;
    s->frame[s->num_frames] = _Unwind_GetIP(context);
    return ++s->num_frames < MAX_FRAMES ? _URC_NO_REASON : _URC_END_OF_STACK;
}

/* A hash of the call stack, the same in every run; odd if our own code asks. 0 within C++ and
 * OpenImageIO, which may end the program or call a file unreadable: such allocations do not fail.
 * Not inline: AddressSanitizer allocates before it can follow a variable whose address is taken. */
static __attribute__((noinline)) uint64_t hash_of_frames(const struct shared *s)
{
    uint64_t hash = 14695981039346656037u, ours = 1;
    const void *here = NULL;
    for (int i = 0; i < s->num_frames; i++) {
        Dl_info in;
        if (dladdr((void *)s->frame[i], &in) == 0)
            break;
        if (strstr(in.dli_fname, "libstdc++") != NULL || strstr(in.dli_fname, "oiio.so") != NULL)
            return 0;
        here = i == 0 ? in.dli_fbase : here;
        if ((i == CALLER && in.dli_fbase != here) ||
            (i == CALLER + 1 && strstr(in.dli_fname, "jansson") != NULL))
            ours = 0;
        if (i < NUM_HASHED)
            hash = (hash ^ (s->frame[i] - (uintptr_t)in.dli_fbase)) * 1099511628211u;
    }
    return hash << 1 | ours;
}

static bool fails(void)
{
    if (!armed || spared)
        return false;
    const long n = atomic_fetch_add(&count, 1);
    if (fail_at != 0 && n + 1 != fail_at)
        return false;
    spared = true;
    shared->num_frames = 0;
    _Unwind_Backtrace(keep_frame, shared);
    const uint64_t hash = hash_of_frames(shared);
    if (fail_at == 0 && n < MAX_ALLOCATIONS)
        shared->seen[n] = hash;
    spared = false;
    const bool now = fail_at != 0 && hash != 0; /* hash 0: with threads it may be another one */
    if (now)
        errno = ENOMEM;
    return now;
}

void *malloc(size_t size)
{
    return fails() ? NULL : MALLOC_BELOW(malloc)(size);
}
void *calloc(size_t n, size_t size)
{
    return fails() ? NULL : MALLOC_BELOW(calloc)(n, size);
}
void *realloc(void *p, size_t size)
{
    return fails() ? NULL : MALLOC_BELOW(realloc)(p, size);
}
void *reallocarray(void *p, size_t n, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(n, size, &bytes)) {
        errno = ENOMEM;
        return NULL;
    }
    return realloc(p, bytes);
}
void *memalign(size_t alignment, size_t size)
{
    return fails() ? NULL : MALLOC_BELOW(memalign)(alignment, size);
}
void *aligned_alloc(size_t alignment, size_t size)
{
    return memalign(alignment, size);
}
int posix_memalign(void **p, size_t alignment, size_t size)
{
    void *q = memalign(alignment, size);
    if (q != NULL)
        *p = q;
    return q != NULL ? 0 : ENOMEM;
}
/* AddressSanitizer's strdup() and strndup() do not call malloc(). */
char *strndup(const char *s, size_t n)
{
    const size_t length = strnlen(s, n);
    char *p = malloc(length + 1);
    if (p != NULL) {
        memcpy(p, s, length);
        p[length] = '\0';
    }
    return p;
}
char *strdup(const char *s)
{
    return strndup(s, SIZE_MAX - 1);
}

/* C++ libraries end the program if their initialisation finds no memory: they are spared. */
extern void *__real_dlopen(const char *name, int flags);
void *__wrap_dlopen(const char *name, int flags);
void *__wrap_dlopen(const char *name, int flags)
{
    spared = true;
    void *module = __real_dlopen(name, flags);
    if (module != NULL && fail_at == 0)
        snprintf(shared->module, sizeof shared->module, "%s", name);
    spared = false;
    return module;
}
/* So does AddressSanitizer if this call fails, by which it finds a thread's stack. */
int pthread_getattr_np(pthread_t thread, pthread_attr_t *attr)
{
    int (*next)(pthread_t, pthread_attr_t *);
    spared = true;
    *(void **)&next = dlsym(RTLD_NEXT, "pthread_getattr_np");
    const int error = next(thread, attr);
    spared = false;
    return error;
}

/* Threads that libraries start when loaded before fork() are hidden from AddressSanitizer, which
 * would look for them in each child. */
static bool loading;
int pthread_create(pthread_t *thread, const pthread_attr_t *how, void *(*run)(void *), void *arg)
{
    int (*next)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    const bool was_spared = spared;
    spared = true;
    void *libc = loading ? __real_dlopen("libc.so.6", RTLD_LAZY | RTLD_NOLOAD) : RTLD_NEXT;
    *(void **)&next = dlsym(libc, "pthread_create");
    spared = was_spared;
    return next(thread, how, run, arg);
}

/* Random names and times would be in the outputs: here they are fixed. */
char *mkdtemp(char *path)
{
    char *last = path + strlen(path) - 6;
    memcpy(last, "AAAAAA", 6);
    while (mkdir(path, 0700) != 0) {
        if (errno != EEXIST || *last == 'Z')
            return NULL;
        ++*last;
    }
    return path;
}
int clock_gettime(clockid_t id, struct timespec *t)
{
    (void)id;
    *t = (struct timespec){.tv_sec = 1000000000};
    return 0;
}
time_t time(time_t *t)
{
    if (t != NULL)
        *t = 1000000000;
    return 1000000000;
}
int getrusage(__rusage_who_t who, struct rusage *usage)
{
    (void)who;
    *usage = (struct rusage){.ru_utime.tv_usec = 1000};
    return 0;
}

pid_t __real_wait4(pid_t child, int *status, int options, struct rusage *usage);
pid_t __wrap_wait4(pid_t child, int *status, int options, struct rusage *usage);
pid_t __wrap_wait4(pid_t child, int *status, int options, struct rusage *usage)
{
    const pid_t ended = __real_wait4(child, status, options, usage);
    if (usage != NULL)
        getrusage(RUSAGE_CHILDREN, usage);
    return ended;
}

/* libxml2's writer and gsl_cheb_alloc() leak a block when they fail. What the dynamic linker keeps
 * of a library loaded late lies, from glibc 2.41 on, where LeakSanitizer does not look for
 * pointers. */
const char *__lsan_default_suppressions(void), *__lsan_default_options(void);
int __lsan_is_turned_off(void);
extern void __lsan_do_leak_check(void) __attribute__((weak));
extern void __lsan_disable(void) __attribute__((weak)), __lsan_enable(void) __attribute__((weak));
const char *__lsan_default_suppressions(void)
{
    return "leak:xmlTextWriter\nleak:gsl_cheb_alloc\nleak:ld-linux\n";
}
const char *__lsan_default_options(void)
{
    return "print_suppressions=0";
}

/* The search for leaks takes two thirds of a run's time: without NO_MEMORY_ALL it is done only if
 * an allocation of our own code failed. */
int __lsan_is_turned_off(void)
{
    return getenv("NO_MEMORY_ALL") == NULL && (fail_at == 0 || shared->seen[fail_at - 1] % 2 == 0);
}

static bool write_file(const char *text)
{
    const int f = creat("file", 0666);
    const bool ok = f >= 0 && write(f, text, strlen(text)) > 0;
    return f >= 0 && close(f) == 0 && ok;
}

/* A program with the fault of that name, or "none". volatile, so that the compiler does not remove
 * the fault. */
static int faulty_main(const char *fault)
{
    static char *volatile kept;
    const bool half = strcmp(fault, "half") == 0 && write_file("wh");
    char *volatile first = malloc(100), *volatile second = malloc(100);
    const bool ok = first != NULL && second != NULL;
    kept = second;
    if (strcmp(fault, "unchecked") == 0)
        kept[1] = 1;
    if (ok || strcmp(fault, "leak") != 0)
        free(first);
    free(second);
    first = second = kept = NULL;
    if (ok || strcmp(fault, "wrong") == 0)
        return !write_file(ok ? "whole" : "who");
    if (strcmp(fault, "undefined") == 0) {
        volatile int most = INT_MAX;
        most++;
    }
    if (!half)
        unlink("file");
    if (strcmp(fault, "silent") != 0)
        fputs(strcmp(fault, "misleading") == 0 ? "no such file\n" : "out of memory\n", stderr);
    if (strcmp(fault, "two lines") == 0)
        fputs("out of memory\n", stderr);
    return strcmp(fault, "points") == 0 ? 1 : EXIT_NOT_JUDGED;
}

extern int __real_main(int, char **, char **);
int __wrap_main(int argc, char **argv, char **env);

static char why[300];    /* what was wrong with a run */
static bool failed;      /* the run ended otherwise than the first, so may have other files */
static const char *line; /* what a failed run said */
static int num_entries;

static void blame(const char *what, const char *about)
{
    if (why[0] == '\0')
        snprintf(why, sizeof why, "%s: %.200s", what, about);
    for (char *c = strchr(why, '\n'); c != NULL; c = strchr(c, '\n'))
        *c = '|';
}

static int remove_entry(const char *path, const struct stat *s, int type, struct FTW *at)
{
    (void)s, (void)type, (void)at;
    return remove(path);
}

/* Bytes of a file, at most `size` less one; -1: there is none. */
static long read_file(const char *path, char *bytes, size_t size)
{
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return -1;
    const size_t n = fread(bytes, 1, size - 1, f);
    bytes[n] = '\0';
    fclose(f);
    return (long)n;
}

static bool same_files(const char *a, const char *b)
{
    FILE *f[2] = {fopen(a, "rb"), fopen(b, "rb")};
    bool same = f[0] != NULL && f[1] != NULL;
    while (same) {
        char bytes[2][4096];
        const size_t n = fread(bytes[0], 1, sizeof bytes[0], f[0]);
        same = n == fread(bytes[1], 1, sizeof bytes[1], f[1]) && memcmp(bytes[0], bytes[1], n) == 0;
        if (n == 0)
            break;
    }
    for (int i = 0; i < 2; i++)
        if (f[i] != NULL)
            fclose(f[i]);
    return same;
}

static bool is_as_in(const char *tree, const char *path, int type)
{
    char other[4096];
    snprintf(other, sizeof other, "%s%s", tree, path + strlen("run"));
    return type == FTW_F ? same_files(path, other) : access(other, F_OK) == 0;
}

/* Does the text speak of memory? OpenEXR has its own words, and does not know why zlib failed. */
static bool says_it(const char *text)
{
    return strstr(text, "out of memory") != NULL || strstr(text, "allocate memory") != NULL ||
           strstr(text, "threads or memory") != NULL ||
           strstr(text, "Unable to allocate") != NULL ||
           strstr(text, "Unable to decompress") != NULL;
}

/* May a failed run leave this entry? Yes for directories of work, and images that wait for their
 * manifest, which the next run cleans up, if the line names them or jansson ended the program
 * (tools/commands/assay.c). */
static bool may_be_left(const char *path)
{
    const char *end = path + strlen(path);
    if (end - path < 7)
        return false;
    /* Of the last program that ran, one of several. */
    if (strcmp(end - 4, ".log") == 0 || strstr(path, "/consistency.exr") != NULL ||
        strstr(path, "/.assay-lock") != NULL)
        return true;
    return strstr(line, strrchr(path, '/') + 1) != NULL
               ? end[-7] == '-'
               : strcmp(line, "assay: out of memory\n") == 0 &&
                     (strstr(path, ".tmp-") != NULL || end[-7] == '-' ||
                      strcmp(end - 5, ".next") == 0);
}

/* Is the file complete, and does it speak of memory, as results do that list what could not be
 * judged? */
static bool is_whole_and_says_it(const char *path)
{
    const long n = read_file(path, shared->text, sizeof shared->text);
    return n > 0 && says_it(shared->text) && strchr("\n>", shared->text[n - 1]) != NULL;
}

static int check_entry(const char *path, const struct stat *s, int type, struct FTW *at)
{
    (void)s;
    num_entries++;
    if (failed && at->level > 0 && may_be_left(path))
        return FTW_SKIP_SUBTREE;
    /* A depth ladder that cannot be read for a reason that zlib does not tell is left out, with its words. */
    if (!is_as_in("right", path, type) && !(failed && is_as_in("start", path, type)) &&
        !((failed || strncmp(path, "run/out/", 8) == 0) && is_whole_and_says_it(path)))
        blame(failed ? "failed, and left" : "did not fail, and made another", path);
    return FTW_CONTINUE;
}

static int count_entry(const char *path, const struct stat *s, int type, struct FTW *at)
{
    (void)path, (void)s, (void)type, (void)at;
    num_entries--;
    return 0;
}

/* Ends a child before the exit handlers of libraries that were loaded before fork(): some wait for
 * threads that it lacks. */
static void end_here(int code, void *unused)
{
    (void)unused;
    fflush(NULL);
    if (__lsan_do_leak_check != NULL)
        __lsan_do_leak_check();
    _exit(code);
}

/* Runs the command, allocation `at` failing (0: none), and ends this child. */
static void run_here(long at, int argc, char **argv, char **env)
{
    const char *fault = getenv("NO_MEMORY_FAULT");
    const int out = creat("out", 0666), err = creat("err", 0666);
    if (dup2(out, STDOUT_FILENO) < 0 || dup2(err, STDERR_FILENO) < 0 || chdir("run") != 0)
        abort();
    close(out);
    close(err);
    unsetenv("NO_MEMORY");
    alarm(SECONDS);
    fail_at = at;
    armed = true;
    const int code = fault != NULL ? faulty_main(fault) : __real_main(argc, argv, env);
    armed = false;
    shared->count = count;
    exit(code);
}

/* run_here() in a child and a fresh directory; returns its wait() status. */
static int run_command(long at, int argc, char **argv, char **env)
{
    nftw("run", remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    nftw("tmp", remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    if (mkdir("tmp", 0777) != 0 ||
        (access("start", F_OK) == 0 ? system("cp -R start run") : mkdir("run", 0777)) != 0)
        abort();
    shared->num_frames = 0;
    shared->count = MAX_ALLOCATIONS;
    fflush(stdout);
    const pid_t child = fork();
    if (child == 0)
        run_here(at, argc, argv, env);
    int status;
    if (child < 0 || waitpid(child, &status, 0) != child)
        abort();
    return status;
}

/* What a failed run said after the lines that the first run said, too. */
static const char *own_words(const char *said)
{
    char all[4096];
    read_file("right.err", all, sizeof all);
    for (size_t n; (n = strcspn(said, "\n")) > 0 && strncmp(said, all, n + 1) == 0; said += n + 1)
        memmove(all, all + n + 1, strlen(all + n + 1) + 1);
    return said;
}

static void check_run(int status, int right_status)
{
    char all[4096], out[4096];
    read_file("err", all, sizeof all);
    read_file("out", out, sizeof out);
    line = own_words(all);
    why[0] = '\0';
    num_entries = 0;
    failed = status != right_status;
    const bool graded = WIFEXITED(status) && WEXITSTATUS(status) == EXIT_FOR_STAFF;
    if (WIFSIGNALED(status))
        blame(strsignal(WTERMSIG(status)), line);
    else if (failed && WEXITSTATUS(status) != EXIT_NOT_JUDGED && !(graded && says_it(out)))
        blame("another exit code", line);
    else if (failed && !says_it(line) &&
             !says_it(out)) /* a list on stdout may say it of one thing */
        blame("speaks of no memory", line);
    else if (failed && !graded && strchr(line, '\n') != line + strlen(line) - 1)
        blame("not one line", line);
    nftw("run", check_entry, 16, FTW_PHYS | FTW_ACTIONRETVAL);
    if (!failed)
        nftw("right", count_entry, 16, FTW_PHYS);
    if (!failed && num_entries != 0)
        blame("did not fail, and left out", "files");
    if (!failed && !same_files("out", "right.out"))
        blame("did not fail, and said something else", out);
}

static bool is_chosen(long i, long num, size_t num_done)
{
    bool first = true, last = true;
    const uint64_t hash = shared->seen[i];
    if (hash == 0 || getenv("NO_MEMORY_ALL") != NULL)
        return hash != 0;
    for (size_t k = 0; k < num_done; k++)
        if (shared->done[k] == hash)
            return false;
    for (long k = 0; k < i && first; k++)
        first = shared->seen[k] != hash;
    for (long k = num - 1; k > i && last && !first; k--)
        last = shared->seen[k] != hash;
    return first || last;
}

static void tell_frames(void)
{
    printf("#   asked for by");
    for (int i = 1; i < shared->num_frames && i < 14; i++) {
        Dl_info in;
        if (dladdr((void *)shared->frame[i], &in) != 0)
            printf(" %s+0x%lx", strrchr(in.dli_fname, '/') + 1,
                   shared->frame[i] - (uintptr_t)in.dli_fbase - 1);
    }
    printf("\n");
}

int __wrap_main(int argc, char **argv, char **env)
{
    const char *dir = getenv("NO_MEMORY"), *name = getenv("NO_MEMORY_NAME");
    if (dir == NULL)
        return __real_main(argc, argv, env);
    shared = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED || chdir(dir) != 0)
        abort();
    int right = run_command(0, argc, argv, env);
    /* oiio.so brings 230 libraries along: they are loaded once, before the other runs fork. */
    if (shared->module[0] != '\0') {
        loading = true;
        if (__lsan_disable != NULL)
            __lsan_disable();
        if (__real_dlopen(shared->module, RTLD_LAZY) == NULL || on_exit(end_here, NULL) != 0)
            abort();
        if (__lsan_enable != NULL)
            __lsan_enable();
        loading = false;
        right = run_command(0, argc, argv, env);
    }
    const long num = shared->count;
    if (!WIFEXITED(right) || WEXITSTATUS(right) >= EXIT_NOT_JUDGED || num >= MAX_ALLOCATIONS ||
        rename("run", "right") != 0 || rename("out", "right.out") != 0 ||
        rename("err", "right.err") != 0) {
        char said[300];
        read_file("err", said, sizeof said);
        printf("not ok no memory: %s: fails anyway: %s\n", name, said);
        return 1;
    }
    FILE *f = fopen(getenv("NO_MEMORY_DONE"), "a+b");
    if (f == NULL)
        abort();
    const size_t num_done = fread(shared->done, sizeof *shared->done, MAX_CHOSEN, f);
    long *chosen = shared->chosen;
    long num_chosen = 0, survived = 0, tried = 0, wrong = 0, of[2] = {0}, step[2] = {1, 1};
    for (long i = 0; i < num && num_chosen < MAX_CHOSEN; i++)
        if (is_chosen(i, num, num_done)) {
            chosen[num_chosen++] = i;
            of[shared->seen[i] % 2]++;
        }
    const char *most = getenv("NO_MEMORY_MOST");
    for (int ours = 0; most != NULL && ours < 2; ours++)
        step[ours] += of[ours] / (atol(most) * (ours ? 3 : 1));
    for (long i = 0; i < num_chosen && wrong < MAX_TOLD; i++) {
        const int ours = shared->seen[chosen[i]] % 2;
        if (--of[ours] % step[ours] != 0)
            continue;
        fwrite(&shared->seen[chosen[i]], sizeof *shared->seen, 1, f);
        check_run(run_command(chosen[i] + 1, argc, argv, env), right);
        tried++;
        survived += !failed;
        if (why[0] == '\0')
            continue;
        wrong++;
        printf("not ok no memory: %s: allocation %ld of %ld: %s\n", name, chosen[i] + 1, num, why);
        tell_frames();
    }
    fclose(f);
    if (wrong == 0)
        printf("ok no memory: %s: %ld of %ld allocations, %ld of which were not needed\n", name,
               tried, num, survived);
    return wrong != 0;
}
