#define _GNU_SOURCE
#include "confine.h"

#include "renderer/base/fs.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <stdint.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined __x86_64__
#define NATIVE AUDIT_ARCH_X86_64
#elif defined __aarch64__
#define NATIVE AUDIT_ARCH_AARCH64
#endif

/* Newer than the headers of Debian 12. */
#ifndef SYS_memfd_secret
#define SYS_memfd_secret 447
#endif

struct refused {
    int call, error;
};

#define X32 0x40000000u /* first system call number of the x32 ABI */

size_t confine_filter(bool alone, unsigned char filter[CONFINE_FILTER])
{
#ifdef NATIVE
    static const struct refused calls[] = {
        {SYS_memfd_create, ENOSYS},
        {SYS_memfd_secret, ENOSYS},
        {SYS_shmget, ENOSYS},
        {SYS_io_uring_setup, ENOSYS}, /* its requests would bypass this filter */
        /* from here on: alone */
        {SYS_socket, EACCES},
        {SYS_semget, ENOSYS},
        {SYS_msgget, ENOSYS},
        {SYS_mq_open, ENOSYS},
        {SYS_ptrace, EPERM},
        {SYS_unshare, EPERM},
        {SYS_setns, EPERM},
        {SYS_clone3, ENOSYS}, /* a filter cannot see its flags; the C library falls back to clone() */
        {SYS_add_key, ENOSYS},
        {SYS_keyctl, ENOSYS},
    };
    enum { ALWAYS = 4, NUM = sizeof calls / sizeof *calls };
    const int num = alone ? NUM : ALWAYS;
    struct sock_filter code[8 + 2 * NUM + 4] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, arch)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, NATIVE, 1, 0),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, X32, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | ENOSYS)};
    size_t n = 6;
    if (prctl(PR_GET_SECCOMP) < 0)
        return 0;
    for (int i = 0; i < num; i++) {
        code[n++] =
            (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (unsigned)calls[i].call, 0, 1);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K,
                                                 SECCOMP_RET_ERRNO | (unsigned)calls[i].error);
    }
    if (alone) { /* clone() with a new user namespace; flags are its first argument, in the lower half */
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clone, 0, 3);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS,
                                                 offsetof(struct seccomp_data, args[0]));
        code[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, CLONE_NEWUSER, 0, 1);
        code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM);
    }
    code[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    _Static_assert(sizeof code <= CONFINE_FILTER, "a filter has room");
    memcpy(filter, code, n * sizeof *code);
    return n * sizeof *code;
#else
    (void)alone;
    (void)filter;
    return 0;
#endif
}

/* The kernel's landlock_ruleset_attr, of which Debian 12's headers know only the first member [Linux,
 * Documentation/userspace-api/landlock.rst]. */
struct ruleset {
    uint64_t files, network, scoped;
};

#define READ                                                                                       \
    (LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR)
#define OF_A_FILE                                                                                  \
    (LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_WRITE_FILE |   \
     TRUNCATE)
#define TRUNCATE    (1u << 14) /* since its version 3 */
#define CONNECT_TCP 3u         /* bind and connect, since 4 */
#define SCOPED      3u         /* abstract sockets and signals, since 6 */

static uint64_t all_rights(long version)
{
    return version >= 3 ? (1u << 15) - 1 : version == 2 ? (1u << 14) - 1 : (1u << 13) - 1;
}

static bool allow(int ruleset, const char *path, uint64_t rights, struct err *e)
{
    struct stat st;
    int fd = open(path, O_PATH | O_CLOEXEC);
    if (fd < 0)
        return true;
    if (fstat(fd, &st) == 0 && !S_ISDIR(st.st_mode))
        rights &= OF_A_FILE;
    const struct landlock_path_beneath_attr rule = {.allowed_access = rights, .parent_fd = fd};
    bool ok = rights == 0 ||
              syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0 ||
              err_set(e, "%s: cannot be shown to programs: %s", path, strerror(errno));
    close(fd);
    return ok;
}

/* A rule covers everything below its path, so a directory that contains something hidden is shown entry by entry;
 * symbolic links are skipped, as paths are resolved anyway. */
static bool allow_around(int ruleset, const char *path, const char *const *hidden, struct err *e)
{
    size_t length = strlen(path);
    bool inside = false;
    for (const char *const *h = hidden; *h != NULL; h++) {
        if (strcmp(*h, path) == 0)
            return true;
        inside = inside || (strncmp(*h, path, length) == 0 && (*h)[length] == '/');
    }
    if (!inside)
        return allow(ruleset, path, READ, e);
    DIR *d = opendir(path);
    struct dirent *entry;
    bool ok = d != NULL || err_set(e, "%s: cannot be shown to programs: %s", path, strerror(errno));
    while (ok && (entry = readdir(d)) != NULL)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0 &&
            entry->d_type != DT_LNK)
            ok = allow_around(ruleset, fs_path("%s/%s", path, entry->d_name).s, hidden, e);
    if (d != NULL)
        closedir(d);
    return ok;
}

bool confine_files(const char *const *read, const char *const *write, const char *const *hidden,
                   int *ruleset, struct err *e)
{
    long version = syscall(SYS_landlock_create_ruleset, NULL, 0, LANDLOCK_CREATE_RULESET_VERSION);
    *ruleset = -1;
    if (version < 1)
        return true;
    const struct ruleset r = {.files = all_rights(version),
                              .network = version >= 4 ? CONNECT_TCP : 0,
                              .scoped = version >= 6 ? SCOPED : 0};
    size_t size = version >= 6   ? sizeof r
                  : version >= 4 ? offsetof(struct ruleset, scoped)
                                 : offsetof(struct ruleset, network);
    int fd = (int)syscall(SYS_landlock_create_ruleset, &r, size, 0);
    if (fd < 0)
        return err_set(e, "cannot restrict files: %s", strerror(errno));
    bool ok = true;
    for (; ok && *read != NULL; read++)
        ok = allow_around(fd, *read, hidden, e);
    for (; ok && *write != NULL; write++)
        ok = allow(fd, *write, r.files, e);
    if (!ok) {
        close(fd);
        return false;
    }
    *ruleset = fd;
    return true;
}

bool confine_enter(const void *ctx)
{
    const struct confine *c = ctx;
    unsigned char filter[CONFINE_FILTER];
    if (!memory_group_enter(&c->group) || (c->in >= 0 && dup2(c->in, 0) < 0) ||
        (c->out >= 0 && dup2(c->out, 1) < 0))
        return false;
    /* Not by the C library, which would signal threads that do not exist in this process. */
    if (c->user != 0 && (syscall(SYS_setgroups, 0, NULL) != 0 ||
                         syscall(SYS_setresgid, c->user, c->user, c->user) != 0 ||
                         syscall(SYS_setresuid, c->user, c->user, c->user) != 0))
        return false;
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
        (c->files >= 0 && syscall(SYS_landlock_restrict_self, c->files, 0) != 0))
        return false;
    struct sock_fprog program = {
        .len = (unsigned short)(confine_filter(true, filter) / sizeof(struct sock_filter)),
        .filter = (struct sock_filter *)(void *)filter};
    return program.len == 0 || syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program) == 0;
}
