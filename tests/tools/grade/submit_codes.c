#include "submit_codes.h"

#include "renderer/image/tone.h"
#include "tests/support/test.h"

struct submitted_image submit_codes(const uint8_t *rgb8, int width, int height)
{
    const char *path = test_path("submitted.png");
    struct submitted_image s;
    struct err e;
    MUST(image_write_png(path, width, height, rgb8, &e));
    MUST(submitted_image_read(path, "cgl", width, height, &s, &e));
    return s;
}
