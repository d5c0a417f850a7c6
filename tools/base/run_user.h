/* A user of its own for each run of a program that nobody vouches for, where there are no namespaces: what one run leaves behind can
 * touch neither us nor the next. Only root can have them. They are numbers of a range that neither Debian nor systemd gives
 * away (60578 to 61183) [systemd, Users, Groups, UIDs and GIDs on systemd Systems]. */
#ifndef ASSAY_RUN_USER_H
#define ASSAY_RUN_USER_H

#include "renderer/base/err.h"

struct run_user {
    unsigned id; /* of the user and of its group */
    int lock;    /* held while it is somebody's, in /run/assay-users */
};

/* One that nobody uses now and of whom nothing is left. The caller calls run_user_release(). */
NODISCARD bool run_user_take(struct run_user *u, struct err *e);

/* Ends all processes of it, however often they fork, and waits until they are gone. */
NODISCARD bool run_user_end(const struct run_user *u, struct err *e);

/* Ends them and removes its System V objects and its files where everybody may write (/tmp, /var/tmp, /dev/shm, /dev/mqueue, /run/lock).
 * False: something of it is left; it is given back all the same, and not taken again while that is so. */
bool run_user_release(struct run_user *u, struct err *e);

#endif
