/* The sandbox against programs that want out of it. Each is a shell script of a few words; what it must not
 * reach, or may not use up, is known by construction. Every attack has its control: without the limit, or from
 * outside, the same thing works. Skipped, with a line, on a machine that has no sandbox. */
#define _GNU_SOURCE

#include "renderer/base/fs.h"
#include "tools/base/memory_group.h"
#include "tools/base/sandbox.h"
#include "tests/support/test.h"

#include <sys/stat.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <netinet/in.h>

enum { MIB = 1 << 20 };

static struct sandbox box;
static bool has_sandbox;
static char out_dir[700];
/* Of the next runs: a build, with a compiler cache. */
static bool tools, fill_cache;
static bool too_large; /* what was packed last */
static const char *cache, *library;

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
    if (!has_sandbox)
        skip();
    assert_true(fs_remove_tree(out_dir, &ignored));
    const struct sandbox_job job = {.argv = (const char *const[]){"sh", "-c", script, NULL},
                                    .tree = tree,
                                    .keep = (const char *const[]){"out.png", "second", NULL},
                                    .out = out_dir,
                                    .tools = tools,
                                    .cache = cache,
                                    .fill_cache = fill_cache,
                                    .library = library,
                                    .limit = limit};
    MUST(sandbox_run(&box, &job, &r, &e));
    return r;
}

static struct sandbox_result run(const char *script)
{
    return run_with(script, small, NULL);
}

/* What the program left under that name; NULL: nothing. Static. */
static const char *kept(const char *name)
{
    static char text[4096];
    char path[800];
    snprintf(path, sizeof path, "%s/%s", out_dir, name);
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return NULL;
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    fclose(f);
    return text;
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
    else
        snprintf(out_dir, sizeof out_dir, "%s/out", box.dir.path);
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
    struct err e;
    struct sandbox_result r;
    for (int k = 0; k < 2; k++) {
        struct sandbox s = box;
        s.unsafe = k == 1;
        const struct sandbox_job job = {
            .argv =
                (const char *const[]){
                    "sh", "-c",
                    "printf 'fine \303\251\033[31m\\n'; head -c 2M /dev/zero | tr '\\0' '\\001'",
                    NULL},
            .out = out_dir,
            .log = log.s,
            .limit = small};
        MUST(sandbox_run(&s, &job, &r, &e));
        assert_int_equal(r.end, SANDBOX_OK);
        assert_int_equal(system(seen.s), 0);
    }
}

/* Ignores SIGTERM, and so does its child in a session of its own. */
TEST(a_hang_ends_with_all_its_processes)
{
    struct sandbox_limits limit = small;
    limit.wall_s = 2;
    char script[128];
    snprintf(script, sizeof script,
             "trap '' TERM; setsid sleep 98765.%d & while :; do sleep 1; done", getpid());
    struct sandbox_result r = run_with(script, limit, NULL);
    assert_int_equal(r.end, SANDBOX_WALL);
    assert_true(r.wall_s < 30);
    char find[128];
    snprintf(find, sizeof find, "sleep 0.5; ! grep -qs [9]8765.%d /proc/[0-9]*/cmdline", getpid());
    assert_int_equal(system(find), 0);
}

TEST(a_busy_loop_ends_by_processor_time)
{
    struct sandbox_limits limit = small;
    limit.cpu_s = 1;
    struct sandbox_result r = run_with("while :; do :; done", limit, NULL);
    assert_int_equal(r.end, SANDBOX_CPU);
    assert_true(r.cpu_s >= 0.8 && r.cpu_s < 2.5);
    assert_int_equal(run_with("trap '' XCPU; while :; do :; done", limit, NULL).end, SANDBOX_CPU);
}

/* Every copy starts two more. The number that ran at a time cannot pass the limit: the kernel says "cannot
 * fork". What is left of it is gone when the run returns. */
