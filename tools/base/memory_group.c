#define _GNU_SOURCE
#include "memory_group.h"

#include "renderer/base/fs.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { TRIES = 100, WAIT_US = 10000 };

/* The control group of this process: of version 2, or of version 1's memory hierarchy. */
static void own_group(bool second, char path[256])
{
    char line[512];
    FILE *f = fopen("/proc/self/cgroup", "r");
    path[0] = '\0';
    while (f != NULL && fgets(line, sizeof line, f) != NULL) {
        const char *start =
            second ? (strncmp(line, "0::", 3) == 0 ? line + 2 : NULL) : strstr(line, ":memory:");
        if (start == NULL)
            continue;
        start = strchr(start + 1, '/');
        if (start != NULL)
            snprintf(path, 256, "%.*s", (int)strcspn(start, "\n"), start);
    }
    if (f != NULL)
        fclose(f);
}

static bool set(const struct memory_group *g, const char *name, size_t bytes)
{
    FILE *f = fopen(fs_path("%s/%s", g->path, name).s, "w");
    bool ok = f != NULL && fprintf(f, "%zu", bytes) > 0;
    return f != NULL && fclose(f) == 0 && ok;
}

static bool try_in(struct memory_group *g, const char *dir, const char *limit, const char *swap,
                   size_t bytes, size_t swapped)
{
    static const char template[] = "/assay.XXXXXX";
    if (strlen(dir) + sizeof template > sizeof g->path)
        return false;
    strcat(strcpy(g->path, dir), template);
    if (mkdtemp(g->path) == NULL)
        return false;
    if (set(g, limit, bytes)) {
        bool without = set(g, swap, swapped); /* a kernel that counts no swap has no such file */
        (void)without;
        g->procs = open(fs_path("%s/cgroup.procs", g->path).s, O_WRONLY | O_CLOEXEC);
    }
    if (g->procs < 0)
        rmdir(g->path);
    return g->procs >= 0;
}

void memory_group_open(struct memory_group *g, size_t bytes)
{
    char own[256];
    *g = (struct memory_group){.procs = -1};
    bool second = access("/sys/fs/cgroup/cgroup.controllers", F_OK) == 0;
    const char *root = second ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory",
               *limit = second ? "memory.max" : "memory.limit_in_bytes",
               *swap = second ? "memory.swap.max" : "memory.memsw.limit_in_bytes";
    size_t swapped = second ? 0 : bytes; /* version 1 limits memory plus swap */
    own_group(second, own);
    if ((strlen(own) < 2 ||
         !try_in(g, fs_path("%s%s", root, own).s, limit, swap, bytes, swapped)) &&
        !try_in(g, root, limit, swap, bytes, swapped))
        g->path[0] = '\0';
}

bool memory_group_enter(const void *ctx)
{
    const struct memory_group *g = ctx;
    return g->procs < 0 || write(g->procs, "0", 1) == 1;
}

bool memory_group_close(struct memory_group *g)
{
    char line[256];
    long killed = 0;
    if (g->path[0] == '\0')
        return false;
    close(g->procs);
    FILE *f = fopen(fs_path("%s/memory.events", g->path).s, "r");
    if (f == NULL)
        f = fopen(fs_path("%s/memory.oom_control", g->path).s, "r");
    while (f != NULL && fgets(line, sizeof line, f) != NULL)
        sscanf(line, "oom_kill %18ld", &killed);
    if (f != NULL)
        fclose(f);
    for (int i = 0; i < TRIES && rmdir(g->path) != 0; i++) /* what was killed may not be gone yet */
        usleep(WAIT_US);
    *g = (struct memory_group){.procs = -1};
    return killed > 0;
}
