/* The sandbox against programs that want out of it. Each is a shell script of a few words; what it must not
 * reach, or may not use up, is known by construction. Every attack has its control: without the limit, or from
 * outside, the same thing works. Skipped, with a line, on a machine that has no sandbox. */
#define _GNU_SOURCE

#include "renderer/base/fs.h"
#include "tools/base/memory_group.h"
#include "tools/base/sandbox.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <sys/stat.h>
#include <sys/syscall.h>

enum { MIB = 1 << 20 };

static struct sandbox box, *in = &box; /* in: where the next program runs */
static bool has_sandbox;
static struct sandbox_job job; /* how */
static struct path out;        /* what it hands out */
static bool too_large;         /* what was packed last */

static const struct sandbox_limits small = {.wall_s = 60,
                                            .cpu_s = 30,
                                            .memory = (size_t)256 * MIB,
                                            .disk = (size_t)32 * MIB,
                                            .file = (size_t)8 * MIB,
                                            .processes = 24};

static struct sandbox_result run_with(const char *script, struct sandbox_limits limit,
                                      const char *tree)
{
    struct err e = {""}, ignored;
    struct sandbox_result r;
    if (in == &box && !has_sandbox)
        skip();
    assert_true(fs_remove_tree(out.s, &ignored));
    struct sandbox_job now = job;
    now.argv = (const char *const[]){"sh", "-c", script, NULL};
    now.tree = tree;
    now.keep = (const char *const[]){"out.png", "second", NULL};
    now.out = out.s;
    now.limit = limit;
    MUST(sandbox_run(in, &now, &r, &e));
    return r;
}

static struct sandbox_result run(const char *script)
{
    return run_with(script, small, NULL);
}

/* A run that keeps all it has made, as a tar of this name. */
static struct path run_for_tree(const char *script, const char *name)
{
    job.keep_tree = true;
    assert_int_equal(run(script).end, SANDBOX_OK);
    job.keep_tree = false;
    const struct path tree = fs_path("%s/%s", in->dir.path, name);
    assert_int_equal(rename(fs_path("%s/tree.tar", out.s).s, tree.s), 0);
    return tree;
}

/* What the program left under that name; NULL: nothing. Static. */
static const char *kept(const char *name)
{
    static char text[4096];
    FILE *f = fopen(fs_path("%s/%s", out.s, name).s, "rb");
    if (f == NULL)
        return NULL;
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    fclose(f);
    return text;
}

/* By a shell outside. */
static void must_do(struct path command)
{
    if (system(command.s) != 0)
        fail_msg("%s", command.s);
}

static void enter(struct sandbox *s)
{
    in = s;
    out = fs_path("%s/out", s->dir.path);
}

/* A box of its own for programs without namespaces. */
static void enter_bare(struct sandbox *s)
{
    struct err e;
    MUST(sandbox_open(true, NULL, s, &e));
    enter(s);
}

static void leave(struct sandbox *s)
{
    sandbox_close(s);
    enter(&box);
}

static void only_root(void)
{
    if (geteuid() != 0)
        skip();
}

static int open_sandbox(void **state)
{
    (void)state;
    struct err e;
    has_sandbox = sandbox_open(false, NULL, &box, &e);
    if (!has_sandbox)
        printf("skipped: %s\n", e.msg);
    enter(&box);
    return 0;
}

static int close_sandbox(void **state)
{
    (void)state;
    if (has_sandbox)
        sandbox_close(&box);
    return 0;
}

TEST(a_file_that_it_writes_comes_back)
{
    struct sandbox_result r =
        run("pwd; printf hello >out.png; cp out.png /tmp/x; echo nobody asked >other");
    assert_int_equal(r.end, SANDBOX_OK);
    assert_string_equal(r.why, "");
    assert_string_equal(kept("out.png"), "hello");
    assert_null(kept("other"));
    assert_null(kept("second"));
    assert_null(kept(".report"));
}

