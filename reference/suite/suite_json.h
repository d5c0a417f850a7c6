/* The .json of one scene of the suite. */
#ifndef ASSAY_SUITE_JSON_H
#define ASSAY_SUITE_JSON_H

#include "reference/base/json_node.h"
#include "suite.h"

/* Everything that suite.h describes but what a 9x scene inherits. s->name is set and s->json is the
 * parsed file, which s->reference and s->not_expressible then borrow from. */
NODISCARD bool suite_json_read(const char *file, struct suite_scene *s, struct err *e);

/* Shared with suites of a user's own. Is the class that was read one? */
NODISCARD bool suite_json_check_class(const struct json_node *n, const struct suite_reference *r,
                                      struct err *e);
/* How a reference is made: by an engine with goldens; kind is NULL: a closed form. */
NODISCARD bool suite_json_read_settings(const struct json_node *n, const struct engine_kind *kind,
                                        struct suite_reference *r, struct err *e);
/* Both members or none. */
NODISCARD bool suite_json_read_lens(const struct json_node *n, struct suite_scene *s,
                                    struct err *e);

#endif
