#include "rubric_internal.h"

#include "renderer/base/fs.h"
#include "tools/images/tone_curve.h"
#include "renderer/base/cli.h"

#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FILE = 1 << 20, MAX_LINE = 2048 };

/* A line being read: its words are taken one by one. */
struct statement {
    struct rubric *r;
    struct rubric_mistakes *m;
    int line;
    char *rest;                 /* what has not been taken, without spaces around */
    struct rubric_image *image; /* the block that the line stands in; at most one is not NULL */
    struct rubric_check *check;
    bool varies; /* a statement with {variant} was read */
    /* Statements given so far, a bit for each row of the table: of the rubric, of the block. */
    uint32_t given[2], limits; /* limits: of the kinds of 'limit' */
};

static char *take_word(struct statement *s)
{
    char *word = s->rest;
    size_t n = strcspn(word, " \t");
    s->rest = word + n + strspn(word + n, " \t");
    if (word[n] != '\0')
        word[n] = '\0';
    return word;
}

static void take_text(struct statement *s, const char *what, char *out, size_t size)
{
    if (s->rest[0] == '\0')
        rubric_mistake(s->m, s->line, "'%s' needs a text", what);
    else if (strlen(s->rest) >= size)
        rubric_mistake(s->m, s->line, "'%s' is longer than %zu characters", what, size - 1);
    else
        snprintf(out, size, "%s", s->rest);
    s->rest += strlen(s->rest);
}

