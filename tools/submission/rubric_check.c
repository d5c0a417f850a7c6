/* Checks a rubric as a whole: what its images, scenes and checks need of each other. */
#include "rubric_internal.h"
#include "renderer/base/cli.h"
#include "renderer/base/fs.h"
#include "renderer/pathtracer/options.h"

#include "tools/base/text.h"
#include "tools/images/tone_curve.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

const char *const rubric_reference_names[] = {"none", "truth",
                                              ENGINES_WITH_GOLDENS(ENGINE_WORD) "ours"};
const char *const rubric_check_kind_name[NUM_CHECK_KINDS] = {"equal", "agree", "sum",   "exact",
                                                             "noise", "rates", "growth"};

void rubric_mistake(struct rubric_mistakes *m, int line, const char *format, ...)
{
    if (m->num < (int)(sizeof m->at / sizeof *m->at)) {
        va_list ap;
        va_start(ap, format);
        m->at[m->num].line = line;
        vsnprintf(m->at[m->num].text, sizeof m->at->text, format, ap);
        va_end(ap);
        err_hide_controls(m->at[m->num].text);
    }
    m->num++;
}

int rubric_line_of(const struct rubric_line lines[RUBRIC_STATEMENTS], const char *word,
                   int otherwise)
{
    for (int i = 0; i < RUBRIC_STATEMENTS; i++)
        if (lines[i].word != NULL && strcmp(lines[i].word, word) == 0)
            return lines[i].line;
    return otherwise;
}

double rubric_option(const struct rubric_image *p, const char *option, int k)
{
    char words[300], with_spaces[16];
    snprintf(words, sizeof words, " %s", p->options);
    snprintf(with_spaces, sizeof with_spaces, " %s ", option);
    char *at = strstr(words, with_spaces);
    double v = 0;
    if (at == NULL)
        return 0;
    for (at += strlen(with_spaces); k >= 0; k--)
        v = strtod(at, &at);
    return v;
}

bool rubric_is_adaptive(const struct rubric_image *p)
{
    double batch = rubric_option(p, "-a", 0);
    return batch > 0 && batch <= p->spp;
}

double rubric_points(const struct rubric *r)
{
    double sum = 0;
    for (int i = 0; i < r->num_checks; i++)
        sum += r->check[i].points;
    return sum;
}

bool rubric_is_shown(const struct rubric_check *c)
{
    return strcmp(c->visibility, "visible") == 0;
}

struct path rubric_scene(const struct rubric *r, const struct rubric_image *p)
{
    return p->suite != NULL ? fs_path("%s", p->suite->dae) : fs_path("%s/%s", r->dir, p->scene);
}

static bool is_word(const char *word, const char *const *words)
{
    for (; *words != NULL; words++)
        if (strcmp(word, *words) == 0)
            return true;
    return false;
}

/* The line given for mistakes of the rubric as a whole. */
enum { LINE_WHOLE = 1 };

static void set_default(char *text, size_t size, const char *value)
{
    if (text[0] == '\0')
        snprintf(text, size, "%s", value);
}

static void check_command(const struct rubric *r, struct rubric_mistakes *m)
{
    const char *command = r->command;
    const int line = rubric_line_of(r->lines, "command", LINE_WHOLE);
    static const char *const known[] = {"program", "scene",   "out",     "width",   "height", "spp",
                                        "lights",  "bounces", "threads", "options", "seed",   NULL};
    for (const char *c = strchr(command, '{'); c != NULL; c = strchr(c + 1, '{')) {
        char name[32];
        size_t n = strcspn(c + 1, "} ");
        snprintf(name, sizeof name, "%.*s", (int)(n < 31 ? n : 31), c + 1);
        if (!is_word(name, known))
            rubric_mistake(m, line, "command: {%s} is nothing that is replaced", name);
    }
    if (strstr(command, "{out}") == NULL)
        rubric_mistake(m, line, "command: without {out} there is no image");
}

