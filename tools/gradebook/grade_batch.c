#include "grade_batch.h"

#include "collect_images.h"
#include "grade_change.h"

#include "reference/base/json_file.h"
#include "reference/base/json_node.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "renderer/base/shell_quote.h"
#include "renderer/base/version.h"
#include "tools/base/hash_tree.h"
#include "tools/base/text.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool key_of(const struct grade_job *job, const struct submission *s, char key[65],
                   struct err *e)
{
    char rubric[65], scenes[65], bugs[65] = "", appeals[65], text[1024];
    const struct path catalogue =
        fs_path("%s/%s/manifest.json", job->rubric->dir, job->rubric->bugs);
    if (!sha256_file(job->rubric->path, rubric, e) || !hash_tree(job->stage, NULL, scenes, e) ||
        (job->bugs != NULL && !sha256_file(catalogue.s, bugs, e)))
        return false;
    appeals_key(job->appeals, s->id, appeals);
    snprintf(text, sizeof text, "%s %s %s %s %s %s %llu %.17g %d %d", assay_version, rubric, scenes,
             bugs, appeals, s->sha256, (unsigned long long)job->s->seed, job->s->alpha,
             job->sandbox->unsafe, job->rubric->variant);
    sha256_text(text, key);
    return true;
}

static json_t *relative_of(const struct difference *a, const struct rubric_image *p)
{
    if (a->relative == NULL)
        return json_null();
    json_t *array = json_array();
    for (int i = 0; i < p->width / RUBRIC_TILE * (p->height / RUBRIC_TILE); i++)
        json_array_append_new(array, json_finite(a->relative[i]));
    return array;
}

/* The intervals that decide the points, with their margins. */
static json_t *intervals_of(const struct difference *a, const struct rubric_check *c)
{
    static const char *const names[] = {"red", "green", "blue", "luminance", "furthest tile"};
    json_t *array = json_array();
    if (c->kind != CHECK_EQUAL && c->kind != CHECK_AGREE && c->kind != CHECK_SUM)
        return array;
    for (int k = 0; k <= NUM_CHANNELS && a->relative != NULL; k++) {
        const struct interval *i = k < NUM_CHANNELS ? &a->image[k] : &a->tile;
        const struct margin *m = k < NUM_CHANNELS ? &c->image : &c->tile;
        if (k < NUM_CHANNELS || a->tiles > 0)
            json_array_append_new(array, json_pack("{ss, sf, sf, sf, sf, sf}", "what", names[k],
                                                   "value", i->value, "lo", i->lo, "hi", i->hi,
                                                   "full", m->full, "none", m->none));
    }
    return array;
}

static json_t *check_json(const struct rubric *r, const struct rubric_check *c,
                          const struct result *result)
{
    return json_pack(
        "{ss, ss, ss, ss, sf, sf, sf, sf, sb, sb, ss, ss, ss, ss, ss, ss, ss, ss, ss, so, so, so}",
        "kind", rubric_check_kind_name[c->kind], "part", r->part[c->part].number, "name", c->name,
        "title", c->title, "points", c->points * result->share, "of", c->points, "share",
        result->share, "chance", result->chance, "judged", result->judged, "provisional",
        result->more > 0, "expected", result->expected, "seen", result->seen, "hint",
        result->no_hint ? "" : c->hint, "where", c->where, "visibility", c->visibility, "accepted",
        result->accepted, "carried", result->carried, "flag", result->flag, "picture",
        r->image[result->image].name, "tile",
        result->agreement.tiles > 0
            ? json_pack("[i, i]", result->agreement.tile_x, result->agreement.tile_y)
            : json_null(),
        "relative", relative_of(&result->agreement, &r->image[result->image]), "intervals",
        intervals_of(&result->agreement, c));
}

