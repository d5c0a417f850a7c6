/* The numbers that a closed form is made of, from the "values" of a reference in a scene's .json. */
#ifndef ASSAY_TRUTH_VALUES_H
#define ASSAY_TRUTH_VALUES_H

#include "renderer/base/err.h"

#include <jansson.h>

/* Fills a double or an array of them for each word of `names`, in its order:
 *
 *   height         a number
 *   footprint.x[2] two of them, in an object
 *   ridges[12]     also as arrays of arrays
 *   ior>1          above 1, and so >0; >=0: not below 0; =0..1: a share
 *   (view)         nothing is filled: it may be there, and is read elsewhere
 *
 * All have to be there, in their ranges, and nothing else. */
NODISCARD bool truth_values_read(const json_t *values, struct err *e, const char *names, ...);

#endif