TEST(a_crash_is_told_with_its_last_words)
{
    struct sandbox_result r = run("echo before; kill -SEGV $$");
    assert_int_equal(r.end, SANDBOX_FAILED);
    assert_int_equal(r.status, 139);
    assert_non_null(strstr(r.why, "killed by signal 11"));
    assert_non_null(strstr(r.why, "before"));
    r = run("echo only; exit 7");
    assert_int_equal(r.end, SANDBOX_FAILED);
    assert_string_equal(r.why, "exit status 7: only");
    r = run("exec ./none");
    assert_int_equal(r.end, SANDBOX_FAILED);
}

/* 2 MiB of bells and escapes: the log keeps one, and none of them. Control: what is no control character comes as it was. */
TEST(a_log_is_cut_and_cleaned)
{
    if (!has_sandbox)
        skip();
    const struct path
        log = fs_path("%s/log", box.dir.path),
        seen = fs_path(
            "[ $(wc -c <%s) -lt 1100000 ] && head -c 30 %s | grep -q 'fine \303\251?\\[31m' && ! grep -aq \"$(printf '[\\001\\033]')\" %s && tail -n 1 %s | grep -q 'more output'",
            log.s, log.s, log.s, log.s);
    job.log = log.s;
    for (int k = 0; k < 2; k++) {
        struct sandbox s = box;
        s.unsafe = k == 1;
        in = &s;
        assert_int_equal(
            run("printf 'fine \303\251\033[31m\\n'; head -c 2M /dev/zero | tr '\\0' '\\001'").end,
            SANDBOX_OK);
        must_do(seen);
    }
    in = &box;
    job.log = NULL;
}

/* Ignores SIGTERM, and so does its child in a session of its own. */
TEST(a_hang_ends_with_all_its_processes)
{
    struct sandbox_limits limit = small;
    limit.wall_s = 2;
    const struct path script =
        fs_path("trap '' TERM; setsid sleep 98765.%d & while :; do sleep 1; done", getpid());
    struct sandbox_result r = run_with(script.s, limit, NULL);
    assert_int_equal(r.end, SANDBOX_WALL);
    assert_true(r.wall_s < 30);
    must_do(fs_path("sleep 0.5; ! grep -qs [9]8765.%d /proc/[0-9]*/cmdline", getpid()));
}

/* What a run had used when it was killed, and the file by which that is known is gone. Control: one that slept. */
TEST(a_killed_run_has_used_time)
{
    if (in != &box)
        skip();
    struct sandbox_limits limit = small;
    limit.wall_s = 3;
    struct sandbox_result busy = run_with("while :; do :; done", limit, NULL),
                          idle = run_with("sleep 60", limit, NULL);
    assert_int_equal(busy.end, SANDBOX_WALL);
    assert_int_equal(idle.end, SANDBOX_WALL);
    printf("busy for 3 s: %.2f CPU s; idle: %.2f\n", busy.cpu_s, idle.cpu_s);
    assert_true(busy.cpu_s > 0.5 && busy.cpu_s < 4 && idle.cpu_s < busy.cpu_s / 2);
    assert_true(access(fs_path("%s/.cpu", out.s).s, F_OK) != 0);
}

/* The kernel looks at its clock ticks, which a busy host may withhold from a virtual machine for a second or two, and
 * the time of the sandbox's own start is counted too: 2.5 s have been seen. Without the limit it is 60 s. */
TEST(a_busy_loop_ends_by_processor_time)
{
    struct sandbox_limits limit = small;
    limit.cpu_s = 1;
    struct sandbox_result r = run_with("while :; do :; done", limit, NULL);
    assert_int_equal(r.end, SANDBOX_CPU);
    assert_true(r.cpu_s >= 0.8 && r.cpu_s < 10);
    assert_int_equal(run_with("trap '' XCPU; while :; do :; done", limit, NULL).end, SANDBOX_CPU);
}

/* Every copy starts two more. No more than the limit can run at a time, as the kernel refuses to fork; what
 * is left of them is gone when the run returns. While /proc is listed some end and others begin, so that more may be
 * counted than there were at any time; without a limit there are thousands after a second. */
