/* The rubric of a course: what is wrong with it is listed, a line each, in order. */
#include "tools/submission/rubric.h"
#include "fuzz.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void check_mistakes(const struct rubric_mistakes *m)
{
    int most = sizeof m->at / sizeof m->at[0], kept = m->num < most ? m->num : most;
    fuzz_require(m->num >= 0, "a count of mistakes below 0");
    for (int i = 0; i < kept; i++) {
        fuzz_require(m->at[i].text[0] != '\0', "a mistake without a word");
        fuzz_require(strpbrk(m->at[i].text, "\n\r\x1b") == NULL, "control characters in a mistake");
        fuzz_require(i == 0 || m->at[i - 1].line <= m->at[i].line, "mistakes out of order");
    }
}

/* What the grader relies on. */
static void check_rubric(const struct rubric *r)
{
    fuzz_require(r->num_checks > 0 && r->num_checks <= RUBRIC_CHECKS, "no check, or too many");
    fuzz_require(r->num_images >= 0 && r->num_images <= RUBRIC_IMAGES, "pictures");
    double points = rubric_points(r);
    fuzz_require(isfinite(points) && points > 0, "points that are no number");
    for (int i = 0; i < r->num_checks; i++) {
        const struct rubric_check *c = &r->check[i];
        fuzz_require(c->part >= 0 && c->part < r->num_parts, "a check of no part");
        fuzz_require(c->num_images > 0 && c->num_images <= CHECK_IMAGES, "a check of no image");
        for (int k = 0; k < c->num_images; k++)
            fuzz_require(c->images[k] >= 0 && c->images[k] < r->num_images,
                         "a check of an image that is not there");
    }
    for (int i = 0; i < r->num_images; i++)
        fuzz_require(r->image[i].width > 0 && r->image[i].height > 0, "an image without pixels");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct suite suite;
    static struct rubric
        *r; /* once: half a megabyte of new pages would cost more than the reading */
    static struct rubric_mistakes *m;
    struct err e = {""};
    if (r == NULL) {
        fuzz_require(suite_load("reference/scenes", &suite, &e), "the suite is not here");
        r = malloc(sizeof *r);
        m = malloc(sizeof *m);
        fuzz_require(r != NULL && m != NULL, "no memory");
    }
    const char *path = fuzz_file(data, size, ".rubric");
    if (!rubric_read(path, &suite, 0, r, m, &e))
        fuzz_check_line(&e, path);
    else if (m->num > 0)
        check_mistakes(m);
    else
        check_rubric(r);
    return 0;
}
