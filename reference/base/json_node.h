/* Strict reading of JSON objects: every error names the file and the key. Also accessors for
 * documents that were checked before. */
#ifndef ASSAY_JSON_NODE_H
#define ASSAY_JSON_NODE_H

#include "renderer/base/err.h"

#include <jansson.h>

#include <stddef.h>

/* An object of a .json file under inspection: `at` is "" or "references.cycles.", so that
 * "<file>: key '<at><key>' ..." names any member. Borrows everything. */
struct json_node {
    const char *file, *at;
    json_t *object;
};

/* Fails on a member that is not in the NULL-terminated list. */
NODISCARD bool json_only_keys(const struct json_node *n, const char *const *allowed, struct err *e);

/* Each fails if the member is missing, of another type, or out of range. */
NODISCARD bool json_get(const struct json_node *n, const char *key, json_t **out, struct err *e);
NODISCARD bool json_get_object(const struct json_node *n, const char *key, json_t **out,
                               struct err *e);
/* lo <= *out <= hi */
NODISCARD bool json_get_int(const struct json_node *n, const char *key, int lo, int hi, int *out,
                            struct err *e);
/* lo < *out < hi */
NODISCARD bool json_get_number(const struct json_node *n, const char *key, double lo, double hi,
                               double *out, struct err *e);
/* One line of text, neither empty nor longer than the buffer. */
NODISCARD bool json_get_text(const struct json_node *n, const char *key, char *out, size_t size,
                             struct err *e);

/* The same for optional members: if one is missing, *out keeps its value. */
NODISCARD bool json_may_int(const struct json_node *n, const char *key, int lo, int hi, int *out,
                            struct err *e);
NODISCARD bool json_may_number(const struct json_node *n, const char *key, double lo, double hi,
                               double *out, struct err *e);
NODISCARD bool json_may_text(const struct json_node *n, const char *key, char *out, size_t size,
                             struct err *e);
bool json_has(const struct json_node *n, const char *key);

/* A number; an interval as [lo, hi]; null if a value is not finite. New references. */
json_t *json_finite(double v);
json_t *json_interval(double lo, double hi);

/* `first` (unless NULL) and an array of strings as one command line, quoted so that
 * shell_quote_split() reads the same words back. The caller frees it; NULL if out of memory. */
NODISCARD char *json_command_line(const char *first, const json_t *words);

/* Is v an array of two numbers, the lower first? */
bool json_is_interval(const json_t *v);

/* Loops over an array; in the body, `element` is a json_t * to the current element. */
#define json_each(element, array)                                                                  \
    for (size_t element##_at = 0, element##_on = 1;                                                \
         element##_on && element##_at < json_array_size(array);                                    \
         element##_on = !element##_on, element##_at++)                                             \
        for (json_t * (element) = json_array_get(array, element##_at); element##_on;               \
             element##_on = !element##_on)

/* Members of an object that was validated before; NULL, "" and 0, respectively, if absent. */
const char *member_text(const json_t *object, const char *name);
const char *member_or_empty(const json_t *object, const char *name);
double member_number(const json_t *object, const char *name);
/* The first object of an array whose "name" equals `name`; NULL if there is none. */
const json_t *member_named(const json_t *array, const char *name);
/* The lower (end = 0) or upper (end = 1) end of a member that is an interval. */
double member_end(const json_t *object, const char *name, size_t end);

#endif
