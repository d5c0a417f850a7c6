/* Memory of a run and all that it starts, bounded by the kernel: a control group of its own, which counts what no process has any more, too
 * [Linux, Documentation/admin-guide/cgroup-v2.rst; cgroup-v1/memory.rst]. Where none can be made there is none: that takes root,
 * or a hierarchy (of version 1) whose part that this process is in was given to its user. */
#ifndef ASSAY_MEMORY_GROUP_H
#define ASSAY_MEMORY_GROUP_H

#include <stdbool.h>
#include <stddef.h>

struct memory_group {
    char path[512]; /* "": there is none */
    int procs;      /* who writes "0" to it is in the group; -1 */
};

/* Of at most that many bytes, files in memory included. The caller calls memory_group_close(). */
void memory_group_open(struct memory_group *g, size_t bytes);
/* For struct process: joins *ctx, a struct memory_group. */
bool memory_group_enter(const void *ctx);
/* Whether somebody in it was killed for want of memory. Removes it once it is empty. */
bool memory_group_close(struct memory_group *g);

#endif