/* Of letters, digits, _ and -. */
static bool is_name(const char *word)
{
    size_t n = strspn(word, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-");
    return n > 0 && word[n] == '\0' && word[0] != '-';
}

static bool take_name(struct statement *s, const char *what, char *out, size_t size)
{
    char *word = take_word(s);
    if (word[0] == '\0') {
        rubric_mistake(s->m, s->line, "'%s' needs a name", what);
        return false;
    }
    if (!is_name(word) || strlen(word) >= size) {
        rubric_mistake(s->m, s->line, "'%s' is no name: letters, digits, _ and -, at most %zu",
                       word, size - 1);
        return false;
    }
    snprintf(out, size, "%s", word);
    return true;
}

static bool take_number(struct statement *s, const char *what, double lo, double hi, double *out)
{
    struct err e;
    char *word = take_word(s);
    if (word[0] == '\0')
        rubric_mistake(s->m, s->line, "'%s' needs a number", what);
    else if (cli_double(what, word, lo, hi, out, &e))
        return true;
    else
        rubric_mistake(s->m, s->line, "%.150s", e.msg);
    return false;
}

static void take_int(struct statement *s, const char *what, int lo, int hi, int *out)
{
    struct err e;
    char *word = take_word(s);
    if (word[0] == '\0')
        rubric_mistake(s->m, s->line, "'%s' needs a whole number", what);
    else if (!cli_int(what, word, lo, hi, out, &e))
        rubric_mistake(s->m, s->line, "%.150s", e.msg);
}

static void take_margin(struct statement *s, const char *what, struct margin *out)
{
    struct margin m = {.given = true};
    if (!take_number(s, what, 0, 100, &m.full) || !take_number(s, what, 0, 100, &m.none))
        return;
    if (m.full >= m.none)
        rubric_mistake(s->m, s->line,
                       "'%s': full points up to %g and none from %g: the first must be less", what,
                       m.full, m.none);
    *out = m;
}

static void read_limit(struct statement *s)
{
    enum { WALL, CPU, BUILD, MEMORY, BUILD_MEMORY, DISK, PROCESSES };
    static const char *const kinds[] = {"wall",         "cpu",  "build",     "memory",
                                        "build-memory", "disk", "processes", NULL};
    struct sandbox_limits *l = &s->r->limit;
    char word[32];
    double mib = 1;
    struct err why;
    int k;
    if (!cli_choice("limit", take_word(s), kinds, &k, &why)) {
        rubric_mistake(s->m, s->line, "%s", why.msg);
        s->rest += strlen(s->rest); /* its value is no second mistake */
        return;
    }
    snprintf(word, sizeof word, "limit %s", kinds[k]);
    if (s->limits >> k & 1)
        rubric_mistake(s->m, s->line, "a second '%s'", word);
    s->limits |= 1u << k;
    if (k == WALL)
        take_number(s, word, 1, 1e5, &l->wall_s);
    else if (k == CPU)
        take_number(s, word, 1, 1e5, &l->cpu_s);
    else if (k == BUILD)
        take_number(s, word, 1, 1e5, &s->r->build_s);
    else if (k == PROCESSES)
        take_int(s, word, 1, 4096, &l->processes);
    else if (take_number(s, word, k == DISK ? 1 : 16, 1 << 20, &mib)) {
        const size_t bytes = (size_t)(mib * (1 << 20));
        *(k == MEMORY ? &l->memory : k == DISK ? &l->disk : &s->r->build_memory) = bytes;
        if (k == DISK)
            l->file = bytes < l->file ? bytes : l->file;
    }
}

/* Appends one of several 'build' lines. */
static void read_build(struct statement *s)
{
    char *build = s->r->build;
    size_t n = strlen(build), length = strlen(s->rest);
    if (length == 0)
        rubric_mistake(s->m, s->line, "'build' needs a text");
    else if (n + length + 2 > sizeof s->r->build)
        rubric_mistake(s->m, s->line, "all 'build' lines are longer than %zu characters",
                       sizeof s->r->build - 2);
    else
        snprintf(build + n, sizeof s->r->build - n, "%s%s", n > 0 ? "\n" : "", s->rest);
    s->rest += length;
}

static void read_budget(struct statement *s)
{
    if (strcmp(take_word(s), "cpu") == 0) {
        take_number(s, "budget cpu", 0, 1e6, &s->r->budget_s);
    } else {
        rubric_mistake(s->m, s->line, "'budget' is of cpu");
        s->rest += strlen(s->rest); /* its value is no second mistake */
    }
}

static void read_allow(struct statement *s)
{
    const char *what = take_word(s);
    s->r->images = strcmp(what, "images") == 0;
    if (!s->r->images)
        rubric_mistake(s->m, s->line, "'allow %.100s': only images can be allowed", what);
}

static void read_mask(struct statement *s)
{
    for (int i = 0; i < 4; i++)
        take_int(s, "mask", i < 2 ? 0 : 1, 4096, &s->r->mask[i]);
}

static void read_bugs(struct statement *s)
{
    take_name(s, "bugs", s->r->bugs, sizeof s->r->bugs);
}

/* An image, a part or a check begins. False: there are too many. */
static bool begin(struct statement *s, const char *what, int num, int most)
{
    s->check = NULL;
    s->image = NULL;
    s->given[1] = 0;
    if (num == most)
        rubric_mistake(s->m, s->line, "more than %d %s", most, what);
    return num < most;
}

static void read_image(struct statement *s)
{
    struct rubric *r = s->r;
    if (!begin(s, "images", r->num_images, RUBRIC_IMAGES))
        return;
    struct rubric_image *p = &r->image[r->num_images];
    *p = (struct rubric_image){.line = s->line, .lights = 1, .bounces = -1};
    s->image = p;
    if (!take_name(s, "image", p->name, sizeof p->name))
        return;
    for (int i = 0; i < r->num_images; i++)
        if (strcmp(r->image[i].name, p->name) == 0)
            rubric_mistake(s->m, s->line, "image '%s' is already in line %d", p->name,
                           r->image[i].line);
    r->num_images++;
}

/* An image by its old word, "picture". */
static void read_picture(struct statement *s)
{
    s->r->old_word_line = s->r->old_word_line > 0 ? s->r->old_word_line : s->line;
    read_image(s);
}

static void read_part(struct statement *s)
{
    struct rubric *r = s->r;
    if (!begin(s, "parts", r->num_parts, RUBRIC_PARTS))
        return;
    struct rubric_part *p = &r->part[r->num_parts++];
    *p = (struct rubric_part){.line = s->line};
    take_name(s, "part", p->number, sizeof p->number);
    take_text(s, "part NUMBER", p->title, sizeof p->title);
}

static bool take_image(struct statement *s, int *out)
{
    char *name = take_word(s);
    for (*out = 0; *out < s->r->num_images; ++*out)
        if (strcmp(s->r->image[*out].name, name) == 0)
            return true;
    rubric_mistake(s->m, s->line, "no image '%s' above", name);
    *out = -1;
    return false;
}

static void read_check(struct statement *s)
{
    struct rubric *r = s->r;
    if (!begin(s, "checks", r->num_checks, RUBRIC_CHECKS))
        return;
    struct rubric_check *c = &r->check[r->num_checks++];
    *c = (struct rubric_check){.line = s->line, .part = r->num_parts - 1, .after = -1};
    s->check = c;
    if (r->num_parts == 0)
        rubric_mistake(s->m, s->line, "a check before the first 'part'");
    if (!take_name(s, "check", c->name, sizeof c->name) ||
        !take_number(s, "points", 0, 1e4, &c->points))
        return;
    for (int i = 0; i < r->num_checks - 1; i++)
        if (strcmp(r->check[i].name, c->name) == 0)
            rubric_mistake(s->m, s->line, "check '%s' is already in line %d", c->name,
                           r->check[i].line);
    char *kind = take_word(s);
    int k = 0;
    while (k < NUM_CHECK_KINDS && strcmp(kind, rubric_check_kind_name[k]) != 0)
        k++;
    c->kind = (enum check_kind)k;
    if (k == NUM_CHECK_KINDS)
        rubric_mistake(s->m, s->line,
                       "'%s' is no kind of check: equal, agree, sum, exact, noise, rates or growth",
                       kind);
    while (s->rest[0] != '\0') {
        int i;
        if (!take_image(s, &i))
            continue;
        if (c->num_images == CHECK_IMAGES)
            rubric_mistake(s->m, s->line, "more than %d images", CHECK_IMAGES);
        else {
            c->images[c->num_images++] = i;
            r->image[i].used = true;
        }
    }
}

static void read_size(struct statement *s)
{
    take_int(s, "size", 16, 4096, &s->image->width);
    take_int(s, "size", 16, 4096, &s->image->height);
}

static void read_reference(struct statement *s)
{
    struct rubric_image *p = s->image;
    char *kind = take_word(s);
    for (int k = REFERENCE_TRUTH; k <= REFERENCE_OURS; k++)
        if (strcmp(kind, rubric_reference_names[k]) == 0)
            p->reference = (enum rubric_reference)k;
    if (p->reference == REFERENCE_NONE)
        rubric_mistake(s->m, s->line,
                       "reference '%s' is none of truth" ENGINES_WITH_GOLDENS(ENGINE_TEXT) " ours",
                       kind);
    if (p->reference == REFERENCE_OURS) {
        take_int(s, "reference ours", 1, 1 << 20, &p->reference_spp);
        if (s->rest[0] != '\0')
            take_text(s, "reference ours SPP", p->reference_options, sizeof p->reference_options);
    }
}

static void read_accept(struct statement *s)
{
    struct accepted *list = s->image != NULL ? s->image->accept : s->r->accept;
    int most = s->image != NULL ? RUBRIC_SETS : RUBRIC_ACCEPTED,
        *num = s->image != NULL ? &s->image->num_accepted : &s->r->num_accepted;
    if (*num == most) {
        rubric_mistake(s->m, s->line, "more than %d accepted deviations", most);
        return;
    }
    struct accepted *a = &list[*num];
    *a = (struct accepted){.line = s->line};
    if (!take_name(s, "accept", a->name, sizeof a->name))
        return;
    take_text(s, "accept NAME", a->how, sizeof a->how);
    for (int i = 0; i < *num; i++)
        if (strcmp(list[i].name, a->name) == 0)
            rubric_mistake(s->m, s->line, "'%s' is already accepted in line %d", a->name,
                           list[i].line);
    ++*num;
}

/* Of a deviation of the whole program that is accepted above. */
static void read_explain(struct statement *s)
{
    struct accepted of = {0};
    if (!take_name(s, "explain", of.name, sizeof of.name))
        return;
    take_text(s, "explain NAME", of.words, sizeof of.words);
    for (int i = 0; i < s->r->num_accepted; i++)
        if (strcmp(s->r->accept[i].name, of.name) == 0) {
            memcpy(s->r->accept[i].words, of.words, sizeof of.words);
            return;
        }
    rubric_mistake(s->m, s->line, "no deviation '%s' is accepted above", of.name);
}

/* Stands once, before any {variant}. */
static void read_variants(struct statement *s)
{
    struct rubric *r = s->r;
    take_int(s, "variants", 2, 99, &r->variants);
    if (r->variant > r->variants)
        rubric_mistake(s->m, s->line, "there is no variant %d", r->variant);
    r->variant = r->variant > 0 ? r->variant : 1;
}

/* Puts the number in place of "{variant}" in what may differ; it is never longer. */
static void fill_in_variant(struct statement *s, const char *word)
{
    static const char *const may[] = {"scene", "environment", "options", "bugs", "accept"};
    static const char name[] = "{variant}";
    bool here = false;
    for (size_t i = 0; i < sizeof may / sizeof *may; i++)
        here = here || strcmp(word, may[i]) == 0;
    for (char *at = here ? strstr(s->rest, name) : NULL; at != NULL; at = strstr(at, name)) {
        if (s->r->variants == 0) {
            rubric_mistake(s->m, s->line, "'%s' without a line 'variants NUMBER' above", name);
            return;
        }
        s->varies = true;
        int n = sprintf(at, "%d", s->r->variant);
        memmove(at + n, at + strlen(name), strlen(at + strlen(name)) + 1);
        at += n;
    }
}

/* A statement that fills a member of the rubric, or of the image or check that it stands in; or,
 * with `read`, any other. */
struct member {
    const char *word;
    enum { TEXT, WHOLE, NUMBER, MARGIN, IMAGE } value;
    size_t at, size;
    int lo, hi; /* of numbers */
    void (*read)(struct statement *s);
    bool many; /* may be given again */
};
#define TO(type, name) .at = offsetof(struct type, name), .size = sizeof((struct type *)NULL)->name

static const struct member of_rubric[] = {{"rubric", TEXT, TO(rubric, title)},
                                          {"variants", .read = read_variants},
                                          {"curve", TEXT, TO(rubric, curve)},
                                          {"command", TEXT, TO(rubric, command)},
                                          {"bugs", .read = read_bugs},
                                          {"output", TEXT, TO(rubric, output)},
                                          {"program", TEXT, TO(rubric, program)},
                                          {"build", .read = read_build, .many = true},
                                          {"packages", TEXT, TO(rubric, packages)},
                                          {"total", NUMBER, TO(rubric, total), 0, 1000000},
                                          {"limit", .read = read_limit, .many = true},
                                          {"budget", .read = read_budget},
                                          {"mask", .read = read_mask},
                                          {"allow", .read = read_allow},
                                          {"explain", .read = read_explain, .many = true},
                                          {"picture", .read = read_picture, .many = true},
                                          {"part", .read = read_part, .many = true},
                                          {"check", .read = read_check, .many = true},
                                          {0}};
static const struct member of_image[] = {{"scene", TEXT, TO(rubric_image, scene)},
                                         {"size", .read = read_size},
                                         {"spp", WHOLE, TO(rubric_image, spp), 1, 1 << 20},
                                         {"lights", WHOLE, TO(rubric_image, lights), 1, 1 << 20},
                                         {"bounces", WHOLE, TO(rubric_image, bounces), 0, 1000},
                                         {"options", TEXT, TO(rubric_image, options)},
                                         {"environment", TEXT, TO(rubric_image, environment)},
                                         {"reference", .read = read_reference},
                                         {"accept", .read = read_accept, .many = true},
                                         {0}};
static const struct member of_check[] = {{"image", MARGIN, TO(rubric_check, image)},
                                         {"tile", MARGIN, TO(rubric_check, tile)},
                                         {"count", MARGIN, TO(rubric_check, count)},
                                         {"share", MARGIN, TO(rubric_check, share)},
                                         {"ratio", MARGIN, TO(rubric_check, log_ratio)},
                                         {"carried", MARGIN, TO(rubric_check, carried)},
                                         {"after", IMAGE, TO(rubric_check, after)},
                                         {"batch", WHOLE, TO(rubric_check, batch), 1, 1 << 20},
                                         {"title", TEXT, TO(rubric_check, title)},
                                         {"hint", TEXT, TO(rubric_check, hint)},
                                         {"where", TEXT, TO(rubric_check, where)},
                                         {"visibility", TEXT, TO(rubric_check, visibility)},
                                         {0}};

_Static_assert(sizeof of_rubric / sizeof *of_rubric <= RUBRIC_STATEMENTS &&
                   sizeof of_image / sizeof *of_image <= RUBRIC_STATEMENTS &&
                   sizeof of_check / sizeof *of_check <= RUBRIC_STATEMENTS,
               "a line for each");

/* False: none of these statements. */
static bool read_member(struct statement *s, const struct member *m, void *object, const char *word)
{
    uint32_t row = 1, *given = &s->given[object != s->r];
    int at = 0;
    for (; m->word != NULL && strcmp(m->word, word) != 0; m++, at++)
        row <<= 1;
    if (object == NULL || m->word == NULL)
        return false;
    struct rubric_line *line = object == s->r       ? &s->r->lines[at]
                               : object == s->image ? &s->image->lines[at]
                                                    : &s->check->lines[at];
    if (line->word == NULL)
        *line = (struct rubric_line){m->word, s->line};
    void *to = (char *)object + m->at;
    if (!m->many && *given & row)
        rubric_mistake(s->m, s->line, "a second '%s'", word);
    *given |= row;
    if (m->read != NULL)
        m->read(s);
    else if (m->value == TEXT)
        take_text(s, word, to, m->size);
    else if (m->value == WHOLE)
        take_int(s, word, m->lo, m->hi, to);
    else if (m->value == NUMBER)
        take_number(s, word, m->lo, m->hi, to);
    else if (m->value == MARGIN)
        take_margin(s, word, to);
    else
        take_image(s, to);
    return true;
}

static void read_statement(struct statement *s)
{
    char *word = take_word(s);
    fill_in_variant(s, word);
    if (strcmp(word, "accept") == 0 && s->image == NULL && s->check == NULL)
        read_accept(s);
    else if (strcmp(word, "image") == 0 && (s->check == NULL || is_name(s->rest)))
        read_image(s); /* a check's margin of that name is two numbers, which are no name */
    else if (!read_member(s, of_rubric, s->r, word) && !read_member(s, of_image, s->image, word) &&
             !read_member(s, of_check, s->check, word)) {
        rubric_mistake(s->m, s->line, "'%s' is no statement %s%s", word,
                       s->image != NULL   ? "of an image"
                       : s->check != NULL ? "of a check"
                                          : "here",
                       strcmp(word, "diagnose") == 0 ? ": 'bugs DIR' names bugs" : "");
        return;
    }
    if (s->rest[0] != '\0')
        rubric_mistake(s->m, s->line, "'%.100s' is too much for '%s'", s->rest, word);
}

static int by_line(const void *a, const void *b)
{
    const int *x = a, *y = b; /* the first member */
    return (*x > *y) - (*x < *y);
}

bool rubric_read(const char *path, const struct suite *suite, int variant, struct rubric *out,
                 struct rubric_mistakes *m, struct err *e)
{
    char line[MAX_LINE];
    *out = (struct rubric){.limit = sandbox_default,
                           .build_s = 600,
                           .build_memory = sandbox_default.memory,
                           .budget_s = 180,
                           .variant = variant};
    *m = (struct rubric_mistakes){0};
    const char *slash = strrchr(path, '/');
    snprintf(out->path, sizeof out->path, "%s", path);
    snprintf(out->dir, sizeof out->dir, "%.*s", slash != NULL ? (int)(slash - path) : 1,
             slash != NULL ? path : ".");
    FILE *f = fs_open(path);
    if (f == NULL)
        return err_set(e, "%s: cannot read: %s", path, strerror(errno));
    struct statement s = {.r = out, .m = m};
    size_t read = 0;
    while (fgets(line, sizeof line, f) != NULL && read <= MAX_FILE) {
        size_t n = strlen(line);
        read += n;
        s.line++;
        if (s.line == 1 && strncmp(line, "\xef\xbb\xbf", 3) == 0) /* a byte order mark */
            memset(line, ' ', 3);
        if (n == sizeof line - 1 && line[n - 1] != '\n') {
            rubric_mistake(m, s.line, "longer than %d characters", MAX_LINE - 2);
            for (int c; (c = getc(f)) != EOF && c != '\n';)
                read++;
        }
        for (char *c = strchr(line, '#'); c != NULL; c = strchr(c + 1, '#'))
            if (c == line || c[-1] == ' ' || c[-1] == '\t') {
                *c = '\0';
                n = (size_t)(c - line);
                break;
            }
        while (n > 0 && strchr(" \t\r\n", line[n - 1]) != NULL)
            line[--n] = '\0';
        s.rest = line + strspn(line, " \t");
        if (s.rest[0] != '\0')
            read_statement(&s);
    }
    const int failed = ferror(f) != 0 ? errno : 0; /* of the last line */
    out->variant = out->variants > 0 ? out->variant : 0;
    if (out->variants > 0 && !s.varies)
        rubric_mistake(m, s.line, "'variants', and no '{variant}' to be one");
    fclose(f);
    if (failed != 0)
        return err_set(e, "%s: cannot read: %s", path, strerror(failed));
    if (read > MAX_FILE)
        return err_set(e, "%s: more than 1 MiB", path);
    rubric_check_whole(out, suite, m);
    int kept = (int)(sizeof m->at / sizeof *m->at);
    qsort(m->at, (size_t)(m->num < kept ? m->num : kept), sizeof *m->at, by_line);
    return true;
}

bool rubric_masks(const struct rubric *r, int width, int height, size_t pixel)
{
    const int *m = r->mask;
    int x = (int)(pixel % (size_t)width), y = height - 1 - (int)(pixel / (size_t)width);
    return x >= m[0] && x < m[0] + m[2] && y >= m[1] && y < m[1] + m[3];
}