static json_t *image_json(const struct rubric *r, const struct submitted_images *h, int i)
{
    const struct rubric_image *p = &r->image[i];
    const struct made *made = &h->made[i];
    return json_pack("{ss, ss?, ss, ss, sf, sf, si, si, si, ss?}", "name", p->name, "file",
                     made->path[0] == '\0' ? NULL : fs_base(made->path), "why",
                     h->why[i][0] != '\0' ? h->why[i] : made->after, "end",
                     sandbox_end_name[made->end], "cpu_s", made->cpu_s, "wall_s", made->wall_s,
                     "width", p->width, "height", p->height, "runs", h->runs[i], "sha256",
                     h->image[i].mean != NULL ? h->image[i].sha256 : NULL);
}

/* Staff are told how far from a decision it is, and what kept it from one: the noisiest image that can have further
 * runs, or else the noisiest. */
static void tell_provisional(const struct rubric *r, const struct submitted_images *h,
                             const struct rubric_check *c, struct result *result)
{
    int noisiest = 0;
    if (result->more <= 0)
        return;
    for (int k = 1; k < c->num_images; k++)
        if (result->noise[k] > result->noise[noisiest])
            noisiest = k;
    const char *why = h->no_more[c->images[noisiest]];
    for (int k = 0; k < c->num_images; k++)
        if (h->no_more[c->images[k]][0] == '\0')
            why = "";
    text_append(result->seen, sizeof result->seen,
                "; too noisy to be decided: it takes about %.2g times the samples",
                ceil(10 * result->more) / 10);
    if (why[0] != '\0')
        text_append(result->seen, sizeof result->seen, ", and %s", why);
    else
        text_append(result->seen, sizeof result->seen,
                    ", and the next run is not within 'budget cpu %g'", r->budget_s);
}

/* Staff and student are told of a program that failed after it had written an image of the check. */
static void tell_failed(const struct rubric *r, const struct submitted_images *h,
                        const struct rubric_check *c, struct result *result)
{
    for (int k = 0; k < c->num_images; k++) {
        const struct made *made = &h->made[c->images[k]];
        if (made->after[0] == '\0')
            continue;
        text_append(result->seen, sizeof result->seen,
                    "; after the program had written '%s' it failed (%s), which costs no points",
                    r->image[c->images[k]].name, made->after);
        return;
    }
}

/* Did the check lose points by an image that was starved, or not run because one was? Another run may make it. */
static bool is_starved(const struct submitted_images *h, const struct rubric *r,
                       const struct rubric_check *c)
{
    bool any = false, here = false;
    for (int i = 0; i < r->num_images; i++)
        any = any || h->made[i].starved;
    for (int k = 0; any && k < c->num_images; k++) {
        const struct made *made = &h->made[c->images[k]];
        here = here || made->starved || (made->end == SANDBOX_WALL && made->wall_s <= 0);
    }
    return here;
}

/* Staff are told of the first image that was starved; nobody else knows how busy the machine was. */
static void flag_starved(const struct rubric *r, const struct submitted_images *h, json_t *grade)
{
    char text[400];
    for (int i = 0; i < r->num_images; i++) {
        const struct made *made = &h->made[i];
        if (!made->starved)
            continue;
        snprintf(
            text, sizeof text,
            "'%s' had not ended after %g s, of which it computed for %.2g s: if the machine was busy, "
            "grade it with --again, or with a larger 'limit wall'",
            r->image[i].name, r->limit.wall_s, made->cpu_s);
        json_object_set_new(grade, "flag", json_string(text));
        return;
    }
}

/* What was done wrong: what all checks say of it, and what those do that students may see. */
struct conclusion {
    struct mistake all, shown;
    bool hides; /* are there others? */
};

/* Other shares stay as they are for now: what comes back is compared with them. */
static void give_all(const struct rubric *r, struct result *result)
{
    for (int i = 0; i < r->num_checks; i++)
        if (score_round(result[i].share, r->check[i].points) == 1)
            result[i].share = 1;
}

static void round_points(const struct rubric *r, struct result *result)
{
    for (int i = 0; i < r->num_checks; i++)
        result[i].share = score_round(result[i].share, r->check[i].points);
}

/* Rounds points, and looks for the mistake of a submission that lost some, unless a check is flagged: a
 * copied image shows no bug. */