TEST(a_fork_bomb_stays_inside)
{
    struct sandbox_limits limit = small;
    limit.wall_s = 5;
    struct sandbox_result r = run_with(
        "b() { b | b & }; b; sleep 1; ls /proc | grep -c '^[0-9]' >out.png; exit 0", limit, NULL);
    if (kept("out.png") != NULL)
        assert_true(atoi(kept("out.png")) <= limit.processes + 4);
    assert_true(r.wall_s < 30);
    /* The limit is what stops it: 16 sleepers are fine, 40 are not. */
    const char *sleepers = "i=0; while [ $i -lt $N ]; do sleep 1 & i=$((i+1)); done; wait";
    char script[128];
    snprintf(script, sizeof script, "N=16; %s", sleepers);
    assert_int_equal(run(script).end, SANDBOX_OK);
    snprintf(script, sizeof script, "N=40; %s", sleepers);
    assert_int_equal(run(script).end, SANDBOX_FAILED);
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
    char script[256];
    snprintf(script, sizeof script, fill, "/box");
    assert_int_equal(run(script).end, SANDBOX_DISK);
    snprintf(script, sizeof script, fill, "/tmp");
    assert_int_equal(run(script).end, SANDBOX_FAILED);
    snprintf(script, sizeof script, fill, "/dev/shm");
    assert_int_equal(run(script).end, SANDBOX_FAILED);
    struct sandbox_limits limit = small;
    limit.disk = (size_t)128 * MIB;
    snprintf(script, sizeof script, fill, "/box");
    assert_int_equal(run_with(script, limit, NULL).end, SANDBOX_OK);
}

TEST(memory_is_bounded_for_one_process_and_for_all)
{
    /* `tail` keeps the last line, 1 GB without an end of line. */
    struct sandbox_result r = run(
        "head -c 1G /dev/zero | tail -n 1 | wc -c >out.png; [ \"$(cat out.png)\" -gt 900000000 ]");
    assert_int_not_equal(r.end, SANDBOX_OK);
    /* Four with 100 MB each, under 256 MiB for each of them. */
    r = run(
        "for i in 1 2 3 4; do (head -c 100M /dev/zero; sleep 20) | tail -n 1 >/dev/null & done; wait");
    assert_int_equal(r.end, SANDBOX_MEMORY);
    assert_true(r.wall_s < 20);
    r = run("(head -c 100M /dev/zero; sleep 1) | tail -n 1 >/dev/null");
    assert_int_equal(r.end, SANDBOX_OK);
    /* Pages that belong to no process are not to be had: */
    static const char uncounted[] =
        "python3 -c 'import os; f = os.memfd_create(\"x\"); os.truncate(f, 1 << 20); print(\"memfd\")' 2>/dev/null;"
        "ipcmk -M 1048576 2>/dev/null; true";
    assert_int_equal(system("python3 -c 'import os; os.memfd_create(\"x\")'"), 0);
    const struct path script = fs_path("{ %s; } >out.png", uncounted);
    for (int k = 0; k < 2; k++) {
        tools = k == 1; /* has ipcmk */
        run(script.s);
        tools = false;
        assert_string_equal(kept("out.png"), "");
    }
}

/* A file of ours outside, that everybody may read. */
TEST(links_lead_nowhere)
{
    if (!has_sandbox)
        skip();
    char secret[600], script[4096];
    snprintf(secret, sizeof secret, "%s/secret", box.dir.path);
    test_write(secret, "the golden\n", 11);
    assert_int_equal(chmod(secret, 0644), 0);
    snprintf(script, sizeof script, "ln -s %s out.png; ln -s /etc/passwd second; true", secret);
    assert_int_equal(run(script).end, SANDBOX_OK);
    assert_null(kept("out.png"));
    assert_null(kept("second"));
    snprintf(script, sizeof script, "cat %s >out.png", secret);
    assert_int_equal(run(script).end, SANDBOX_FAILED);
    assert_string_equal(kept("out.png"), "");
    /* What is no file is no output, and nobody waits for it. */
    struct sandbox_result r = run("mkfifo out.png; mkdir second");
    assert_int_equal(r.end, SANDBOX_OK);
    assert_true(r.wall_s < 30);
    assert_null(kept("out.png"));
    /* Links in the submission itself. */
    char tree[600], dir[600], command[4096];
    struct err e;
    snprintf(dir, sizeof dir, "%s/submission", box.dir.path);
    snprintf(tree, sizeof tree, "%s/tree.tar", box.dir.path);
    snprintf(command, sizeof command,
             "mkdir %s && ln -s %s %s/out.png && ln -s / %s/scene && echo own >%s/second", dir,
             secret, dir, dir, dir);
    assert_int_equal(system(command), 0);
    assert_true(sandbox_pack(dir, tree, MIB, &too_large, &e));
    assert_int_equal(run_with("cat out.png", small, tree).end, SANDBOX_FAILED);
    assert_null(kept("out.png"));
    assert_string_equal(kept("second"), "own\n");
}

