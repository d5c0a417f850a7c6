#define _GNU_SOURCE
#include "renew.h"

#include "reference/base/json_node.h"
#include "reference/suite/engine_table.h"
#include "tools/base/data_dirs.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void add_words(json_t *words, const char *const *word)
{
    for (; *word != NULL; word++)
        json_array_append_new(words, json_string(*word));
}

/* Did the engine make what is stored? Else: is the reference called as it, or as it and -VERSION? So does `golden render`
 * choose the reference that an engine makes. */
static bool is_made_by(const struct engine *en, const struct renew *r)
{
    const size_t n = en != NULL ? strlen(en->name) : 0;
    const char *maker = member_text(
        json_object_get(json_object_get(r->manifest, "settings"), "description"), "name");
    if (n > 0 && maker != NULL)
        return strcmp(maker, en->name) == 0;
    return n > 0 && strncmp(r->name, en->name, n) == 0 && (r->name[n] == '\0' || r->name[n] == '-');
}

void renew_add_places(json_t *words, bool is_own, const char *suite_dir, const char *golden_dir)
{
    char full[PATH_MAX], found[PATH_MAX];
    const struct data_dirs at = is_own ? data_dirs_of_suite(suite_dir) : data_dirs_find();
    if ((is_own || strcmp(suite_dir, at.suite.s) != 0) && realpath(suite_dir, full) != NULL)
        add_words(words, (const char *[]){"--suite", full, NULL});
    if (golden_dir == NULL || realpath(golden_dir, full) == NULL)
        return;
    if (realpath(at.golden.s, found) == NULL || strcmp(full, found) != 0)
        add_words(words, (const char *[]){"--golden", full, NULL});
}

static char *command(const struct renew *r, const char *verb)
{
    json_t *w = json_array();
    const bool renders = strcmp(verb, "render") == 0, ours = engine_with_goldens(r->name) != NULL;
    add_words(w, (const char *[]){"golden", verb, NULL});
    renew_add_places(w, r->is_own, r->suite_dir, renders ? NULL : r->golden_dir);
    if (renders)
        add_words(w, (const char *[]){"--fresh", "--engine", ours ? r->name : r->engine->file,
                                      "--only", r->scene, NULL});
    if (renders && !ours)
        add_words(w, (const char *[]){"--as", r->name, NULL});
    if (!renders)
        add_words(w, (const char *[]){"--new", fs_path("%s/%s", r->scene, r->name).s, NULL});
    char *text = json_command_line("assay", w);
    json_decref(w);
    return text;
}

char *renew_commands(const struct renew *r)
{
    if (engine_with_goldens(r->name) == NULL && !is_made_by(r->engine, r))
        return NULL;
    char *render = command(r, "render"), *approve = command(r, "approve"), *both = NULL;
    if (render != NULL && approve != NULL && asprintf(&both, "%s\n%s", render, approve) < 0)
        both = NULL;
    free(render);
    free(approve);
    return both;
}

bool renew_say(const struct renew *r, struct err *e)
{
    const struct err why = *e;
    char *commands = renew_commands(r);
    if (commands != NULL) {
        char *end = strchr(commands, '\n');
        *end = '\0';
        err_set(e, "%.500s: %s && %s", why.msg, commands, end + 1);
    } else {
        err_set(e,
                "%.500s: render it with the file that describes what makes it (golden render "
                "--engine FILE --as %s), then approve it",
                why.msg, r->name);
    }
    free(commands);
    return false;
}