static bool is_beside(const struct rubric *r, const char *file)
{
    const struct path path = fs_path("%s/%s", r->dir, file);
    return strchr(file, '/') == NULL && access(path.s, R_OK) == 0;
}

static void check_head(struct rubric *r, struct rubric_mistakes *m)
{
    struct curve curve;
    struct err e;
    if (r->title[0] == '\0')
        rubric_mistake(m, LINE_WHOLE, "no 'rubric TITLE'");
    set_default(r->curve, sizeof r->curve, "cgl");
    set_default(r->output, sizeof r->output, "out.png");
    set_default(r->program, sizeof r->program, "pathtracer");
    if (!tone_curve_parse(r->curve, &curve, &e))
        rubric_mistake(m, rubric_line_of(r->lines, "curve", LINE_WHOLE),
                       "curve '%s' is none of: " TONE_CURVES, r->curve);
    const char *dot = strrchr(r->output, '.');
    if (dot == NULL || !is_word(dot, (const char *const[]){".png", ".exr", ".pfm", ".hdr", NULL}) ||
        r->output[strspn(r->output,
                         "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-")] !=
            '\0' ||
        r->output[0] == '.' || r->output[0] == '-')
        rubric_mistake(m, rubric_line_of(r->lines, "output", LINE_WHOLE),
                       "output '%s' is no file name ending in .png, .exr, .pfm or .hdr", r->output);
    if (r->program[0] == '/' || strstr(r->program, "..") != NULL)
        rubric_mistake(m, rubric_line_of(r->lines, "program", LINE_WHOLE),
                       "program '%s' is not inside the submission", r->program);
    set_default(r->command, sizeof r->command,
                "{program} -t {threads} -r {width} {height} -s {spp} -l {lights} -m {bounces} "
                "{options} -f {out} {scene}");
    check_command(r, m);
    if (r->bugs[0] != '\0' && !is_beside(r, r->bugs))
        rubric_mistake(m, rubric_line_of(r->lines, "bugs", LINE_WHOLE),
                       "bugs: no directory '%s' beside the rubric", r->bugs);
}

static void check_golden(const struct rubric_image *p, const char *engine,
                         struct rubric_mistakes *m)
{
    const struct suite_reference *ref =
        p->suite != NULL ? suite_reference_of(p->suite, engine) : NULL;
    if (ref == NULL)
        rubric_mistake(m, p->line, "image '%s': '%s' has no reference '%s'", p->name, p->scene,
                       engine);
    else if (strcmp(engine, "truth") != 0 &&
             (p->width != p->suite->width || p->height != p->suite->height ||
              p->bounces != p->suite->depth))
        rubric_mistake(m, p->line, "image '%s': the golden of %s is %d x %d with %d bounces",
                       p->name, p->scene, p->suite->width, p->suite->height, p->suite->depth);
}

/* Does our renderer take the words? If not, *e has its line. */
static bool are_ours(const struct rubric_image *p, const char *words, const char *accepted,
                     struct err *e)
{
    enum { MOST = 128 };
    char text[1200], *argv[MOST] = {"pathtracer"};
    struct options ignored;
    int num = 1;
    snprintf(text, sizeof text, "-q -r %d %d -s 1 -l %d -m %d %s %s -f out.exr scene.dae", p->width,
             p->height, p->lights, p->bounces, words, accepted);
    for (char *at = text + strspn(text, " \t"); *at != '\0' && num < MOST - 1;) {
        const size_t n = strcspn(at, " \t"), gap = strspn(at + n, " \t");
        argv[num++] = at;
        at += n + gap;
        if (gap > 0)
            at[-(ptrdiff_t)gap] = '\0';
    }
    return options_parse(num, argv, &ignored, e);
}