TEST(a_fork_bomb_stays_inside)
{
    struct sandbox_limits limit = small;
    limit.wall_s = 5;
    struct sandbox_result r = run_with(
        "b() { b | b & }; b; sleep 1; ls /proc | grep -c '^[0-9]' >out.png; exit 0", limit, NULL);
    if (kept("out.png") != NULL)
        assert_true(atoi(kept("out.png")) <= 4 * limit.processes);
    assert_true(r.wall_s < 30);
    /* The limit is what stops it: 16 sleepers are fine, 40 are not. */
    static const char sleepers[] = "i=0; while [ $i -lt %d ]; do sleep 1 & i=$((i+1)); done; wait";
    assert_int_equal(run(fs_path(sleepers, 16).s).end, SANDBOX_OK);
    assert_int_equal(run(fs_path(sleepers, 40).s).end, SANDBOX_FAILED);
}

TEST(a_file_of_100_gb_is_cut_off)
{
    assert_int_equal(run("exec head -c 100G /dev/zero >out.png").end, SANDBOX_FILE_SIZE);
    struct sandbox_result r = run("exec truncate -s 100G out.png");
    assert_int_not_equal(r.end, SANDBOX_OK);
    assert_int_equal(run("exec head -c 7M /dev/zero >out.png").end, SANDBOX_OK);
}

/* 10 files of 7 MB: each is allowed, all together are not. The same in every other place. */
TEST(many_files_fill_only_their_own_disk)
{
    static const char fill[] =
        "cd %s && for i in 1 2 3 4 5 6 7 8 9 10; do head -c 7M /dev/zero >f$i || exit 1; done";
    assert_int_equal(run(fs_path(fill, "/box").s).end, SANDBOX_DISK);
    assert_int_equal(run(fs_path(fill, "/tmp").s).end, SANDBOX_FAILED);
    assert_int_equal(run(fs_path(fill, "/dev/shm").s).end, SANDBOX_FAILED);
    struct sandbox_limits limit = small;
    limit.disk = (size_t)128 * MIB;
    assert_int_equal(run_with(fs_path(fill, "/box").s, limit, NULL).end, SANDBOX_OK);
}

TEST(memory_is_bounded_for_one_process_and_for_all)
{
    /* `tail` keeps the last line, 1 GB without an end of line. */
    struct sandbox_result r = run(
        "head -c 1G /dev/zero | tail -n 1 | wc -c >out.png; [ \"$(cat out.png)\" -gt 900000000 ]");
    assert_int_not_equal(r.end, SANDBOX_OK);
    /* Four with 150 MB each: every one is below the limit of 256 MiB, together they are above. */
    r = run(
        "for i in 1 2 3 4; do (head -c 150M /dev/zero; sleep 20) | tail -n 1 >/dev/null & done; wait");
    assert_int_equal(r.end, SANDBOX_MEMORY);
    assert_true(r.wall_s < 20);
    r = run("(head -c 150M /dev/zero; sleep 1) | tail -n 1 >/dev/null");
    assert_int_equal(r.end, SANDBOX_OK);
    /* Pages that belong to no process are not to be had: */
    static const char uncounted[] =
        "python3 -c 'import os; f = os.memfd_create(\"x\"); os.truncate(f, 1 << 20); print(\"memfd\")' 2>/dev/null;"
        "ipcmk -M 1048576 2>/dev/null; true";
    assert_int_equal(system("python3 -c 'import os; os.memfd_create(\"x\")'"), 0);
    const struct path script = fs_path("{ %s; } >out.png", uncounted);
    for (int k = 0; k < 2; k++) {
        job.tools = k == 1; /* has ipcmk */
        run(script.s);
        job.tools = false;
        assert_string_equal(kept("out.png"), "");
    }
}

