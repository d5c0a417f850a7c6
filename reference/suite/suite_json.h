/* The .json of one scene of the suite. */
#ifndef ASSAY_SUITE_JSON_H
#define ASSAY_SUITE_JSON_H

#include "reference/base/json_node.h"
#include "suite.h"

/* Reads everything that suite.h describes except what a 9x scene inherits. The caller has set
 * s->name and s->json, the parsed file, from which s->reference and s->not_expressible borrow. */
NODISCARD bool suite_json_read(const char *file, struct suite_scene *s, struct err *e);

/* These are shared with suite_own.c. Fails unless r->fidelity is a known class. */
NODISCARD bool suite_json_check_class(const struct json_node *n, const struct suite_reference *r,
                                      struct err *e);
/* Reads how a reference is made: by an engine with goldens, or, if kind is NULL, as a closed
 * form. */
NODISCARD bool suite_json_read_settings(const struct json_node *n, const struct engine_kind *kind,
                                        struct suite_reference *r, struct err *e);
/* Reads "lens_radius" and "focal_distance": both or neither. */
NODISCARD bool suite_json_read_lens(const struct json_node *n, struct suite_scene *s,
                                    struct err *e);

#endif