/* The checkout, the goldens and the user's home are not there; what lies below /usr can be hidden. */
TEST(nothing_of_ours_can_be_read)
{
    if (!has_sandbox)
        skip();
    char here[512], script[1200];
    assert_non_null(getcwd(here, sizeof here));
    assert_int_equal(access("golden/diagnose/manifest.json", R_OK), 0);
    snprintf(
        script, sizeof script,
        "ls %s && echo seen >out.png; ls / >second; find / -name manifest.json >>second 2>/dev/null; true",
        here);
    run(script);
    assert_null(kept("out.png"));
    assert_null(strstr(kept("second"), "manifest.json"));
    assert_null(strstr(kept("second"), "home"));
    struct sandbox other;
    struct err e;
    assert_true(
        sandbox_open(false, (const char *const[]){"/usr/share", "/nowhere", NULL}, &other, &e));
    const struct sandbox ours = box;
    box = other;
    tools = true;
    run("ls /usr/share | wc -l >out.png");
    box = ours;
    assert_string_equal(kept("out.png"), "0\n");
    sandbox_close(&other);
    run("ls /usr/share | wc -l >out.png");
    tools = false;
    assert_true(atoi(kept("out.png")) > 3);
}

/* Nor other people's renderers, which a program might run: what is installed is seen by builds alone. */
TEST(only_a_build_sees_compilers)
{
    static const char look[] =
        "ls -d /usr/include/stdio.h /usr/lib/gcc/*/* /usr/share/* 2>/dev/null | head -n 20 >out.png;"
        "for p in cc gcc as ld make cmake pathtracer /usr/lib/gcc/*/*/cc1; do command -v $p; done >>out.png; true";
    run(look);
    assert_string_equal(kept("out.png"), "");
    tools = true;
    run(look);
    tools = false;
    assert_non_null(strstr(kept("out.png"), "stdio.h"));
    assert_non_null(strstr(kept("out.png"), "/bin/make"));
    /* What has been linked runs without them. */
    char tree[600], from[800];
    const struct sandbox_job job = {
        .argv = (const char *const[]){"sh", "-c",
                                      "echo 'int main(void){return 42;}' >a.c; cc -o a a.c", NULL},
        .keep_tree = true,
        .tools = true,
        .out = out_dir,
        .limit = small};
    struct sandbox_result r;
    struct err e;
    MUST(sandbox_run(&box, &job, &r, &e));
    assert_int_equal(r.end, SANDBOX_OK);
    snprintf(from, sizeof from, "%s/tree.tar", out_dir);
    snprintf(tree, sizeof tree, "%s/linked.tar", box.dir.path);
    assert_int_equal(rename(from, tree), 0);
    assert_int_equal(run_with("./a", small, tree).status, 42);
    library = "/box/lib";
    run("echo $LD_LIBRARY_PATH >out.png");
    library = NULL;
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
    const struct path make =
        fs_path("chmod 755 %s && mkdir %s/a %s/b && echo answer | tee %s/a/x >%s/b/x", lib, lib,
                lib, lib, lib);
    assert_int_equal(system(make.s), 0);
    const struct path a = fs_path("%s/a", lib),
                      script = fs_path("cat %s %s/a/x; cat %s/b/x >&2", bin, lib, lib),
                      all = fs_path("{ %s; } >out.png 2>second; true", script.s);
    for (int k = 0; k < 4; k++) {
        MUST(sandbox_open(k >= 2, (const char *const[]){bin, a.s, NULL}, &other, &e));
        const struct sandbox ours = box;
        box = other;
        tools = k % 2 == 0;
        run(all.s);
        box = ours;
        tools = false;
        sandbox_close(&other);
        assert_string_equal(kept("out.png"), "");
        assert_non_null(strstr(kept("second"), "answer"));
    }
    assert_false(sandbox_open(false, (const char *const[]){"/usr/local", NULL}, &other, &e));
    assert_non_null(strstr(e.msg, "cannot be hidden"));
    assert_int_equal(unlink(bin), 0);
    assert_true(fs_remove_tree(lib, &e));
}