/* The options by which our renderer makes the image, or measures its noise (answer_key.c). */
static void check_options(const struct rubric *r, const struct rubric_image *p,
                          struct rubric_mistakes *m)
{
    const bool own = p->reference_options[0] != '\0';
    const char *words = !own                                        ? p->options
                        : strcmp(p->reference_options, "none") == 0 ? ""
                                                                    : p->reference_options;
    struct err e;
    if (p->width == 0 || p->height == 0 || p->bounces < 0) /* which is another mistake */
        return;
    if (!are_ours(p, words, "", &e)) {
        rubric_mistake(m, rubric_line_of(p->lines, own ? "reference" : "options", p->line),
                       "image '%s': our renderer: %.100s%s", p->name, e.msg,
                       own ? "" : " (see 'reference ours SPP none')");
        return;
    }
    for (int i = 0; i < p->num_accepted; i++)
        if (p->accept[i].how[0] == '-' && !are_ours(p, words, p->accept[i].how, &e))
            rubric_mistake(m, p->accept[i].line, "'%s': our renderer: %.100s", p->accept[i].name,
                           e.msg);
    for (int i = 0; p->reference == REFERENCE_OURS && i < r->num_accepted; i++)
        if (!are_ours(p, words, r->accept[i].how, &e))
            rubric_mistake(m, r->accept[i].line, "'%s': our renderer, image '%s': %.100s",
                           r->accept[i].name, p->name, e.msg);
}

static void check_image(const struct rubric *r, struct rubric_image *p, const struct suite *suite,
                        struct rubric_mistakes *m)
{
    size_t n = strlen(p->scene);
    p->suite = suite_find(suite, p->scene);
    if (p->scene[0] == '\0')
        rubric_mistake(m, p->line, "image '%s' has no 'scene'", p->name);
    else if (p->suite == NULL && (n < 5 || strcmp(p->scene + n - 4, ".dae") != 0))
        rubric_mistake(m, p->line, "image '%s': the suite has no scene '%s' (a file ends in .dae)",
                       p->name, p->scene);
    else if (p->suite == NULL && !is_beside(r, p->scene))
        rubric_mistake(m, p->line, "image '%s': no file '%s' beside the rubric", p->name, p->scene);
    if (p->width == 0)
        rubric_mistake(m, p->line, "image '%s' has no 'size'", p->name);
    if (p->width % RUBRIC_TILE != 0 || p->height % RUBRIC_TILE != 0)
        rubric_mistake(m, p->line, "image '%s': %d x %d are not whole tiles of %d", p->name,
                       p->width, p->height, RUBRIC_TILE);
    if (p->spp == 0)
        rubric_mistake(m, p->line, "image '%s' has no 'spp'", p->name);
    if (p->bounces < 0)
        rubric_mistake(m, p->line, "image '%s' has no 'bounces'", p->name);
    if (p->reference >= REFERENCE_TRUTH && p->reference < REFERENCE_OURS && p->scene[0] != '\0')
        check_golden(p, rubric_reference_names[p->reference], m);
    if (p->environment[0] != '\0' && !is_beside(r, p->environment))
        rubric_mistake(m, p->line, "image '%s': no file '%s' beside the rubric", p->name,
                       p->environment);
    for (int i = 0; i < p->num_accepted; i++)
        if (p->accept[i].how[0] != '-' && !is_beside(r, p->accept[i].how))
            rubric_mistake(m, p->accept[i].line, "no file '%s' beside the rubric",
                           p->accept[i].how);
        else if (p->accept[i].how[0] == '-' && p->reference != REFERENCE_OURS)
            rubric_mistake(m, p->accept[i].line, "'%s' by options needs 'reference ours'",
                           p->accept[i].name);
    check_options(r, p, m);
    if (!p->used)
        rubric_mistake(m, p->line, "image '%s' is in no check", p->name);
}

static bool is_of_earlier_part(const struct rubric *r, const struct rubric_check *c, int image)
{
    for (int i = 0; i < r->num_checks; i++)
        for (int k = 0; r->check[i].part < c->part && k < r->check[i].num_images; k++)
            if (r->check[i].images[k] == image)
                return true;
    return false;
}

