#include "collect_images.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double step = 1.35; /* less 0.15: the least factor between the samples of two runs */
enum { MOST_RUNS = 12, MOST_ADAPTIVE = 6 };

/* A hash of seed and name [FNV-1a]: images have different seeds, or their noise would be the same,
 * and a seed does not depend on the rubric's other images. */
static uint64_t image_seed(uint64_t seed, const char *name)
{
    uint64_t hash = 14695981039346656037u ^ seed;
    for (; *name != '\0'; name++)
        hash = (hash ^ (unsigned char)*name) * 1099511628211u;
    return hash % 1000000007u;
}

/* Are there file descriptors left? A reader that lacks them only says that it cannot read. */
static bool can_open_more(void)
{
    enum { MORE = 8 };
    int fd[MORE], num = 0;
    while (num < MORE && (fd[num] = open("/dev/null", O_RDONLY | O_CLOEXEC)) >= 0)
        num++;
    for (int i = 0; i < num; i++)
        close(fd[i]);
    return num == MORE;
}

/* Makes and reads one image; `why` says why there is none, or is "". Fails only for reasons of our
 * own. */
static bool make_image(const struct collect *c, const struct rubric_image *p, struct made *made,
                       struct submitted_image *image, char why[400], struct err *e)
{
    const struct grade_job *job = c->job;
    struct err wrong = {""};
    if (made->why[0] == '\0' &&
        !submission_image(job->rubric, job->sandbox, c->submission, p, job->stage, c->work, c->out,
                          image_seed(job->s->seed, p->name), job->s->threads, made, e))
        return false;
    if (made->path[0] != '\0' && access(made->path, R_OK) != 0)
        return err_set(e, "%s: %s", made->path, strerror(errno));
    if (made->path[0] == '\0')
        err_set(&wrong, "%s", made->why);
    else if (submitted_image_read(made->path, job->rubric->curve, p->width, p->height, image,
                                  &wrong))
        wrong.msg[0] = '\0';
    else if (err_is_of_memory(&wrong) || !can_open_more()) /* which is our trouble */
        return err_set(e, "%s: %s", p->name, wrong.msg);
    image->spp = p->spp;
    /* Students know neither where staff keep it nor how it is called there. */
    const size_t place = strlen(made->path);
    const bool is_ours = place > 0 && strncmp(wrong.msg, made->path, place) == 0;
    const char *theirs =
        c->submission->kind == SUBMISSION_IMAGES ? fs_base(made->path) : job->rubric->output;
    snprintf(why, 400, "%.64s%.330s", is_ours ? theirs : "", wrong.msg + (is_ours ? place : 0));
    return true;
}

static bool is_one_colour(const struct submitted_image *s)
{
    for (int i = 3; i < 3 * s->width * s->height; i++)
        if (s->mean[i] != s->mean[i - 3])
            return false;
    return true;
}

/* How many other scenes have the same image, bit by bit. */
static int repeats_of(const struct rubric *r, const struct submitted_images *h, int image)
{
    const char *seen[RUBRIC_IMAGES];
    int num = 0;
    seen[num++] = r->image[image].scene;
    for (int i = 0; i < r->num_images; i++) {
        bool is_new = i != image && h->image[i].mean != NULL;
        for (int k = 0; is_new && k < num; k++)
            is_new = strcmp(r->image[i].scene, seen[k]) != 0;
        if (is_new && submitted_image_same(&h->image[i], &h->image[image]))
            seen[num++] = r->image[i].scene;
    }
    return num - 1;
}

/* Refuses images that were handed in unchanged for three or more scenes; two scenes may look alike.
 * Images of one colour are kept and judged: a program without light renders black. */
static void refuse_repeated(const struct rubric *r, struct submitted_images *h)
{
    enum { MOST = 1 };
    int repeats[RUBRIC_IMAGES] = {0};
    for (int i = 0; i < r->num_images; i++)
        if (h->image[i].mean != NULL && !is_one_colour(&h->image[i]))
            repeats[i] = repeats_of(r, h, i);
    for (int i = 0; i < r->num_images; i++) {
        if (repeats[i] <= MOST)
            continue;
        submitted_image_free(&h->image[i]);
        h->image[i] = (struct submitted_image){0};
        snprintf(h->why[i], sizeof h->why[i], "the same image was handed in for %d other scenes",
                 repeats[i]);
    }
}

