#include "cli.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int find_long(const struct cli_option *options, const char *name, size_t length)
{
    for (int i = 0; options[i].long_name != NULL; i++)
        if (strlen(options[i].long_name) == length &&
            strncmp(options[i].long_name, name, length) == 0)
            return i;
    return CLI_ERROR;
}

static int find_short(const struct cli_option *options, char name)
{
    for (int i = 0; options[i].long_name != NULL; i++)
        if (options[i].short_name == name)
            return i;
    return CLI_ERROR;
}

/* Edit distance of two words of at most 31 letters [Damerau64], in the variant that edits no letter
 * twice: letters to change, insert or delete, and neighbours to swap. MOST for longer words. */
static int distance(const char *a, size_t n, const char *b)
{
    enum { MOST = 32 };
    int d[MOST][MOST];
    size_t m = strlen(b);
    if (n >= MOST || m >= MOST)
        return MOST;
    for (size_t i = 0; i <= n; i++)
        for (size_t j = 0; j <= m; j++) {
            if (i == 0 || j == 0) {
                d[i][j] = (int)(i + j);
                continue;
            }
            int least = d[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            least = d[i - 1][j] + 1 < least ? d[i - 1][j] + 1 : least;
            least = d[i][j - 1] + 1 < least ? d[i][j - 1] + 1 : least;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] &&
                d[i - 2][j - 2] + 1 < least)
                least = d[i - 2][j - 2] + 1;
            d[i][j] = least;
        }
    return d[n][m];
}

const char *cli_nearest(const char *word, const char *(*next)(const void *list, size_t i),
                        const void *list)
{
    const char *nearest = NULL, *other;
    size_t length = strcspn(word, "=");
    int least = (int)length / 3 + 1;
    for (size_t i = 0; (other = next(list, i)) != NULL; i++) {
        int d = distance(word, length, other);
        if (d < least) {
            least = d;
            nearest = other;
        }
    }
    return nearest;
}

static const char *long_name(const void *options, size_t i)
{
    return ((const struct cli_option *)options)[i].long_name;
}

static int unknown(const struct cli_option *options, const char *arg, struct err *e)
{
    const char *meant = arg[1] == '-' ? cli_nearest(arg + 2, long_name, options) : NULL;
    if (meant != NULL)
        err_set(e, "unknown option '%s', did you mean --%s? (see --help)", arg, meant);
    else
        err_set(e, "unknown option '%s' (see --help)", arg);
    return CLI_ERROR;
}

static int num_args(const struct cli_option *o)
{
    int num = o->args != NULL && o->args[0] != '\0';
    for (const char *c = o->args; num > 0 && *c != '\0'; c++)
        num += *c == ' ';
    return num;
}

/* Takes `word` as both arguments of an option with W H if it reads like "480x360". */
static bool take_size(struct cli *c, const struct cli_option *o, const char *word)
{
    size_t w = strspn(word, "0123456789");
    if (o->args == NULL || strcmp(o->args, "W H") != 0 || w == 0 || word[w] != 'x' ||
        w + 1 == strlen(word) || strlen(word) >= sizeof c->size)
        return false;
    strcpy(c->size, word);
    c->size[w] = '\0';
    c->value[0] = c->size;
    c->value[1] = c->size + w + 1;
    return true;
}

/* Takes option i's arguments from the words that follow. Returns i or CLI_ERROR. */
static int take_words(struct cli *c, int i, const char *arg, struct err *e)
{
    const struct cli_option *o = &c->options[i];
    if (c->next < c->argc && take_size(c, o, c->argv[c->next])) {
        c->next++;
        return i;
    }
    if (c->argc - c->next < num_args(o)) {
        err_set(e, "option '%s' needs %s", arg, o->args);
        return CLI_ERROR;
    }
    for (int k = 0; k < num_args(o); k++)
        c->value[k] = c->argv[c->next++];
    return i;
}

