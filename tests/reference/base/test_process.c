/* process_run() against programs whose behaviour is known: they are shell scripts of a few words.
 * Times are compared with bounds far from what is measured, so that a loaded machine passes. */
#define _GNU_SOURCE

#include "reference/base/process.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

/* One script through sh -c. */
static bool sh(const char *script, const char *log, double timeout_s, struct process_usage *usage,
               struct err *e)
{
    const char *const argv[] = {"sh", "-c", script, NULL};
    return process_run(&(struct process){.argv = argv, .log = log, .timeout_s = timeout_s}, usage,
                       e);
}

static long read_number(const char *path)
{
    long v = -1;
    FILE *f = fopen(path, "r");
    if (f != NULL) {
        if (fscanf(f, "%ld", &v) != 1)
            v = -1;
        fclose(f);
    }
    return v;
}

/* Alive: exists and is not a zombie that its new parent has yet to collect. */
static bool is_alive(long pid)
{
    char path[64], state = 'Z';
    snprintf(path, sizeof path, "/proc/%ld/stat", pid);
    FILE *f = fopen(path, "r");
    if (f == NULL)
        return false;
    if (fscanf(f, "%*d (%*[^)]) %c", &state) != 1)
        state = 'Z';
    fclose(f);
    return state != 'Z' && state != 'X';
}

/* SIGKILL has been sent; the kernel may need a moment. */
static bool dies_soon(long pid)
{
    for (int i = 0; i < 1000 && is_alive(pid); i++)
        usleep(10000);
    return !is_alive(pid);
}

static int count_fds(void)
{
    int n = 0;
    DIR *d = opendir("/proc/self/fd");
    assert_non_null(d);
    while (readdir(d) != NULL)
        n++;
    closedir(d);
    return n;
}

TEST(success_leaves_the_error_untouched)
{
    struct err e = {"untouched"};
    struct process_usage u = {.wall_s = -1, .cpu_s = -1, .exit_status = -1};
    assert_true(sh("echo hello", NULL, 60, &u, &e));
    assert_string_equal(e.msg, "untouched");
    assert_true(u.wall_s > 0 && u.wall_s < 60);
    assert_true(u.cpu_s >= 0 && u.cpu_s < 60);
}

TEST(exit_status_and_last_lines_are_reported)
{
    struct err e;
    assert_false(
        sh("for i in 1 2 3 4 5 6 7 8; do echo line $i; done; echo; exit 7", NULL, 60, NULL, &e));
    assert_string_equal(e.msg,
                        "sh: exit status 7: line 3 | line 4 | line 5 | line 6 | line 7 | line 8");
    assert_false(sh("echo only >&2; exit 1", NULL, 60, NULL, &e));
    assert_string_equal(e.msg, "sh: exit status 1: only");
    assert_false(sh("exit 2", NULL, 60, NULL, &e));
    assert_string_equal(e.msg, "sh: exit status 2");
}

/* Bytes that would break a terminal, JSON or XML, and a line without end. */
TEST(the_line_is_short_printable_ascii)
{
    struct err e;
    assert_false(sh("printf 'a\\033[31m\\tb\\377'; exit 1", NULL, 60, NULL, &e));
    assert_string_equal(e.msg, "sh: exit status 1: a?[31m b?");
    assert_false(sh("head -c 100000 /dev/zero | tr '\\0' x; exit 1", NULL, 60, NULL, &e));
    assert_non_null(strstr(e.msg, "exit status 1: ...xxxx"));
    assert_true(strlen(e.msg) < 700);
}

TEST(a_signal_is_named)
{
    struct err e;
    assert_false(sh("echo before; kill -SEGV $$", NULL, 60, NULL, &e));
    assert_non_null(strstr(e.msg, "sh: killed by signal 11 ("));
    assert_non_null(strstr(e.msg, "): before"));
}

TEST(a_missing_program_is_not_found)
{
    struct err e;
    char path[4096];
    const char *const none[] = {"assay-no-such-program", NULL};
    assert_false(process_run(&(struct process){.argv = none}, NULL, &e));
    assert_string_equal(e.msg, "assay-no-such-program: no such program in PATH");
    const char *const directory[] = {"/", NULL};
    assert_false(process_run(&(struct process){.argv = directory}, NULL, &e));
    assert_string_equal(e.msg, "/: no such program");
    assert_false(process_find("assay-no-such-program", path, sizeof path));
    assert_false(process_find("", path, sizeof path));
    assert_true(process_find("sh", path, sizeof path));
    assert_int_equal(path[0], '/');
    assert_int_equal(access(path, X_OK), 0);
    assert_false(process_find("sh", path, 3));
}

