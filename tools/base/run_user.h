/* A separate user for each run of an untrusted program, where there are no namespaces: what one run
 * leaves behind can harm neither us nor the next run. Requires root. The ids are from a range that
 * neither Debian nor systemd assigns (60578 to 61183) [systemd, Users, Groups, UIDs and GIDs on systemd
 * Systems]. */
#ifndef ASSAY_RUN_USER_H
#define ASSAY_RUN_USER_H

#include "renderer/base/err.h"

struct run_user {
    unsigned id; /* of the user and of its group */
    int lock;    /* descriptor of a lock in /run/assay-users, held while the user is taken */
};

/* Takes a user that no run is using and of whom nothing is left. The caller calls run_user_release(). */
NODISCARD bool run_user_take(struct run_user *u, struct err *e);

/* Ends all processes of it, however often they fork, and waits until they are gone. */
NODISCARD bool run_user_end(const struct run_user *u, struct err *e);

/* Ends all processes of it and removes its System V objects and its files where everybody may write
 * (/tmp, /var/tmp, /dev/shm, /dev/mqueue, /run/lock). False if something of it is left; the user is
 * released all the same, but not taken again while that is so. */
bool run_user_release(struct run_user *u, struct err *e);

#endif
