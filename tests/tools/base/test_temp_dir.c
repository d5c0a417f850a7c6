/* Directories of a run's own: made, removed, and where a kill left one, removed by the next run, but no other. */
#include "tools/base/temp_dir.h"
#include "renderer/base/fs.h"
#include "tests/support/test.h"

#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>

static const char *temp;

static int set_up(void **state)
{
    (void)state;
    temp = strdup(test_path("temp"));
    return mkdir(temp, 0700) != 0 || setenv("TMPDIR", temp, 1) != 0;
}

static int tear_down(void **state)
{
    (void)state;
    free((char *)temp);
    return 0;
}

static bool write_file(const char *dir)
{
    FILE *f = fopen(fs_path("%s/file", dir).s, "w");
    bool ok = f != NULL && fputs("kept", f) >= 0;
    return f != NULL && fclose(f) == 0 && ok;
}

static bool is_there(const char *path)
{
    struct stat st;
    return lstat(path, &st) == 0;
}

/* A process that has a directory of that name with a file in it; its path. It waits for a signal. */
static pid_t hold(const char *name, char path[512])
{
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        struct temp_dir d;
        struct err e;
        if (!temp_dir_open(&d, name, &e) || !write_file(d.path) ||
            write(ends[1], d.path, sizeof d.path) != sizeof d.path)
            _exit(1);
        alarm(60); /* where the test fails before it ends this one */
        for (;;)
            pause();
    }
    close(ends[1]);
    assert_int_equal(read(ends[0], path, 512), 512);
    close(ends[0]);
    return pid;
}

static void end(pid_t pid)
{
    int status;
    assert_int_equal(kill(pid, SIGKILL), 0);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_true(WIFSIGNALED(status));
}

TEST(it_is_ours_and_removed)
{
    struct temp_dir d;
    struct err e = {""};
    struct stat st;
    assert_true(temp_dir_open(&d, "one", &e));
    assert_memory_equal(d.path, temp, strlen(temp));
    assert_int_equal(stat(d.path, &st), 0);
    assert_int_equal(st.st_mode & 0777, 0700);
    assert_int_equal(st.st_uid, geteuid());
    assert_true(write_file(d.path));
    char path[512];
    strcpy(path, d.path);
    assert_true(temp_dir_close(&d, &e));
    assert_false(is_there(path));
    assert_true(temp_dir_close(&d, &e)); /* again: nothing */
    d = (struct temp_dir){0};
    assert_true(temp_dir_close(&d, &e));
}

TEST(what_a_kill_left_is_removed_by_the_next)
{
    char dead[512], alive[512], other[512];
    struct temp_dir d;
    struct err e = {""};
    pid_t a = hold("kill", dead), b = hold("kill", alive), c = hold("other", other);
    end(a);
    assert_true(is_there(dead));
    end(c);
    assert_true(temp_dir_open(&d, "kill", &e));
    assert_false(is_there(dead));
    assert_true(is_there(alive));
    assert_true(is_there(other)); /* of another name */
    end(b);
    assert_true(is_there(alive));
    assert_true(temp_dir_close(&d, &e));
    assert_true(temp_dir_open(&d, "kill", &e));
    assert_false(is_there(alive));
    assert_true(temp_dir_close(&d, &e));
}

/* Other things with such a name, a link and a longer name, are left alone. */
TEST(nothing_else_is_removed)
{
    struct temp_dir d;
    struct err e = {""};
    assert_true(temp_dir_open(&d, "like", &e));
    const int start = (int)strlen(d.path) - 6;
    const struct path link = fs_path("%.*sabcdef", start, d.path),
                      file = fs_path("%.*sghijkl", start, d.path),
                      longer = fs_path("%.*sabcdefg", start, d.path),
                      target = fs_path("%s/precious", temp);
    assert_true(temp_dir_close(&d, &e));
    assert_int_equal(mkdir(target.s, 0700), 0);
    assert_int_equal(mkdir(longer.s, 0700), 0);
    assert_true(write_file(target.s));
    assert_int_equal(symlink(target.s, link.s), 0);
    assert_int_equal(mkdir(file.s, 0700), 0); /* what there is to remove: the control */
    assert_true(temp_dir_open(&d, "like", &e));
    assert_false(is_there(file.s));
    assert_true(is_there(link.s));
    assert_true(is_there(longer.s));
    assert_true(is_there(fs_path("%s/file", target.s).s));
    assert_true(temp_dir_close(&d, &e));
}

/* Eight processes that each open and close 200 times: none finds its file gone, or fails, and nothing stays. */
TEST(many_at_once)
{
    enum { PROCESSES = 8, TIMES = 200 };
    pid_t pid[PROCESSES];
    for (int i = 0; i < PROCESSES; i++) {
        pid[i] = fork();
        assert_true(pid[i] >= 0);
        for (int k = 0; pid[i] == 0 && k < TIMES; k++) {
            struct temp_dir d;
            struct err e;
            if (!temp_dir_open(&d, "many", &e) || !write_file(d.path))
                _exit(1);
            if (!is_there(fs_path("%s/file", d.path).s) || !temp_dir_close(&d, &e))
                _exit(2);
        }
        if (pid[i] == 0)
            _exit(0);
    }
    for (int i = 0; i < PROCESSES; i++) {
        int status;
        assert_int_equal(waitpid(pid[i], &status, 0), pid[i]);
        assert_true(WIFEXITED(status));
        assert_int_equal(WEXITSTATUS(status), 0);
    }
    struct temp_dir d;
    struct err e;
    assert_true(temp_dir_open(&d, "many", &e));
    assert_true(temp_dir_close(&d, &e));
    assert_int_equal(system(fs_path("! ls '%s' | grep -q many", temp).s), 0);
}

TEST(no_room_is_a_line)
{
    struct temp_dir d;
    struct err e = {""};
    assert_int_equal(setenv("TMPDIR", "/nonexistent", 1), 0);
    assert_false(temp_dir_open(&d, "none", &e));
    assert_string_equal(e.msg,
                        "/nonexistent: no temporary directory in it: No such file or directory");
    assert_true(temp_dir_close(&d, &e));
    assert_int_equal(setenv("TMPDIR", temp, 1), 0);
}

TEST_GROUP(set_up, tear_down)
