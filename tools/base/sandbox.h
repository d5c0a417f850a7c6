/* Runs untrusted programs. Each run gets a container of its own, made with bubblewrap (bwrap) in
 * two nested layers.
 *
 * Inner layer. The program sees, read-only, the libraries of /usr, a shell with small tools, and the
 * few files of /etc that linking needs (a build sees all of /usr, with compilers and headers); a
 * /proc of its own processes; and two writable directories, /box (where it starts) and /tmp, both in
 * memory and of a size that the kernel enforces. It has no network, none of our environment, no
 * other user's files, and can make no further namespaces.
 *
 * Outer layer. A short shell script, the supervisor, unpacks the submission, watches the memory of
 * all its processes together, kills what is left over, and hands out the requested files: regular
 * files of bounded size. No link can lead outside, as nothing outside is visible. If we run as root,
 * programs run as "nobody", since the kernel does not limit the number of root's processes.
 *
 * Limits. The filter of system calls refuses only a few, so a hole in the kernel is a way out. Where
 * no control group can be made (memory_group.h), each process has its limit of memory, but that of
 * all together is only checked five times a second. A machine that forbids user namespaces (many
 * containers) has no sandbox.
 *
 * Without a sandbox ("unsafe"), where namespaces are forbidden:
 *   as root        Each run has a user of its own (run_user.h). Afterwards all processes of that user
 *                  are ended and all of its files removed. Unpacking, copying and packing are done as
 *                  that user, so root follows no link.
 *   as any user    seccomp refuses the network, other processes and memory that no limit counts;
 *                  Landlock refuses files that are neither the system's nor the run's own
 *                  (confine.h); both where the kernel has them. Limits of each process hold.
 *   not kept       The limit of disk; that of memory of all processes together, where no control
 *                  group can be made. */
#ifndef ASSAY_SANDBOX_H
#define ASSAY_SANDBOX_H

#include "temp_dir.h"

#include <stddef.h>

struct sandbox {
    bool unsafe;         /* no bubblewrap: see above */
    bool drop;           /* we are root: programs run as somebody else */
    struct temp_dir dir; /* for what runs read and write, readable by everybody */
    char filter[544];    /* path in it of the seccomp(2) filter; "": none */
    char libraries[544]; /* path in it of what programs see as /etc/ld.so.cache, if that exists */
    char hidden[48]
               [512]; /* files and directories that must not be seen though they lie below /usr */
    int num_hidden;
};

struct sandbox_limits {
    double wall_s, cpu_s; /* of the run; of each of its processes */
    size_t memory; /* bytes, of each process, and of all together (checked five times a second) */
    size_t disk, file; /* bytes: of all in /box, and as much again in /tmp; of one file */
    int processes;     /* and threads */
};
extern const struct sandbox_limits sandbox_default; /* 2 min, 4 GiB, 512 MiB, 128 MiB, 64 */

struct sandbox_job {
    const char *const *argv; /* NULL-terminated; argv[0] relative to /box or in PATH */
    const char *
        tree; /* a world-readable tar, unpacked into /box; NULL: none. If unsafe, "box" beside it serves as /box,
                       * for one run at a time, so that paths linked into programs stay valid */
    const char *scene; /* a directory that everybody can read, copied to /box/scene; NULL: none */
    const char *const
        *keep;      /* names in /box (letters, digits, . _ -; no directories), NULL at the end; what
                     * the tree has of these names is removed before the run */
    bool keep_tree; /* also everything in /box, as "tree.tar" */
    bool tools;     /* a build: it sees all of /usr */
    const char
        *cache; /* directory of ccache, which then wraps the compilers; read-only; NULL: no ccache */
    bool fill_cache;     /* the cache is made if need be and is writable */
    const char *library; /* LD_LIBRARY_PATH; NULL: none */
    const char *out;     /* directory that receives what is kept; made if need be */
    const char *log;     /* stdout and stderr; NULL: none */
    struct sandbox_limits limit;
};

enum sandbox_end {
    SANDBOX_OK,
    SANDBOX_FAILED,    /* exit status not 0, or a signal */
    SANDBOX_WALL,      /* did not end */
    SANDBOX_CPU,       /* a process used more processor time than it may */
    SANDBOX_MEMORY,    /* all processes together use too much */
    SANDBOX_FILE_SIZE, /* wrote a file that is too large */
    SANDBOX_DISK,      /* failed with /box full */
    SANDBOX_UNPACK,    /* the submission does not fit into /box, or holds what cannot be unpacked */
    SANDBOX_LOST /* the outer layer died, or had no room for the output: not the program's fault */
};
extern const char *const sandbox_end_name[]; /* "ok", "failed", "wall time", .. */

struct sandbox_result {
    enum sandbox_end end;
    int status; /* exit status of the program, 128 + n for signal n; if it ended by itself */
    double wall_s, cpu_s;
    char why
        [512]; /* one line, with the program's last lines, in printable ASCII; "" if SANDBOX_OK */
};

/* Checks that the sandbox works here by running `true` in it, and fails with the reason if it does
 * not; with `unsafe` only that a program can be run. hidden: files and directories (NULL at the end)
 * that no program may read; only those below /usr need it. Our own programs and other renderers
 * there are hidden as well. Makes out->dir. The caller calls sandbox_close(). */
NODISCARD bool sandbox_open(bool unsafe, const char *const *hidden, struct sandbox *out,
                            struct err *e);
/* Removes out->dir. */
void sandbox_close(struct sandbox *s);

/* Runs one program. False only if the run could not be made, which is never the program's fault;
 * what the program did wrong is in *out. May be called from several threads. */
NODISCARD bool sandbox_run(const struct sandbox *s, const struct sandbox_job *job,
                           struct sandbox_result *out, struct err *e);

/* Packs a directory (or one file) into a tar of at most `most` bytes for struct sandbox_job; links
 * stay links. *too_large: it failed because of the size and of nothing else. */
NODISCARD bool sandbox_pack(const char *path, const char *tar, size_t most, bool *too_large,
                            struct err *e);

#endif