/* All that a run sees but for libraries, /proc and its shell's programs, of which each has to be of a list. */
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

/* ccache's own account of hits and misses, and of what its directory holds before and after. */
TEST(only_staff_fill_the_compiler_cache)
{
    if (!has_sandbox || system("command -v ccache >/dev/null") != 0)
        skip();
    static const char build[] =
        "mkdir -p $D && cd $D && echo 'int three(void){return 3;}' >a.c && CCACHE_LOGFILE=/box/log cc -c a.c;"
        "cd /box; grep 'Succeeded getting cached result' log >out.png; (: >$CCACHE_DIR/x) && echo written >second; true";
    char dir[600], count[800], script[1400];
    snprintf(dir, sizeof dir, "%s/cache", box.dir.path);
    snprintf(count, sizeof count, "test \"$(find %s -type f -name '*[RM]' | wc -l)\" ", dir);
    cache = dir;
    tools = fill_cache = true;
    snprintf(script, sizeof script, "D=src; %s", build);
    assert_int_equal(run(script).end, SANDBOX_OK);
    assert_string_equal(kept("second"), "written\n");
    snprintf(script, sizeof script, "%s -gt 0", count);
    assert_int_equal(system(script), 0);
    fill_cache = false;
    snprintf(script, sizeof script, "D=src; %s", build);
    assert_int_equal(run(script).end, SANDBOX_OK);
    assert_non_null(strstr(kept("out.png"), "cached result"));
    assert_null(kept("second"));
    snprintf(script, sizeof script, "cp -R %s %s.before", dir, dir);
    assert_int_equal(system(script), 0);
    /* Other text: compiled, and not kept. */
    assert_int_equal(
        run("echo 'int four(void){return 4;}' >b.c && cc -c b.c && cp b.o out.png; rm -rf $CCACHE_DIR/*; true")
            .end,
        SANDBOX_OK);
    assert_non_null(kept("out.png"));
    snprintf(script, sizeof script, "diff -r %s %s.before", dir, dir);
    assert_int_equal(system(script), 0);
    cache = NULL;
    tools = false;
}

/* A server of ours on the loopback, which a program outside reaches. */
TEST(there_is_no_network)
{
    if (!has_sandbox)
        skip();
    int s = socket(AF_INET, SOCK_STREAM, 0);
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof at;
    assert_int_equal(bind(s, (struct sockaddr *)&at, size), 0);
    assert_int_equal(listen(s, 4), 0);
    assert_int_equal(getsockname(s, (struct sockaddr *)&at, &size), 0);
    char script[256], outside[512];
    snprintf(script, sizeof script, "exec 3<>/dev/tcp/127.0.0.1/%d", ntohs(at.sin_port));
    snprintf(outside, sizeof outside, "bash -c '%s' 2>/dev/null", script);
    assert_int_equal(system(outside), 0);
    snprintf(outside, sizeof outside, "bash -c '%s'", script);
    assert_int_equal(run(outside).end, SANDBOX_FAILED);
    run("cat /proc/net/dev | grep -c : >out.png");
    assert_string_equal(kept("out.png"), "1\n"); /* lo */
    close(s);
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
    /* No way to privileges or to a machine within. */
    assert_int_equal(run("unshare -U true").end, SANDBOX_FAILED);
    run("grep CapEff /proc/self/status >out.png; grep -c '' /proc/1/cmdline >second");
    assert_non_null(strstr(kept("out.png"), "0000000000000000"));
}

