/* A student's picture: what a file says of each pixel, by the course's tone curve where it is one of codes, and
 * made fit for a comparison. No noise is stated by such files: it is taken from the difference (spatial.h).
 *
 * Clipping. A code of 255 says "at least so much". Dropping pixels because they came out saturated would choose
 * them by their noise, and would hide a picture that is white where it should not be. So the reference decides:
 * where it lies within 5 standard errors of the clipping point (those of a render with as many samples, from the
 * reference's own variance of a sample) nothing is compared; elsewhere both sides are cut off at that point. */
#ifndef ASSAY_STUDENT_H
#define ASSAY_STUDENT_H

#include "../renderer/moments.h"

struct student {
    int width, height;
    double *mean, *tolerance,
        *rounding;          /* 3 per pixel: value, how far a whole area may be off, variance */
    unsigned char *clipped; /* 3 per pixel: at the brightest code */
    double clip;            /* the radiance of that code; INFINITY of floats */
    char sha256[65];        /* of the file */
};

/* curve: of integer files (curve.h). Fails, with a line fit for the student, on what is no picture of that size.
 * The header is looked at before anything is decoded. The caller frees with student_free(). */
bool student_read(const char *path, const char *curve, int width, int height, struct student *out,
                  struct err *e) __attribute__((warn_unused_result));
void student_free(struct student *s);

/* dst += src, clipped where either is. */
void student_add(struct student *dst, const struct student *src);

/* Whether pixel p may be compared, told by the reference of a render with spp samples a pixel; reference NULL:
 * whether neither it nor its 8 neighbours are clipped in s. */
bool student_comparable(const struct student *s, const struct moments *reference, double spp,
                        size_t p);

/* Standard deviation that channel i (3 per pixel) of a render of spp samples has, by the reference's samples. */
double student_expected_sd(const struct moments *reference, size_t i, double spp);

#endif