static bool find_mistake(const struct grade_job *job, struct submitted_images *h, int *set,
                         struct result *result, struct conclusion *out, struct err *e)
{
    const struct grading g = {job->rubric, job->answers, h, job->s->alpha, job->bugs};
    double share[RUBRIC_CHECKS];
    const int first = *set;
    bool lost = false, flagged = false;
    *out = (struct conclusion){.all.located.image = -1, .shown.located.image = -1};
    give_all(job->rubric, result);
    for (int i = 0; i < job->rubric->num_checks; i++) {
        share[i] = result[i].share;
        lost |= share[i] < 1;
        flagged |= result[i].flag[0] != '\0';
        out->hides |= !rubric_is_shown(&job->rubric->check[i]);
    }
    bool ok = !lost || flagged ||
              (mistake_judge(&g, set, result, &out->all, e) &&
               (!out->hides || mistake_shown(&g, first, share, &out->shown, e)));
    round_points(job->rubric, result);
    return ok;
}

static bool add_checks(const struct collect *c, struct submitted_images *h, json_t *grade,
                       struct conclusion *mistake, struct err *e)
{
    int set = 0;
    bool provisional = false;
    const struct rubric *r = c->job->rubric;
    json_t *checks = json_array(), *parts = json_array(), *images = json_array();
    double part[RUBRIC_PARTS] = {0}, of[RUBRIC_PARTS] = {0}, points = 0, chance = 0, cpu_s = 0;
    struct result *result = calloc(RUBRIC_CHECKS, sizeof *result);
    bool ok = (result != NULL || err_set(e, "out of memory")) &&
              collect_until_decided(c, h, result, &set, e) &&
              find_mistake(c->job, h, &set, result, mistake, e);
    for (int i = 0; ok && i < r->num_checks; i++) {
        tell_provisional(r, h, &r->check[i], &result[i]);
        tell_failed(r, h, &r->check[i], &result[i]);
        if (is_starved(h, r, &r->check[i]))
            result[i].chance = 1;
        provisional |= result[i].more > 0;
        json_array_append_new(checks, check_json(r, &r->check[i], &result[i]));
        part[r->check[i].part] += r->check[i].points * result[i].share;
        of[r->check[i].part] += r->check[i].points;
        points += r->check[i].points * result[i].share;
        chance = fmin(1, chance + result[i].chance);
        result_free(&result[i]);
    }
    free(result);
    for (int i = 0; i < r->num_parts; i++)
        json_array_append_new(parts,
                              json_pack("{ss, ss, sf, sf}", "number", r->part[i].number, "title",
                                        r->part[i].title, "points", part[i], "of", of[i]));
    for (int i = 0; i < r->num_images; i++) {
        json_array_append_new(images, image_json(r, h, i));
        cpu_s += h->made[i].cpu_s;
    }
    json_object_update_new(grade, json_pack("{sf, sf, sf, sf, sb, ss, so, so, so}", "points",
                                            points, "of", rubric_points(r), "chance", chance,
                                            "cpu_s", cpu_s + h->bought_s, "provisional",
                                            provisional, "accepted", r->set[set].name, "parts",
                                            parts, "checks", checks, "pictures", images));
    return ok;
}

/* Adds "diagnosis", "located" and "located_picture". */
static void add_mistake(const struct grade_job *job, const struct mistake *m, json_t *to)
{
    json_object_set_new(to, "diagnosis",
                        m->judged ? grade_diagnose_by_images(job->bugs, job->rubric, m)
                                  : json_null());
    if (m->located.text[0] == '\0')
        return;
    json_object_set_new(to, "located", json_string(m->located.text));
    json_object_set_new(to, "located_picture",
                        json_string(job->rubric->image[m->located.image].name));
}

