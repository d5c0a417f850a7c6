/* A memory limit that the kernel enforces on a run and all processes that it starts: a control
 * group of its own. It also counts memory that no process owns any more [Linux,
 * Documentation/admin-guide/cgroup-v2.rst; cgroup-v1/memory.rst]. Making one requires root or, with
 * version 1, a hierarchy in which this process's group was delegated to its user; otherwise there
 * is no such limit. */
#ifndef ASSAY_MEMORY_GROUP_H
#define ASSAY_MEMORY_GROUP_H

#include <stdbool.h>
#include <stddef.h>

struct memory_group {
    char path[512]; /* "": there is none */
    int procs;      /* writing "0" to this descriptor joins the group; -1: no group */
};

/* Makes a group limited to `bytes` of memory, files in memory included; if it cannot, path is "".
 * The caller calls memory_group_close(). */
void memory_group_open(struct memory_group *g, size_t bytes);
/* For struct process, as `before`: joins *ctx, a struct memory_group; does nothing if there is no
 * group. */
bool memory_group_enter(const void *ctx);
/* Removes the group once it is empty. True if the kernel killed a process in it for lack of
 * memory. */
bool memory_group_close(struct memory_group *g);

#endif