/* A file of ours outside, that everybody may read. */
TEST(links_lead_nowhere)
{
    if (!has_sandbox)
        skip();
    const struct path secret = fs_path("%s/secret", box.dir.path);
    test_write(secret.s, "the golden\n", 11);
    assert_int_equal(chmod(secret.s, 0644), 0);
    assert_int_equal(
        run(fs_path("ln -s %s out.png; ln -s /etc/passwd second; true", secret.s).s).end,
        SANDBOX_OK);
    assert_null(kept("out.png"));
    assert_null(kept("second"));
    assert_int_equal(run(fs_path("cat %s >out.png", secret.s).s).end, SANDBOX_FAILED);
    assert_string_equal(kept("out.png"), "");
    /* What is no file is no output, and nobody waits for it. */
    struct sandbox_result r = run("mkfifo out.png; mkdir second");
    assert_int_equal(r.end, SANDBOX_OK);
    assert_true(r.wall_s < 30);
    assert_null(kept("out.png"));
    /* Links in the submission itself. */
    const struct path dir = fs_path("%s/submission", box.dir.path),
                      tree = fs_path("%s/tree.tar", box.dir.path);
    struct err e;
    must_do(fs_path("cd %s && mkdir submission && cd submission && ln -s %s out.png && "
                    "ln -s %s in && ln -s / scene && echo own >mine",
                    box.dir.path, secret.s, secret.s));
    MUST(sandbox_pack(dir.s, tree.s, MIB, &too_large, &e));
    assert_int_equal(run_with("cp mine second; cat in", small, tree.s).end, SANDBOX_FAILED);
    assert_null(kept("out.png"));
    assert_string_equal(kept("second"), "own\n");
}

/* What lies below /usr can be hidden; what else is ours is not there (test_attacks.c). */
TEST(a_folder_of_the_system_can_be_hidden)
{
    if (!has_sandbox)
        skip();
    struct sandbox other;
    struct err e;
    MUST(sandbox_open(false, (const char *const[]){"/usr/share", "/nowhere", NULL}, &other, &e));
    job.tools = true;
    enter(&other);
    run("ls /usr/share | wc -l >out.png");
    assert_string_equal(kept("out.png"), "0\n");
    leave(&other);
    run("ls /usr/share | wc -l >out.png");
    job.tools = false;
    assert_true(atoi(kept("out.png")) > 3);
}

/* Installed programs, such as other renderers that a submission might run, are visible to builds alone. */
TEST(only_a_build_sees_compilers)
{
    static const char look[] =
        "ls -d /usr/include/stdio.h /usr/lib/gcc/*/* /usr/share/* 2>/dev/null | head -n 20 >out.png;"
        "for p in cc gcc as ld make cmake pathtracer /usr/lib/gcc/*/*/cc1; do command -v $p; done >>out.png; true";
    run(look);
    assert_string_equal(kept("out.png"), "");
    job.tools = true;
    run(look);
    assert_non_null(strstr(kept("out.png"), "stdio.h"));
    assert_non_null(strstr(kept("out.png"), "/bin/make"));
    /* What has been linked runs without them. */
    const struct path tree =
        run_for_tree("echo 'int main(void){return 42;}' >a.c; cc -o a a.c", "linked.tar");
    job.tools = false;
    assert_int_equal(run_with("./a", small, tree.s).status, 42);
    job.library = "/box/lib";
    run("echo $LD_LIBRARY_PATH >out.png");
    job.library = NULL;
    assert_string_equal(kept("out.png"), "/box/lib\n");
}

/* Programs that would render in place of a student's, and files below a library folder: a build sees neither, nor does a run. Control:
 * a neighbour that is not hidden. */
