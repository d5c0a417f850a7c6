/* Whose noise is the same? Images made here, gamma noise of 64 exponential samples a pixel on a gradient, as 8-bit PNG would
 * have them by the assignment's curve; the reference has 1024 samples, and its noise is in all of them. */

#include "renderer/image/tone.h"
#include "tools/gradebook/same_noise.h"
#include "tools/gradebook/student_page.h"
#include "tests/support/own.h"
#include "tests/tools/grade/submit_codes.h"
#include "tests/support/test.h"

#include <gsl/gsl_randist.h>

enum { WIDTH = 64, HEIGHT = 48, PIXELS = WIDTH * HEIGHT, SPP = 64, REFERENCE = 1024 };

static gsl_rng *rng;
static struct moments reference;

static double truth(size_t p)
{
    return 0.05 + 0.25 * (double)(p % WIDTH) / WIDTH + 0.1 * (p / WIDTH > 20);
}

static int set_up(void **state)
{
    struct err e;
    (void)state;
    rng = gsl_rng_alloc(gsl_rng_mt19937);
    gsl_rng_set(rng, 20261122);
    if (!moments_alloc(&reference, WIDTH, HEIGHT, &e))
        return -1;
    for (size_t p = 0; p < PIXELS; p++) {
        double mean = truth(p) * gsl_ran_gamma(rng, REFERENCE, 1.0 / REFERENCE);
        reference.n[p] = REFERENCE;
        for (size_t i = 3 * p; i < 3 * p + 3; i++) {
            reference.mean[i] = mean;
            reference.m2[i] = REFERENCE * mean * mean;
        }
    }
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    gsl_rng_free(rng);
    moments_free(&reference);
    return 0;
}

/* Noise relative to the truth, one factor for each pixel. */
static void draw(double *factor, double spp)
{
    for (size_t p = 0; p < PIXELS; p++)
        factor[p] = gsl_ran_gamma(rng, spp, 1 / spp);
}

/* An image of this light, as it is submitted. */
static struct submitted_image image_of(const double *light)
{
    static uint8_t rgb8[3 * PIXELS];
    for (size_t i = 0; i < 3 * PIXELS; i++)
        rgb8[i] = tone_map(TONE_CGL, light[i / 3]);
    return submit_codes(rgb8, WIDTH, HEIGHT);
}

/* What is known of an image: a share of its noise that of `other` (NULL: none), rounded to codes, times `scale`. */
static struct noise_print noise_of(const double *own, const double *other, double share,
                                   double scale)
{
    static double light[PIXELS];
    struct noise_print out;
    struct err e;
    for (size_t p = 0; p < PIXELS; p++) {
        double factor = share * (other != NULL ? other[p] : 0) + (1 - share) * own[p];
        light[p] = scale * truth(p) * factor;
    }
    OWN(submitted_image) s = image_of(light);
    MUST(same_noise_of(&s, &reference, SPP, &out, &e));
    return out;
}

/* H0: images with noise of their own. All 1770 pairs of 60: T above 2.33 in about 1 % of them (normal law; the bound says
 * 6.6 %), at most 40 of 1770, and none above the bound at alpha 1e-3 over all. All are 1 % too bright, as within margins a bug
 * that they share may make them. */
TEST(noise_of_their_own)
{
    enum { CLASS = 60, PAIRS = CLASS * (CLASS - 1) / 2 };
    static struct noise_print noise[CLASS];
    static double factor[PIXELS];
    int tests = 0, high = 0;
    double most = -INFINITY;
    for (int k = 0; k < CLASS; k++) {
        draw(factor, SPP);
        noise[k] = noise_of(factor, NULL, 0, 1.01);
        for (int j = 0; j < k; j++) {
            double t = same_noise_t(&noise[k], &noise[j]);
            assert_true(isfinite(t));
            tests++;
            high += t > 2.33;
            most = fmax(most, t);
        }
    }
    printf("independent pairs: %d, T above 2.33: %d, largest %.2f, bound %.2f\n", tests, high, most,
           same_noise_bound(PAIRS, 1e-3));
    assert_int_equal(tests, PAIRS);
    assert_true(high <= 40 && most < same_noise_bound(PAIRS, 1e-3));
    for (int k = 0; k < CLASS; k++)
        same_noise_free(&noise[k]);
}

/* Power, each of 20 times, over the pairs and images of a class of 300: the same noise, retouched to be 2 % brighter; half of
 * it and half of one's own. */
TEST(noise_of_others)
{
    static double one[PIXELS], two[PIXELS];
    double bound = same_noise_bound(300 * 299 / 2 * 20.0, 1e-3), least = INFINITY, half = INFINITY;
    for (int k = 0; k < 20; k++) {
        draw(one, SPP);
        draw(two, SPP);
        struct noise_print a = noise_of(one, NULL, 0, 1), same = noise_of(one, NULL, 0, 1.02),
                           mixed = noise_of(two, one, 0.5, 1);
        least = fmin(least, same_noise_t(&a, &same));
        half = fmin(half, same_noise_t(&a, &mixed));
        same_noise_free(&a);
        same_noise_free(&same);
        same_noise_free(&mixed);
    }
    printf("the same noise: T at least %.1f; half of it: %.1f; bound %.1f\n", least, half, bound);
    assert_true(least > bound && half > bound);
}

/* H0: 300 programs with noise of their own, correct or 20 % too bright on one half: T above 2.33 in about 1 %
 * (normal law), so at most 12 of 300 (more have P < 1e-4), none above the bound of a class of 300 with 20 images (P
 * < 1e-3). Power, 20 of each: the reference as it is, with the noise of 64 samples added, 2 % brighter, or half of
 * it; all share its noise, unlike a longer render. Where the reference's variance is a sixteenth of the added one, T
 * is about 6 in one image, so about half are found in one; with five images (the sum of T over sqrt 5 obeys the same
 * bound) all are. */