/* Its words are not taken for the supervisor's, nor a file named like its report. */
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
    char built[800], moved[800];
    struct err e;
    struct sandbox_result r;
    const struct sandbox_job job = {
        .argv = (const char *const[]){"sh", "-c",
                                      "mkdir d; printf 'echo built' >d/program; chmod +x d/program",
                                      NULL},
        .keep_tree = true,
        .out = out_dir,
        .limit = small};
    assert_true(sandbox_run(&box, &job, &r, &e));
    assert_int_equal(r.end, SANDBOX_OK);
    snprintf(built, sizeof built, "%s/tree.tar", out_dir);
    snprintf(moved, sizeof moved, "%s/built.tar", box.dir.path);
    assert_int_equal(rename(built, moved), 0);
    r = run_with("./d/program >out.png", small, moved);
    assert_int_equal(r.end, SANDBOX_OK);
    assert_string_equal(kept("out.png"), "built\n");
    /* 100 MB of submission are not unpacked into 32, and cost nothing but this submission. */
    char command[2000];
    snprintf(command, sizeof command, "mkdir %s/large && head -c 40M /dev/urandom >%s/large/f",
             box.dir.path, box.dir.path);
    assert_int_equal(system(command), 0);
    snprintf(command, sizeof command, "%s/large", box.dir.path);
    assert_true(sandbox_pack(command, moved, (size_t)64 * MIB, &too_large, &e));
    assert_int_equal(run_with("true", small, moved).end, SANDBOX_UNPACK);
    REFUSES(sandbox_pack(command, moved, MIB, &too_large, &e), "cannot be packed into 1 MiB");
    assert_true(too_large);
    REFUSES(sandbox_pack(command, "/nowhere/x.tar", MIB, &too_large, &e), "cannot be packed");
    assert_false(too_large);
}

/* On request, and only then: time and file size are bounded, the rest is open. */
TEST(unsafe_is_as_unsafe_as_it_says)
{
    struct sandbox s;
    struct err e;
    struct sandbox_result r;
    char out[600], script[1400];
    assert_true(sandbox_open(true, NULL, &s, &e));
    snprintf(out, sizeof out, "%s/out", s.dir.path);
    snprintf(script, sizeof script, "test -d %s && printf hello >out.png", s.dir.path);
    struct sandbox_job job = {.argv = (const char *const[]){"sh", "-c", script, NULL},
                              .keep = (const char *const[]){"out.png", NULL},
                              .out = out,
                              .limit = small};
    assert_true(sandbox_run(&s, &job, &r, &e));
    assert_int_equal(r.end, SANDBOX_OK);
    snprintf(out_dir, sizeof out_dir, "%s", out);
    assert_string_equal(kept("out.png"), "hello");
    job.argv = (const char *const[]){"sh", "-c", "exec head -c 100G /dev/zero >out.png", NULL};
    assert_true(sandbox_run(&s, &job, &r, &e));
    assert_int_equal(r.end, SANDBOX_FILE_SIZE);
    /* Of root only that is left that nobody has: no file of ours, and no way back. */
    char secret[600];
    snprintf(secret, sizeof secret, "%s/secret", s.dir.path);
    FILE *f = fopen(secret, "w");
    assert_true(f != NULL && fchmod(fileno(f), 0600) == 0 && fputs("mine", f) >= 0);
    fclose(f);
    snprintf(script, sizeof script, "id -u >out.png; cat %s; ln -sf %s x", secret, secret);
    job.argv = (const char *const[]){"sh", "-c", script, NULL};
    assert_true(sandbox_run(&s, &job, &r, &e));
    if (geteuid() == 0)
        assert_in_range(atoi(kept("out.png")), 60578, 61183);
    snprintf(script, sizeof script, "cat %s >out.png", secret);
    assert_true(sandbox_run(&s, &job, &r, &e));
    bool landlock = syscall(SYS_landlock_create_ruleset, NULL, 0, 1) >= 1;
    assert_int_equal(r.end, geteuid() == 0 || landlock ? SANDBOX_FAILED : SANDBOX_OK);
    sandbox_close(&s);
    assert_int_not_equal(access(s.dir.path, F_OK), 0);
    snprintf(out_dir, sizeof out_dir, "%s/out", box.dir.path);
}

/* What a run without namespaces is to others who come after it. */
static struct sandbox_result run_bare(struct sandbox *s, const char *script, const char *tree)
{
    struct sandbox_result r;
    struct err e;
    const struct sandbox_job job = {.argv = (const char *const[]){"sh", "-c", script, NULL},
                                    .tree = tree,
                                    .keep = (const char *const[]){"out.png", NULL},
                                    .out = out_dir,
                                    .limit = small};
    MUST(sandbox_run(s, &job, &r, &e));
    return r;
}

