/* A command line as one text and back: what provenance stores, and what a person can paste into a shell. */
#ifndef ASSAY_SHELL_QUOTE_H
#define ASSAY_SHELL_QUOTE_H

#include "err.h"

/* Joins `first`, unless it is NULL, and the words of a NULL-terminated array with blanks, in quotes where a shell needs them.
 * The caller frees the text. NULL if out of memory. */
NODISCARD char *shell_quote_join(const char *first, const char *const *word);

/* The words of a text that shell_quote_join() made, or that a person typed with blanks, '...' and \ alone: a NULL-terminated
 * array, one block of memory, to free(). NULL with a line on anything else that a shell would act on, on an open quote,
 * and out of memory. */
NODISCARD char **shell_quote_split(const char *text, int *num, struct err *e);

#endif