TEST(copies_of_the_reference)
{
    enum { OWN, BRIGHT_HALF, COPY, WITH_NOISE, RETOUCHED, HALF_OF_IT, LONGER, KINDS };
    static double factor[PIXELS], image[PIXELS];
    OWN(moments) twin;
    struct err e;
    double bound = same_noise_bound(300 * 20.0, SAME_NOISE_ALPHA), least[KINDS], most[KINDS];
    int high = 0, found[KINDS] = {0};
    MUST(moments_alloc(&twin, WIDTH, HEIGHT, &e));
    draw(factor, REFERENCE);
    for (size_t i = 0; i < 3 * PIXELS; i++)
        twin.mean[i] = truth(i / 3) * factor[i / 3];
    for (int kind = 0; kind < KINDS; kind++) {
        least[kind] = INFINITY;
        most[kind] = -INFINITY;
        double five = 0;
        for (int k = 0; k < (kind <= BRIGHT_HALF ? 150 : 20); k++) {
            draw(factor, kind == LONGER ? 1e5 : SPP);
            for (size_t p = 0; p < PIXELS; p++) {
                double copy = reference.mean[3 * p], own = truth(p) * factor[p];
                switch (kind) {
                case OWN:
                case LONGER: image[p] = own; break;
                case BRIGHT_HALF: image[p] = own * (p % WIDTH < WIDTH / 2 ? 1.2 : 1); break;
                case COPY: image[p] = copy; break;
                case WITH_NOISE: image[p] = copy * factor[p]; break;
                case RETOUCHED: image[p] = 1.02 * copy * factor[p]; break;
                case HALF_OF_IT: image[p] = (copy + own) / 2; break;
                }
            }
            OWN(submitted_image) s = image_of(image);
            double t = same_noise_copy_t(&s, &reference, &twin);
            found[kind] += t > bound;
            five += t / sqrt(5);
            if (k % 5 == 4) {
                least[kind] = fmin(least[kind], five);
                five = 0;
            }
            most[kind] = fmax(most[kind], t);
            high += kind <= BRIGHT_HALF && t > 2.33;
        }
        printf("kind %d: T at most %.1f, %d found; of five at least %.1f, bound %.1f\n", kind,
               most[kind], found[kind], least[kind], bound);
    }
    assert_true(high <= 12);
    assert_true(most[OWN] < bound && most[BRIGHT_HALF] < bound && most[LONGER] < bound);
    for (int kind = COPY; kind <= HALF_OF_IT; kind++)
        assert_true(least[kind] > bound && found[kind] >= 5);
}

/* Noise finer than codes is rounded alike by everybody: nothing is said of it, nor of images without noise. */
TEST(too_fine_to_tell)
{
    static double one[PIXELS], two[PIXELS];
    draw(one, 1e7);
    draw(two, 1e7);
    struct noise_print a = noise_of(one, NULL, 0, 1), b = noise_of(two, NULL, 0, 1);
    assert_true(isnan(same_noise_t(&a, &b)));
    same_noise_free(&a);
    same_noise_free(&b);
}

/* A class of `num`, of which the first `alike` have the same noise and the same two images. */
static char *page_of(int num, int alike)
{
    json_auto_t *grades = json_array();
    char *text;
    size_t size;
    struct err e;
    for (int i = 0; i < num; i++) {
        char id[16], sha[16];
        snprintf(id, sizeof id, "s%d", i);
        snprintf(sha, sizeof sha, "%d", i < alike ? 0 : i);
        json_t *grade = json_pack("{ss, ss, sf, s[{ss, ss}, {ss, ss}]}", "rubric", "R", "id", id,
                                  "cpu_s", 1.0 + i, "pictures", "sha256", sha, "end",
                                  i == num - 1 ? "wall time" : "ok", "sha256", sha, "end", "ok");
        snprintf(id, sizeof id, "s%d", i + 1 < alike ? i + 1 : i - 1);
        if (i < alike) /* a chain */
            json_object_set_new(grade, "alike", json_pack("[{ss}]", "id", id));
        json_array_append_new(grades, grade);
    }
    FILE *f = open_memstream(&text, &size);
    MUST(class_page(f, grades, &e));
    fclose(f);
    return text;
}

TEST(many_alike_have_what_all_were_given)
{
    static const struct {
        int num, alike;
        const char *words; /* NULL: of the handout nothing is said */
    } of[] = {{12, 5, "5 of 12, so many"}, {12, 3, NULL}, {40, 5, NULL}};
    for (size_t i = 0; i < COUNT(of); i++) {
        char *text = page_of(of[i].num, of[i].alike);
        assert_int_equal(strstr(text, "The same noise") != NULL, 1);
        assert_int_equal(strstr(text, "so many") != NULL, of[i].words != NULL);
        if (of[i].words != NULL)
            assert_non_null(strstr(text, of[i].words));
        free(text);
    }
}

TEST(the_same_images_are_one_line)
{
    char *text = page_of(6, 4);
    assert_non_null(strstr(text, "<li>s0, s1, s2, s3</li>"));
    assert_null(strstr(text, "<li>s1, s2"));
    assert_non_null(strstr(text, "more than 6.0 s</td><td>s5"));
    assert_non_null(strstr(text, ">5.0 s</td><td>s4"));
    free(text);
}

TEST_GROUP(set_up, tear_down)