/* Found and executable, but the kernel refuses it: its interpreter is missing. */
TEST(a_program_that_cannot_be_executed_says_why)
{
    static const char script[] = "#!/assay/no/such/interpreter\n";
    const char *path = test_path("script");
    char want[1024];
    test_write(path, script, strlen(script));
    assert_int_equal(chmod(path, 0755), 0);
    struct err e;
    const char *const argv[] = {path, NULL};
    assert_false(process_run(&(struct process){.argv = argv}, NULL, &e));
    snprintf(want, sizeof want,
             "%s: cannot run: %s: what its first line names (is there a Windows line end?)", path,
             strerror(ENOENT));
    assert_string_equal(e.msg, want);
}

/* The shell ignores SIGTERM and so does what it started: only SIGKILL to the group ends them. */
TEST(a_hang_is_killed_with_its_grandchild)
{
    const char *file = test_path("hang.pid");
    char script[2048];
    snprintf(script, sizeof script,
             "trap '' TERM; sleep 1000 & echo $! > %s; echo started; while :; do sleep 1; done",
             file);
    struct err e;
    struct process_usage u;
    assert_false(sh(script, NULL, 3, &u, &e));
    assert_string_equal(e.msg, "sh: no end after 3 s: started");
    assert_true(u.wall_s >= 3 && u.wall_s < 60);
    long pid = read_number(file);
    assert_true(pid > 1);
    assert_true(dies_soon(pid));
}

/* A program that ends but leaves a process behind, which holds the output open. */
TEST(what_a_finished_program_leaves_behind_is_killed)
{
    const char *file = test_path("left.pid");
    char script[2048];
    snprintf(script, sizeof script, "sleep 1000 & echo $! > %s", file);
    struct err e;
    struct process_usage u;
    assert_true(sh(script, NULL, 100, &u, &e));
    assert_true(u.wall_s < 60);
    assert_true(dies_soon(read_number(file)));
}

/* Ctrl-C, or even kill -9, of the harness must not leave an engine and its children running. */
TEST(the_death_of_the_caller_ends_the_group)
{
    const char *file = test_path("caller.pid");
    char script[2048];
    snprintf(script, sizeof script, "sleep 1000 & echo $! > %s.new; mv %s.new %s; wait", file, file,
             file);
    pid_t caller = fork();
    assert_true(caller >= 0);
    if (caller == 0)
        _exit(sh(script, NULL, 0, NULL, NULL) ? 0 : 1);
    long pid = -1;
    for (int i = 0; i < 2000 && pid < 0; i++) {
        usleep(10000);
        pid = read_number(file);
    }
    assert_true(pid > 1 && is_alive(pid));
    kill(caller, SIGKILL);
    assert_int_equal(waitpid(caller, NULL, 0), caller);
    assert_true(dies_soon(pid));
}

TEST(stdin_is_empty_and_the_directory_is_the_one_asked_for)
{
    const char *dir = test_path("gone");
    char want[1024];
    assert_int_equal(mkdir(dir, 0777), 0);
    struct err e;
    const char *const argv[] = {"sh", "-c", "cat; pwd -P; exit 1", NULL};
    assert_false(
        process_run(&(struct process){.argv = argv, .cwd = dir, .timeout_s = 60}, NULL, &e));
    OWN_TEXT real = realpath(dir, NULL);
    snprintf(want, sizeof want, "sh: exit status 1: %s", real);
    assert_string_equal(e.msg, want);
    rmdir(dir);
    REFUSES(process_run(&(struct process){.argv = argv, .cwd = dir}, NULL, &e), "sh: cannot run: ");
}

/* 1e5 lines of 100 bytes go to the log whole; only the last are quoted. */
TEST(a_long_output_is_logged_whole)
{
    const char *log = test_path("long.log");
    struct err e;
    assert_false(
        sh("yes 123456789012345678901234567890123456789012345678901234567890123456789012345"
           "678901234567890123456789 | head -n 100000; echo end; exit 5",
           log, 120, NULL, &e));
    assert_non_null(strstr(e.msg, "exit status 5: "));
    assert_string_equal(e.msg + strlen(e.msg) - 6, " | end");
    struct stat st;
    assert_int_equal(stat(log, &st), 0);
    assert_int_equal(st.st_size, 100 * 100000 + 4);
}

/* `yes` prints for ever, faster than we can read: the time limit must still apply and the log must
 * stay bounded. */