static void check_carried(const struct rubric *r, struct rubric_check *c, struct rubric_mistakes *m)
{
    if (!c->carried.given)
        c->carried = (struct margin){.full = 0.15, .none = 0.5};
    else if (c->after < 0)
        rubric_mistake(m, rubric_line_of(c->lines, "carried", c->line),
                       "check '%s': 'carried' needs 'after IMAGE'", c->name);
    if (c->after < 0)
        return;
    const int line = rubric_line_of(c->lines, "after", c->line);
    if (c->kind != CHECK_EQUAL)
        rubric_mistake(m, line, "check '%s': 'after' is for 'equal'", c->name);
    else if (!is_of_earlier_part(r, c, c->after))
        rubric_mistake(m, line, "check '%s': 'after %s' is in no check of an earlier part", c->name,
                       r->image[c->after].name);
    else if (r->image[c->after].width != r->image[c->images[0]].width ||
             r->image[c->after].height != r->image[c->images[0]].height)
        rubric_mistake(m, line, "check '%s': 'after %s' has another size", c->name,
                       r->image[c->after].name);
    else if (r->image[c->after].reference == REFERENCE_NONE)
        rubric_mistake(m, line, "check '%s': 'after %s' has no reference", c->name,
                       r->image[c->after].name);
}

/* A black image is off by 100 %, and a share of pixels is at most that: a margin of 2 was meant as 2 %. */
static void check_margins(const struct rubric_check *c, struct rubric_mistakes *m)
{
    const struct {
        const char *name;
        const struct margin *margin;
    } of[] = {{"image", &c->image}, {"tile", &c->tile}, {"share", &c->share}, {"count", &c->count}};
    for (size_t i = 0; c->kind != CHECK_GROWTH && i < sizeof of / sizeof *of; i++)
        if (of[i].margin->full >= 1)
            rubric_mistake(
                m, rubric_line_of(c->lines, of[i].name, c->line),
                "check '%s': '%s': all points up to %g %%, black images too; margins are not in %%",
                c->name, of[i].name, 100 * of[i].margin->full);
}

/* Which statements a kind of check has, and how many images. */
static void check_check(const struct rubric *r, struct rubric_check *c, struct rubric_mistakes *m)
{
    static const struct {
        int least, most;
        bool image, share, ratio, batch, reference;
    } kinds[NUM_CHECK_KINDS] = {
        [CHECK_EQUAL] = {1, 1, true, false, false, false, true},
        [CHECK_AGREE] = {2, 2, true, false, false, false, false},
        [CHECK_SUM] = {3, CHECK_IMAGES, true, false, false, false, false},
        [CHECK_EXACT] = {1, 1, false, true, false, false, true},
        [CHECK_NOISE] = {2, 2, false, false, true, false, true},
        [CHECK_RATES] = {1, 1, false, true, false, true, false},
        [CHECK_GROWTH] = {4, 4, true, false, true, false, true},
    };
    static const char *const visibilities[] = {"hidden", "after_due_date", "after_published",
                                               "visible", NULL};
    if (c->kind == NUM_CHECK_KINDS)
        return;
    const char *kind = rubric_check_kind_name[c->kind];
    if (c->num_images < kinds[c->kind].least || c->num_images > kinds[c->kind].most)
        rubric_mistake(m, c->line, "check '%s': '%s' takes %d%s images, not %d", c->name, kind,
                       kinds[c->kind].least,
                       kinds[c->kind].most > kinds[c->kind].least ? " or more" : "", c->num_images);
    const struct {
        const char *name;
        bool given, wanted;
    } statements[] = {{"image", c->image.given, kinds[c->kind].image},
                      {"tile", c->tile.given, kinds[c->kind].image},
                      {"share", c->share.given, kinds[c->kind].share},
                      {"ratio", c->log_ratio.given, kinds[c->kind].ratio},
                      {"batch", c->batch > 0, kinds[c->kind].batch},
                      {"count", c->count.given, kinds[c->kind].batch}};
    for (size_t i = 0; i < sizeof statements / sizeof *statements; i++) {
        if (statements[i].given && !statements[i].wanted)
            rubric_mistake(m, c->line, "check '%s': '%s' is not for '%s'", c->name,
                           statements[i].name, kind);
        if (!statements[i].given && statements[i].wanted)
            rubric_mistake(m, c->line, "check '%s': '%s' needs '%s'", c->name, kind,
                           statements[i].name);
    }
    for (int i = 0; i < c->num_images; i++) {
        const struct rubric_image *p = &r->image[c->images[i]], *first = &r->image[c->images[0]];
        if (kinds[c->kind].reference && p->reference == REFERENCE_NONE)
            rubric_mistake(m, p->line, "image '%s' has no 'reference', which check '%s' needs",
                           p->name, c->name);
        if (p->width != first->width || p->height != first->height)
            rubric_mistake(m, c->line, "check '%s': '%s' and '%s' have different sizes", c->name,
                           first->name, p->name);
    }
    check_margins(c, m);
    set_default(c->visibility, sizeof c->visibility, "visible");
    struct err why;
    if (!cli_choice("visibility", c->visibility, visibilities, &(int){0}, &why))
        rubric_mistake(m, c->line, "check '%s': %s", c->name, why.msg);
    set_default(c->title, sizeof c->title, c->name);
    check_carried(r, c, m);
}

