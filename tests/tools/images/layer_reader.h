/* Reads what pixel_codec_encode() packs, from the format's description in tools/images/pixel_codec.h alone. */
#ifndef ASSAY_LAYER_READER_H
#define ASSAY_LAYER_READER_H

#include <stddef.h>
#include <stdint.h>

struct layer_numbers {
    double *value, *error; /* 3 a pixel, interleaved; error 0: none */
    double *n;             /* 1 a pixel, or NULL where the packed layer has none */
};

/* Fails the running cmocka test if the bytes are not a layer of that size. */
struct layer_numbers layer_read(const uint8_t *bytes, size_t size, int width, int height);
void layer_numbers_free(struct layer_numbers *l);

#endif
