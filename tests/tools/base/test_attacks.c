/* Attacks on whoever runs a submission, one line of shell each; an attack has won if it exits with 0. Tried as a
 * build and as a run, in the sandbox and without namespaces. Control: outside, as root, those marked 'c' win, so
 * that none fails merely because it is badly written. Exhausting limits and leaving things behind are in
 * test_sandbox.c. */
#define _GNU_SOURCE

#include "renderer/base/fs.h"
#include "tools/base/sandbox.h"
#include "tests/support/own.h"
#include "tests/support/test.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/prctl.h>
#include <sys/syscall.h>

/* c: with a control; s: only without namespaces, as the sandbox has one of its own; l, p: where the kernel has Landlock, seccomp;
 * u: without namespaces only if the run has a user of its own, which needs root. */
static const struct {
    const char *mark, *script;
} attacks[] = {
    /* Reads what is ours, or another's. */
    {"c", "cat $S/secret"},
    {"c", "cat $S/other/tree.tar"},
    {"c", "ls $S"},
    {"cl", "cat $HERE/golden/diagnose/manifest.json"},
    {"cl", "ls $HERE"},
    {"cl", "find $HERE -name '*.dae' | grep ."},
    {"cl", "cat $REF/x.exr"},
    {"cl", "ls $REF | grep ."},
    {"cl", "find / -name 'assay-secret*' | grep ."},
    {"", "ln -s $S/secret l1 && cat l1"},
    {"", "ln -s $S l2 && ls l2/"},
    {"", "ln $S/secret h1"},
    {"", "ln -s / l3 && cat l3$S/secret"},
    {"cl", "ls /var/lib/dpkg"},
    {"cl", "ls /run/"},
    {"cl", "ls /sys/kernel"},
    {"c", "cat /etc/shadow"},
    {"", "cat /root/.bashrc"},
    {"", "ls /root"},
    {"", "cat /dev/mem"},
    {"", "head -c 1 /dev/sda || head -c 1 /dev/vda"},
    {"", "head -c 1 /dev/kmsg"},
    {"c", "cat /proc/$OUR/environ"},
    {"c", "cat /proc/$OUR/maps"},
    {"cu", "ls /proc/$OUR/fd/"},
    {"c", "cat /proc/$OUR/root$S/secret"},
    {"c", "ls /proc/$OUR/cwd/"},
    {"", "cat /proc/1/root$S/secret"},
    {"", "cat /proc/self/root$S/secret"},
    {"", "cat /box/../$S/secret"},
    /* Writes outside. */
    {"", "echo x >/etc/assay-attack"},
    {"", "touch /usr/bin/assay-attack"},
    {"", "touch /usr/local/lib/assay-attack"},
    {"", "touch $S/results.json"},
    {"", "mkdir $S/d"},
    {"", "touch $HERE/assay-attack"},
    {"sl", "touch /tmp/assay-attack"},
    {"l", "touch /var/tmp/assay-attack"},
    {"l", "touch /dev/mqueue/assay-attack"},
    {"l", "touch /run/lock/assay-attack"},
    {"", "mv ../box ../b"},
    {"", "ln -s / ../assay-attack"},
    {"", "rm ../tree.tar"},
    {"u", "chmod 777 .."},
    {"", "echo x >/proc/sys/kernel/hostname"},
    {"", "echo -500 >/proc/self/oom_score_adj"},
    {"", "touch f1 && chown 0 f1"},
    {"", "mknod n1 b 8 0"},
    /* Other processes, other users. */
    {"c", "kill -0 $OUR"},
    {"", "renice -n -5 $$"},
    {"u", "prlimit --pid $OUR --nofile=10"},
    {"", "sys 101 16 $OUR 0 0"},    /* ptrace */
    {"", "sys 101 16902 $OUR 0 0"}, /* ptrace: seize */
    {"", "setpriv --reuid 0 true"},
    {"", "setpriv --reuid 65534 --clear-groups true"},
    {"", "su -c true"},
    {"", "sudo -n true"},
    {"", "chroot / true"},
    {"p", "unshare -U true"},
    {"p", "unshare -r true"},
    {"", "unshare -m true"},
    {"", "unshare -n true"},
    {"", "nsenter -t $OUR -m true"},
    {"", "mount -t tmpfs none ."},
    /* The network, and messages. */
    {"c", "bash -c \"exec 3<>/dev/tcp/127.0.0.1/$PORT\""},
    {"sp", "sys 41 2 1 0"},  /* socket: TCP */
    {"sp", "sys 41 2 2 0"},  /* UDP */
    {"sp", "sys 41 10 1 0"}, /* over IPv6 */
    {"sp", "sys 41 16 3 0"}, /* netlink */
    {"sp", "sys 41 1 1 0"},  /* local */
    {"", "sys 41 17 3 0"},   /* raw frames */
    {"", "sys 41 2 3 1"},    /* raw IP */
    /* Memory that no limit counts, and other ways into the kernel. */
    {"cp", "python3 -c 'import os; os.memfd_create(\"x\")'"},
    {"p", "sys 447 0"}, /* memfd_secret */
    {"p", "ipcmk -M 4096"},
    {"sp", "ipcmk -S 1"},
    {"sp", "ipcmk -Q"},
    {"p", "sys 425 8 0"},    /* io_uring_setup */
    {"sp", "sys 250 0 0 0"}, /* keyctl */
    {"", "sys 321 0 0 0"},   /* bpf */
    {"", "sys 298 0 0 0"},   /* perf_event_open */
    {"", "sys 175 0 0 0"},   /* init_module */
    {"", "sys 167 0 0"},     /* swapon */
    {"", "sys 172 3"},       /* iopl */
    {"", "sys 170 0 1"},     /* sethostname */
    /* Its own limits. */
    {"", "ulimit -H -t unlimited"},
    {"", "ulimit -H -u 100000"},
    {"", "ulimit -H -f unlimited"},
    {"", "ulimit -H -d unlimited"},
    {"", "ulimit -H -n 100000"},
    {"", "ulimit -c 1000"},
};
enum { NUM = sizeof attacks / sizeof *attacks, MIB = 1 << 20 };