static int next_long(struct cli *c, const char *arg, struct err *e)
{
    const char *equals = strchr(arg, '=');
    int i = find_long(c->options, arg + 2, equals ? (size_t)(equals - arg - 2) : strlen(arg + 2));
    if (i == CLI_ERROR)
        return unknown(c->options, arg, e);
    const struct cli_option *o = &c->options[i];
    if (equals == NULL)
        return take_words(c, i, arg, e);
    if (take_size(c, o, equals + 1))
        return i;
    if (num_args(o) != 1) {
        err_set(e, "option --%s takes %d arguments, not '='", o->long_name, num_args(o));
        return CLI_ERROR;
    }
    c->value[0] = equals + 1;
    return i;
}

/* at: the next letter of arg to read. It may be followed by more flags (-qv) or by the option's
 * argument (-j4). */
static int next_short(struct cli *c, const char *arg, const char *at, struct err *e)
{
    int i = find_short(c->options, *at);
    c->letters = NULL;
    if (at == arg + 1 && at[1] != '\0' &&
        find_long(c->options, at, strcspn(at, "=")) != CLI_ERROR) {
        err_set(e, "unknown option '%s': long options have two dashes, -%s", arg, arg);
        return CLI_ERROR;
    }
    if (i == CLI_ERROR)
        return unknown(c->options, arg, e);
    const struct cli_option *o = &c->options[i];
    if (at[1] == '\0')
        return take_words(c, i, arg, e);
    if (num_args(o) > 1) {
        err_set(e, "option '-%c' takes %s, each a word of its own, not '%s'", *at, o->args, arg);
        return CLI_ERROR;
    }
    if (num_args(o) == 1)
        c->value[0] = at + 1;
    else
        c->letters = at + 1;
    return i;
}

int cli_next(struct cli *c, struct err *e)
{
    if (c->letters != NULL)
        return next_short(c, c->name, c->letters, e);
    if (c->next < c->argc && !c->only_positional && strcmp(c->argv[c->next], "--") == 0) {
        c->only_positional = true;
        c->next++;
    }
    if (c->next >= c->argc)
        return CLI_END;
    const char *arg = c->argv[c->next++];
    c->name = arg;
    if (c->only_positional || arg[0] != '-' || arg[1] == '\0') {
        c->value[0] = arg;
        return CLI_POSITIONAL;
    }
    return arg[1] == '-' ? next_long(c, arg, e) : next_short(c, arg, arg + 1, e);
}

char **cli_apart(const struct cli_option *options, int argc, char **argv)
{
    size_t most = (size_t)argc + 1;
    for (int k = 1; k < argc; k++)
        most += strlen(argv[k]);
    char **word = malloc(most * (sizeof *word + sizeof "-x"));
    if (word == NULL)
        return NULL;
    char *letters = (char *)(word + most);
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    struct err e;
    size_t n = 0;
    word[n++] = argv[0];
    for (;;) {
        const int from = c.next, i = cli_next(&c, &e);
        if (i == CLI_END || i == CLI_ERROR)
            break;
        if (i == CLI_POSITIONAL || c.name[1] == '-' || c.name[2] == '\0') {
            for (int k = from; k < c.next; k++)
                word[n++] = argv[k];
            continue;
        }
        sprintf(letters, "-%c", options[i].short_name);
        word[n++] = letters;
        letters += sizeof "-x";
        for (int k = 0; k < num_args(&options[i]); k++)
            word[n++] = (char *)c.value[k];
    }
    word[n] = NULL;
    return word;
}

void cli_print_help(const char *usage, const struct cli_option *options)
{
    puts(usage);
    for (const struct cli_option *o = options; o->long_name != NULL; o++) {
        char left[64];
        int n = o->short_name
                    ? snprintf(left, sizeof left, "  -%c, --%s", o->short_name, o->long_name)
                    : snprintf(left, sizeof left, "      --%s", o->long_name);
        if (num_args(o) > 0)
            snprintf(left + n, sizeof left - (size_t)n, " %s", o->args);
        const char *help = o->help;
        while (true) {
            const char *end = strchr(help, '\n');
            int length = end ? (int)(end - help) : (int)strlen(help);
            printf("%-30s %.*s\n", left, length, help);
            if (end == NULL)
                break;
            help = end + 1;
            left[0] = '\0';
        }
    }
}

