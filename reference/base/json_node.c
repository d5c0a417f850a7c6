#include "json_node.h"

#include "renderer/base/shell_quote.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool json_only_keys(const struct json_node *n, const char *const *allowed, struct err *e)
{
    const char *key;
    json_t *value;
    json_object_foreach(n->object, key, value) {
        const char *const *k = allowed;
        while (*k != NULL && strcmp(*k, key) != 0)
            k++;
        if (*k == NULL)
            return err_set(e, "%s: unknown key '%s%s'", n->file, n->at, key);
    }
    return true;
}

bool json_get(const struct json_node *n, const char *key, json_t **out, struct err *e)
{
    *out = json_object_get(n->object, key);
    return *out != NULL || err_set(e, "%s: missing key '%s%s'", n->file, n->at, key);
}

bool json_get_object(const struct json_node *n, const char *key, json_t **out, struct err *e)
{
    if (!json_get(n, key, out, e))
        return false;
    if (!json_is_object(*out))
        return err_set(e, "%s: '%s%s' is not an object", n->file, n->at, key);
    return true;
}

bool json_get_int(const struct json_node *n, const char *key, int lo, int hi, int *out,
                  struct err *e)
{
    json_t *v;
    if (!json_get(n, key, &v, e))
        return false;
    if (!json_is_integer(v))
        return err_set(e, "%s: '%s%s' is not a whole number", n->file, n->at, key);
    json_int_t i = json_integer_value(v);
    if (i < lo || i > hi)
        return err_set(e, "%s: '%s%s' is %" JSON_INTEGER_FORMAT ", not in %d..%d", n->file, n->at,
                       key, i, lo, hi);
    *out = (int)i;
    return true;
}

bool json_get_number(const struct json_node *n, const char *key, double lo, double hi, double *out,
                     struct err *e)
{
    json_t *v;
    if (!json_get(n, key, &v, e))
        return false;
    if (!json_is_number(v))
        return err_set(e, "%s: '%s%s' is not a number", n->file, n->at, key);
    *out = json_number_value(v);
    if (!(*out > lo && *out < hi))
        return err_set(e, "%s: '%s%s' is %g, not between %g and %g", n->file, n->at, key, *out, lo,
                       hi);
    return true;
}

bool json_get_text(const struct json_node *n, const char *key, char *out, size_t size,
                   struct err *e)
{
    json_t *v;
    if (!json_get(n, key, &v, e))
        return false;
    const char *s = json_string_value(v);
    if (s == NULL)
        return err_set(e, "%s: '%s%s' is not a text", n->file, n->at, key);
    if (*s == '\0')
        return err_set(e, "%s: '%s%s' is empty", n->file, n->at, key);
    if (strlen(s) >= size)
        return err_set(e, "%s: '%s%s' is longer than %zu bytes", n->file, n->at, key, size - 1);
    for (const char *c = s; *c != '\0'; c++)
        if ((unsigned char)*c < ' ')
            return err_set(e, "%s: '%s%s' is not one line", n->file, n->at, key);
    memcpy(out, s, strlen(s) + 1);
    return true;
}

bool json_has(const struct json_node *n, const char *key)
{
    return json_object_get(n->object, key) != NULL;
}

bool json_may_int(const struct json_node *n, const char *key, int lo, int hi, int *out,
                  struct err *e)
{
    return !json_has(n, key) || json_get_int(n, key, lo, hi, out, e);
}

bool json_may_number(const struct json_node *n, const char *key, double lo, double hi, double *out,
                     struct err *e)
{
    return !json_has(n, key) || json_get_number(n, key, lo, hi, out, e);
}

bool json_may_text(const struct json_node *n, const char *key, char *out, size_t size,
                   struct err *e)
{
    return !json_has(n, key) || json_get_text(n, key, out, size, e);
}

json_t *json_finite(double v)
{
    return isfinite(v) ? json_real(v) : json_null();
}

json_t *json_interval(double lo, double hi)
{
    return isfinite(lo) && isfinite(hi) ? json_pack("[f,f]", lo, hi) : json_null();
}

char *json_command_line(const char *first, const json_t *words)
{
    size_t num = json_array_size(words);
    const char **word = calloc(num + 1, sizeof *word);
    for (size_t i = 0; word != NULL && i < num; i++)
        word[i] = json_string_value(json_array_get(words, i));
    char *text = word != NULL ? shell_quote_join(first, word) : NULL;
    free(word);
    return text;
}

bool json_is_interval(const json_t *v)
{
    double lo, hi;
    return json_unpack((json_t *)v, "[FF!]", &lo, &hi) == 0 && lo <= hi;
}

const char *member_text(const json_t *object, const char *name)
{
    return json_string_value(json_object_get(object, name));
}

const char *member_or_empty(const json_t *object, const char *name)
{
    const char *text = member_text(object, name);
    return text != NULL ? text : "";
}

double member_number(const json_t *object, const char *name)
{
    return json_number_value(json_object_get(object, name));
}

double member_end(const json_t *object, const char *name, size_t end)
{
    return json_number_value(json_array_get(json_object_get(object, name), end));
}

const json_t *member_named(const json_t *array, const char *name)
{
    json_each(object, array) {
        if (strcmp(member_or_empty(object, "name"), name) == 0)
            return object;
    }
    return NULL;
}