bool collect_images(const struct collect *c, struct submitted_images *h, struct err *e)
{
    const struct rubric *r = c->job->rubric;
    h->can_buy = c->submission->kind != SUBMISSION_IMAGES && c->submission->why[0] == '\0';
    for (int i = 0; i < r->num_images; i++) {
        h->runs[i] = 1;
        submission_will_hang(r, h->made, i, &h->made[i]);
        if (!make_image(c, &r->image[i], &h->made[i], &h->image[i], h->why[i], e))
            return false;
    }
    const struct path build_log = fs_path("%s/build.log", c->out);
    submission_conclude(r, h->made, h->why, build_log.s, c->submission);
    refuse_repeated(r, h);
    return true;
}

/* What has been bought. */
struct purchases {
    double left_s;
    double tried[RUBRIC_IMAGES][MOST_RUNS]; /* samples of the runs of an image */
    int num[RUBRIC_IMAGES];
    struct longest { /* the run with most samples: its time a sample holds least of the start's */
        double spp, cpu_s, wall_s;
    } longest[RUBRIC_IMAGES];
    struct submitted_image first[RUBRIC_IMAGES], last[RUBRIC_IMAGES]; /* of its runs */
    bool stuck[RUBRIC_IMAGES]; /* no further run is possible */
};

static bool was_tried(const double *tried, int num, double spp)
{
    for (int k = 0; k < num; k++)
        if (fmax(spp / tried[k], tried[k] / spp) < step - 0.15)
            return true;
    return false;
}

/* Says why an image has no further run: it has had the most, a longer one might be killed, or there is no other number
 * of samples. */
static void tell_no_more(const struct collect *c, const struct longest *run,
                         struct submitted_images *h, int image)
{
    const struct rubric_image *p = &c->job->rubric->image[image];
    const struct sandbox_limits *limit = &c->job->rubric->limit;
    const int most = rubric_is_adaptive(p) ? MOST_ADAPTIVE : MOST_RUNS;
    const double grows = 64 * p->spp / run->spp; /* the most samples over this run's */
    const double cpu = run->cpu_s / limit->cpu_s, wall = run->wall_s / limit->wall_s;
    char *why = h->no_more[image];
    if (h->runs[image] >= most)
        snprintf(why, sizeof *h->no_more, "'%s' has had %d runs, the most", p->name, most);
    else if (grows * fmax(cpu, wall) > 0.5)
        snprintf(why, sizeof *h->no_more,
                 "a longer run of '%s' might not end within 'limit %s %g': %g samples took %.2g s",
                 p->name, wall > cpu ? "wall" : "cpu", wall > cpu ? limit->wall_s : limit->cpu_s,
                 run->spp, wall > cpu ? run->wall_s : run->cpu_s);
    else
        snprintf(why, sizeof *h->no_more,
                 "'%s' has no further run with another number of samples that would help", p->name);
}

/* Samples a pixel of the next run of an image that needs `more` times those it has; 0: no run is
 * possible. A square where the rubric asks for one, as programs that stratify pixels rely on it. */
static int next_samples(const struct collect *c, const struct purchases *b,
                        const struct submitted_images *h, int image, double more)
{
    const struct rubric_image *p = &c->job->rubric->image[image];
    const struct sandbox_limits *limit = &c->job->rubric->limit;
    const struct longest *run = &b->longest[image];
    double base = p->spp, has = h->image[image].spp, batch = rubric_option(p, "-a", 0),
           largest = run->spp;
    double wanted = (more - 1) * has * 1.2, most = 64 * base;
    int root = (int)lround(sqrt(base)), num = h->runs[image], best = 0;
    if (num >= (rubric_is_adaptive(p) ? MOST_ADAPTIVE : MOST_RUNS) || base < 2)
        return 0;
    most = fmin(most, 2.9 * largest); /* so that two runs are left to measure noise */
    most = fmin(most, 0.5 * largest * limit->cpu_s / fmax(0.02, run->cpu_s));
    most = fmin(most, 0.5 * largest * limit->wall_s / fmax(0.02, run->wall_s));
    if (rubric_is_adaptive(p))
        wanted = base;
    else if (batch > base)
        most = fmin(most, batch - 1);
    double spp = fmax(largest / 2.9, 2);
    while (spp <= most) {
        double try = root >= 2 && root * root == p->spp ? pow(ceil(sqrt(spp)), 2) : ceil(spp);
        spp *= 1.1;
        if (try > most || was_tried(b->tried[image], num, try))
            continue;
        best = (int)try;
        if (try >= wanted)
            break;
    }
    return best;
}

static double cost_of(const struct longest *run, const struct rubric_image *p, int spp)
{
    return fmax(0.02, run->cpu_s) * (rubric_is_adaptive(p) ? 1.5 : spp / run->spp);
}

/* Index of the image that adds most noise to an undecided check; -1: none has further runs. *more:
 * the factor by which its samples have to grow. */
