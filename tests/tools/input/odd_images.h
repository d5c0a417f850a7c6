/* Image files that our own writers never make, byte by byte from their specifications, for the
 * readers' tests. All abort() where the file cannot be written. */
#ifndef ASSAY_TESTS_ODD_IMAGES_H
#define ASSAY_TESTS_ODD_IMAGES_H

#include <stdbool.h>
#include <stdint.h>

/* OpenEXR, one part, scan lines, no compression. `names`: one channel for each letter, in alphabetical
 * order; v: interleaved. half: 16 bits, of numbers that they hold exactly. */
void odd_exr(const char *path, int width, int height, const char *names, bool half, const float *v);
/* The same with a display window that is not the data window, whose pixels v are. */
struct odd_window {
    int x, y, width, height;
};
void odd_exr_cropped(const char *path, struct odd_window data, struct odd_window shown,
                     const char *names, bool half, const float *v);
/* PNG of 1 (grey), 3 or 4 channels of 8 or 16 bits, deflate in stored blocks; width*height*channels
 * below 30000. */
void odd_png(const char *path, int width, int height, int channels, int bits, const uint16_t *code);
/* Radiance HDR, flat pixels (no run lengths): 4 bytes each, R G B E. */
void odd_hdr(const char *path, int width, int height, const uint8_t (*rgbe)[4]);
/* Colour PFM, little endian, its rows from the bottom up; v has row 0 at the top. */
void odd_pfm(const char *path, int width, int height, const float *v);
/* Any bytes. */
void odd_file(const char *path, const char *text);

#endif