TEST(what_is_installed_can_be_hidden)
{
    only_root();
    char bin[] = "/usr/local/bin/assay-test.XXXXXX", lib[] = "/usr/local/lib/assay-test.XXXXXX";
    struct err e;
    struct sandbox other;
    int fd = mkstemp(bin);
    assert_true(fd >= 0 && write(fd, "answer", 6) == 6 && fchmod(fd, 0755) == 0);
    close(fd);
    assert_non_null(mkdtemp(lib));
    must_do(fs_path("chmod 755 %s && mkdir %s/a %s/b && echo answer | tee %s/a/x >%s/b/x", lib, lib,
                    lib, lib, lib));
    const struct path a = fs_path("%s/a", lib),
                      script = fs_path("cat %s %s/a/x; cat %s/b/x >&2", bin, lib, lib),
                      all = fs_path("{ %s; } >out.png 2>second; true", script.s);
    for (int k = 0; k < 4; k++) {
        MUST(sandbox_open(k >= 2, (const char *const[]){bin, a.s, NULL}, &other, &e));
        job.tools = k % 2 == 0;
        enter(&other);
        run(all.s);
        job.tools = false;
        assert_string_equal(kept("out.png"), "");
        assert_non_null(strstr(kept("second"), "answer"));
        leave(&other);
    }
    REFUSES(sandbox_open(false, (const char *const[]){"/usr/local", NULL}, &other, &e),
            "cannot be hidden");
    assert_int_equal(unlink(bin), 0);
    assert_true(fs_remove_tree(lib, &e));
}

/* Everything that a run sees, except libraries and /proc, must be in a list; so must the shell's programs. */
TEST(a_run_sees_what_is_listed_and_nothing_else)
{
    static const char list[] =
        "^/$|^/(bin|box|dev|etc|lib|lib32|lib64|libx32|proc|sbin|tmp|usr)$|^/etc/(ld.so.cache|alternatives)$|^/etc/alternatives/|"
        "^/usr/(bin|lib|lib32|lib64|libx32|local|local/lib)$|^/box/(out.png|second)$|"
        "^/dev/(console|core|fd|full|null|ptmx|pts|pts/[0-9]+|pts/ptmx|random|shm|stderr|stdin|stdout|tty|urandom|zero)$|"
        "^/usr/bin/(\\[|awk|basename|bash|cat|chmod|cp|cut|date|dd|dirname|echo|env|expr|false|find|grep|head|id|ln|ls|mkdir|mkfifo|mktemp|mv|"
        "nproc|od|printf|prlimit|pwd|python3|rm|sed|seq|setsid|sh|sleep|sort|tail|tee|test|touch|tr|true|truncate|uname|uniq|wc)$";
    const struct path look = fs_path(
        "find / -path /proc -prune -o \\( -path '/usr/lib*/*' -o -path '/usr/local/lib/*' \\) -prune -o -print | grep -vE '%s' >out.png;"
        "find / -name '*.dae' -o -name '*.exr' -o -name 'oiio.so' -o -name '*.rubric' 2>/dev/null >second; true",
        list);
    run(look.s);
    assert_string_equal(kept("out.png"), "");
    assert_string_equal(kept("second"), "");
    run("find / -maxdepth 2 | grep -c / >out.png"); /* control: it does look */
    assert_true(atoi(kept("out.png")) > 30);
}

/* ldconfig(8) replaces /etc/ld.so.cache at any time, after which a mount of it cannot be mounted again. */
TEST(the_list_of_libraries_is_a_copy)
{
    struct stat st;
    if (stat("/etc/ld.so.cache", &st) != 0)
        skip();
    run("stat -c %i /etc/ld.so.cache >second; cat /etc/ld.so.cache >out.png");
    assert_int_not_equal(strtoul(kept("second"), NULL, 10), st.st_ino);
    must_do(fs_path("cmp /etc/ld.so.cache %s/out.png", out.s));
}

