#include "appeals.h"

#include "renderer/base/fs.h"
#include "reference/base/json_node.h"
#include "renderer/base/cli.h"
#include "renderer/base/sha256.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char blanks[] = " \t\r\n";

/* The next word of the line, or what stands in double quotes; "" at its end. */
static char *take_word(char **rest)
{
    char *word = *rest + strspn(*rest, blanks);
    bool quoted = *word == '"';
    word += quoted;
    char *end = word + strcspn(word, quoted ? "\"\n" : blanks);
    *rest = end + (*end != '\0');
    *end = '\0';
    return word;
}

static bool read_line(char *line, const struct rubric *r, struct appeal *out, struct err *e)
{
    char *rest = line, *id = take_word(&rest), *check = take_word(&rest),
         *points = take_word(&rest);
    rest += strspn(rest, blanks);
    rest[strcspn(rest, "\r\n")] = '\0';
    for (out->check = 0; out->check < r->num_checks; out->check++)
        if (strcmp(r->check[out->check].name, check) == 0)
            break;
    if (out->check == r->num_checks)
        return err_set(e,
                       "'%s' is no check of %s: take the line out, or keep a file for each rubric",
                       check, r->path);
    if (!cli_double("points", points, 0, r->check[out->check].points, &out->points, e)) {
        const struct err why = *e;
        return err_set(e, "%.300s, the points of '%s' in %s", why.msg, check, r->path);
    }
    if (rest[0] == '\0')
        return err_set(e, "no reason given");
    if (strlen(id) >= sizeof out->id || strlen(rest) >= sizeof out->reason)
        return err_set(e, "longer than %zu characters", sizeof out->reason - 1);
    snprintf(out->id, sizeof out->id, "%s", id);
    snprintf(out->reason, sizeof out->reason, "%s", rest);
    return true;
}

/* Appends it unless there is one for the same. */
static bool append(struct appeals *a, const struct appeal *one, struct err *e)
{
    for (int i = 0; i < a->num; i++)
        if (a->of[i].check == one->check && strcmp(a->of[i].id, one->id) == 0)
            return err_set(e, "decided in line %d already", a->of[i].line);
    struct appeal *more = realloc(a->of, ((size_t)a->num + 1) * sizeof *more);
    if (more == NULL)
        return err_set(e, "out of memory");
    a->of = more;
    a->of[a->num++] = *one;
    return true;
}

bool appeals_read(const char *path, const struct rubric *r, struct appeals *out, struct err *e)
{
    FILE *f = fs_open(path);
    char *line = NULL;
    size_t room = 0;
    bool ok = true;
    *out = (struct appeals){0};
    if (f == NULL)
        return err_set(e, "%s: %s", path, strerror(errno));
    for (int number = 1; ok && getline(&line, &room, f) > 0; number++) {
        struct appeal one = {.line = number};
        const char *first = line + strspn(line, blanks);
        if (*first == '#' || *first == '\0')
            continue;
        ok = (read_line(line, r, &one, e) && append(out, &one, e)) ||
             err_prefix(e, "%s:%d", path, number);
    }
    ok = ok && (!ferror(f) || err_set(e, "%s: cannot be read", path));
    free(line);
    fclose(f);
    if (!ok)
        appeals_free(out);
    return ok;
}

void appeals_free(struct appeals *a)
{
    free(a->of);
    *a = (struct appeals){0};
}

void appeals_key(const struct appeals *a, const char *id, char key[65])
{
    char text[1024];
    sha256_text("", key);
    for (int i = 0; a != NULL && i < a->num; i++)
        if (strcmp(a->of[i].id, id) == 0) {
            snprintf(text, sizeof text, "%s %d %.17g %s", key, a->of[i].check, a->of[i].points,
                     a->of[i].reason);
            sha256_text(text, key);
        }
}

static void add_points(json_t *object, double more)
{
    json_object_set_new(object, "points", json_real(member_number(object, "points") + more));
}

static void decide(const struct appeal *one, const struct rubric_check *c, json_t *grade)
{
    json_t *check = json_array_get(json_object_get(grade, "checks"), (size_t)one->check);
    double more = one->points - member_number(check, "points");
    add_points(check, more);
    add_points(grade, more);
    json_each(part, json_object_get(grade, "parts"))
        if (strcmp(member_or_empty(part, "number"), member_or_empty(check, "part")) == 0)
            add_points(part, more);
    json_object_set_new(check, "share", json_real(c->points > 0 ? one->points / c->points : 1));
    json_object_set_new(check, "judged", json_true());
    json_object_del(check, "provisional");
    json_object_set_new(check, "appeal", json_string(one->reason));
}

void appeals_apply(const struct appeals *a, const struct rubric *r, json_t *grade)
{
    for (int i = 0; a != NULL && i < a->num; i++)
        if (strcmp(a->of[i].id, member_or_empty(grade, "id")) == 0)
            decide(&a->of[i], &r->check[a->of[i].check], grade);
}
