/* The answer key: each image of a rubric as it should be, rendered with each set of accepted
 * deviations (grade_checks.h). */
#include "grade_checks.h"

#include "reference/base/process.h"
#include "reference/store/reference_render.h"
#include "reference/truth/truth.h"
#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"
#include "renderer/base/version.h"
#include "tools/base/text.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { MAX_ARGS = 96, TEXT = 8192 };

/* Far from the seeds that submissions get. */
static const unsigned long long answer_seed = 0x9e3779b97f4a7c15u;
static const char twin_seed[] = "--seed 14057662040733408311";

/* The command by which our renderer makes an image, with the assignment's options; it runs in the
 * directory that has "scene" staged. */
static bool command_of(const struct rubric *r, const struct rubric_image *p, const char *words,
                       const struct answer_options *opt, const char *out, char *text,
                       const char **argv, struct err *e)
{
    struct rubric ours = {0};
    struct rubric_image image = *p;
    snprintf(
        ours.command, sizeof ours.command,
        "{program} -q -t {threads} -r {width} {height} -s {spp} -l {lights} -m {bounces} --seed {seed} {options} %s -f {out} {scene}",
        words);
    snprintf(ours.output, sizeof ours.output, "%s", out);
    if (p->reference_options[0] != '\0')
        snprintf(image.options, sizeof image.options, "%s",
                 strcmp(p->reference_options, "none") == 0 ? "" : p->reference_options);
    image.spp = p->reference_spp;
    return submission_command(&ours, &image, opt->pathtracer, answer_seed, opt->threads, text, TEXT,
                              argv, MAX_ARGS) ||
           err_set(e, "%s:%d: the command of '%s' is too long", r->path, p->line, p->name);
}

/* Hash of all that decides our render: the version, the words of its command but the threads, the
 * files of the scene. */
static bool key_of(const char *const *argv, const char *scene_file, const char *environment,
                   char key[65], struct err *e)
{
    char text[TEXT + 512], hash[65], other[65] = "";
    if (!sha256_file(scene_file, hash, e) ||
        (environment[0] != '\0' && !sha256_file(environment, other, e)))
        return false;
    snprintf(text, sizeof text, "%s %s %s", assay_version, hash, other);
    for (const char *const *a = argv + 1; *a != NULL; a++)
        if (strcmp(a[-1], "-t") != 0)
            text_append(text, sizeof text, " %s", *a);
    sha256_text(text, key);
    return true;
}

/* "" where it has none. */
static struct path environment_of(const struct rubric *r, const struct rubric_image *p)
{
    return p->environment[0] != '\0' ? fs_path("%s/%s", r->dir, p->environment)
                                     : fs_path("%s", p->suite != NULL ? p->suite->environment : "");
}

/* Into `path`, whole or not at all. */
static bool make_render(const struct rubric *r, const struct rubric_image *p, const char *words,
                        const struct answer_options *opt, const char *path, struct err *e)
{
    char text[TEXT];
    const char *argv[MAX_ARGS];
    const struct path made = fs_path("%s/new.exr", opt->cache);
    const struct path log = fs_path("%s/%s.log", opt->cache, p->name);
    if (!command_of(r, p, words, opt, "new.exr", text, argv, e))
        return false;
    const struct process process = {
        .argv = argv, .cwd = opt->cache, .log = log.s, .timeout_s = opt->timeout_s};
    if (!process_run(&process, NULL, e))
        return err_prefix(e, "reference of '%s'", p->name);
    if (rename(made.s, path) != 0)
        return err_set(e, "%s: cannot rename", made.s);
    unlink(log.s);
    return true;
}

/* Reads a render of ours from the cache, or makes it. words: options besides those of the image;
 * "": none. */
