/* Decimal numbers from text. */
#ifndef ASSAY_NUMBER_H
#define ASSAY_NUMBER_H

#include "err.h"

#include <stdbool.h>

/* A finite decimal number that ends at a blank or at the end of the text: *out as strtod() rounds it in the C
 * locale, *end where it ends. False on anything else, also hexadecimal, "nan", "inf". */
NODISCARD bool number_parse(const char *s, const char **end, double *out);

#endif