/* A box of its own for programs without namespaces, and a place in it for what they hand out. */
static void open_bare(struct sandbox *s)
{
    struct err e;
    MUST(sandbox_open(true, NULL, s, &e));
    snprintf(out_dir, sizeof out_dir, "%.600s", fs_path("%s/o", s->dir.path).s);
}

static void close_bare(struct sandbox *s)
{
    sandbox_close(s);
    snprintf(out_dir, sizeof out_dir, "%s/out", box.dir.path);
}

/* A daemon of the first run waits for the second one's folders, and puts links to ours in their place: as root would
 * unpack or remove by path, it would write and remove where they lead. 2000 files leave it time. */
TEST(a_folder_that_is_swapped_leads_nowhere)
{
    only_root();
    struct sandbox s;
    struct err e;
    open_bare(&s);
    const struct path dir = fs_path("%s/sub", s.dir.path),
                      tree = fs_path("%s/w/tree.tar", s.dir.path),
                      victim = fs_path("%s/victim", s.dir.path);
    const struct path make = fs_path(
        "mkdir -p %s/d %s/w %s && cd %s/d && seq 2000 | xargs touch && cd %s && seq 5000 9000 | xargs touch",
        dir.s, s.dir.path, victim.s, dir.s, victim.s);
    assert_int_equal(system(make.s), 0);
    MUST(sandbox_pack(dir.s, tree.s, 16 * MIB, &too_large, &e));
    const struct path script = fs_path(
        "setsid sh -c 'while [ ! -e %s/stop ]; do [ -L d ] || ! mv d was 2>/dev/null || ln -s %s d; cd %s/w/box; done' "
        ">/dev/null 2>&1 & sleep 0.2",
        s.dir.path, victim.s, s.dir.path);
    for (int i = 0; i < 4; i++)
        run_bare(&s, i == 0 ? script.s : "sleep 0.1", tree.s);
    const struct path count =
        fs_path("touch %s/stop; [ $(ls %s | wc -l) = 4001 ]", s.dir.path, victim.s);
    assert_int_equal(system(count.s), 0);
    close_bare(&s);
}

/* Processes, files where everybody may write, System V objects. Control: of another user they stay. */
TEST(nothing_of_a_run_without_namespaces_is_left)
{
    only_root();
    struct sandbox s;
    open_bare(&s);
    const struct path script = fs_path(
        "setsid sleep 98766.%d & for d in /tmp /var/tmp /dev/shm; do mkdir -p $d/assay-left-%d/in; done;"
        "ipcmk -M 4096; ipcmk -S 2; ipcmk -Q; id -u >out.png; id -G >>out.png",
        getpid(), getpid());
    const struct path count = fs_path("ipcs -a | grep -c ^0x >%s/before; true", s.dir.path);
    assert_int_equal(system(count.s), 0);
    run_bare(&s, script.s, NULL);
    assert_non_null(kept("out.png"));
    const struct path look = fs_path(
        "! grep -qs [9]8766.%d /proc/[0-9]*/cmdline && ! ls -d /tmp/assay-left-%d /var/tmp/assay-left-%d "
        "/dev/shm/assay-left-%d 2>/dev/null && ipcs -a | grep -c ^0x | cmp - %s/before",
        getpid(), getpid(), getpid(), getpid(), s.dir.path);
    assert_int_equal(system(look.s), 0);
    close_bare(&s);
}

/* Eight with 100 MB each, which no process may not have, and no namespaces in which somebody counts them: the kernel does. Control: two. */
TEST(memory_of_all_is_bounded_without_namespaces)
{
    only_root();
    struct memory_group group;
    memory_group_open(&group, MIB);
    if (group.path[0] == '\0')
        skip();
    memory_group_close(&group);
    struct sandbox s;
    struct err e;
    MUST(sandbox_open(true, NULL, &s, &e));
    static const char fill[] =
        "set --; for i in %s; do (head -c 100M /dev/zero; sleep 2) | tail -n 1 >/dev/null & set -- $@ $!; done;"
        "for p; do wait $p || exit 1; done";
    assert_int_equal(run_bare(&s, fs_path(fill, "1 2 3 4 5 6 7 8").s, NULL).end, SANDBOX_MEMORY);
    assert_int_equal(run_bare(&s, fs_path(fill, "1 2").s, NULL).end, SANDBOX_OK);
    sandbox_close(&s);
}