bool cli_int(const char *what, const char *text, long lo, long hi, int *out, struct err *e)
{
    char *end;
    errno = 0;
    long v = strtol(text, &end, 10);
    if (end != text && (*end == 'e' || *end == 'E')) { /* 1e3 */
        double whole = strtod(text, &end);
        v = whole == floor(whole) && fabs(whole) < 1e15 ? (long)whole : lo - 1;
    }
    if (end == text || *end != '\0' || errno != 0 || v < lo || v > hi)
        return err_set(e, "%s: '%s' is not a whole number from %ld to %ld", what, text, lo, hi);
    *out = (int)v;
    return true;
}

bool cli_uint64(const char *what, const char *text, uint64_t *out, struct err *e)
{
    char *end;
    errno = 0;
    unsigned long long v = strtoull(text, &end, strncmp(text, "0x", 2) == 0 ? 16 : 10);
    if (end == text || *end != '\0' || errno != 0 || strchr(text, '-') != NULL)
        return err_set(e, "%s: '%s' is not a whole number from 0 to 2^64-1", what, text);
    *out = v;
    return true;
}

bool cli_double(const char *what, const char *text, double lo, double hi, double *out,
                struct err *e)
{
    char *end;
    double v = strtod(text, &end);
    if (end == text || *end != '\0' || !isfinite(v) || v < lo || v > hi)
        return err_set(e, "%s: '%s' is not a number from %g to %g", what, text, lo, hi);
    *out = v;
    return true;
}

const struct cli_unit cli_time_units[] = {{"s", 1}, {"m", 60}, {"h", 3600}, {NULL, 1}};

static bool with_unit(const char *what, const char *text, const struct cli_unit *unit, double hi,
                      double *out, struct err *e)
{
    char number[64];
    size_t n = strlen(text);
    while (unit->name != NULL && (n == 0 || strcmp(text + n - 1, unit->name) != 0))
        unit++;
    n -= unit->name != NULL;
    snprintf(number, sizeof number, "%.*s", (int)(n < 63 ? n : 63), text);
    if (!cli_double(what, number, 1e-9, hi, out, e))
        return false;
    *out *= unit->value;
    return true;
}

bool cli_choice(const char *what, const char *text, const char *const *words, int *out,
                struct err *e)
{
    char list[256] = "";
    size_t n = 0;
    for (int i = 0; words[i] != NULL; i++) {
        if (strcmp(words[i], text) == 0) {
            *out = i;
            return true;
        }
        int added = snprintf(list + n, sizeof list - n, "%s%s", i ? ", " : "", words[i]);
        n = added < 0 || n + (size_t)added >= sizeof list ? sizeof list - 1 : n + (size_t)added;
    }
    return err_set(e, "%s: '%s' is none of: %s", what, text, list);
}

int cli_processors(void)
{
    long n = sysconf(_SC_NPROCESSORS_ONLN);
    return n < 1 ? 1 : n > 1024 ? 1024 : (int)n;
}

bool cli_uint32(const char *what, const char *text, uint32_t *out, struct err *e)
{
    uint64_t v = 0;
    if (!cli_uint64(what, text, &v, e))
        return false;
    *out = (uint32_t)v;
    return v <= UINT32_MAX || err_set(e, "%s: '%s' is above 2^32-1", what, text);
}