/* ccache's own account of hits and misses, and of what its directory holds before and after. */
TEST(only_staff_fill_the_compiler_cache)
{
    if (!has_sandbox || system("command -v ccache >/dev/null") != 0)
        skip();
    static const char build[] =
        "mkdir -p src && cd src && echo 'int three(void){return 3;}' >a.c && CCACHE_LOGFILE=/box/log cc -c a.c;"
        "cd /box; grep 'Succeeded getting cached result' log >out.png; (: >$CCACHE_DIR/x) && echo written >second; true";
    const struct path dir = fs_path("%s/cache", box.dir.path);
    job.cache = dir.s;
    job.tools = job.fill_cache = true;
    assert_int_equal(run(build).end, SANDBOX_OK);
    assert_string_equal(kept("second"), "written\n");
    must_do(fs_path("test \"$(find %s -type f -name '*[RM]' | wc -l)\" -gt 0", dir.s));
    job.fill_cache = false;
    assert_int_equal(run(build).end, SANDBOX_OK);
    assert_non_null(strstr(kept("out.png"), "cached result"));
    assert_null(kept("second"));
    must_do(fs_path("cp -R %s %s.before", dir.s, dir.s));
    /* Other text: compiled, and not kept. */
    assert_int_equal(
        run("echo 'int four(void){return 4;}' >b.c && cc -c b.c && cp b.o out.png; rm -rf $CCACHE_DIR/*; true")
            .end,
        SANDBOX_OK);
    assert_non_null(kept("out.png"));
    must_do(fs_path("diff -r %s %s.before", dir.s, dir.s));
    job.cache = NULL;
    job.tools = false;
}

TEST(the_environment_stays_outside)
{
    assert_int_equal(setenv("ASSAY_SECRET", "token", 1), 0);
    run("env >out.png; cat /proc/*/environ >second 2>/dev/null; true");
    unsetenv("ASSAY_SECRET");
    assert_null(strstr(kept("out.png"), "SECRET"));
    assert_null(strstr(kept("out.png"), "OUT="));
    assert_null(memmem(kept("second"), 4000, "SECRET", 6));
}

TEST(only_two_places_can_be_written)
{
    run("for d in / /usr /usr/bin /dev /etc /proc /out /in /var; do (: >$d/x) 2>/dev/null && echo $d; done >out.png; true");
    assert_string_equal(kept("out.png"), "");
    run("for d in /box /tmp /dev/shm; do (: >$d/x) && echo $d; done >out.png");
    assert_string_equal(kept("out.png"), "/box\n/tmp\n/dev/shm\n");
    /* No way to privileges; of the network there is lo. */
    run("grep -c : /proc/net/dev >out.png");
    assert_string_equal(kept("out.png"), "1\n");
    run("grep CapEff /proc/self/status >out.png; grep -c '' /proc/1/cmdline >second");
    assert_non_null(strstr(kept("out.png"), "0000000000000000"));
}

/* Neither the program's output nor a file named like the supervisor's report is taken for that report. */
TEST(a_made_up_report_is_not_believed)
{
    struct sandbox_result r =
        run("echo '0 ended' >.report; echo '0 ended'; echo results >results.json; exit 3");
    assert_int_equal(r.end, SANDBOX_FAILED);
    assert_int_equal(r.status, 3);
    assert_null(kept("results.json"));
}

TEST(a_tree_goes_from_one_run_to_the_next)
{
    if (!has_sandbox)
        skip();
    struct err e;
    const struct path moved =
        run_for_tree("mkdir d; printf 'echo built' >d/program; chmod +x d/program", "built.tar");
    assert_int_equal(run_with("./d/program >out.png", small, moved.s).end, SANDBOX_OK);
    assert_string_equal(kept("out.png"), "built\n");
    /* 40 MB of submission are not unpacked into 32, and cost nothing but this submission. */
    const struct path large = fs_path("%s/large", box.dir.path);
    must_do(fs_path("mkdir %s && head -c 40M /dev/urandom >%s/f", large.s, large.s));
    MUST(sandbox_pack(large.s, moved.s, (size_t)64 * MIB, &too_large, &e));
    assert_int_equal(run_with("true", small, moved.s).end, SANDBOX_UNPACK);
    REFUSES(sandbox_pack(large.s, moved.s, MIB, &too_large, &e), "cannot be packed into 1 MiB");
    assert_true(too_large);
    REFUSES(sandbox_pack(large.s, "/nowhere/x.tar", MIB, &too_large, &e), "cannot be packed");
    assert_false(too_large);
}

