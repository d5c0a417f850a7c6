/* A command line as one text and back, for provenance records and for pasting into a shell. */
#ifndef ASSAY_SHELL_QUOTE_H
#define ASSAY_SHELL_QUOTE_H

#include "err.h"

/* Joins `first`, unless it is NULL, and the words of a NULL-terminated array with blanks, in quotes where a shell needs them.
 * The caller frees the text. NULL if out of memory. */
NODISCARD char *shell_quote_join(const char *first, const char *const *word);

/* Splits a text that shell_quote_join() made, or that a person typed with only blanks, '...' and \ as syntax, into a
 * NULL-terminated array in one block of memory, which the caller frees. NULL with a line on anything else that a shell
 * would interpret, on an unclosed quote, or out of memory. */
NODISCARD char **shell_quote_split(const char *text, int *num, struct err *e);

#endif
