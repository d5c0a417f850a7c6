/* A command line as one text and back: what provenance stores, and what a person can paste into a shell. */
#ifndef ASSAY_SHELL_WORDS_H
#define ASSAY_SHELL_WORDS_H

#include "err.h"

#include <stddef.h>

/* Appends one word to the text in a buffer of `size` bytes, after a blank, in quotes where a shell would need them. False, and the
 * text as it was, if it does not fit. */
bool shell_append(char *text, size_t size, const char *word);

/* Appends the words of a NULL-terminated array, as many as fit. */
void shell_append_all(char *text, size_t size, const char *const *word);

/* The words of a text that shell_append() made, or that a person typed with blanks, '...' and \ alone: a NULL-terminated
 * array, one block of memory, to free(). NULL with a line on anything else that a shell would act on, on an open quote,
 * and out of memory. */
char **shell_split(const char *text, int *num, struct err *e) __attribute__((warn_unused_result));

#endif
