#include "reproduce_png.h"

#include "renderer/base/cli.h"
#include "renderer/image/moments.h"
#include "renderer/pathtracer/png_metadata.h"
#include "renderer/base/shell_quote.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PATH = 4096 };

static const char *attr(const struct image *im, const char *name)
{
    const char *value = image_get_attr(im, name);
    return value != NULL ? value : "";
}

/* What has to be as it was; of rates, which are looked at in an EXR, the first NUM_OF_RATES. */
enum { NUM_OF_RATES = 5, NUM_SAME = 8 };
static const char *const same[NUM_SAME] = {"assay:scene",   "assay:settings", "assay:adaptive",
                                           "assay:seed",    "assay:cell",     "assay:picture",
                                           "assay:samples", "assay:ranges"};

static bool check_same(const char *path, enum picture_kind kind, const struct image *a,
                       const struct image *b, struct err *e)
{
    int num = kind == PICTURE_RATES ? NUM_OF_RATES : NUM_SAME;
    for (int i = 0; i < num; i++)
        if (strcmp(attr(a, same[i]), attr(b, same[i])) != 0)
            return err_set(e, "%s: %s was '%.300s', and is '%.300s' of what its command makes now",
                           path, same[i], attr(a, same[i]), attr(b, same[i]));
    return true;
}

/* The samples of each pixel, which an EXR has, in the colours of rates. A render that was stopped had asked for more samples than
 * are made again, so the rates of that one have other colours. */
static bool rates_of(const char *path, const struct image *then, const char *exr, struct image *now,
                     struct err *e)
{
    static const char *const names[] = {"R", "G", "B"};
    struct moments m;
    struct image im = {0};
    int most;
    if (!cli_int("assay:most", attr(then, "assay:most"), 1, 1 << 24, &most, e))
        return err_prefix(e, "%s", path);
    if (!moments_read(exr, &m, &im, e))
        return false;
    bool ok = image_alloc(now, m.width, m.height, 3, names, e);
    for (size_t p = 0; ok && p < (size_t)m.width * (size_t)m.height; p++) {
        uint8_t c[3];
        rate_colour(m.n[p] / most, c);
        for (size_t k = 0; k < 3; k++)
            now->data[3 * p + k] = c[k];
    }
    for (int i = 0; ok && i < NUM_OF_RATES; i++)
        ok = image_set_attr(now, same[i], attr(&im, same[i]), e);
    moments_free(&m);
    image_free(&im);
    return ok;
}

static bool read_command(const char *path, const struct image *im, enum picture_kind *kind,
                         char ***word, int *num, struct err *e)
{
    /* An output has to be there to be left out. */
    static const char program[] = "pathtracer ", output[] = "-f again.png ";
    int k;
    const char *command = image_get_attr(im, "assay:command");
    if (command == NULL)
        return err_set(e, "%s: does not say by what command it was made", path);
    if (!cli_choice("assay:picture", attr(im, "assay:picture"), png_metadata_kind_names, &k, e))
        return err_prefix(e, "%s", path);
    *kind = (enum picture_kind)k;
    if (strncmp(command, program, strlen(program)) != 0)
        return err_set(e, "%s: its command is none of this program", path);
    char *text = malloc(strlen(command) + sizeof output);
    if (text == NULL)
        return err_set(e, "out of memory");
    stpcpy(stpcpy(stpcpy(text, program), output), command + strlen(program));
    *word = shell_quote_split(text, num, e);
    free(text);
    return *word != NULL || err_prefix(e, "%s", path);
}

static bool remake(const char *path, const struct image *then, enum picture_kind kind, char **word,
                   int num, const struct reproduce_options *opt, const char *dir, struct image *now,
                   struct reproduced *out, struct err *e)
{
    char exr[MAX_PATH], png[MAX_PATH];
    const char *samples = attr(then, "assay:samples");
    snprintf(exr, sizeof exr, "%s/again.exr", dir);
    snprintf(png, sizeof png, "%s/again.png", dir);
    switch (kind) {
    case PICTURE_IMAGE:
        return (image_get_attr(then, "assay:ranges") != NULL
                    ? reproduce_ranges(path, then, word, num, opt, png, out, e)
                    : reproduce_render(path, then, word, num, samples, opt, png, NULL, out, e)) &&
               image_read_png(png, now, e);
    case PICTURE_RATES:
        return reproduce_render(path, then, word, num, samples, opt, exr, NULL, out, e) &&
               rates_of(path, then, exr, now, e);
    case PICTURE_HEATMAP: /* no sample matters, and one there has to be */
        return reproduce_render(path, then, word, num, "0:1", opt, exr, png, out, e) &&
               image_read_png(png, now, e);
    }
    return false;
}

static bool keep(const char *path, const struct image *im, struct err *e)
{
    size_t num = 3 * (size_t)im->width * (size_t)im->height;
    uint8_t *rgb8 = malloc(num);
    struct image_attr *text = calloc((size_t)im->num_attrs + 1, sizeof *text);
    bool ok = (rgb8 != NULL && text != NULL) || err_set(e, "%s: out of memory", path);
    for (size_t i = 0; ok && i < num; i++)
        rgb8[i] = (uint8_t)im->data[i];
    for (int i = 0; ok && i < im->num_attrs; i++)
        text[i] = (struct image_attr){im->attr[2 * i], im->attr[2 * i + 1]};
    ok = ok && image_write_png_texts(path, im->width, im->height, rgb8, text, im->num_attrs, e);
    free(rgb8);
    free(text);
    return ok;
}

bool reproduce_png(const char *path, const struct reproduce_options *opt, const char *dir,
                   struct reproduced *out, struct err *e)
{
    struct image then, now = {0};
    enum picture_kind kind = PICTURE_IMAGE;
    char **word = NULL;
    int num = 0;
    if (!image_read_png(path, &then, e))
        return false;
    snprintf(out->made_by, sizeof out->made_by, "%s", attr(&then, "assay:version"));
    bool ok = read_command(path, &then, &kind, &word, &num, e) &&
              remake(path, &then, kind, word, num, opt, dir, &now, out, e) &&
              check_same(path, kind, &then, &now, e) &&
              reproduce_compare(path, &then, &now, out, e) &&
              (opt->keep == NULL || keep(opt->keep, &now, e));
    free(word);
    image_free(&then);
    image_free(&now);
    return ok;
}