static bool grade_made(const struct grade_job *job, struct submission *s, const char *work,
                       const char *out, json_t *grade, struct err *e)
{
    struct submitted_images *h = calloc(1, sizeof *h);
    struct conclusion mistake = {0};
    bool ok = h != NULL || err_set(e, "out of memory");
    const struct collect c = {job, s, work, out};
    ok = ok && collect_images(&c, h, e);
    json_object_set_new(grade, "state", json_string(submission_state_name[s->state]));
    json_object_set_new(grade, "wrong", s->why[0] != '\0' ? json_string(s->why) : json_null());
    if (s->kind == SUBMISSION_IMAGES && !job->rubric->images)
        json_object_set_new(
            grade, "flag",
            json_string("images were handed in, and no program that makes them: nobody knows whose "
                        "they are ('allow images' in the rubric, if they are what it asks for)"));
    ok = ok && add_checks(&c, h, grade, &mistake, e);
    if (ok) {
        flag_starved(job->rubric, h, grade);
        add_mistake(job, &mistake.all, grade);
    }
    if (ok && mistake.all.judged && mistake.hides) {
        json_t *shown = json_object();
        add_mistake(job, &mistake.shown, shown);
        json_object_set_new(grade, "for_student", shown);
    }
    for (int i = 0; h != NULL && i < job->rubric->num_images; i++)
        submitted_image_free(&h->image[i]);
    free(h);
    return ok;
}

/* The command that grades this one submission again; NULL: not known, or out of memory. */
static json_t *command_of(const struct grade_job *job, const char *path)
{
    int num = 0;
    while (job->word != NULL && job->word[num] != NULL)
        num++;
    const char **word = num > 0 ? calloc((size_t)num + 4, sizeof *word) : NULL;
    if (word == NULL)
        return NULL;
    memcpy(word, job->word, (size_t)num * sizeof *word);
    char variant[16];
    snprintf(variant, sizeof variant, "%d", job->rubric->variant);
    if (job->rubric->variant > 0) {
        word[num++] = "--variant";
        word[num++] = variant;
    }
    word[num] = path;
    char *text = shell_quote_join("assay", word);
    json_t *command = text != NULL ? json_string(text) : NULL;
    free(text);
    free(word);
    return command;
}

static bool grade_anew(const struct grade_job *job, const char *path, const char *work,
                       const char *key, const json_t *old, struct submission *s, json_t **grade,
                       struct err *e)
{
    const struct path out = fs_path("%s/%s", job->s->out, s->id);
    const struct path log = fs_path("%s/build.log", out.s);
    if (!fs_remove_tree(out.s, e) || !fs_make_dirs(out.s, e) ||
        !submission_build(job->rubric, job->sandbox, job->build_cache, false, work, log.s, s, e))
        return false;
    json_t *command = command_of(job, path);
    if (command == NULL && job->word != NULL && job->word[0] != NULL)
        return err_set(e, "%s: out of memory", path);
    *grade = json_pack("{si, ss, ss, so?, ss, ss, ss, sb, sI, sf, sn}", "assay_grade", 1, "id",
                       s->id, "kind", submission_kind_name[s->kind], "command", command, "version",
                       assay_version, "key", key, "rubric", job->rubric->title, "sandbox",
                       !job->sandbox->unsafe, "seed", (json_int_t)job->s->seed, "alpha",
                       job->s->alpha, "trouble");
    if (job->rubric->variant > 0)
        json_object_set_new(*grade, "variant", json_integer(job->rubric->variant));
    if (access(log.s, R_OK) == 0)
        json_object_set_new(*grade, "build_log", json_string(fs_base(log.s)));
    if (*grade != NULL && grade_made(job, s, work, out.s, *grade, e)) {
        appeals_apply(job->appeals, job->rubric, *grade);
        json_t *before = grade_change(old, *grade);
        if (before != NULL)
            json_object_set_new(*grade, "before", before);
        if (json_write(fs_path("%s/grade.json", out.s).s, *grade, e))
            return true;
    }
    json_decref(*grade);
    *grade = NULL;
    return e->msg[0] != '\0' ? false : err_set(e, "%s: out of memory", path);
}

