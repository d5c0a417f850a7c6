#include "export_provenance.h"

#include <errno.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>

enum { NUM_KEYS = 4 };
static const char *const keys[NUM_KEYS] = {"assay:version", "assay:command", "assay:scene",
                                           "assay:environment"};

static const struct {
    const char *before, *after;
} marks[] = {
    [COMMENT_POVRAY] = {"// ", ""}, [COMMENT_PBRT] = {"# ", ""}, [COMMENT_XML] = {"<!-- ", " -->"}};
enum { NUM_MARKS = sizeof marks / sizeof *marks };

void export_origin_write(FILE *f, enum export_comment comment, const struct export_origin *o,
                         bool named)
{
    const char *const value[NUM_KEYS] = {o->version, named ? o->named : o->command, o->scene,
                                         o->environment};
    for (int k = 0; k < NUM_KEYS; k++) {
        if (value[k] == NULL)
            continue;
        fprintf(f, "%s%s ", marks[comment].before, keys[k]);
        for (const char *c = value[k]; *c != '\0'; c++) {
            fputc(*c, f);
            if (comment == COMMENT_XML && c[0] == '-' && c[1] == '-')
                fputs("''", f);
        }
        fprintf(f, "%s\n", marks[comment].after);
    }
}

static char **member(struct export_said *s, int k)
{
    char **const all[NUM_KEYS] = {&s->version, &s->command, &s->scene, &s->environment};
    return all[k];
}

static bool starts(const char *text, const char *with)
{
    return strncmp(text, with, strlen(with)) == 0;
}

static bool set(struct export_said *s, int k, const char *value, struct err *e)
{
    char **to = member(s, k);
    free(*to);
    *to = strdup(value);
    return *to != NULL || err_set(e, "out of memory");
}

/* Is the line, without its end, one of ours? */
static bool take_line(struct export_said *s, char *line, bool *ours, struct err *e)
{
    *ours = false;
    for (int m = 0; m < NUM_MARKS; m++) {
        size_t n = strlen(line), before = strlen(marks[m].before), after = strlen(marks[m].after);
        if (n < before + after || !starts(line, marks[m].before) ||
            strcmp(line + n - after, marks[m].after) != 0)
            continue;
        for (int k = 0; k < NUM_KEYS; k++) {
            size_t key = strlen(keys[k]);
            const char *text = line + before;
            if (!starts(text, keys[k]) || text[key] != ' ')
                continue;
            *ours = true;
            line[n - after] = '\0';
            return set(s, k, text + key + 1, e);
        }
    }
    return true;
}

/* They stand together and near the top: what looks like them further down is a name that somebody gave to an object. */
static bool read_comments(FILE *f, struct export_said *s, struct err *e)
{
    enum { MOST_BEFORE = 2 }; /* declaration of XML, how to render it */
    char *line = NULL;
    size_t size = 0;
    bool ok = true, ours = false, any = false;
    for (int before = 0; ok && before <= MOST_BEFORE;) {
        errno = 0;
        ssize_t n = getline(&line, &size, f);
        if (n < 0) {
            ok = errno != ENOMEM || err_set(e, "out of memory");
            break;
        }
        if (n > 0 && line[n - 1] == '\n')
            line[n - 1] = '\0';
        s->is_scene = s->is_scene || starts(line, "<scene ");
        ok = take_line(s, line, &ours, e);
        any = any || ours;
        if (any && !ours)
            break;
        before += !ours;
    }
    free(line);
    return ok;
}

static bool read_keys(FILE *f, struct export_said *s, struct err *e)
{
    json_error_t je;
    json_t *root = json_loadf(f, 0, &je);
    bool ok = root != NULL || json_error_code(&je) != json_error_out_of_memory ||
              err_set(e, "out of memory");
    s->is_scene = json_object_get(root, "assay_cycles") != NULL;
    for (int k = 0; ok && s->is_scene && k < NUM_KEYS; k++) {
        const char *value = json_string_value(json_object_get(root, keys[k]));
        ok = value == NULL || set(s, k, value, e);
    }
    json_decref(root);
    return ok;
}

bool export_origin_read(const char *path, struct export_said *s, struct err *e)
{
    *s = (struct export_said){.is_scene = false};
    const char *dot = strrchr(path, '.');
    FILE *f = fopen(path, "rb");
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    int first = getc(f);
    ungetc(first, f);
    bool ok = first == '{' ? read_keys(f, s, e) : read_comments(f, s, e);
    fclose(f);
    s->is_scene = s->is_scene || (dot != NULL && first != '{' &&
                                  (strcmp(dot, ".pov") == 0 || strcmp(dot, ".pbrt") == 0));
    s->is_scene = s->is_scene || (s->command != NULL && starts(s->command, "assay export "));
    return ok || err_prefix(e, "%s", path);
}

void export_said_free(struct export_said *s)
{
    for (int k = 0; k < NUM_KEYS; k++)
        free(*member(s, k));
    *s = (struct export_said){.is_scene = false};
}
