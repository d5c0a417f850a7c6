/* Errors: one line of text in a struct that the caller owns.
 *
 * Library functions return bool (or NULL). On failure, and only then, they fill a struct err with
 * one line that says where and what: "scene.dae:123: unexpected <toon> in <technique>". The line
 * has no newline and no program name; only main() prints it and chooses the exit code. */
#ifndef ASSAY_ERR_H
#define ASSAY_ERR_H

#include <stdbool.h>

struct err {
    char msg[1024];
};

/* For a function whose return value must not be ignored. */
#define NODISCARD __attribute__((warn_unused_result))

/* Formats the line into *e, silently cut at its size, with a '?' for each control character. e may be NULL.
 * Always returns false, so that a failing function can `return err_set(e, "...")`. */
bool err_set(struct err *e, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/* Puts "prefix: " in front of a line that is already set: who was doing what when it failed. Always
 * returns false. */
bool err_prefix(struct err *e, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/* True if the line reports lack of memory, in our words or those of the C library or OpenEXR: then
 * the file that was being read is not at fault. */
bool err_is_of_memory(const struct err *e);

/* Replaces each control character in place by '?': text from files and libraries ends up in error lines and must
 * neither control a terminal nor look like two lines in a log. */
void err_hide_controls(char *text);

/* The analyzer of `make lint` sees one file at a time and would otherwise assume that these may return true. */
#ifdef __clang_analyzer__
#define err_set(...)    ((void)err_set(__VA_ARGS__), false)
#define err_prefix(...) ((void)err_prefix(__VA_ARGS__), false)
#endif

#endif