static char script[1 << 16];
static struct path ref, dir;
static int port, server;

/* All attacks; each that wins says its number. */
static void write_script(const char *sandbox)
{
    char here[512];
    assert_non_null(getcwd(here, sizeof here));
    size_t n = (size_t)snprintf(
        script, sizeof script,
        "S=%s HERE=%s REF=%s OUR=%d PORT=%d\n"
        "sys() { python3 -c 'import ctypes, sys; a = [ctypes.c_long(int(x, 0)) for x in sys.argv[1:]]; "
        "sys.exit(ctypes.CDLL(None).syscall(*a) < 0)' \"$@\"; }\n",
        sandbox, here, ref.s, getpid(), port);
    for (int i = 0; i < NUM; i++)
        n += (size_t)snprintf(script + n, sizeof script - n,
                              "( %s ) >/dev/null 2>&1 </dev/null && echo \"won %d.\"\n",
                              attacks[i].script, i);
    assert_true(n + 8 < sizeof script);
    strcpy(script + n, ":\n");
}

static int set_up(void **state)
{
    (void)state;
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof at;
    server = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(bind(server, (struct sockaddr *)&at, size), 0);
    assert_int_equal(listen(server, 16), 0);
    assert_int_equal(getsockname(server, (struct sockaddr *)&at, &size), 0);
    port = ntohs(at.sin_port);
    ref = fs_path("/usr/share/assay-attacks.%d", getpid());
    dir = fs_path("%s", test_path("attacks"));
    const struct path make =
        fs_path("mkdir -p %s %s && echo right >%s/x.exr; echo mine >%s/assay-secret; true", ref.s,
                dir.s, ref.s, ref.s);
    return geteuid() == 0 ? system(make.s) : 0;
}

static int tear_down(void **state)
{
    (void)state;
    struct err ignored;
    close(server);
    return fs_remove_tree(ref.s, &ignored) ? 0 : -1;
}

