/* A small web server on loopback that shows a folder's latest page and reloads it when a newer one is there. */
#ifndef ASSAY_WATCH_H
#define ASSAY_WATCH_H

#include "renderer/base/err.h"

struct watch; /* opaque */

/* Serves from then on, in a thread of its own, on 127.0.0.1:port (0: any free one; *port is what it got):
 *   /        a frame around the page and the script that reloads it
 *   /report  the newest index.html in dir or one level below, 404 until there is one
 *   /state   one line that changes when /report does
 * and nothing else, to GET and HEAD that name this host (a page elsewhere that points its name at 127.0.0.1
 * gets 403). Fails with a line if dir is no directory or the port is taken. */
bool watch_start(const char *dir, int *port, struct watch **out, struct err *e)
    __attribute__((warn_unused_result));
void watch_stop(struct watch *w);

#endif