static bool grade_one(const struct grade_job *job, const char *path, const char *work,
                      json_t **grade, struct err *e)
{
    struct submission s;
    char key[65];
    if (!submission_open(job->rubric, path, work, &s, e) || !key_of(job, &s, key, e))
        return false;
    const struct path runs = fs_path("%s/.runs/%s", job->s->before, s.id);
    s.runs = runs.s;
    s.runs_again = job->s->again;
    *grade = json_load_file(fs_path("%s/%s/grade.json", job->s->out, s.id).s, 0, NULL);
    if (!job->s->again && strcmp(member_or_empty(*grade, "key"), key) == 0)
        return true;
    json_decref(*grade);
    json_t *old = json_load_file(fs_path("%s/%s/grade.json", job->s->before, s.id).s, 0, NULL);
    *grade = NULL;
    bool ok = grade_anew(job, path, work, key, old, &s, grade, e);
    json_decref(old);
    return ok;
}

/* What the workers share. */
struct batch {
    const struct grade_job *job;
    pthread_mutex_t lock;
    int next, done;
    json_t **grade;
};

static json_t *trouble_json(const struct grade_job *job, const char *path, const char *why)
{
    char id[128];
    submission_id(path, id);
    return json_pack("{si, ss, sf, sf, sf, ss, sn, s[], s[], s[]}", "assay_grade", 1, "id", id,
                     "points", 0.0, "of", rubric_points(job->rubric), "cpu_s", 0.0, "trouble", why,
                     "wrong", "parts", "checks", "pictures");
}

static void *work(void *ctx)
{
    struct batch *b = ctx;
    const struct grade_job *job = b->job;
    for (;;) {
        struct err e = {""}, ignored;
        pthread_mutex_lock(&b->lock);
        int i = b->next++;
        pthread_mutex_unlock(&b->lock);
        if (i >= job->s->num)
            return NULL;
        const struct path dir = fs_path("%s/work-%d", job->sandbox->dir.path, i);
        if (!grade_one(job, job->s->submission[i], dir.s, &b->grade[i], &e))
            b->grade[i] = trouble_json(job, job->s->submission[i], e.msg);
        bool removed = fs_remove_tree(dir.s, &ignored);
        (void)removed; /* goes with the sandbox's directory */
        pthread_mutex_lock(&b->lock);
        b->done++;
        job->done(job->s, b->done, b->grade[i]);
        pthread_mutex_unlock(&b->lock);
    }
}

static bool check_ids(const struct grade_job *job, struct err *e)
{
    char id[128], other[128];
    for (int i = 0; i < job->s->num; i++) {
        submission_id(job->s->submission[i], id);
        json_t *text = json_string(id); /* NULL: no UTF-8 */
        json_decref(text);
        if (id[0] == '\0' || strlen(id) > 120 || id[0] == '.' || text == NULL ||
            grade_writes_file(id))
            return err_set(e, "%s: '%s' is no name for a submission", job->s->submission[i], id);
        for (int k = 0; k < i; k++) {
            submission_id(job->s->submission[k], other);
            if (strcmp(id, other) == 0)
                return err_set(e, "%s and %s would both be '%s'", job->s->submission[k],
                               job->s->submission[i], id);
        }
    }
    return true;
}

bool grade_batch_run(const struct grade_job *job, json_t **grades, struct err *e)
{
    enum { MOST_JOBS = 64 };
    pthread_t thread[MOST_JOBS];
    struct batch b = {.job = job, .lock = PTHREAD_MUTEX_INITIALIZER};
    int started = 0, jobs = job->s->jobs < MOST_JOBS ? job->s->jobs : MOST_JOBS;
    if (!check_ids(job, e) || !fs_make_dirs(job->s->out, e))
        return false;
    b.grade = calloc((size_t)job->s->num, sizeof(json_t *));
    *grades = json_array();
    if (b.grade == NULL || *grades == NULL) {
        free(b.grade);
        return err_set(e, "out of memory");
    }
    json_object_seed(0); /* before threads make objects */
    while (started < jobs && pthread_create(&thread[started], NULL, work, &b) == 0)
        started++;
    if (started == 0)
        work(&b);
    for (int k = 0; k < started; k++)
        pthread_join(thread[k], NULL);
    for (int i = 0; i < job->s->num; i++)
        json_array_append_new(*grades, b.grade[i]);
    free(b.grade);
    return true;
}
