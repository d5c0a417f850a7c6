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

/* Formats the line into e (truncating quietly at its size; e may be NULL), a '?' for each control character.
 * Always returns false, so that a failing function can `return err_set(e, "...")`. */
bool err_set(struct err *e, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/* Puts "prefix: " in front of a line that is already set: who was doing what when it failed. Always
 * returns false. */
bool err_prefix(struct err *e, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/* Does the line say that memory ran out, in our words or those of the C library or OpenEXR? Then it
 * says nothing about the file that was read. For callers that would otherwise blame that file. */
bool err_is_of_memory(const struct err *e);

/* Each control character becomes a '?'. What a file or a library said may end up in a line: a terminal must not obey
 * it, and a log must not take it for two lines. */
void err_hide_controls(char *text);

/* `make lint` looks at one file at a time and would follow the paths on which these return true. */
#ifdef __clang_analyzer__
#define err_set(...)    ((void)err_set(__VA_ARGS__), false)
#define err_prefix(...) ((void)err_prefix(__VA_ARGS__), false)
#endif

#endif
