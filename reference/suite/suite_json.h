/* The .json of one scene of the suite. */
#ifndef ASSAY_SUITE_JSON_H
#define ASSAY_SUITE_JSON_H

#include "suite.h"

/* Everything that suite.h describes but what a 9x scene inherits. s->name is set and s->json is the
 * parsed file, which s->reference and s->not_expressible then borrow from. */
NODISCARD bool suite_json_read(const char *file, struct suite_scene *s, struct err *e);

#endif