static int noisiest(const struct rubric_check *c, const struct result *result,
                    const struct purchases *b, double *more)
{
    int most = -1;
    double sum = 0;
    for (int k = 0; k < c->num_images; k++) {
        sum += result->noise[k];
        if (!b->stuck[c->images[k]] && (most < 0 || result->noise[k] > result->noise[most]))
            most = k;
    }
    if (most < 0)
        return -1;
    double share = sum > 0 ? result->noise[most] / sum : 1, rest = 1 / result->more - (1 - share);
    *more = rest > share / 8 ? share / rest : 8;
    if (b->num[c->images[most]] == 1) /* kappa is a guess where programs differ; two runs measure */
        *more = fmin(*more, 2.5);
    return c->images[most];
}

/* Index of the image with the cheapest next run that an undecided check needs; *spp: its samples.
 * -1: none is left, or none within the budget. */
static int cheapest(const struct collect *c, struct submitted_images *h,
                    const struct result *result, struct purchases *b, int *spp)
{
    const struct rubric *r = c->job->rubric;
    int best = -1;
    double least = b->left_s;
    for (int i = 0; i < r->num_checks; i++) {
        double more;
        int image = result[i].more > 0 ? noisiest(&r->check[i], &result[i], b, &more) : -1;
        if (image < 0)
            continue;
        int samples = next_samples(c, b, h, image, more);
        double cost = cost_of(&b->longest[image], &r->image[image], samples);
        if (samples == 0) {
            b->stuck[image] = true;
            tell_no_more(c, &b->longest[image], h, image);
        } else if (cost <= least) {
            least = cost;
            best = image;
            *spp = samples;
        }
    }
    return best;
}

/* Share of the values at the brightest code where none should be. */
static double clipped_share(const struct submitted_image *s, const unsigned char *use)
{
    double clipped = 0, num = 0;
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++) {
        num += use[i / 3];
        clipped += use[i / 3] && s->clipped[i];
    }
    return num > 0 ? clipped / num : 1;
}

/* Would a render of ours have more noise than a file's codes hide? */
static bool should_vary(const struct submitted_image *s, const unsigned char *use)
{
    double noise = 0, rounding = 0;
    for (size_t i = 0; i < 3 * (size_t)s->width * (size_t)s->height; i++) {
        noise += use[i / 3] ? s->variance[i] : 0;
        rounding += use[i / 3] ? s->rounding[i] : 0;
    }
    return noise > rounding;
}

/* Mean square of a - b; *sd: standard deviation of its logarithm, with the three channels taken as
 * fully correlated. */
static double mean_square(const struct submitted_image *a, const struct submitted_image *b,
                          const unsigned char *use, double *sd)
{
    double sum = 0, squares = 0, num = 0;
    for (size_t i = 0; i < 3 * (size_t)a->width * (size_t)a->height; i++)
        if (use[i / 3]) {
            double d2 = pow(a->mean[i] - b->mean[i], 2);
            sum += d2;
            squares += d2 * d2;
            num++;
        }
    *sd = sum > 0 ? sqrt(3 * fmax(0, squares - sum * sum / num)) / sum : INFINITY;
    return sum / num;
}

/* Does noise fall with the samples? Three runs have the same bias, so the mean squares of
 * successive differences should be as 1/s0 + 1/s1 to 1/s1 + 1/s2. False: surely less than half of
 * that, in logarithms. Clipping takes noise away from smaller runs: true where there is much of
 * it. */
static bool has_fallen(const struct submitted_image *const *run, const unsigned char *use)
{
    static const double few = 0.005, sure = 4.4; /* standard deviations: 1e-5 */
    double sd[2], d0 = mean_square(run[0], run[1], use, &sd[0]),
                  d1 = mean_square(run[1], run[2], use, &sd[1]);
    double expected =
        log((1 / run[1]->spp + 1 / run[2]->spp) / (1 / run[0]->spp + 1 / run[1]->spp));
    for (int k = 0; k < 3; k++)
        if (clipped_share(run[k], use) > few)
            return true;
    return !(expected < 0) || log(d1 / d0) - sure * hypot(sd[0], sd[1]) < expected / 2;
}

/* Keeps copies of the first run and of the latest, for has_fallen(). */
static bool keep_copies(const struct submitted_image *s, const struct submitted_image *more,
                        struct submitted_image *first, struct submitted_image *last, struct err *e)
{
    if (first->mean == NULL && !submitted_image_copy(s, first, e))
        return false;
    first->spp = first->spp > 0 ? first->spp : s->spp;
    submitted_image_free(last);
    bool ok = submitted_image_copy(more, last, e);
    last->spp = more->spp;
    return ok;
}

/* Sets the expected variances of both, use[] to the pixels that can be compared, and *right to our
 * render. */