TEST(a_flood_is_stopped_by_the_clock_and_the_log_is_bounded)
{
    const char *log = test_path("flood.log");
    struct err e;
    struct process_usage u;
    REFUSES(sh("exec yes flood", log, 1, &u, &e), "sh: no end after 1 s: flood | flood");
    assert_true(u.wall_s < 60);
    struct stat st;
    assert_int_equal(stat(log, &st), 0);
    assert_true(st.st_size > 0 && st.st_size <= (64 << 20) + 64);
}

TEST(a_log_that_cannot_be_written_is_an_error)
{
    struct err e;
    REFUSES(sh("echo x", "/assay/no/such/directory/log", 60, NULL, &e),
            "/assay/no/such/directory/log: cannot write: ");
    REFUSES(sh("echo x", "/dev/full", 60, NULL, &e), "/dev/full: cannot write: ");
}

static void count_tick(void *ctx)
{
    ++*(int *)ctx;
}

/* Ticks come a few times a second: in about a second at least 2, and never more than 10 a second.
 */
TEST(the_caller_is_called_back_while_it_runs)
{
    int ticks = 0;
    const char *const argv[] = {"sleep", "1", NULL};
    struct err e;
    struct process_usage u;
    assert_true(process_run(&(struct process){.argv = argv, .tick = count_tick, .tick_ctx = &ticks},
                            &u, &e));
    assert_true(ticks >= 2 && ticks <= 10 * u.wall_s + 1);
}

enum { PAGE = 4096, PAGES = 4096 };

static void write_to_all(void *ctx)
{
    for (size_t i = 0; i < PAGES; i++)
        ++((char *)ctx)[i * PAGE];
}

/* After a fork() each page of the caller that it writes to is copied, in a fault: the 4096 that are written here. Other
 * faults are counted, too, so an eighth of that is allowed. */
TEST(the_memory_of_the_caller_is_not_copied)
{
    OWN_TEXT memory = aligned_alloc(PAGE, (size_t)PAGES * PAGE);
    assert_non_null(memory);
    memset(memory, 0, (size_t)PAGES * PAGE);
    const char *const argv[] = {"sleep", "0.5", NULL};
    struct err e;
    struct rusage first, last;
    getrusage(RUSAGE_SELF, &first);
    assert_true(process_run(
        &(struct process){.argv = argv, .tick = write_to_all, .tick_ctx = memory}, NULL, &e));
    getrusage(RUSAGE_SELF, &last);
    assert_true(memory[0] > 0);
    assert_true(last.ru_minflt - first.ru_minflt < PAGES / 8);
}

/* The shell's arithmetic loop burns CPU in a grandchild that the shell waits for. */
TEST(cpu_time_includes_descendants)
{
    struct err e;
    struct process_usage u;
    assert_true(
        sh("sh -c 'i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done'; exit 0", NULL, 120, &u, &e));
    assert_true(u.cpu_s > 0.02);
}

TEST(nothing_is_left_open_and_no_zombie_waits)
{
    struct err e;
    int before = count_fds();
    for (int i = 0; i < 20; i++) {
        assert_true(sh("true", "/dev/null", 60, NULL, &e));
        assert_false(sh("false", NULL, 60, NULL, &e));
        const char *const bad[] = {"sh", NULL};
        assert_false(process_run(&(struct process){.argv = bad, .cwd = "/assay/none"}, NULL, &e));
    }
    assert_int_equal(count_fds(), before);
    assert_int_equal(waitpid(-1, NULL, WNOHANG), -1);
    assert_int_equal(errno, ECHILD);
}

static void ignore(int sig)
{
    (void)sig;
}

/* Signals with a handler interrupt our system calls all the time (no SA_RESTART). */
TEST(interrupted_system_calls_are_repeated)
{
    struct sigaction act = {.sa_handler = ignore}, old;
    sigaction(SIGALRM, &act, &old);
    timer_t timer;
    assert_int_equal(timer_create(CLOCK_MONOTONIC, NULL, &timer), 0);
    struct itimerspec every = {.it_interval = {0, 2000000}, .it_value = {0, 2000000}};
    assert_int_equal(timer_settime(timer, 0, &every, NULL), 0);
    struct err e;
    bool ok = true;
    for (int i = 0; ok && i < 10; i++)
        ok = sh("sleep 0.05; echo done", "/dev/null", 60, NULL, &e);
    timer_delete(timer);
    sigaction(SIGALRM, &old, NULL);
    assert_true(ok);
}
