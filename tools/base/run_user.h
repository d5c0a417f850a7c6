/* A user of its own for each run of an untrusted program, where there are no namespaces: what one
 * run leaves behind can touch neither us nor the next run. Only root can have them. Their numbers
 * are of a range that neither Debian nor systemd assigns (60578 to 61183) [systemd, Users, Groups,
 * UIDs and GIDs on systemd Systems]. */
#ifndef ASSAY_RUN_USER_H
#define ASSAY_RUN_USER_H

#include "renderer/base/err.h"

struct run_user {
    unsigned id; /* of the user and of its group */
    int lock;    /* held while it is somebody's, in /run/assay-users */
};

/* Takes a user that no run has now and of whom nothing is left. The caller calls run_user_release(). */
NODISCARD bool run_user_take(struct run_user *u, struct err *e);

/* Ends all processes of it, however often they fork, and waits until they are gone. */
NODISCARD bool run_user_end(const struct run_user *u, struct err *e);

/* Ends all processes of it and removes its System V objects and its files where everybody may write
 * (/tmp, /var/tmp, /dev/shm, /dev/mqueue, /run/lock). False: something of it is left; the user is
 * given back all the same, and not taken again while that is so. */
bool run_user_release(struct run_user *u, struct err *e);

#endif
