/* Runs programs that nobody vouches for. Each run gets an empty machine of its own, made with bubblewrap
 * (bwrap) in two shells: the program sees the libraries of /usr, a shell with small programs, and the few files of
 * /etc that linking needs, read-only (a build all of /usr: compilers, headers), a /proc
 * of its own processes, and two places it may write, /box (its directory, where it starts) and /tmp, both in
 * memory and of a size that the kernel enforces. No network, no environment, no other user's files, no further
 * namespaces. Around it, in a second such machine, a few lines of shell unpack the submission, watch the memory
 * of all its processes together, kill what is left, and hand out the files that were asked for: regular files of
 * bounded size, never through a link that leads outside, as there is nothing outside. Whoever runs us as root
 * has the programs run by "nobody", since the kernel does not count root's processes.
 *
 * Limits of this: a filter refuses a few system calls, no more (a hole in the kernel is a way out); memory of all together is
 * watched five times a second where no control group can be made, not reserved, beyond what each process may have for itself. A machine that forbids user namespaces (many containers) has no sandbox.
 *
 * Unsafe, as it is called, where namespaces are forbidden: as root, each run is made by a user of its own (run_user.h), of whom
 * nothing stays: all its processes are ended, its files removed; unpacking, copying and packing are done as that user, so that no link is
 * followed by root. System calls for what no limit counts, the network and other processes are refused by seccomp, files that are not the
 * system's or its own by Landlock (confine.h), where the kernel has these. Not kept: the limit of disk, and that of memory of all processes together where no control group (memory_group.h) can be made.
 * As another user, only the last two and the limits of a process hold. */
#ifndef ASSAY_SANDBOX_H
#define ASSAY_SANDBOX_H

#include "temp_dir.h"

#include <stddef.h>

struct sandbox {
    bool unsafe;         /* no bubblewrap: see above */
    bool drop;           /* we are root: programs run as somebody else */
    struct temp_dir dir; /* for what runs read and write, readable by everybody */
    char filter[544];    /* a file of it with what seccomp(2) refuses; "": none */
    char hidden[48]
               [512]; /* files and directories that must not be seen though they lie below /usr */
    int num_hidden;
};

struct sandbox_limits {
    double wall_s, cpu_s; /* of the run; of each of its processes */
    size_t memory; /* bytes, of each process, and of all together (looked at five times a second) */
    size_t disk, file; /* bytes, of all in /box and as much again in /tmp; of one file */
    int processes;     /* and threads */
};
extern const struct sandbox_limits sandbox_default; /* 2 min, 4 GiB, 512 MiB, 128 MiB, 64 */

struct sandbox_job {
    const char *const *argv; /* NULL-terminated; argv[0] relative to /box or in PATH */
    const char *
        tree; /* a tar that everybody can read, unpacked into /box; NULL: none. Where the sandbox is unsafe, "box" beside
                       * it stands for /box, for one run at a time, so that programs find what they were linked with */
    const char *scene; /* a directory that everybody can read, copied to /box/scene; NULL: none */
    const char *const
        *keep;      /* names in /box (letters, digits, . _ -; no directories), NULL at the end */
    bool keep_tree; /* also everything in /box, as "tree.tar" */
    bool tools;     /* a build: it sees all of /usr */
    const char
        *cache; /* of ccache, which then stands for the compilers, read-only; NULL: none is used */
    bool fill_cache;     /* it is made, if need be, and may be written */
    const char *library; /* LD_LIBRARY_PATH; NULL: none */
    const char *out;     /* directory that receives them; made if need be */
    const char *log;     /* stdout and stderr; NULL: none */
    struct sandbox_limits limit;
};

enum sandbox_end {
    SANDBOX_OK,
    SANDBOX_FAILED,    /* exit status not 0, or a signal */
    SANDBOX_WALL,      /* did not end */
    SANDBOX_CPU,       /* a process used more processor time than it may */
    SANDBOX_MEMORY,    /* all together */
    SANDBOX_FILE_SIZE, /* wrote a file that is too large */
    SANDBOX_DISK,      /* failed with /box full */
    SANDBOX_UNPACK,    /* the submission does not fit into /box, or holds what cannot be unpacked */
    SANDBOX_LOST /* the machine around it died, or had no room for what came out: our trouble */
};
extern const char *const sandbox_end_name[]; /* "ok", "failed", "wall time", .. */

struct sandbox_result {
    enum sandbox_end end;
    int status; /* of the program; 128 + n for signal n; where it ended by itself */
    double wall_s, cpu_s;
    char why
        [512]; /* one line, with the program's last lines, in printable ASCII; "" if SANDBOX_OK */
};

/* Looks whether the sandbox works here by running `true` in it. Fails with the reason where it does not;
 * with `unsafe` nothing is asked but that a program can be run. hidden: files and directories (NULL at the end) that no
 * program may read; only those below /usr need it. Our own programs and other renderers there are hidden besides. Makes out->dir. The
 * caller calls sandbox_close(). */
NODISCARD bool sandbox_open(bool unsafe, const char *const *hidden, struct sandbox *out,
                            struct err *e);
/* Removes out->dir. */
void sandbox_close(struct sandbox *s);

/* One program. False only if the run could not be made, which is our trouble or the machine's; what the program
 * did wrong is in *out. May be called from several threads. */
NODISCARD bool sandbox_run(const struct sandbox *s, const struct sandbox_job *job,
                           struct sandbox_result *out, struct err *e);

/* A tar of a directory (or of one file) for struct sandbox_job, at most `most` bytes: links stay links. *too_large: it fails because of
 * that, and of nothing else. */
NODISCARD bool sandbox_pack(const char *path, const char *tar, size_t most, bool *too_large,
                            struct err *e);

#endif