static bool prepare(struct submitted_image *s, struct submitted_image *more,
                    const struct moments *m, unsigned char *use, struct submitted_image *right,
                    struct err *e)
{
    memset(use, 1, (size_t)s->width * (size_t)s->height);
    submitted_image_expect(s, m, s->spp);
    submitted_image_expect(more, m, more->spp);
    return submitted_image_comparable(s, m, fmin(s->spp, more->spp), false, use, e) &&
           submitted_image_from(m, s, right, e);
}

/* Adds a further run to an image unless its noise is correlated with the last one's; consumes
 * *more. */
static bool take_run(const struct collect *c, struct submitted_images *h, int image,
                     struct submitted_image *more, struct purchases *b, struct err *e)
{
    struct submitted_image *s = &h->image[image], right, *first = &b->first[image];
    const struct submitted_image *last = s->num_runs > 0 ? &s->run[s->num_runs - 1] : s;
    const struct submitted_image *const runs[] = {first, &b->last[image], more};
    const bool same = submitted_image_same(last, more), third = first->mean != NULL;
    unsigned char *use = malloc((size_t)s->width * (size_t)s->height);
    bool ok = (use != NULL || err_set(e, "out of memory")) &&
              prepare(s, more, &c->job->answers->of[0][image].noise, use, &right, e);
    if (ok) {
        bool alone = same || difference_correlated(last, more, &right, use);
        bool fallen = same ? !should_vary(s, use) : !third || alone || has_fallen(runs, use);
        h->fixed[image] = !fallen && !rubric_is_adaptive(&c->job->rubric->image[image]);
        b->stuck[image] = same || h->fixed[image];
        if (b->stuck[image])
            snprintf(h->no_more[image], sizeof *h->no_more,
                     same ? "'%s' is the same with another number of samples"
                          : "the noise of '%s' does not fall with the samples",
                     c->job->rubric->image[image].name);
        submitted_image_free(&right);
        ok = keep_copies(s, more, first, &b->last[image], e);
        if (ok && !alone) {
            ok = submitted_image_add_run(s, more, e);
        } else if (ok && !same && more->spp > s->spp) {
            submitted_image_free(s);
            *s = *more;
            *more = (struct submitted_image){0};
        }
    }
    free(use);
    submitted_image_free(more);
    return ok;
}

static bool buy(const struct collect *c, struct submitted_images *h, int image, int spp,
                struct purchases *b, struct err *e)
{
    struct rubric_image as = c->job->rubric->image[image];
    struct submitted_image more = {0};
    struct made made = {0};
    char why[400];
    const int run = h->runs[image]++;
    snprintf(as.name, sizeof as.name, "%.34s-%d", c->job->rubric->image[image].name, run + 1);
    as.spp = spp;
    b->tried[image][run] = spp;
    b->num[image] = run + 1;
    if (!make_image(c, &as, &made, &more, why, e))
        return false;
    b->left_s -= made.cpu_s;
    h->bought_s += made.cpu_s;
    if (spp > b->longest[image].spp)
        b->longest[image] = (struct longest){spp, made.cpu_s, made.wall_s};
    if (more.mean == NULL) {
        b->stuck[image] = true;
        snprintf(h->no_more[image], sizeof *h->no_more,
                 "a run of '%s' with %d samples made no image (%.80s)",
                 c->job->rubric->image[image].name, spp, why);
        return true;
    }
    if (rubric_is_adaptive(&as))
        more.spp = c->job->rubric->image[image].spp;
    return take_run(c, h, image, &more, b, e);
}

bool collect_until_decided(const struct collect *c, struct submitted_images *h, struct result *out,
                           int *set, struct err *e)
{
    const struct rubric *r = c->job->rubric;
    const struct grading g = {r, c->job->answers, h, c->job->s->alpha, NULL};
    struct purchases *b = calloc(1, sizeof *b);
    bool ok = b != NULL || err_set(e, "out of memory");
    if (ok)
        b->left_s = r->budget_s;
    for (int i = 0; ok && i < r->num_images; i++) {
        b->tried[i][b->num[i]++] = r->image[i].spp;
        b->longest[i] = (struct longest){r->image[i].spp, h->made[i].cpu_s, h->made[i].wall_s};
    }
    for (int image = 0, spp = 0; ok && image >= 0;) {
        ok = grade_all_checks(&g, out, set, e);
        image = ok ? cheapest(c, h, out, b, &spp) : -1;
        if (image < 0)
            break;
        for (int i = 0; i < r->num_checks; i++)
            result_free(&out[i]);
        ok = buy(c, h, image, spp, b, e);
    }
    for (int i = 0; b != NULL && i < r->num_images; i++) {
        submitted_image_free(&b->first[i]);
        submitted_image_free(&b->last[i]);
    }
    free(b);
    return ok;
}