static bool read_range(const struct cli_option *o, const char *what, const char *text, int out[2],
                       struct err *e)
{
    char first[32] = "";
    const char *colon = strchr(text, ':');
    if (colon == NULL || colon - text >= (ptrdiff_t)sizeof first)
        return err_set(e, "%s: '%s' is not a range A:B", what, text);
    memcpy(first, text, (size_t)(colon - text));
    return cli_int(what, first, 0, (long)o->hi - 1, &out[0], e) &&
           cli_int(what, colon + 1, 1, (long)o->hi, &out[1], e) &&
           (out[0] < out[1] || err_set(e, "%s: no %s in '%s'", what, o->noun, text));
}

/* Parses one argument of option o into *to. */
static bool read_value(const struct cli_option *o, const char *text, void *to, struct err *e)
{
    char what[64];
    int index;
    assert(text != NULL);
    snprintf(what, sizeof what, "--%s", o->long_name);
    if (o->names != NULL && !cli_choice(what, text, o->names, &index, e))
        return false;
    if (o->kind == CLI_TEXT)
        *(const char **)to = text;
    else if (o->names != NULL)
        *(int *)to = (int)o->lo + index;
    else if (o->kind == CLI_INT)
        return cli_int(what, text, (long)o->lo, (long)o->hi, to, e);
    else if (o->kind == CLI_UINT32)
        return cli_uint32(what, text, to, e);
    else if (o->kind == CLI_UINT64)
        return cli_uint64(what, text, to, e);
    else if (o->kind == CLI_RANGE)
        return read_range(o, what, text, to, e);
    else
        return o->unit != NULL ? with_unit(what, text, o->unit, o->hi, to, e)
                               : cli_double(what, text, o->lo, o->hi, to, e);
    return true;
}

/* Appends the argument to a list of *num texts with room for `most`. */
static bool add_text(const struct cli_option *o, const struct cli *c, const char **to, int *num,
                     int most, struct err *e)
{
    if (*num < most) {
        to[(*num)++] = c->value[0];
        return true;
    }
    if (o->long_name != NULL)
        return err_set(e, "--%s: at most %d %s", o->long_name, most, o->noun);
    return o->noun != NULL
               ? err_set(e, "at most %d %s", most, o->noun)
               : err_set(e, "%s takes %s, '%s' is one more", c->argv[0], o->args, c->value[0]);
}

static bool take(const struct cli_option *o, const struct cli *c, void *settings, struct err *e)
{
    char *to = (char *)settings + o->to;
    const char **text = (void *)to;
    int num = num_args(o);
    if (o->read != NULL)
        return o->read(settings, c->value, e);
    if (o->kind == CLI_LIST)
        return add_text(o, c, text, (void *)((char *)settings + o->num), (int)o->hi, e);
    if (o->kind == CLI_REST)
        *(int *)(void *)to = c->next - 1;
    else if (o->long_name == NULL && o->kind == CLI_TEXT)
        return add_text(o, c, text, &(int){*text != NULL}, 1, e);
    else if (o->long_name == NULL)
        return err_set(e, "%s takes no argument '%s'", c->argv[0], c->value[0]);
    else if (o->kind == CLI_FLAG)
        *(bool *)to = true;
    else if (num == 0)
        *(int *)(void *)to = (int)o->lo;
    for (int k = 0; k < num; k++, to += o->kind == CLI_INT ? sizeof(int) : sizeof *text)
        if (!read_value(o, c->value[k], to, e))
            return false;
    return true;
}

bool cli_read(const struct cli_option *options, int argc, char **argv, void *settings,
              struct err *e)
{
    struct cli c = {.options = options, .argc = argc, .argv = argv, .next = 1};
    const struct cli_option *words = options;
    while (words->long_name != NULL)
        words++;
    for (int i; (i = cli_next(&c, e)) != CLI_END;) {
        if (i == CLI_ERROR)
            return false;
        const struct cli_option *o = i == CLI_POSITIONAL ? words : &options[i];
        if (!take(o, &c, settings, e))
            return false;
        if (o->usage != NULL)
            cli_print_help(o->usage, options);
        if (o->stops || o->usage != NULL)
            break;
    }
    return true;
}
