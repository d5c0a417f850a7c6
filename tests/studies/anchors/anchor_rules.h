/* The rules by which other renderers' tests judge an image, as published, on our moments images: what
 * tests/studies/anchors/make_anchors.c runs beside our own gate on the same renders. Each is a number ("score") and a
 * threshold that is part of the rule, so that the threshold can be set to another false-alarm rate. A
 * is the tested image, B the reference; same sizes. Nothing here fails. */
#ifndef ASSAY_TESTS_ANCHOR_RULES_H
#define ASSAY_TESTS_ANCHOR_RULES_H

#include "renderer/image/moments.h"
#include "tools/images/idiff.h"

/* CIE XYZ (2 degrees) of linear RGB with the primaries of BT.709 and white D65, from the chromaticities
 * in the standard [BT.709-6 table 1]. */
void anchor_xyz(const double light[3], double xyz[3]);

/* Mitsuba 3, src/render/tests/test_renders.py (read at commit 042f6af). A long render is the reference,
 * taken as exact; its moments give the variance of one sample, in XYZ, never below 1e-4. Per pixel and
 * channel z = |A - reference| sqrt(samples of A / variance), two-sided normal p. A channel fails if p
 * <= 1 - (1 - level)^(1/pixels), level 0.01: Sidak over pixels, not channels. The image passes if
 * passed channels / 3 >= 0.9975 pixels. */
struct mitsuba_reference {
    int width, height;
    double *mean; /* XYZ, 3 a pixel */
    double *var;  /* of one sample, 3 a pixel; the floor is not applied yet */
};
#define MITSUBA_LEVEL 0.01
#define MITSUBA_SHARE 0.9975
#define MITSUBA_FLOOR 1e-4
/* |z| of every pixel and channel, unsorted, into z (3 a pixel). */
void mitsuba_z(const struct moments *a, const struct mitsuba_reference *r, double *z);
/* The z at which a channel fails. */
double mitsuba_critical_z(double level, size_t pixels);
/* Channels that fail at that z. */
size_t mitsuba_failures(const double *z, size_t pixels, double critical_z);
/* The largest number of channels that may fail if the image is to pass. */
size_t mitsuba_allowed(double share, size_t pixels);
/* The image fails at any critical z up to this one if `allowed` channels may fail: the (allowed + 1)-th largest
 * z. */
double mitsuba_score(const double *z, size_t pixels, size_t allowed);

/* Eradiate, src/eradiate/test_tools/regression.py, class ZTest (read at commit 00b1015): the
 * difference of every value of the two sides over the root of the sum of the variances of both means,
 * the family p of the smallest by Sidak; the image passes if that is above the level. Its p is the
 * normal law's; here it is Student's with Welch's degrees of freedom, which keeps its level with few
 * samples. A value without noise on either side, 0/0 there and so never passed, is left out. */
#define WELCH_LEVEL 0.01
/* log10 of the family p of all pixels and channels; 0 if nothing can be tested. */
double welch_log10_p(const struct moments *a, const struct moments *b);

/* The plain z-test of tiles: in each tile of side x side pixels (less at the border), of which there are whole
 * ones from the top left, and each channel, the sum of A - B over the root of the sum of the variances of both
 * sides' means, normal law, two-sided; log10 of the smallest p times the number of tiles and channels tested, at
 * most 0. Tiles without noise are left out. */
double tiles_log10_p(const struct moments *a, const struct moments *b, int side);

/* Root of the mean square of A - B over all values, over the mean of B. */
double relative_rmse(const struct moments *a, const struct moments *b);

/* The smallest difference in 1/255 such that no more than `percent` of the pixels differ by more: the
 * image passes with any `fail` of at least that. */
int idiff_fail_score(const size_t count[256], size_t pixels, double percent);

#endif
