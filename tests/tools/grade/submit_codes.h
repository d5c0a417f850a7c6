/* What a student hands in, as a file: written as PNG and read back. */
#ifndef ASSAY_TESTS_SUBMIT_CODES_H
#define ASSAY_TESTS_SUBMIT_CODES_H

#include "tools/submission/submitted_image.h"

/* 3 codes a pixel, by the assignment's curve. Freed with submitted_image_free(). */
struct submitted_image submit_codes(const uint8_t *rgb8, int width, int height);

#endif
