/* Linear radiance -> 8 bits for an image file. */
#ifndef ASSAY_TONE_H
#define ASSAY_TONE_H

#include <stdint.h>

enum tone_curve {
    TONE_SRGB, /* IEC 61966-2-1, rounded to the nearest step */
    TONE_CGL   /* the assignment's: (sqrt(2) L)^(1/2.2), cut off to the step below */
};

/* NaN and negative give 0, too bright gives 255. */
uint8_t tone_map(enum tone_curve curve, double radiance);

#endif