static void append(char *text, size_t size, const char *between, const char *more)
{
    text_append(text, size, "%s%s", text[0] != '\0' ? between : "", more);
}

/* Lists all combinations of deviations of the whole program, then those of some images. */
static void list_sets(struct rubric *r, struct rubric_mistakes *m)
{
    r->num_sets = 1 << r->num_accepted;
    for (int k = 1; k < r->num_sets; k++)
        for (int i = 0; i < r->num_accepted; i++)
            if (k >> i & 1) {
                append(r->set[k].name, sizeof r->set->name, ", ", r->accept[i].name);
                append(r->set[k].words, sizeof r->set->words, " ", r->accept[i].how);
            }
    for (int i = 0; i < r->num_images; i++)
        for (int a = 0; a < r->image[i].num_accepted; a++) {
            const struct accepted *by = &r->image[i].accept[a];
            int k = 0;
            while (k < r->num_sets && strcmp(r->set[k].name, by->name) != 0)
                k++;
            if (k < r->num_sets && r->set[k].words[0] != '\0')
                rubric_mistake(m, by->line, "'%s' is already accepted by words", by->name);
            else if (k == RUBRIC_SETS)
                rubric_mistake(m, by->line, "more accepted deviations than there is room for");
            else if (k == r->num_sets)
                append(r->set[r->num_sets++].name, sizeof r->set->name, "", by->name);
        }
}

void rubric_check_whole(struct rubric *r, const struct suite *suite, struct rubric_mistakes *m)
{
    check_head(r, m);
    for (int i = 0; i < r->num_images; i++)
        check_image(r, &r->image[i], suite, m);
    for (int i = 0; i < r->num_checks; i++)
        check_check(r, &r->check[i], m);
    list_sets(r, m);
    if (r->num_checks == 0)
        rubric_mistake(m, LINE_WHOLE, "no checks");
    for (int i = 0; i < r->num_parts; i++) {
        bool any = false;
        for (int k = 0; k < r->num_checks; k++)
            any |= r->check[k].part == i;
        if (!any)
            rubric_mistake(m, r->part[i].line, "part '%s' has no checks", r->part[i].number);
    }
    if (r->total > 0 && fabs(rubric_points(r) - r->total) > 1e-9)
        rubric_mistake(m, rubric_line_of(r->lines, "total", LINE_WHOLE),
                       "the checks add up to %g points, not to %g", rubric_points(r), r->total);
}
