#include "truth_values.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A member of `values`, or of an object in it; `name` ends at a character that cannot be part of a name. */
static const json_t *find(const json_t *values, const char *name)
{
    size_t n = strcspn(name, ".[>=) ");
    const json_t *v = json_object_getn(values, name, n);
    return name[n] == '.' ? find(v, name + n + 1) : v;
}

/* Copies the numbers of v, nested arrays included; returns how many, or -1 if something else is among them or there are
 * more than num. */
static int flatten(const json_t *v, double *to, int num)
{
    int all = 0;
    if (json_is_number(v) && num > 0) {
        *to = json_number_value(v);
        return 1;
    }
    for (size_t i = 0; all >= 0 && i < json_array_size(v); i++) {
        int here = flatten(json_array_get(v, i), to + all, num - all);
        all = here < 0 ? -1 : all + here;
    }
    return json_is_array(v) ? all : -1;
}

/* Reads the member that `word` names into `to`. */
static bool read_word(const json_t *values, const char *word, double *to, struct err *e)
{
    const int length = (int)strcspn(word, "[>= ");
    const char *range = word + strcspn(word, ">= ");
    const int num = word[length] == '[' ? atoi(word + length + 1) : 1;
    const bool share = strncmp(range, "=0..1", 5) == 0, from = strncmp(range, ">=0", 3) == 0,
               above = range[0] == '>' && !from;
    const double least = above ? atof(range + 1) : 0;
    const json_t *v = find(values, word);
    if (v == NULL)
        return err_set(e, "'%.*s' is missing", length, word);
    if (json_is_array(v) != (num > 1) || flatten(v, to, num) != num)
        return num == 1 ? err_set(e, "'%.*s' is not a number", length, word)
                        : err_set(e, "'%.*s' is not %d numbers", length, word, num);
    for (int i = 0; i < num; i++) {
        char index[16] = "";
        if (num > 1)
            snprintf(index, sizeof index, "[%d]", i);
        if (above && !(to[i] > least))
            return err_set(e, "%.*s%s is %g, not above %g", length, word, index, to[i], least);
        if ((share || from) && !(to[i] >= 0 && to[i] <= (share ? 1 : HUGE_VAL)))
            return err_set(e, "%.*s%s is %g, not %s", length, word, index, to[i],
                           share ? "in [0, 1]" : "0 or more");
    }
    return true;
}

/* Fails on a member that no word names; `at`: the object's own name with a dot, "" for the outermost. */
static bool only_known(const json_t *object, const char *at, const char *names, struct err *e)
{
    const char *key;
    json_t *member;
    json_object_foreach((json_t *)object, key, member) {
        char name[80];
        bool known = false, holds = false;
        size_t n = (size_t)snprintf(name, sizeof name, "%s%.60s", at, key);
        for (const char *w = names; *w != '\0'; w += strcspn(w, " "), w += strspn(w, " ")) {
            const char *word = w + (w[0] == '(');
            if (strncmp(word, name, n) == 0) {
                known |= strchr("[>=) ", word[n]) != NULL;
                holds |= word[n] == '.';
            }
        }
        if (!known && !holds)
            return err_set(e, "nothing is called '%s'", name);
        snprintf(name + n, sizeof name - n, ".");
        if (holds && !only_known(member, name, names, e))
            return false;
    }
    return true;
}

bool truth_values_read(const json_t *values, struct err *e, const char *names, ...)
{
    va_list to;
    bool ok = true;
    va_start(to, names);
    for (const char *w = names; ok && *w != '\0'; w += strcspn(w, " "), w += strspn(w, " "))
        ok = w[0] == '(' || read_word(values, w, va_arg(to, double *), e);
    va_end(to);
    return ok && only_known(values, "", names, e);
}
