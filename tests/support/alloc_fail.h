/* Memory that runs out: malloc() and its kin of a test program, of whose calls any one can be made to fail. Linked into a
 * program they take the place of the C library's, or AddressSanitizer's, for all of its code and for its shared libraries. */
#ifndef ASSAY_TESTS_ALLOC_FAIL_H
#define ASSAY_TESTS_ALLOC_FAIL_H

#include "renderer/base/err.h"

/* Whose calls count and fail. Not operator new: libraries of C++ may end the program there. */
enum alloc_by {
    ALLOC_ALL,  /* everyone's, libraries included */
    ALLOC_OURS, /* those of the code that is linked into the program itself */
    ALLOC_LOSSY /* everyone's; no leak is looked for, as a library loses blocks itself when it fails */
};

/* Calls `call` without failure, counting its allocations, then once for each of them, which fails, then without failure again.
 * Each time it has to return true, having looked itself at what came out, or, where one failed, false with one line in e, which
 * speaks of memory; and it has to give back every block, on whichever way. *e is empty before; a call that returns true
 * leaves it so. What `call` does between alloc_fail_off() and alloc_fail_on() does not count, and does not fail. Fails as a cmocka
 * assertion does. */
void alloc_fail_each(const char *name, enum alloc_by by, bool (*call)(void *ctx, struct err *e),
                     void *ctx);
void alloc_fail_off(void);
void alloc_fail_on(void);

/* jansson's memory. The program assay ends where it is out (tools/commands/assay.c), so what matters is that no output has appeared by then;
 * functions that build no document, or see to it that theirs is whole, may have it fail as any. Set before the first case. */
enum alloc_json {
    ALLOC_JSON_FAILS,
    ALLOC_JSON_ENDS /* it does not fail; alloc_fail_each() fails where `output` exists at one of its calls in `call` */
};
void alloc_json(enum alloc_json how, const char *output);

/* For writers, after alloc_fail_off(): whether the file is there as told, and nothing else in its directory. Removes it. */
void alloc_fail_output(const char *path, bool there);

/* A teardown of cmocka: where a test failed, tells which allocation had, and who asked for it. Returns 0. */
int alloc_fail_tell(void **state);
/* A teardown of a group: one line with the number of cases, allocations, and how the calls ended. Returns 0. */
int alloc_fail_sum(void **state);

/* Bytes of a file that is there. */
long alloc_fail_file_size(const char *path);

#endif