static bool render_ours(const struct rubric *r, const struct rubric_image *p, const char *words,
                        const struct answer_options *opt, struct moments *out, struct err *e)
{
    char text[TEXT], key[65];
    const struct path environment = environment_of(r, p);
    const char *argv[MAX_ARGS];
    if (!command_of(r, p, words, opt, "out.exr", text, argv, e))
        return false;
    if (!key_of(argv, rubric_scene(r, p).s, environment.s, key, e))
        return false;
    const struct path path = fs_path("%s/%s.exr", opt->cache, key);
    if (access(path.s, R_OK) == 0 && moments_read(path.s, out, NULL, e))
        return true;
    const struct path lock = fs_path("%s/.lock", opt->cache); /* others may fill the same cache */
    int fd = open(lock.s, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (fd < 0 || lockf(fd, F_LOCK, 0) != 0) {
        if (fd >= 0)
            close(fd);
        return err_set(e, "%s: cannot be locked", lock.s);
    }
    bool ok = (access(path.s, R_OK) == 0 && moments_read(path.s, out, NULL, e)) ||
              (make_render(r, p, words, opt, path.s, e) && moments_read(path.s, out, NULL, e));
    close(fd);
    return ok;
}

static bool reference_of(const struct rubric *r, const struct rubric_image *p,
                         const struct answer_options *opt, struct moments *out, struct err *e)
{
    if (p->reference == REFERENCE_OURS)
        return render_ours(r, p, "", opt, out, e);
    struct suite_scene scene = *p->suite;
    const struct suite_reference *ref =
        suite_reference_of(&scene, rubric_reference_names[p->reference]);
    json_t *manifest = NULL;
    if (p->reference != REFERENCE_TRUTH) {
        bool ok = golden_read(opt->golden_dir, &scene, ref, out, &manifest, e);
        json_decref(manifest);
        return ok;
    }
    scene.width = p->width;
    scene.height = p->height;
    scene.depth = p->bounces;
    return truth_render(&scene, ref, out, e) || err_prefix(e, "%s:%d", r->path, p->line);
}

/* How samples vary, from a render of ours. */
static bool noise_of(const struct rubric *r, const struct rubric_image *p,
                     const struct answer_options *opt, struct moments *out, struct err *e)
{
    enum { NOISE_SPP = 256 };
    struct rubric_image ours = *p;
    if (p->reference != REFERENCE_OURS)
        ours.reference_spp = NOISE_SPP;
    return render_ours(r, &ours, "", opt, out, e);
}

bool answer_key_render(const struct rubric *r, int image, bool as_asked, const char *words, int spp,
                       const struct answer_options *opt, struct moments *out, struct err *e)
{
    struct rubric_image ours = r->image[image];
    char all[sizeof ours.reference_options + sizeof r->set->words + 64];
    /* By the reference's estimator: its noise decides how many samples adaptive sampling takes. */
    bool has =
        as_asked && ours.reference == REFERENCE_OURS && strcmp(ours.reference_options, "none") != 0;
    snprintf(all, sizeof all, "%s %s", has ? ours.reference_options : "", words);
    ours.reference_spp = spp;
    if (as_asked)
        ours.reference_options[0] = '\0';
    return render_ours(r, &ours, all, opt, out, e);
}

static bool twin_of(const struct rubric *r, int image, const struct answer_options *opt,
                    struct moments *out, struct err *e)
{
    bool needed = false;
    for (int i = 0; i < r->num_checks; i++)
        needed |= r->check[i].kind == CHECK_EQUAL && r->check[i].images[0] == image;
    return !needed || r->image[image].reference != REFERENCE_OURS ||
           answer_key_render(r, image, false, twin_seed, r->image[image].reference_spp, opt, out,
                             e);
}

/* Render with the student's options, for the samples of each pixel, if a check of rates needs
 * them. */
static bool as_asked(const struct rubric *r, int image, const char *words,
                     const struct answer_options *opt, struct moments *out, struct err *e)
{
    bool needed = false;
    for (int i = 0; i < r->num_checks; i++)
        needed |= r->check[i].kind == CHECK_RATES && r->check[i].images[0] == image;
    return !needed || answer_key_render(r, image, true, words, r->image[image].spp, opt, out, e);
}

/* Does our renderer make another image with these words? Told by one sample a pixel, of the same seed. */
static bool words_matter(const struct rubric *r, const struct rubric_image *p, const char *words,
                         const struct answer_options *opt, bool *matter, struct err *e)
{
    struct rubric_image quick = *p;
    struct moments with = {0}, without = {0};
    quick.reference_spp = 1;
    bool ok = render_ours(r, &quick, words, opt, &with, e) &&
              render_ours(r, &quick, "", opt, &without, e);
    *matter = ok && memcmp(with.mean, without.mean,
                           3 * (size_t)with.width * (size_t)with.height * sizeof *with.mean) != 0;
    moments_free(&with);
    moments_free(&without);
    return ok;
}

static bool read_accepted(const struct rubric *r, const struct rubric_image *p, const char *file,
                          struct moments *out, struct err *e)
{
    const struct path path = fs_path("%s/%s", r->dir, file);
    return moments_read(path.s, out, NULL, e) &&
           ((out->width == p->width && out->height == p->height) ||
            err_set(e, "%s is %d x %d pixels, image '%s' %d x %d", path.s, out->width, out->height,
                    p->name, p->width, p->height));
}

/* What image i looks like with the deviations of a set; left empty where they change nothing. */
static bool deviating(const struct rubric *r, const struct rubric_set *set, int i,
                      const struct answer_options *opt, struct answer *out, struct err *e)
{
    const struct rubric_image *p = &r->image[i];
    const char *words = set->words;
    bool matter = false;
    for (int a = 0; a < p->num_accepted; a++)
        if (strcmp(p->accept[a].name, set->name) == 0) {
            words = p->accept[a].how;
            if (words[0] != '-')
                return read_accepted(r, p, words, &out->m, e);
        }
    if (words[0] == '\0' || p->reference != REFERENCE_OURS)
        return true;
    return words_matter(r, p, words, opt, &matter, e) &&
           (!matter || (render_ours(r, p, words, opt, &out->m, e) &&
                        as_asked(r, i, words, opt, &out->as_asked, e)));
}

bool answer_key_make(const struct rubric *r, const struct answer_options *opt,
                     struct answer_key *out, struct err *e)
{
    *out = (struct answer_key){0};
    bool ok = submission_stage(r, fs_path("%s/scene", opt->cache).s, e);
    for (int i = 0; ok && i < r->num_images; i++) {
        const struct rubric_image *p = &r->image[i];
        struct answer *a = &out->of[0][i];
        ok = p->reference == REFERENCE_NONE || reference_of(r, p, opt, &a->m, e);
        ok = ok && noise_of(r, p, opt, &a->noise, e) && twin_of(r, i, opt, &a->twin, e) &&
             as_asked(r, i, "", opt, &a->as_asked, e);
        for (int k = 1; ok && k < r->num_sets; k++)
            ok = deviating(r, &r->set[k], i, opt, &out->of[k][i], e);
    }
    if (!ok)
        answer_key_free(out);
    return ok;
}

void answer_key_free(struct answer_key *a)
{
    for (int k = 0; k < RUBRIC_SETS; k++)
        for (int i = 0; i < RUBRIC_IMAGES; i++) {
            moments_free(&a->of[k][i].m);
            moments_free(&a->of[k][i].twin);
            moments_free(&a->of[k][i].noise);
            moments_free(&a->of[k][i].as_asked);
        }
}

int answer_key_set(const struct rubric *r, const char *name)
{
    int k = r->num_sets - 1;
    while (k > 0 && strcmp(r->set[k].name, name) != 0)
        k--;
    return k;
}

const struct moments *answer_key_image(const struct answer_key *a, int set, int image)
{
    const struct moments *own = &a->of[set][image].m, *plain = &a->of[0][image].m;
    return own->width > 0 ? own : plain->width > 0 ? plain : NULL;
}

const struct moments *answer_key_counts(const struct answer_key *a, int set, int image)
{
    const struct moments *own = &a->of[set][image].as_asked;
    return own->width > 0 ? own : &a->of[0][image].as_asked;
}