static bool marked(int i, char mark)
{
    return strchr(attacks[i].mark, mark) != NULL;
}

static void try_all(bool unsafe, bool tools)
{
    struct sandbox s;
    struct sandbox_result r;
    struct err e;
    if (!sandbox_open(unsafe, (const char *const[]){ref.s, NULL}, &s, &e)) {
        printf("skipped: %s\n", e.msg);
        skip();
    }
    const struct path
        out = fs_path("%s/o", s.dir.path),
        work = fs_path("%s/w", s.dir.path), log = fs_path("%s/log", s.dir.path),
        make = fs_path(
            "mkdir -p %s/other %s/in && echo theirs >%s/other/tree.tar && echo mine >%s/secret && chmod -R a+rX %s/other "
            "%s/secret && tar -C %s/in -cf %s/tree.tar . && chmod 755 %s",
            s.dir.path, work.s, s.dir.path, s.dir.path, s.dir.path, s.dir.path, work.s, work.s,
            work.s),
        tree = fs_path("%s/tree.tar", work.s);
    assert_int_equal(system(make.s), 0);
    write_script(s.dir.path);
    const struct sandbox_job job = {.argv = (const char *const[]){"sh", "-c", script, NULL},
                                    .tree = tree.s,
                                    .tools = tools,
                                    .out = out.s,
                                    .log = log.s,
                                    .limit = {.wall_s = 100,
                                              .cpu_s = 60,
                                              .memory = (size_t)1024 * MIB,
                                              .disk = (size_t)64 * MIB,
                                              .file = (size_t)8 * MIB,
                                              .processes = 64}};
    MUST(sandbox_run(&s, &job, &r, &e));
    assert_int_equal(r.end, SANDBOX_OK);
    OWN_TEXT said = test_read(job.log);
    sandbox_close(&s);
    bool no_landlock = unsafe && syscall(SYS_landlock_create_ruleset, NULL, 0, 1) < 1;
    bool no_seccomp = prctl(PR_GET_SECCOMP) < 0;
    for (int i = 0; i < NUM; i++) {
        char word[32];
        snprintf(word, sizeof word, "won %d.", i);
        bool may = (marked(i, 's') && !unsafe) || (marked(i, 'l') && no_landlock) ||
                   (marked(i, 'u') && unsafe && geteuid() != 0) || (marked(i, 'p') && no_seccomp);
        if (strstr(said, word) != NULL && !may)
            fail_msg("%s", attacks[i].script);
    }
}

TEST(in_the_sandbox_a_run)
{
    try_all(false, false);
}

TEST(in_the_sandbox_a_build)
{
    try_all(false, true);
}

/* Also as another user, who has Landlock and seccomp alone; without Landlock nothing is promised to him. */
TEST(without_namespaces)
{
    if (geteuid() != 0 && syscall(SYS_landlock_create_ruleset, NULL, 0, 1) < 6)
        skip();
    try_all(true, false);
    try_all(true, true);
}

/* Tries only the attacks marked 'c', on files of our own. */
TEST(outside_they_win)
{
    if (geteuid() != 0)
        skip();
    const struct path make = fs_path(
        "cd %s && mkdir -p other && echo theirs >other/tree.tar && echo mine >secret", dir.s);
    int won = 0, asked = 0;
    assert_int_equal(system(make.s), 0);
    write_script(dir.s);
    char *head = strstr(script, "( ");
    for (int i = 0; i < NUM; i++) {
        char one[16384];
        if (!marked(i, 'c'))
            continue;
        asked++;
        snprintf(one, sizeof one, "%.*scd %s; ( %s ) >%s/said 2>&1 </dev/null",
                 (int)(head - script), script, dir.s, attacks[i].script, dir.s);
        bool wins = system(one) == 0;
        won += wins;
        if (!wins)
            printf("does not win outside: %s\n", attacks[i].script);
    }
    assert_true(asked >= 20);
    assert_int_equal(won, asked);
}

TEST_GROUP(set_up, tear_down)