/* An image that was handed in under the output's name was not made by the run; a file of another name stays. */
TEST(what_was_there_is_no_output)
{
    const struct path tree =
        run_for_tree("echo old >out.png; echo old >second; echo old >third", "old.tar");
    assert_int_equal(run_with("cat third >second", small, tree.s).end, SANDBOX_OK);
    assert_null(kept("out.png"));
    assert_string_equal(kept("second"), "old\n");
}

/* The unsafe mode, only on request: time and file size are bounded, the rest is open. */
TEST(unsafe_is_as_unsafe_as_it_says)
{
    struct sandbox s;
    enter_bare(&s);
    assert_int_equal(run(fs_path("test -d %s && printf hello >out.png", s.dir.path).s).end,
                     SANDBOX_OK);
    assert_string_equal(kept("out.png"), "hello");
    assert_int_equal(run("exec head -c 100G /dev/zero >out.png").end, SANDBOX_FILE_SIZE);
    /* Root is replaced by an otherwise unused user: no file of ours can be read, and there is no way back. */
    const struct path secret = fs_path("%s/secret", s.dir.path);
    test_write(secret.s, "mine", 4);
    assert_int_equal(chmod(secret.s, 0600), 0);
    run(fs_path("id -u >out.png; cat %s; ln -sf %s x", secret.s, secret.s).s);
    if (geteuid() == 0)
        assert_in_range(atoi(kept("out.png")), 60578, 61183);
    bool landlock = syscall(SYS_landlock_create_ruleset, NULL, 0, 1) >= 1;
    assert_int_equal(run(fs_path("cat %s >out.png", secret.s).s).end,
                     geteuid() == 0 || landlock ? SANDBOX_FAILED : SANDBOX_OK);
    leave(&s);
    assert_int_not_equal(access(s.dir.path, F_OK), 0);
}

/* A daemon of the first run waits for the second one's folders, and puts links to ours in their place: as root would
 * unpack or remove by path, it would write and remove where they lead. 2000 files leave it time. */
TEST(a_folder_that_is_swapped_leads_nowhere)
{
    only_root();
    struct sandbox s;
    struct err e;
    enter_bare(&s);
    const struct path dir = fs_path("%s/sub", s.dir.path),
                      tree = fs_path("%s/w/tree.tar", s.dir.path),
                      victim = fs_path("%s/victim", s.dir.path);
    must_do(fs_path(
        "mkdir -p %s/d %s/w %s && cd %s/d && seq 2000 | xargs touch && cd %s && seq 5000 9000 | xargs touch",
        dir.s, s.dir.path, victim.s, dir.s, victim.s));
    MUST(sandbox_pack(dir.s, tree.s, 16 * MIB, &too_large, &e));
    const struct path script = fs_path(
        "setsid sh -c 'while [ ! -e %s/stop ]; do [ -L d ] || ! mv d was 2>/dev/null || ln -s %s d; cd %s/w/box; done' "
        ">/dev/null 2>&1 & sleep 0.2",
        s.dir.path, victim.s, s.dir.path);
    for (int i = 0; i < 4; i++)
        run_with(i == 0 ? script.s : "sleep 0.1", small, tree.s);
    must_do(fs_path("touch %s/stop; [ $(ls %s | wc -l) = 4001 ]", s.dir.path, victim.s));
    leave(&s);
}

/* Processes, files in world-writable folders and System V objects are removed. Control: those of another user stay.
 * */