/* What a run sees and reaches where there are no namespaces; every line of the script that works says its number. Control: outside, the
 * first six do. */
TEST(a_run_without_namespaces_reaches_only_its_own)
{
    only_root();
    struct sandbox s;
    struct err e;
    char script[4096], list[] = "/usr/share/assay-hidden.XXXXXX";
    assert_non_null(mkdtemp(list));
    assert_int_equal(chmod(list, 0755), 0);
    MUST(sandbox_open(true, (const char *const[]){list, NULL}, &s, &e));
    const struct path out = fs_path("%s/o", s.dir.path), other = fs_path("%s/other", s.dir.path);
    const struct path make = fs_path(
        "mkdir %s && echo theirs >%s/tree.tar && chmod -R a+rX %s && touch %s/reference.exr",
        other.s, other.s, other.s, list);
    snprintf(out_dir, sizeof out_dir, "%.600s", out.s);
    assert_int_equal(system(make.s), 0);
    snprintf(
        script, sizeof script,
        "{ ls %s && echo ok 1; cat %s/reference.exr && echo ok 2; python3 -c 'import os; os.memfd_create(\"x\")' && echo ok 3;"
        "python3 -c 'import socket; socket.socket()' && echo ok 4; unshare -U true && echo ok 5; ipcmk -M 4096 && echo ok 6;"
        "ls %s && echo ok 7; echo x >/tmp/assay-probe && echo ok 8; kill -0 %d && echo ok 9; } >out.png 2>&1; true",
        list, list, s.dir.path, getpid());
    run_bare(&s, script, NULL);
    const char *said = kept("out.png");
    assert_non_null(said);
    for (int i = 1; i <= 9; i++) {
        char word[24];
        snprintf(word, sizeof word, "ok %d", i);
        bool by_landlock = i == 1 || i == 2 || i == 8;
        if (strstr(said, word) != NULL &&
            !(by_landlock && syscall(SYS_landlock_create_ruleset, NULL, 0, 1) < 1))
            fail_msg("%s: %s", word, said);
    }
    run_bare(
        &s,
        "echo $TMPDIR >out.png; echo x >$TMPDIR/x && cat $TMPDIR/x /etc/ld.so.conf >/dev/null && mktemp >&2 && echo fine >>out.png",
        NULL);
    assert_non_null(strstr(kept("out.png"), "fine"));
    sandbox_close(&s);
    struct err ignored;
    assert_true(fs_remove_tree(list, &ignored));
    snprintf(out_dir, sizeof out_dir, "%s/out", box.dir.path);
}

/* Without bwrap in PATH there is a line, not a run. */
TEST(without_bubblewrap_it_refuses)
{
    struct sandbox s;
    struct err e;
    char path[4096];
    snprintf(path, sizeof path, "%s", getenv("PATH"));
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
    char dir[700], name[800], text[1600], path[4096], with[5000];
    struct err e;
    snprintf(path, sizeof path, "%s", getenv("PATH"));
    snprintf(dir, sizeof dir, "%s/killed", box.dir.path);
    snprintf(name, sizeof name, "%s/bwrap", dir);
    snprintf(with, sizeof with, "%s:%s", dir, path);
    MUST(fs_make_dirs(dir, &e));
    for (int i = 0; i < 2; i++) {
        snprintf(text, sizeof text, "#!/bin/sh\necho '141 ended 0' >%s/.report\n%s\n", out_dir,
                 end[i]);
        test_write(name, text, strlen(text));
        assert_int_equal(chmod(dir, 0755) + chmod(name, 0755), 0);
        setenv("PATH", with, 1);
        struct sandbox_result r = run("true");
        setenv("PATH", path, 1);
        assert_int_equal(r.end, i == 0 ? SANDBOX_FAILED : SANDBOX_LOST);
    }
}

TEST_GROUP(open_sandbox, close_sandbox)