TEST(nothing_of_a_run_without_namespaces_is_left)
{
    only_root();
    struct sandbox s;
    enter_bare(&s);
    const struct path script = fs_path(
        "setsid sleep 98766.%d & for d in /tmp /var/tmp /dev/shm; do mkdir -p $d/assay-left-%d/in; done;"
        "ipcmk -M 4096; ipcmk -S 2; ipcmk -Q; id -u >out.png; id -G >>out.png",
        getpid(), getpid());
    must_do(fs_path("ipcs -a | grep -c ^0x >%s/before; true", s.dir.path));
    run(script.s);
    assert_non_null(kept("out.png"));
    must_do(fs_path(
        "! grep -qs [9]8766.%d /proc/[0-9]*/cmdline && ! ls -d /tmp/assay-left-%d /var/tmp/assay-left-%d "
        "/dev/shm/assay-left-%d 2>/dev/null && ipcs -a | grep -c ^0x | cmp - %s/before",
        getpid(), getpid(), getpid(), getpid(), s.dir.path));
    leave(&s);
}

/* Four processes hold 150 MB each at the same time. None exceeds its own limit, and without namespaces only the
 * kernel's memory group can add them up. Control: two processes. */
TEST(memory_of_all_is_bounded_without_namespaces)
{
    only_root();
    struct memory_group group;
    memory_group_open(&group, MIB);
    if (group.path[0] == '\0')
        skip();
    memory_group_close(&group);
    struct sandbox s;
    enter_bare(&s);
    static const char fill[] =
        "set --; for i in %s; do (head -c 150M /dev/zero; touch full.$i; until [ -e go ]; do sleep .1; done) | "
        "tail -n 1 >/dev/null & set -- $@ $!; done; for i in %s; do until [ -e full.$i ]; do sleep .1; done; done; touch go;"
        "for p; do wait $p || exit 1; done";
    static const char *const four = "1 2 3 4", *const two = "1 2";
    assert_int_equal(run(fs_path(fill, four, four).s).end, SANDBOX_MEMORY);
    assert_int_equal(run(fs_path(fill, two, two).s).end, SANDBOX_OK);
    leave(&s);
}

/* Without namespaces a run has a place for temporary files, and programs that need libraries run. */
TEST(a_run_without_namespaces_has_its_own)
{
    only_root();
    struct sandbox s;
    enter_bare(&s);
    run("echo x >$TMPDIR/x && cat $TMPDIR/x /etc/ld.so.conf >/dev/null && mktemp >&2 && echo fine >out.png");
    assert_string_equal(kept("out.png"), "fine\n");
    leave(&s);
}

/* Without bwrap in PATH there is a line, not a run. */
TEST(without_bubblewrap_it_refuses)
{
    struct sandbox s;
    struct err e;
    OWN_TEXT path = strdup(getenv("PATH"));
    setenv("PATH", "/nowhere", 1);
    bool ok = sandbox_open(false, NULL, &s, &e);
    setenv("PATH", path, 1);
    assert_false(ok);
    assert_non_null(strstr(e.msg, "no sandbox for other people's programs on this machine: "));
}

/* A bwrap that is killed takes its machine with it only after a while, in which the program fails for want of its log (signal 13, SIGPIPE)
 * and the supervisor reports that. It is not the program's fault. The control is a bwrap that ends by itself with the same report. */
TEST(a_report_of_a_machine_that_is_killed_is_none)
{
    static const char *const end[] = {"exit 141", "kill -9 $$"};
    OWN_TEXT path = strdup(getenv("PATH"));
    const struct path dir = fs_path("%s/killed", box.dir.path), name = fs_path("%s/bwrap", dir.s),
                      with = fs_path("%s:%s", dir.s, path);
    struct err e;
    MUST(fs_make_dirs(dir.s, &e));
    for (int i = 0; i < 2; i++) {
        const struct path text =
            fs_path("#!/bin/sh\necho '141 ended 0' >%s/.report\n%s\n", out.s, end[i]);
        test_write(name.s, text.s, strlen(text.s));
        assert_int_equal(chmod(dir.s, 0755) + chmod(name.s, 0755), 0);
        setenv("PATH", with.s, 1);
        struct sandbox_result r = run("true");
        setenv("PATH", path, 1);
        assert_int_equal(r.end, i == 0 ? SANDBOX_FAILED : SANDBOX_LOST);
    }
}

TEST_GROUP(open_sandbox, close_sandbox)
